//! Sums of samples that do not depend on the order in which they are added, bit for bit.
//!
//! A sum consists of two `f64`: the sum rounded to nearest, and its rounding error (Knuth 1997, vol. 2, 4.2.2, theorem
//! B; Dekker 1971). Samples are `f32`, and those below 2⁻⁴⁰ are rounded to multiples of 2⁻⁶⁴ W·m⁻²·sr⁻¹, so every
//! sample is a multiple of that. As long as a sum stays below 2⁴⁰ (10¹² W·m⁻²·sr⁻¹), the two parts represent it
//! exactly, and that pair is unique: films that were rendered apart add up to the film that was rendered in one go.
//! Above that, a sum is accurate to 106 bits, but its last bits depend on the order.

use glam::{DVec3, Vec3};

/// Sum of the samples of one pixel, W·m⁻²·sr⁻¹ per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExactSum {
    /// The sum, rounded to nearest.
    pub sum: DVec3,
    /// Exact sum minus `sum`.
    pub rest: DVec3,
}

impl ExactSum {
    /// Adds a finite sample.
    #[inline]
    pub fn add(&mut self, sample: Vec3) {
        self.add_exact(on_grid(sample.as_dvec3()), DVec3::ZERO);
    }

    /// Adds another sum.
    #[inline]
    pub fn merge(&mut self, other: &Self) {
        self.add_exact(other.sum, other.rest);
    }

    #[inline]
    fn add_exact(&mut self, value: DVec3, value_rest: DVec3) {
        let (sum, lost) = two_sum(self.sum, value);
        // Multiples of 2⁻⁶⁴ below 2⁻¹¹: this addition does not round.
        let rest = self.rest + value_rest + lost;
        // The larger summand comes first, so three operations are enough (Dekker's fast two-sum).
        self.sum = sum + rest;
        self.rest = rest - (self.sum - sum);
    }
}

/// Returns `a + b` rounded, and the rounding error.
#[inline]
fn two_sum(a: DVec3, b: DVec3) -> (DVec3, DVec3) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

/// Rounds to a multiple of 2⁻⁶⁴. Above 2⁻⁴⁰ the 24 bits of an `f32` end on one anyway.
#[inline]
fn on_grid(value: DVec3) -> DVec3 {
    /// The last bit of numbers of this size is 2⁻⁶⁴, so adding it rounds.
    const ROUNDER: f64 = 1.5 / (1u64 << 12) as f64;
    const COARSE_ENOUGH: f64 = 1.0 / (1u64 << 40) as f64;
    let round = |x: f64| if x.abs() < COARSE_ENOUGH { (x + ROUNDER) - ROUNDER } else { x };
    DVec3::new(round(value.x), round(value.y), round(value.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Exact sums in integers, in units of 2⁻⁶⁴.
    fn in_integers(samples: &[f32]) -> i128 {
        let unit = (1u128 << 64) as f64;
        // Scaling by a power of two is exact; rounding to an integer is what the grid does.
        samples.iter().map(|&sample| (f64::from(sample) * unit).round_ties_even() as i128).sum()
    }

    fn sum_of(samples: &[f32]) -> ExactSum {
        let mut sum = ExactSum::default();
        samples.iter().for_each(|&sample| sum.add(Vec3::splat(sample)));
        sum
    }

    /// From far below the grid to 10⁸, of both signs (some filters have negative weights).
    fn sample() -> impl Strategy<Value = f32> {
        (any::<bool>(), -90.0..27.0_f32, 1.0..2.0_f32)
            .prop_map(|(negative, exponent, mantissa)| if negative { -1.0 } else { 1.0 } * mantissa * exponent.exp2())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn sums_are_exact_and_do_not_depend_on_order(
            samples in proptest::collection::vec(sample(), 1..300),
            cut in 0.0..1.0_f64,
        ) {
            let one_go = sum_of(&samples);
            let expected = in_integers(&samples);
            let unit = (1u128 << 64) as f64;
            // Each part is an integer number of units, and small enough for `i128`.
            let (sum, rest) = ((one_go.sum.x * unit) as i128, (one_go.rest.x * unit) as i128);
            prop_assert_eq!(sum + rest, expected);
            prop_assert_eq!(one_go.sum.x, expected as f64 / unit, "rounded to nearest");

            let (a, b) = samples.split_at((cut * samples.len() as f64) as usize);
            let mut merged = sum_of(a);
            merged.merge(&sum_of(b));
            prop_assert_eq!(merged, one_go);
            let mut backwards = sum_of(b);
            backwards.merge(&sum_of(a));
            prop_assert_eq!(backwards, one_go);
        }
    }

    #[test]
    fn light_that_no_sum_holds_exactly_is_kept_all_the_same() {
        let sum = sum_of(&[f32::MAX, 1.0, f32::MAX, f32::MIN_POSITIVE]);
        assert_eq!(sum.sum.x, 2.0 * f64::from(f32::MAX));
        assert!(sum.rest.is_finite());
    }
}
