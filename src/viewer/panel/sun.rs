//! The sun of a clear sky by latitude, date and time of day, as a sundial tells it: it is highest at noon.
//!
//! Elevation and azimuth are what the scene has; hour and declination follow from them, and back (Meeus 1998,
//! "Astronomical Algorithms", ch. 13).

/// Where the sun is seen from, and in which half of the year: its declination is the same twice a year.
pub struct SunPlace {
    /// Degrees north of the equator.
    pub latitude: f64,
    /// From June to December.
    is_late: bool,
}

impl SunPlace {
    /// The day of the year on which the sun has a declination.
    pub fn day_of(&self, declination: f64) -> f64 {
        day_of(declination, self.is_late)
    }

    /// Goes to a day of the year; the declination of the sun, degrees.
    pub fn go_to(&mut self, day: f64) -> f64 {
        self.is_late = (EQUINOX + 0.25 * DAYS..EQUINOX + 0.75 * DAYS).contains(&day);
        declination_of(day)
    }
}

impl Default for SunPlace {
    fn default() -> Self {
        Self { latitude: 50.0, is_late: false }
    }
}

/// The hour of the sun, 0 to 24, and its declination in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunTime {
    pub hour: f64,
    pub declination: f64,
}

/// Declination at the solstices, degrees.
pub const TILT: f64 = 23.44;
/// Days of a year, and the one of the equinox in March.
pub const DAYS: f64 = 365.0;
const EQUINOX: f64 = 80.0;
const MONTHS: [(&str, u32); 12] = [
    ("Jan", 31),
    ("Feb", 28),
    ("Mar", 31),
    ("Apr", 30),
    ("May", 31),
    ("Jun", 30),
    ("Jul", 31),
    ("Aug", 31),
    ("Sep", 30),
    ("Oct", 31),
    ("Nov", 30),
    ("Dec", 31),
];

impl SunTime {
    /// - `elevation`, `azimuth`: of the sun, degrees, the azimuth from north clockwise; `latitude`: degrees.
    pub fn of([elevation, azimuth]: [f64; 2], latitude: f64) -> Self {
        let ((sin_h, cos_h), (sin_a, cos_a)) = (elevation.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
        let (sin_l, cos_l) = latitude.to_radians().sin_cos();
        let declination = (sin_l * sin_h + cos_l * cos_h * cos_a).clamp(-1.0, 1.0).asin().to_degrees();
        let angle = (-sin_a * cos_h).atan2(cos_l * sin_h - sin_l * cos_h * cos_a);
        Self { hour: 12.0 + angle.to_degrees() / 15.0, declination }
    }

    /// Elevation and azimuth of the sun, degrees.
    pub fn direction(self, latitude: f64) -> [f64; 2] {
        let (sin_t, cos_t) = (15.0 * (self.hour - 12.0)).to_radians().sin_cos();
        let (sin_d, cos_d) = self.declination.to_radians().sin_cos();
        let (sin_l, cos_l) = latitude.to_radians().sin_cos();
        let elevation = (sin_l * sin_d + cos_l * cos_d * cos_t).clamp(-1.0, 1.0).asin();
        let azimuth = (-sin_t * cos_d).atan2(cos_l * sin_d - sin_l * cos_d * cos_t);
        [elevation.to_degrees(), azimuth.to_degrees()]
    }

    /// Half of the time for which the sun is up, hours.
    pub fn half_day(self, latitude: f64) -> f64 {
        let cosine = -latitude.to_radians().tan() * self.declination.to_radians().tan();
        cosine.clamp(-1.0, 1.0).acos().to_degrees() / 15.0
    }
}

/// The declination of a day of the year, degrees, good to a degree (Cooper 1969).
fn declination_of(day: f64) -> f64 {
    TILT * ((day - EQUINOX) / DAYS * std::f64::consts::TAU).sin()
}

/// The day of the year, 1 to 365; declinations beyond those of the year are at a solstice.
fn day_of(declination: f64, is_late: bool) -> f64 {
    let since = (declination / TILT).clamp(-1.0, 1.0).asin() / std::f64::consts::TAU * DAYS;
    let since = if is_late { 0.5 * DAYS - since } else { since };
    (EQUINOX + since - 1.0).rem_euclid(DAYS) + 1.0
}

pub fn date_text(day: f64) -> String {
    let mut left = day.round().clamp(1.0, DAYS) as u32;
    for (name, n) in MONTHS {
        if left <= n {
            return format!("{left} {name}");
        }
        left -= n;
    }
    "31 Dec".to_owned()
}

/// A day as [`date_text`] writes it, or its number in the year.
pub fn date_of(text: &str) -> Option<f64> {
    let mut words = text.split([' ', '.', ',']).filter(|word| !word.is_empty());
    let (first, second) = (words.next()?, words.next());
    let Some(second) = second else { return first.parse().ok() };
    let (day, name) = if first.parse::<u32>().is_ok() { (first, second) } else { (second, first) };
    let known = |(known, _): &(&str, u32)| name.get(..3).is_some_and(|start| start.eq_ignore_ascii_case(known));
    let month = MONTHS.iter().position(known)?;
    let before: u32 = MONTHS[..month].iter().map(|(_, n)| n).sum();
    Some(f64::from(before + day.parse::<u32>().ok().filter(|day| (1..=MONTHS[month].1).contains(day))?))
}

pub fn hour_text(hour: f64) -> String {
    let minutes = (60.0 * hour).round() as u32;
    format!("{:02}:{:02}", minutes / 60, minutes % 60)
}

/// An hour as [`hour_text`] writes it, or with a fraction.
pub fn hour_of(text: &str) -> Option<f64> {
    match text.trim().split_once(':') {
        Some((hour, minute)) => Some(hour.trim().parse::<f64>().ok()? + minute.trim().parse::<f64>().ok()? / 60.0),
        None => text.trim().parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sun(latitude: f64, date: &str, hour: f64) -> [f64; 2] {
        SunTime { hour, declination: declination_of(date_of(date).unwrap()) }.direction(latitude)
    }

    #[test]
    fn the_sun_is_where_almanacs_have_it() {
        for (latitude, date, hour, expected) in [
            // At noon: 90° less the latitude, and the tilt of the axis at the solstices.
            (50.0, "21 Mar", 12.0, [40.0, 180.0]),
            (50.0, "21 Jun", 12.0, [63.4, 180.0]),
            (50.0, "21 Dec", 12.0, [16.6, 180.0]),
            // At the equinox it rises in the east and sets in the west, everywhere.
            (35.0, "21 Mar", 6.0, [0.0, 90.0]),
            (-35.0, "22 Sep", 18.0, [0.0, -90.0]),
            // In the south it is in the north at noon.
            (-35.0, "21 Dec", 12.0, [78.4, 0.0]),
        ] {
            let [elevation, azimuth] = sun(latitude, date, hour);
            let turn = (azimuth - expected[1] + 180.0).rem_euclid(360.0) - 180.0;
            let off = (elevation - expected[0]).abs().max(turn.abs());
            assert!(off < 1.0, "{latitude} {date} {hour}: {elevation} {azimuth}");
        }
    }

    #[test]
    fn time_follows_from_the_direction() {
        for (latitude, date, hour) in [(50.0, "3 May", 8.25), (-20.0, "11 Aug", 15.5), (60.0, "2 Feb", 11.0)] {
            let is_late = date == "11 Aug";
            let time = SunTime::of(sun(latitude, date, hour), latitude);
            assert!((time.hour - hour).abs() < 1e-9, "{time:?}");
            assert_eq!(date_text(day_of(time.declination, is_late)), date);
        }
    }

    #[test]
    fn dates_and_hours_are_read_as_they_are_written() {
        assert_eq!([1.0, 31.0, 32.0, 172.0, 365.0].map(date_text), ["1 Jan", "31 Jan", "1 Feb", "21 Jun", "31 Dec"]);
        assert_eq!(["21 June", "June 21", "21. jun", "172"].map(date_of), [Some(172.0); 4]);
        assert_eq!(["", "30 Feb", "21 Juli 2", "soon"].map(date_of), [None, None, Some(202.0), None]);
        assert_eq!([hour_text(9.5), hour_text(17.99), hour_text(12.0)], ["09:30", "17:59", "12:00"]);
        assert_eq!(["9:30", "9.5", " 09:30 ", "noon"].map(hour_of), [Some(9.5), Some(9.5), Some(9.5), None]);
        let june = SunTime { hour: 12.0, declination: declination_of(172.0) };
        assert!((june.half_day(50.0) - 8.1).abs() < 0.1 && june.half_day(70.0) == 12.0);
    }
}
