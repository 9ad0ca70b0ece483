//! χ² tests of counts.

/// χ² of counts against their expectations; bins with expectations below five are merged.
pub(crate) struct ChiSquared {
    pub value: f64,
    pub degrees_of_freedom: f64,
}

impl ChiSquared {
    /// - `tolerance`: relative uncertainty of the expectations.
    pub fn of(counts: &[f64], expected: &[f64], tolerance: f64) -> Self {
        let (mut value, mut bins) = (0.0, 0.0);
        let mut add = |count: f64, expected: f64| {
            value += ((count - expected).abs() - tolerance * expected).max(0.0).powi(2) / expected;
            bins += 1.0;
        };
        let mut rest = (0.0, 0.0);
        for (&count, &expected) in counts.iter().zip(expected) {
            if expected < 5.0 {
                rest = (rest.0 + count, rest.1 + expected);
            } else {
                add(count, expected);
            }
        }
        if rest.1 >= 5.0 {
            add(rest.0, rest.1);
        }
        Self { value, degrees_of_freedom: bins - 1.0 }
    }

    /// Fails if it exceeds its mean by more than `most` standard deviations of a normal distribution (Wilson and
    /// Hilferty 1931).
    pub fn assert_below(&self, most: f64, name: &str) {
        let Self { value, degrees_of_freedom: dof } = *self;
        let z = ((value / dof).cbrt() - (1.0 - 2.0 / (9.0 * dof))) / (2.0 / (9.0 * dof)).sqrt();
        assert!(z < most, "{name}: χ² {value:.1} with {dof} degrees of freedom is {z:.1} σ");
    }
}
