//! The error of an image that is denoised while it is rendered: how many samples it takes to a goal, from the errors so
//! far. That of the samples themselves has a better estimate, [`ErrorEstimate`](crate::render::ErrorEstimate).

/// Power of the samples with which the error of independent ones falls.
const EXPECTED: f64 = 0.5;
/// Below this power the error has flattened: four times the samples took less than a third of it away.
const FLAT: f64 = 0.25;
/// Errors of fewer than one in so many of the samples do not count.
const RECENT: u32 = 8;
/// How much the expected power counts, beside the sum of squares of the logarithms of the samples from their mean.
const PRIOR: f64 = 0.5;

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

    /// The error now, by a line through the newest ones: each of them is a guess.
    pub fn error(&self) -> Option<f64> {
        self.line().map(|(error, _)| error)
    }

    /// The error now, and the power of the samples with which it falls: least squares of logarithms.
    fn line(&self) -> Option<(f64, f64)> {
        let &(spp, _) = self.seen.last()?;
        let recent = self.seen.iter().filter(|(fewer, _)| fewer.saturating_mul(RECENT) >= spp);
        let logs: Vec<(f64, f64)> = recent.map(|&(spp, error)| (f64::from(spp).ln(), error.ln())).collect();
        let n = logs.len() as f64;
        let (mean_x, mean_y) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
        let squares: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
        let products: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
        let power = (PRIOR * EXPECTED - products) / (PRIOR + squares);
        Some(((mean_y - power * (f64::from(spp).ln() - mean_x)).exp(), power))
    }

    /// What the error `goal` takes; `None` as long as no error is known.
    pub fn to(&self, goal: f64) -> Option<Outlook> {
        let (&(first, _), &(spp, _)) = (self.seen.first()?, self.seen.last()?);
        let (error, power) = self.line()?;
        if error > goal && power < FLAT && first.saturating_mul(4) <= spp {
            return Some(Outlook::Flat);
        }
        Some(Outlook::Samples(f64::from(spp) * (error / goal).powf(power.clamp(FLAT, EXPECTED).recip())))
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
        let Some(Outlook::Samples(spp)) = trend(&[(4, 0.08)]).to(0.02) else { panic!() };
        assert!((spp - 64.0).abs() < 1e-9, "{spp}");
        let Some(Outlook::Samples(spp)) = trend(&[(4, 0.08), (8, 0.08 / 2f64.sqrt()), (16, 0.04)]).to(0.02) else {
            panic!()
        };
        assert!((spp - 64.0).abs() < 1e-9, "{spp}");
        // Slower than that, but it falls.
        let Some(Outlook::Samples(spp)) = trend(&[(4, 0.08), (16, 0.05)]).to(0.02) else { panic!() };
        assert!(spp > 120.0, "{spp}");
    }

    #[test]
    fn errors_that_jump_move_the_outlook_less() {
        let jumps = [1.1, 0.9, 1.05, 0.92, 1.1, 0.95, 0.9, 1.1];
        let mut trend = Trend::default();
        for (i, jump) in (0..).zip(jumps) {
            let spp = (4.0 * 1.4f64.powi(i)) as u32;
            trend.add(spp, jump * 0.16 / f64::from(spp).sqrt());
            let Some(Outlook::Samples(needed)) = trend.to(0.01) else { panic!("flat after {spp}") };
            // Those of the newest errors alone would be 200 to 310.
            assert!(i < 2 || (needed / 256.0).ln().abs() < 0.15, "{needed} after {spp}");
        }
    }

    #[test]
    fn an_error_that_stays_is_told() {
        let flat = trend(&[(4, 0.08), (8, 0.07), (16, 0.066), (32, 0.065)]);
        assert_eq!(flat.to(0.02), Some(Outlook::Flat));
        assert!(matches!(flat.to(0.07), Some(Outlook::Samples(_))), "it is there already");
        assert!(matches!(trend(&[(4, 0.08), (5, 0.08)]).to(0.02), Some(Outlook::Samples(_))), "too early to tell");
    }
}
