//! The error of an image that is denoised while it is rendered: how many samples it takes to a goal, from the errors so
//! far. That of the samples themselves has a better estimate, [`ErrorEstimate`](crate::render::ErrorEstimate).

/// Power of the samples with which the error of independent ones falls.
const EXPECTED: f64 = 0.5;
/// Below this power the error has flattened: four times the samples took less than a third of it away.
const FLAT: f64 = 0.25;

/// Measured errors, by samples per pixel.
#[derive(Clone, Debug, Default)]
pub struct Trend {
    seen: Vec<(u32, f64)>,
}

/// What a goal takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outlook {
    /// So many samples per pixel.
    Samples(f64),
    /// More samples may not reach it.
    Flat,
}

impl Trend {
    /// - `spp`: more than before.
    pub fn add(&mut self, spp: u32, error: f64) {
        if spp > 0 && error > 0.0 {
            self.seen.push((spp, error));
        }
    }

    /// The newest error.
    pub fn error(&self) -> Option<f64> {
        self.seen.last().map(|&(_, error)| error)
    }

    /// What the error `goal` takes; `None` as long as no error is known.
    pub fn to(&self, goal: f64) -> Option<Outlook> {
        let &(spp, error) = self.seen.last()?;
        // The latest error of at most a `factor`-th of the samples tells how it falls: neighbours would tell noise.
        let since = |factor: u32| {
            let &(fewer, before) = self.seen.iter().rev().find(|(fewer, _)| fewer.saturating_mul(factor) <= spp)?;
            Some((before / error).ln() / (f64::from(spp) / f64::from(fewer)).ln())
        };
        if error > goal && since(4).is_some_and(|power| power < FLAT) {
            return Some(Outlook::Flat);
        }
        let power = since(4).or(since(2)).unwrap_or(EXPECTED).clamp(FLAT, EXPECTED);
        Some(Outlook::Samples(f64::from(spp) * (error / goal).powf(power.recip())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trend(errors: &[(u32, f64)]) -> Trend {
        Trend { seen: errors.to_vec() }
    }

    #[test]
    fn half_the_error_takes_four_times_the_samples() {
        assert_eq!(trend(&[]).to(0.02), None);
        assert_eq!(trend(&[(4, 0.08)]).to(0.02), Some(Outlook::Samples(64.0)));
        let Some(Outlook::Samples(spp)) = trend(&[(4, 0.08), (8, 0.08 / 2f64.sqrt()), (16, 0.04)]).to(0.02) else {
            panic!()
        };
        assert!((spp - 64.0).abs() < 1e-9, "{spp}");
        // Slower than that, but it falls.
        let Some(Outlook::Samples(spp)) = trend(&[(4, 0.08), (16, 0.05)]).to(0.02) else { panic!() };
        assert!(spp > 200.0, "{spp}");
    }

    #[test]
    fn an_error_that_stays_is_told() {
        let flat = trend(&[(4, 0.08), (8, 0.07), (16, 0.066), (32, 0.065)]);
        assert_eq!(flat.to(0.02), Some(Outlook::Flat));
        assert!(matches!(flat.to(0.07), Some(Outlook::Samples(_))), "it is there already");
        assert!(matches!(trend(&[(4, 0.08), (5, 0.08)]).to(0.02), Some(Outlook::Samples(_))), "too early to tell");
    }
}
