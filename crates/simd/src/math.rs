//! Elementary functions: from the standard library for one number, by series for sixteen.

use super::number::Float;
use super::real::{Real, select};
use super::simd::Simd;
use super::word::Word;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, LN_2, LOG2_E, PI};

/// Functions whose one-lane and sixteen-lane versions differ in the last bits: formulas that use them agree up to
/// rounding.
pub trait Elementary: Real {
    /// Sine and cosine of an angle within ±100, to 2e-7.
    fn sin_cos(self) -> (Self, Self);

    /// The angle of (`x`, `self`), in −π..π; relative error below 4e-7. At the origin sixteen are NaN.
    fn atan2(self, x: Self) -> Self;

    /// `self` to the power of `y`, for `self` in 0..=1 and `y >= 0`. With sixteen lanes, the relative error is below
    /// 3e-7 (1 + |log₂ selfʸ|), and results below 2⁻¹²⁶ are 0.
    fn power(self, y: Self) -> Self;

    /// The largest integer that is not above `self`, for finite values; the sign of zero may differ.
    fn floor(self) -> Self;

    /// Rounds towards zero, for finite values; the sign of zero may differ.
    fn truncated(self) -> Self;
}

impl Elementary for f32 {
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        f32::sin_cos(self)
    }

    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        f32::atan2(self, x)
    }

    #[inline(always)]
    fn power(self, y: Self) -> Self {
        f32::powf(self, y)
    }

    #[inline(always)]
    fn floor(self) -> Self {
        f32::floor(self)
    }

    #[inline(always)]
    fn truncated(self) -> Self {
        f32::trunc(self)
    }
}

impl<S: Simd> Elementary for Float<S> {
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        sin_cos(self)
    }

    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        atan2(self, x)
    }

    #[inline(always)]
    fn power(self, y: Self) -> Self {
        power(self, y)
    }

    #[inline(always)]
    fn floor(self) -> Self {
        floor(self)
    }

    #[inline(always)]
    fn truncated(self) -> Self {
        truncated(self)
    }
}

/// Sine and cosine of angles within ±100, to 2e-7.
///
/// The angle is reduced to ±π/4 by subtracting multiples of π/2; there Taylor series are truncated where the remainder
/// falls below rounding.
#[inline(always)]
fn sin_cos<S: Simd>(x: Float<S>) -> (Float<S>, Float<S>) {
    // Rounds to the nearest multiple: adds a half away from zero and truncates.
    let quarters = (x * (1.0 / FRAC_PI_2) + x.all(0.5).copysign(x)).truncate();
    let count = quarters.to_float();
    // π/2 in two parts, the first with so few digits that its product is exact.
    let r = (x - count * QUARTER_HIGH) - count * QUARTER_LOW;
    let (sin, cos) = sin_cos_eighth(r);
    let odd = quarters.has(1);
    let (a, b) = (select(odd, cos, sin), select(odd, sin, cos));
    // The sine changes sign in the third and fourth quadrant, the cosine in the second and third.
    let flip_sin = (quarters & 2).shift_left(30);
    let flip_cos = ((quarters + 1) & 2).shift_left(30);
    ((a.to_bits() ^ flip_sin).as_float(), (b.to_bits() ^ flip_cos).as_float())
}

const QUARTER_HIGH: f32 = 1.570_312_5;
const QUARTER_LOW: f32 = 4.838_268e-4;

/// Sine and cosine of an angle in −π/4..π/4, to 1e-7: Taylor series, truncated where the remainder falls below
/// rounding.
#[inline(always)]
pub fn sin_cos_eighth<R: Real>(x: R) -> (R, R) {
    let (x2, one) = (x * x, x.all(1.0));
    let s = x.all(1.0 / 5040.0) - x2 * (1.0 / 362_880.0);
    let s = x.all(1.0 / 6.0) - x2 * (x.all(1.0 / 120.0) - x2 * s);
    let c = x.all(1.0 / 720.0) - x2 * (1.0 / 40_320.0);
    let c = x.all(0.5) - x2 * (x.all(1.0 / 24.0) - x2 * c);
    let (sin, cos) = (x * (one - x2 * s), one - x2 * c);
    (sin, cos)
}

/// The angle of (x, y), in −π..π; relative error below 4e-7. NaN at the origin.
///
/// The quotient is reduced to below tan(π/8), where a short polynomial suffices (Moshier's Cephes library, `atanf`).
#[inline(always)]
fn atan2<S: Simd>(y: Float<S>, x: Float<S>) -> Float<S> {
    const TAN_PI_8: f32 = 0.414_213_57;
    let (ax, ay) = (x.abs(), y.abs());
    let (short, long) = (ax.min(ay), ax.max(ay));
    let wide = (long * TAN_PI_8).lt(short);
    let t = select(wide, short - long, short) / select(wide, short + long, long);
    let t2 = t * t;
    let p = ((t2 * 8.053_745e-2 - 1.387_768_6e-1) * t2 + 1.997_771_1e-1) * t2 - 3.333_295e-1;
    let small = p * t2 * t + t;
    let angle = select(wide, small + FRAC_PI_4, small);
    let angle = select(ax.lt(ay), -angle + FRAC_PI_2, angle);
    let angle = select(x.lt(x.all(0.0)), -angle + PI, angle);
    angle.copysign(y)
}

/// `x` to the power of `y`, for `x` in 0..=1 and `y >= 0`; relative error below 3e-7 (1 + |log₂ xʸ|), and 0 for results
/// below 2⁻¹²⁶.
///
/// The mantissa is reduced to within a factor √2 of 1, where the series of the inverse hyperbolic tangent is short.
#[inline(always)]
fn power<S: Simd>(x: Float<S>, y: Float<S>) -> Float<S> {
    const ONE: u32 = 0x3f80_0000;
    const SQRT_HALF: u32 = 0x3f35_04f3;
    let shifted = x.to_bits() + (ONE - SQRT_HALF);
    let exponent = (shifted.shift_right(23) + 127_u32.wrapping_neg()).to_float();
    let mantissa = ((shifted & 0x007f_ffff) + SQRT_HALF).as_float();
    let one = x.all(1.0);
    let f = mantissa - one;
    let r = f / (f + 2.0);
    let r2 = r * r;
    let series = ((r2 * (1.0 / 9.0) + 1.0 / 7.0) * r2 + 1.0 / 5.0) * r2 + 1.0 / 3.0;
    let log = (r + r * (r2 * series)) * (2.0 * LOG2_E) + exponent;
    let log = (log * y).at_least(-200.0);
    let whole = (log - 0.5).truncate();
    let part = (log - whole.to_float()) * LN_2;
    let series = (part * (1.0 / 5040.0) + 1.0 / 720.0) * part + 1.0 / 120.0;
    let series = ((series * part + 1.0 / 24.0) * part + 1.0 / 6.0) * part + 0.5;
    let raised = (series * part * part + part + 1.0) * (whole + 127).shift_left(23).as_float();
    let vanishes = log.lt(one.all(-126.0)) | (x.is_zero() & y.is_positive());
    select(vanishes, one.all(0.0), raised)
}

/// The largest integer that is not above `x`, like `f32::floor` for all finite numbers.
#[inline(always)]
fn floor<S: Simd>(x: Float<S>) -> Float<S> {
    let whole = truncated(x);
    select(x.lt(whole), whole - 1.0, whole)
}

/// Like `f32::trunc` for all finite numbers, except for the sign of zero.
#[inline(always)]
fn truncated<S: Simd>(x: Float<S>) -> Float<S> {
    // Larger numbers have no fractional part.
    let small = x.abs().lt(x.all(8_388_608.0));
    select(small, select(small, x, x.all(0.0)).truncate().to_float(), x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{InstructionSet, LANES, dispatch};

    #[inline(always)]
    fn powers<S: Simd>(s: S, a: &[f32; LANES], b: &[f32; LANES], out: &mut [[f32; LANES]; 3]) {
        let (x, y) = (Float::load(s, a), Float::load(s, b));
        power(x, y).store(&mut out[0]);
        floor(y).store(&mut out[1]);
        truncated(y).store(&mut out[2]);
    }

    fn powers_by(set: InstructionSet, a: &[f32; LANES], b: &[f32; LANES]) -> [[f32; LANES]; 3] {
        let mut out = [[0.0; LANES]; 3];
        let to = &mut out;
        dispatch!(set, powers(a: &[f32; LANES], b: &[f32; LANES], to: &mut [[f32; LANES]; 3]));
        out
    }

    #[test]
    fn powers_are_as_good_as_promised() {
        for i in 0..20_000_u32 {
            let a: [f32; LANES] = std::array::from_fn(|k| match (i + k as u32) % 4 {
                0 => (i * 16 + k as u32) as f32 / 320_000.0,
                1 => 1.0 - (i * 16 + k as u32) as f32 / 32_000_000.0,
                2 => (-((i * 16 + k as u32) as f32) / 40_000.0).exp2(),
                _ => [0.0, 1.0, 0.5, f32::from_bits(0x3f7f_ffff)][(i % 4) as usize],
            });
            let exponents = [0.0, 0.3, 1.0, 5.0, 49.5, 400.0, 1e5];
            let b: [f32; LANES] = std::array::from_fn(|k| exponents[(i as usize + 3 * k) % exponents.len()]);
            let out = powers_by(InstructionSet::detect(), &a, &b);
            if i % 100 == 0 {
                assert!(InstructionSet::available().into_iter().all(|set| powers_by(set, &a, &b) == out));
            }
            for k in 0..LANES {
                let expected = f64::from(a[k]).powf(f64::from(b[k]));
                let bound = expected * 3e-7 * (1.0 - expected.log2()) + f64::from(f32::MIN_POSITIVE);
                let found = f64::from(out[0][k]);
                assert!(!((found - expected).abs() > bound), "{} to {}: {found} for {expected}", a[k], b[k]);
            }
        }
    }

    #[test]
    fn whole_numbers_are_those_of_one_lane() {
        let numbers = [
            0.0,
            -0.0,
            0.5,
            -0.5,
            1.0,
            -1.0,
            1e7,
            -1e7,
            8_388_607.5,
            -8_388_607.5,
            3e9,
            -3e9,
            1e30,
            -1e30,
            1e-30,
            -1e-30,
        ];
        for set in InstructionSet::available() {
            let out = powers_by(set, &[1.0; LANES], &numbers);
            assert_eq!(out[1], numbers.map(f32::floor), "{set:?}");
            assert_eq!(out[2], numbers.map(f32::trunc), "{set:?}");
        }
    }

    #[inline(always)]
    fn both<S: Simd>(s: S, a: &[f32; LANES], b: &[f32; LANES], out: &mut [[f32; LANES]; 3]) {
        let (x, y) = (Float::load(s, a), Float::load(s, b));
        let (sin, cos) = sin_cos(x);
        sin.store(&mut out[0]);
        cos.store(&mut out[1]);
        atan2(x, y).store(&mut out[2]);
    }

    #[test]
    fn angles_are_as_good_as_promised() {
        for i in 0..40_000 {
            let a: [f32; LANES] = std::array::from_fn(|k| ((i * 16 + k) as f32 - 320_000.0) * (100.0 / 320_000.0));
            let b: [f32; LANES] = std::array::from_fn(|k| ((i * 37 + k * k) % 2001) as f32 * 0.1 - 100.0 + 1e-3);
            let run = |set| {
                let mut out = [[0.0; LANES]; 3];
                let (a, b, to) = (&a, &b, &mut out);
                dispatch!(set, both(a: &[f32; LANES], b: &[f32; LANES], to: &mut [[f32; LANES]; 3]));
                out
            };
            let out = run(InstructionSet::detect());
            if i % 100 == 0 {
                assert!(InstructionSet::available().into_iter().all(|set| run(set) == out));
            }
            for k in 0..LANES {
                let (x, y) = (f64::from(a[k]), f64::from(b[k]));
                assert!((f64::from(out[0][k]) - x.sin()).abs() < 2e-7, "sin {x}: {}", out[0][k]);
                assert!((f64::from(out[1][k]) - x.cos()).abs() < 2e-7, "cos {x}: {}", out[1][k]);
                let angle = x.atan2(y);
                assert!((f64::from(out[2][k]) - angle).abs() <= 4e-7 * angle.abs(), "{x} {y}: {}", out[2][k]);
            }
        }
    }
}
