//! Angles, sixteen at a time.

use super::number::{Float, select};
use super::simd::Simd;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Sine and cosine of angles within ±100, to 2e-7.
///
/// The angle is brought to an eighth of a turn by whole quarters; there Taylor's series are cut where the rest falls
/// below rounding.
#[inline(always)]
pub(crate) fn sin_cos<S: Simd>(x: Float<S>) -> (Float<S>, Float<S>) {
    // To the nearest quarter, by truncation after a half away from zero.
    let quarters = (x * (1.0 / FRAC_PI_2) + x.all(0.5).copysign(x)).truncate();
    let count = quarters.to_float();
    // π/2 in two parts, of which the first has few enough digits that its product is exact.
    let r = (x - count * QUARTER_HIGH) - count * QUARTER_LOW;
    let (sin, cos) = sin_cos_eighth(r);
    let odd = quarters.has(1);
    let (a, b) = (select(odd, cos, sin), select(odd, sin, cos));
    // The sign of the sine flips in the third and fourth quarter, that of the cosine in the second and third.
    let flip_sin = (quarters & 2).shl(30);
    let flip_cos = ((quarters + 1) & 2).shl(30);
    ((a.to_bits() ^ flip_sin).as_float(), (b.to_bits() ^ flip_cos).as_float())
}

const QUARTER_HIGH: f32 = 1.570_312_5;
const QUARTER_LOW: f32 = 4.838_268e-4;

/// As `sampling::warp::sin_cos_eighth`, rounding for rounding.
#[inline(always)]
pub(crate) fn sin_cos_eighth<S: Simd>(x: Float<S>) -> (Float<S>, Float<S>) {
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
/// The quotient is brought below tan(π/8), where a short polynomial does (Moshier's Cephes library, `atanf`).
#[inline(always)]
pub(crate) fn atan2<S: Simd>(y: Float<S>, x: Float<S>) -> Float<S> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{InstructionSet, LANES, dispatch};

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
