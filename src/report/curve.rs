//! Interpolation and extrapolation of error over time, which are straight lines on logarithmic axes.

/// A time that was measured, or extrapolated along the fitted line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CurveSeconds {
    /// Between two measured steps.
    Interpolated(f64),
    /// Beyond the first or the last step.
    Extrapolated(f64),
}

impl CurveSeconds {
    pub fn value(self) -> f64 {
        match self {
            Self::Interpolated(seconds) | Self::Extrapolated(seconds) => seconds,
        }
    }
}

/// relMSE of independent samples falls with slope −1. A curve that falls more slowly than this is limited by its
/// distance to a reference of something else, so its line is not extrapolated.
pub const STUCK: f64 = -0.25;

/// Slope of the least-squares line through (log x, log y); `None` with fewer than two usable points.
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> =
        points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mean_x, mean_y) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let spread: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    let common: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    (logs.len() >= 2 && spread > 0.0).then(|| common / spread)
}

/// Predicts the seconds for `spp` samples per pixel from the (samples, seconds) of at least one step, each with twice
/// the samples of the one before.
///
/// The first samples take longer: each step pays for work done once per doubling, whatever its size, and for work done
/// once. The two latest differences separate both from the cost of a sample: t(n) = a·n + b·log₂ n + c.
pub fn seconds_at(steps: &[(f64, f64)], spp: f64) -> f64 {
    let (n, seconds) = *steps.last().expect("at least one step");
    let [.., (n_first, t_first), (n_before, t_before), _] = *steps else { return seconds * spp / n };
    let (earlier, later) = (t_before - t_first, seconds - t_before);
    // Noise must make neither of them negative: the cost per sample is between half and all of that in the last step.
    let whole = later / (n - n_before);
    let sample = ((later - earlier) / ((n - n_before) - (n_before - n_first))).clamp(0.5 * whole, whole);
    let doubling = later - sample * (n - n_before);
    seconds + sample * (spp - n) + doubling * (spp / n).log2()
}

/// Returns when `points` (seconds, error), rising in seconds, fall below `target` for good.
///
/// Interpolates between two points, extrapolates beyond them along `slope`; `None` if that hardly falls (`STUCK`).
pub fn seconds_to(points: &[(f64, f64)], slope: Option<f64>, target: f64) -> Option<CurveSeconds> {
    let along = |(seconds, error): (f64, f64), slope: f64| seconds * (target / error).powf(1.0 / slope);
    let falling = slope.filter(|slope| *slope < STUCK);
    match points.iter().rposition(|&(_, error)| error > target) {
        None => Some(CurveSeconds::Extrapolated(along(*points.first()?, falling?))),
        Some(last) if last + 1 == points.len() => Some(CurveSeconds::Extrapolated(along(points[last], falling?))),
        Some(before) => {
            let (a, b) = (points[before], points[before + 1]);
            let share = (a.1 / target).ln() / (a.1 / b.1).ln();
            Some(CurveSeconds::Interpolated(a.0 * (b.0 / a.0).powf(share)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_gives_its_exponent_and_its_times() {
        let points: Vec<(f64, f64)> = (0..6).map(|k| (0.1 * f64::from(1 << k), 0.8 / f64::from(1 << k))).collect();
        let fitted = slope(&points);
        assert!((fitted.unwrap() + 1.0).abs() < 1e-12);
        // error = 0.08 / seconds.
        let inside = seconds_to(&points, fitted, 0.03);
        assert!(matches!(inside, Some(CurveSeconds::Interpolated(s)) if (s - 0.08 / 0.03).abs() < 1e-9), "{inside:?}");
        for target in [1e-4, 5.0] {
            let outside = seconds_to(&points, fitted, target);
            assert!(
                matches!(outside, Some(CurveSeconds::Extrapolated(s)) if (s * target - 0.08).abs() < 1e-9),
                "{outside:?}"
            );
        }
    }

    #[test]
    fn start_up_is_not_extended() {
        let time = |n: f64| 0.3 + 0.01 * n + 0.02 * n.log2();
        let steps: Vec<(f64, f64)> = [1.0, 2.0, 4.0, 8.0].map(|n| (n, time(n))).to_vec();
        for n in [8.0, 24.0, 64.0, 1000.0] {
            assert!((seconds_at(&steps, n) / time(n) - 1.0).abs() < 1e-9, "{n}: {}", seconds_at(&steps, n));
        }
        assert_eq!(seconds_at(&steps[..1], 2.0), 2.0 * time(1.0));
        // A late step that was delayed does not make time negative.
        assert!(seconds_at(&[(1.0, 1.0), (2.0, 9.0), (4.0, 10.0)], 64.0) > 10.0);
    }

    #[test]
    fn what_does_not_fall_never_gets_there() {
        let flat = [(1.0, 0.5), (2.0, 0.5), (4.0, 0.5)];
        assert_eq!(seconds_to(&flat, slope(&flat), 0.1), None);
        assert_eq!(seconds_to(&flat, Some(-0.01), 0.1), None, "stuck");
        assert_eq!(slope(&flat[..1]), None);
        assert_eq!(seconds_to(&[], None, 0.1), None);
    }

    #[test]
    fn a_curve_that_rises_again_counts_from_its_last_crossing() {
        let points = [(1.0, 0.2), (2.0, 0.05), (4.0, 0.2), (8.0, 0.05)];
        let found = seconds_to(&points, Some(-1.0), 0.1).unwrap();
        assert!((found.value() - 4.0 * 2.0_f64.sqrt()).abs() < 1e-9, "{found:?}");
    }
}
