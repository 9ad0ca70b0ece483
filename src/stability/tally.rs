//! Counts of findings, and the worst ray.

use glam::Vec3;

/// Counts of one case; all findings must be 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Rays traced, or samples taken.
    pub rays: u64,
    /// Rays that went through a closed surface.
    pub leaks: u64,
    /// Rays that hit the surface that they had just left.
    pub acne: u64,
    /// Sure hits that were not found.
    pub missed: u64,
    /// Hits that are not on their primitive, or that hide a nearer one.
    pub wrong_t: u64,
    /// Samples that were not finite.
    pub non_finite: u64,
    /// Samples brighter than the largest radiance of the scene.
    pub above: u64,
    /// Largest error of radiance against the known value, relative to the allowed error; above 1 is a finding.
    pub energy: Option<Energy>,
    /// The worst ray.
    pub worst: Option<Worst>,
}

/// Error of the measured radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy {
    /// Relative to the expected radiance.
    pub error: f64,
    pub allowed: f64,
}

impl Energy {
    pub fn is_finding(&self) -> bool {
        // NaN is a finding as well.
        !(self.error <= self.allowed)
    }
}

/// One ray or sample, and the indices to replay it.
#[derive(Clone, Debug, PartialEq)]
pub struct Worst {
    /// Ratio for comparison: at most 1 is within the bounds.
    pub severity: f64,
    pub what: String,
    /// Index of the test scene within its case, and of the ray within the test scene.
    pub test_scene: usize,
    pub ray: u64,
}

impl Tally {
    pub fn findings(&self) -> u64 {
        let energy = u64::from(self.energy.is_some_and(|energy| energy.is_finding()));
        self.leaks + self.acne + self.missed + self.wrong_t + self.non_finite + self.above + energy
    }

    /// Adds two tallies. The sum does not depend on the order: of equally bad rays the first one is kept.
    pub fn merged(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.leaks += other.leaks;
        self.acne += other.acne;
        self.missed += other.missed;
        self.wrong_t += other.wrong_t;
        self.non_finite += other.non_finite;
        self.above += other.above;
        self.energy = match (self.energy, other.energy) {
            (Some(a), Some(b)) => {
                Some(if b.error / b.allowed > a.error / a.allowed || b.error.is_nan() { b } else { a })
            }
            (a, b) => a.or(b),
        };
        let worst = [self.worst.take(), other.worst].into_iter().flatten();
        self.worst = worst.reduce(|a, b| {
            let a_first = (a.test_scene, a.ray) <= (b.test_scene, b.ray);
            if a.severity > b.severity || (a.severity == b.severity && a_first) { a } else { b }
        });
        self
    }

    /// Keeps a ray if it is worse than the worst so far.
    pub fn offer(&mut self, severity: f64, test_scene: usize, ray: u64, what: impl FnOnce() -> String) {
        let severity = if severity.is_nan() { f64::INFINITY } else { severity };
        if self.worst.as_ref().is_none_or(|worst| severity > worst.severity) {
            self.worst = Some(Worst { severity, what: what(), test_scene, ray });
        }
    }
}

/// Formats a number with all its bits in the hexadecimal notation of C: `0x1.8p+1` is 3.
pub fn hex(x: f32) -> String {
    let bits = x.to_bits();
    let (sign, exponent, fraction) = (if x.is_sign_negative() { "-" } else { "" }, bits >> 23 & 0xff, bits & 0x7f_ffff);
    match (exponent, fraction) {
        (0xff, 0) => format!("{sign}inf"),
        (0xff, _) => "nan".to_owned(),
        (0, 0) => format!("{sign}0x0p+0"),
        _ => {
            let (lead, exponent) = if exponent == 0 { (0, -126) } else { (1, exponent as i32 - 127) };
            let digits = format!("{:06x}", fraction << 1);
            let digits = digits.trim_end_matches('0');
            let point = if digits.is_empty() { "" } else { "." };
            format!("{sign}0x{lead}{point}{digits}p{exponent:+}")
        }
    }
}

pub fn hex3(v: Vec3) -> String {
    format!("({}, {}, {})", hex(v.x), hex(v.y), hex(v.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_with_all_their_bits() {
        for (x, text) in [
            (3.0, "0x1.8p+1"),
            (-0.1, "-0x1.99999ap-4"),
            (0.0, "0x0p+0"),
            (-0.0, "-0x0p+0"),
            (1.0, "0x1p+0"),
            (f32::from_bits(1), "0x0.000002p-126"),
            (f32::MAX, "0x1.fffffep+127"),
            (f32::NEG_INFINITY, "-inf"),
        ] {
            assert_eq!(hex(x), text);
        }
    }

    #[test]
    fn sums_do_not_depend_on_the_order() {
        let tally = |severity, ray, leaks| {
            let mut tally = Tally { rays: 10, leaks, ..Tally::default() };
            tally.offer(severity, 0, ray, || format!("{ray}"));
            tally
        };
        let (a, b, c) = (tally(2.0, 7, 1), tally(2.0, 3, 0), tally(1.0, 0, 2));
        let sums = [a.clone().merged(b.clone()).merged(c.clone()), c.merged(a).merged(b)];
        assert_eq!(sums[0], sums[1]);
        assert_eq!((sums[0].worst.as_ref().unwrap().ray, sums[0].leaks, sums[0].findings()), (3, 3, 3));
    }
}
