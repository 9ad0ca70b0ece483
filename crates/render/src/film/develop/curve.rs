//! Tone curves, for one colour or for sixteen with the same bits.

use firstlight_simd::{Float, Real, Simd, Vector, select, select_vector};
use glam::{Mat3, Vec3};
use serde::{Deserialize, Serialize};

/// Tone curve: maps exposed radiance to the range of a display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ToneCurve {
    /// Clips at 1.
    Linear,
    /// Khronos PBR Neutral: preserves colours, compresses highlights.
    #[default]
    Neutral,
    /// Filmic: Hill's fit of the ACES reference rendering and output transforms.
    Filmic,
}

impl ToneCurve {
    /// Returns display light, 0..1 per channel.
    ///
    /// - `light`: exposed radiance, not negative.
    #[inline]
    pub fn apply(self, light: Vec3) -> Vec3 {
        match self {
            Self::Linear => light.min(Vec3::ONE),
            Self::Neutral => pbr_neutral(light),
            Self::Filmic => aces_fitted(light),
        }
    }

    /// Like [`Self::apply`], for sixteen colours.
    #[inline(always)]
    pub(crate) fn apply_lanes<S: Simd>(self, light: Vector<S>) -> Vector<S> {
        match self {
            Self::Linear => each(
                light,
                #[inline(always)]
                |x| x.at_most(1.0),
            ),
            Self::Neutral => pbr_neutral_lanes(light),
            Self::Filmic => aces_fitted_lanes(light),
        }
    }
}

/// Brightness from which on [`pbr_neutral`] compresses.
const START: f32 = 0.8 - 0.04;
const DESATURATION: f32 = 0.15;

/// Khronos 2024, "PBR Neutral tone mapper" specification.
fn pbr_neutral(color: Vec3) -> Vec3 {
    let low = color.min_element();
    let offset = if low < 0.08 { low - 6.25 * low * low } else { 0.04 };
    let color = color - Vec3::splat(offset);
    let peak = color.max_element();
    if peak < START {
        return color;
    }
    let d = 1.0 - START;
    let new_peak = 1.0 - d * d / (peak + d - START);
    let grey = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    // Infinite radiance becomes white, not NaN.
    if !peak.is_finite() { Vec3::ONE } else { (color * (new_peak / peak)).lerp(Vec3::splat(new_peak), grey) }
}

/// See [`pbr_neutral`].
#[inline(always)]
fn pbr_neutral_lanes<S: Simd>(color: Vector<S>) -> Vector<S> {
    let Vector { x, y, z } = color;
    let one = x.all(1.0);
    let low = x.min(y).min(z);
    let offset = select(low.lt(x.all(0.08)), low - one.all(6.25) * low * low, x.all(0.04));
    let color = Vector { x: x - offset, y: y - offset, z: z - offset };
    let peak = color.x.max(color.y).max(color.z);
    let d = 1.0 - START;
    let new_peak = one - one.all(d * d) / (peak + d - START);
    let grey = one - one / ((peak - new_peak) * DESATURATION + 1.0);
    let ratio = new_peak / peak;
    let (keep, mixed) = (one - grey, new_peak * grey);
    let bent = Vector {
        x: color.x * ratio * keep + mixed,
        y: color.y * ratio * keep + mixed,
        z: color.z * ratio * keep + mixed,
    };
    let bent = select_vector(peak.lt(peak.all(f32::INFINITY)), bent, Vector::splat(x.s, Vec3::ONE));
    select_vector(peak.lt(peak.all(START)), color, bent)
}

/// Columns of Hill's fit of the ACES reference rendering and output transforms for sRGB: into the fit's space, and
/// back.
const INTO_ACES: [Vec3; 3] =
    [Vec3::new(0.59719, 0.07600, 0.02840), Vec3::new(0.35458, 0.90834, 0.13383), Vec3::new(0.04823, 0.01566, 0.83777)];
const OUT_OF_ACES: [Vec3; 3] = [
    Vec3::new(1.60475, -0.10208, -0.00327),
    Vec3::new(-0.53108, 1.10813, -0.07276),
    Vec3::new(-0.07367, -0.00605, 1.07602),
];

fn aces_fitted(color: Vec3) -> Vec3 {
    let [into, out] = [INTO_ACES, OUT_OF_ACES].map(|[x, y, z]| Mat3::from_cols(x, y, z));
    // Above this the curve is flat, and the quotient of two squares would overflow.
    let v = (into * color).min(Vec3::splat(1e6));
    let curve = (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
    (out * curve).clamp(Vec3::ZERO, Vec3::ONE)
}

/// See [`aces_fitted`].
#[inline(always)]
fn aces_fitted_lanes<S: Simd>(color: Vector<S>) -> Vector<S> {
    let curve = each(
        transformed(&INTO_ACES, color),
        #[inline(always)]
        |v| {
            let v = v.at_most(1e6);
            (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (v * 0.983_729 + 0.432_951) + 0.238_081)
        },
    );
    each(
        transformed(&OUT_OF_ACES, curve),
        #[inline(always)]
        |x| x.at_least(0.0).at_most(1.0),
    )
}

#[inline(always)]
fn each<S: Simd>(color: Vector<S>, f: impl Fn(Float<S>) -> Float<S>) -> Vector<S> {
    Vector { x: f(color.x), y: f(color.y), z: f(color.z) }
}

/// Multiplies the matrix with these columns by a colour.
#[inline(always)]
fn transformed<S: Simd>(columns: &[Vec3; 3], color: Vector<S>) -> Vector<S> {
    let [a, b, c] = *columns;
    Vector {
        x: color.x * a.x + color.y * b.x + color.z * c.x,
        y: color.x * a.y + color.y * b.y + color.z * c.y,
        z: color.x * a.z + color.y * b.z + color.z * c.z,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_stay_in_range_and_grow() {
        for curve in [ToneCurve::Linear, ToneCurve::Neutral, ToneCurve::Filmic] {
            let mut before = -1.0;
            for i in 0..400 {
                let x = 1e-4 * 1.06_f32.powi(i);
                let mapped = curve.apply(Vec3::splat(x)).x;
                assert!((0.0..=1.0).contains(&mapped) && mapped >= before - 1e-6, "{curve:?} at {x}: {mapped}");
                before = mapped;
            }
            assert!(curve.apply(Vec3::splat(f32::INFINITY)).is_finite());
        }
    }

    #[test]
    fn neutral_keeps_plain_colours() {
        let color = Vec3::new(0.5, 0.3, 0.2);
        let mapped = ToneCurve::Neutral.apply(color);
        assert!((mapped - (color - Vec3::splat(0.04))).length() < 1e-6);
    }
}
