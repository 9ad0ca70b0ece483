//! Parsers of numbers in the command line: each reports the valid range before anything is loaded.

use firstlight::mesh::simplify::{Target, check_target};
use firstlight::scene::{check_fps, check_stops};
use std::fmt::Display;
use std::str::FromStr;

/// Parses `640x480` as a width and a height; pixels.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = text.split_once(['x', 'X', '×']).ok_or("expected WIDTHxHEIGHT, such as 1280x720")?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| format!("`{text}` is not a number of pixels"));
    let (width, height) = (number(width)?, number(height)?);
    firstlight::scene::file::check_film_size(width, height)?;
    Ok((width, height))
}

/// Parses a positive, finite number.
pub fn parse_positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a positive number".to_owned()),
    }
}

/// A parser of integers in a range, both ends included.
pub fn between<T>(low: T, high: T) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Copy + Display,
{
    move |text| match text.parse::<T>() {
        Ok(value) if value >= low && value <= high => Ok(value),
        // Integers that overflow the type get the message about the range.
        _ if text.trim_start_matches('-').bytes().all(|byte| byte.is_ascii_digit()) && !text.is_empty() => {
            Err(format!("must be between {low} and {high}"))
        }
        _ => Err(format!("must be a whole number between {low} and {high}")),
    }
}

/// Parses an integer, at least 1.
pub fn at_least_one(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|number| *number > 0).ok_or_else(|| "must be a whole number, at least 1".to_owned())
}

/// Frames per second.
pub fn parse_fps(text: &str) -> Result<f64, String> {
    let fps = text.parse::<f64>().map_err(|_| "must be a number of frames per second".to_owned())?;
    check_fps(fps).map(|()| fps).map_err(|error| error.to_string())
}

/// Parses the share of the time of a frame during which the shutter is open.
pub fn parse_shutter(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("must be a number from 0 (no motion blur) to 1 (the whole time of a frame)".to_owned()),
    }
}

/// Parses a name and a value.
pub fn parse_define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("must be NAME=VALUE".to_owned()),
    }
}

/// Parses a finite number of seconds.
pub fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("must be a finite number of seconds".to_owned()),
    }
}

/// Parses the time between two events in seconds. Times of the system clock can be added up to it.
pub fn parse_interval(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 1e9 => Ok(value),
        _ => Err("must be a positive number of seconds, at most 1e9".to_owned()),
    }
}

/// Parses a relative error: `0.05` or `5%`. Values from 1 on need the percent sign, since 5 usually means 5 %.
pub fn parse_share(text: &str) -> Result<f64, String> {
    let (number, unit) = number_and_unit(text);
    match number.parse::<f64>().map(|value| value * unit) {
        Ok(share) if unit == 1.0 && share >= 1.0 && share.is_finite() => {
            let per_cent = 100.0 * share;
            Err(format!("{number} means {per_cent} %: write {number}% for {number} percent"))
        }
        Ok(share) if share > 0.0 && share.is_finite() => Ok(share),
        _ => Err("must be a positive number: five percent is 0.05 or 5%".to_owned()),
    }
}

/// A fraction as a percentage with two significant digits, the precision of the estimates.
pub fn percent(share: f64) -> String {
    format!("{} %", two_digits(100.0 * share))
}

/// A number with two significant digits, or all digits of its integer part.
pub fn two_digits(value: f64) -> String {
    let digits = if value > 0.0 { (1.0 - value.log10().floor()).clamp(0.0, 9.0) as usize } else { 0 };
    format!("{value:.digits$}")
}

/// A number with three significant digits, without zeros at the end.
pub fn three_digits(value: f64) -> String {
    // Without the sign of -0.
    if value == 0.0 || !value.is_finite() {
        return (value + 0.0).to_string();
    }
    let digits = (2.0 - value.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A number and a noun, whose plural ends in s.
pub fn counted(n: usize, one: &str) -> String {
    format!("{n} {one}{}", if n == 1 { "" } else { "s" })
}

/// A number of samples per pixel as text.
pub fn samples_per_pixel(spp: u32) -> String {
    format!("{spp} {} per pixel", if spp == 1 { "sample" } else { "samples" })
}

/// Parses a number of stops of exposure.
pub fn parse_stops(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(stops) => check_stops(stops).map(|()| stops).map_err(|error| error.to_string()),
        _ => Err("must be a finite number of stops".to_owned()),
    }
}

/// Parses the fraction of triangles to keep: `0.1` or `10%`.
pub fn parse_ratio(text: &str) -> Result<f64, String> {
    let (number, unit) = number_and_unit(text);
    let ratio = number.parse::<f64>().map_err(|_| "must be a number above 0 and at most 1, or a percentage")? * unit;
    check_target(Target::Ratio(ratio)).map_err(|error| error.to_string())?;
    Ok(ratio)
}

/// Parses a number of triangles to keep.
pub fn parse_faces(text: &str) -> Result<usize, String> {
    let faces = text.parse().map_err(|_| "must be a number of triangles, at least 1")?;
    check_target(Target::Faces(faces)).map_err(|error| error.to_string())?;
    Ok(faces)
}

/// The maximum distance between two surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PrintedDeviation {
    /// In the units of the file.
    Length(f64),
    /// As a fraction of the diagonal of the model's bounding box.
    Share(f64),
}

impl PrintedDeviation {
    /// The distance for a model with this diagonal, in the same units.
    pub fn length(self, diagonal: f64) -> f64 {
        match self {
            Self::Length(length) => length,
            Self::Share(share) => share * diagonal,
        }
    }
}

/// Parses `0.01` as a length and `0.5%` as a fraction of the diagonal.
pub fn parse_error(text: &str) -> Result<PrintedDeviation, String> {
    let (number, unit) = number_and_unit(text);
    let number: f64 = number.parse().map_err(|_| "must be a length above 0, or a percentage of the diagonal")?;
    check_target(Target::Error(number)).map_err(|error| error.to_string())?;
    Ok(if unit == 1.0 { PrintedDeviation::Length(number) } else { PrintedDeviation::Share(unit * number) })
}

/// A number and its unit: 0.01 with `%`, else 1.
fn number_and_unit(text: &str) -> (&str, f64) {
    match text.trim_end().strip_suffix('%') {
        Some(number) => (number.trim_end(), 0.01),
        None => (text.trim_end(), 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentages_have_two_digits_that_mean_something() {
        for (share, text) in [
            (1.0549, "105 %"),
            (0.0819, "8.2 %"),
            (0.12, "12 %"),
            (0.00416, "0.42 %"),
            (1e-6, "0.00010 %"),
            (0.0, "0 %"),
        ] {
            assert_eq!(percent(share), text);
        }
    }

    #[test]
    fn lengths_have_three_digits() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (-0.5, "-0.5"),
            (1.6694, "1.67"),
            (1234.5, "1234"),
            (0.000123456, "0.000123"),
            (3e7, "30000000"),
        ] {
            assert_eq!(three_digits(value), text);
        }
    }

    #[test]
    fn whole_numbers_lie_between_their_limits() {
        let parse = between::<u16>(1, 1024);
        assert_eq!((parse("1"), parse("1024")), (Ok(1), Ok(1024)));
        for text in ["0", "1025", "-3", "99999999999999999999"] {
            assert_eq!(parse(text).unwrap_err(), "must be between 1 and 1024", "{text}");
        }
        for text in ["", "two", "1.5", "1 2"] {
            assert_eq!(parse(text).unwrap_err(), "must be a whole number between 1 and 1024", "{text}");
        }
    }

    #[test]
    fn deviations_are_lengths_or_percentages_of_the_diagonal() {
        assert_eq!(parse_error("0.25"), Ok(PrintedDeviation::Length(0.25)));
        assert_eq!(parse_error("0.5%").unwrap().length(200.0), 1.0);
        assert_eq!(parse_error("2 %").unwrap().length(50.0), 1.0);
        for text in ["", "%", "0%", "-1%", "nan", "0", "half"] {
            assert!(parse_error(text).is_err(), "{text}");
        }
        assert_eq!((parse_ratio("0.25"), parse_ratio("25%")), (Ok(0.25), Ok(0.25)));
        assert!(parse_ratio("150%").is_err() && parse_ratio("0 %").is_err());
    }

    #[test]
    fn intervals_fit_into_the_clock() {
        for text in ["1e-9", "60", "1e9"] {
            let wait = std::time::Duration::from_secs_f64(parse_interval(text).unwrap());
            assert!(std::time::Instant::now().checked_add(2 * wait).is_some(), "{text}");
        }
        for text in ["0", "-1", "nan", "inf", "1e19", "1e20", ""] {
            assert!(parse_interval(text).is_err(), "{text}");
        }
    }

    #[test]
    fn shares_are_numbers_or_percent() {
        for (text, share) in [("0.05", 0.05), ("5%", 0.05), ("0.5 %", 0.005), ("1e-3", 1e-3), ("150%", 1.5)] {
            assert!((parse_share(text).unwrap() - share).abs() < 1e-15, "{text}");
        }
        assert_eq!(parse_share("100%"), Ok(1.0));
        for text in ["5", "1.5", "5 ", "1e3"] {
            let number = text.trim();
            let error = parse_share(text).unwrap_err();
            assert!(
                error.starts_with(&format!("{number} means ")) && error.contains(&format!("write {number}%")),
                "{error}"
            );
        }
        assert!(parse_share("5").unwrap_err().starts_with("5 means 500 %"));
        assert!(parse_share("1").unwrap_err().starts_with("1 means 100 %"));
        for text in ["", "%", "5%%", "5 percent", "-5%", "0%", "nan%", "inf", "%5"] {
            assert!(parse_share(text).unwrap_err().contains("0.05 or 5%"), "{text}");
        }
    }
}
