//! Albedos of layers, which determine how much light reaches the layers below.
//!
//! All are tables of integrals over the visible microfacets, computed at first use.

use crate::shading::anisotropic_albedo;
use crate::shading::ggx::{TABLE_LEAST_ALPHA, mean_schlick, single_scattering_albedo};
use crate::shading::integral_table::{Between, GAUSS, IntegralTable};
use crate::shading::sheen;
use firstlight_simd::{Elementary, Real, Truth, Vector3, select};
use std::f32::consts::PI;

/// Albedo of a layer of GGX microfacets with reflectance `f0 + (f90 − f0) x`, where x is Schlick's (1 − cos θ)⁵:
/// `f0 · facing + f90 · grazing`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SchlickAlbedo<R = f32> {
    pub facing: R,
    pub grazing: R,
}

impl<R: Real> SchlickAlbedo<R> {
    /// Albedo at an angle; within 10⁻³ of the integral.
    #[inline(always)]
    pub fn new(cos_theta: R, alpha: R) -> Self {
        Self::of(single_scattering_albedo(cos_theta, alpha), mean_schlick(cos_theta, alpha))
    }

    /// Albedo for a direction in the frame of a surface with two widths; within 1 % of the integral in nearly all
    /// directions.
    ///
    /// - `w`: unit, above the surface; `alpha`: along x and y.
    #[inline(always)]
    pub fn along(w: Vector3<R>, alpha: [R; 2]) -> Self {
        let isotropic = alpha[0].equals(alpha[1]);
        let even = Self::new(w.z, alpha[0]);
        if !(!isotropic).any() {
            return even;
        }
        let (whole, schlick) = anisotropic_albedo::albedo(w, alpha);
        even.where_true(isotropic, Self::of(whole, schlick))
    }

    /// - `schlick`: mean of Schlick's (1 − cos)⁵ over the returned light.
    #[inline(always)]
    fn of(whole: R, schlick: R) -> Self {
        let grazing = whole * schlick;
        Self { facing: whole - grazing, grazing }
    }

    #[inline(always)]
    fn where_true(self, mask: R::Mask, other: Self) -> Self {
        let facing = select(mask, self.facing, other.facing);
        Self { facing, grazing: select(mask, self.grazing, other.grazing) }
    }

    /// Mean over all directions, weighted by their cosine.
    #[inline(always)]
    pub fn mean(alpha: [R; 2]) -> Self {
        let rows = Between::new(alpha[0].at_least(0.0).sqrt(), N_MEANS);
        let start = alpha[0].all(0.0);
        let [facing, grazing] = [&MEANS[0], &MEANS[1]];
        let even = Self { facing: rows.in_row(facing.get(), start), grazing: rows.in_row(grazing.get(), start) };
        let isotropic = alpha[0].equals(alpha[1]);
        if !(!isotropic).any() {
            return even;
        }
        let (narrow, wide) = (alpha[0].min(alpha[1]), alpha[0].max(alpha[1]));
        let columns = Between::new(narrow.at_least(0.0).sqrt(), N_ANISOTROPIC);
        let room = (start + 1.0 - narrow).at_least(f32::MIN_POSITIVE);
        let rows = Between::new(((wide - narrow) / room).sqrt(), N_ANISOTROPIC);
        let [facing, grazing] = [&ANISOTROPIC_MEANS[0], &ANISOTROPIC_MEANS[1]];
        let facing = columns.in_rows(&rows, facing.get(), N_ANISOTROPIC);
        let grazing = columns.in_rows(&rows, grazing.get(), N_ANISOTROPIC);
        even.where_true(isotropic, Self { facing, grazing })
    }

    /// Albedo of a white layer.
    #[inline(always)]
    pub fn whole(&self) -> R {
        self.facing + self.grazing
    }
}

/// Means by the root of the width.
static MEANS: [IntegralTable; 2] = [
    IntegralTable::new(N_MEANS, |i| cosine_mean(|cos| SchlickAlbedo::new(cos, mean_alpha(i)).facing)),
    IntegralTable::new(N_MEANS, |i| cosine_mean(|cos| SchlickAlbedo::new(cos, mean_alpha(i)).grazing)),
];

fn mean_alpha(i: usize) -> f32 {
    (i as f32 / (N_MEANS - 1) as f32).powi(2)
}

/// Means by the root of the narrow width, and by that of the difference of both.
static ANISOTROPIC_MEANS: [IntegralTable; 2] = [
    IntegralTable::new(N_ANISOTROPIC * N_ANISOTROPIC, |i| {
        hemisphere_mean(|w| SchlickAlbedo::along(w, anisotropic_alpha(i)).facing)
    }),
    IntegralTable::new(N_ANISOTROPIC * N_ANISOTROPIC, |i| {
        hemisphere_mean(|w| SchlickAlbedo::along(w, anisotropic_alpha(i)).grazing)
    }),
];

fn anisotropic_alpha(i: usize) -> [f32; 2] {
    let at = |k: usize| (k as f32 / (N_ANISOTROPIC - 1) as f32).powi(2);
    let narrow = at(i % N_ANISOTROPIC).max(TABLE_LEAST_ALPHA);
    [narrow + (1.0 - narrow) * at(i / N_ANISOTROPIC), narrow]
}

const N_MEANS: usize = 65;
const N_ANISOTROPIC: usize = 17;

/// Returns f of a sheen of strength 1, sr⁻¹, reciprocal: [`sheen::value`], where its albedo would exceed 1 divided by
/// the larger albedo of both directions.
///
/// - `cos_o`, `cos_i`, `cos_h`: as of [`sheen::value`]; `alpha`: width, from [`sheen::LEAST_ALPHA`] to 1.
#[inline(always)]
pub(crate) fn bounded_sheen<R: Elementary>(cos_o: R, cos_i: R, cos_h: R, alpha: R) -> R {
    let table = UNBOUNDED_SHEEN.get();
    let most = sheen_entry(table, cos_o, alpha).max(sheen_entry(table, cos_i, alpha)).at_least(1.0);
    sheen::value(cos_o, cos_i, cos_h, alpha) / most
}

/// Returns the albedo of [`bounded_sheen`] at an angle.
#[inline(always)]
pub(crate) fn sheen_albedo<R: Real>(cos_theta: R, alpha: R) -> R {
    sheen_entry(BOUNDED_SHEEN.get(), cos_theta, alpha)
}

/// Computes the tables of sheen on all threads.
pub(crate) fn compute_sheen() {
    UNBOUNDED_SHEEN.compute();
    BOUNDED_SHEEN.compute();
}

/// Albedo of [`sheen::value`]: above 1 for a narrow sheen at grazing angles.
static UNBOUNDED_SHEEN: IntegralTable =
    IntegralTable::new(N_SHEEN * N_SHEEN, |i| integrate_sheen(sheen_cos(i), sheen_alpha(i), sheen::value));

static BOUNDED_SHEEN: IntegralTable =
    IntegralTable::new(N_SHEEN * N_SHEEN, |i| integrate_sheen(sheen_cos(i), sheen_alpha(i), bounded_sheen));

fn sheen_cos(entry: usize) -> f32 {
    ((entry % N_SHEEN) as f32 / (N_SHEEN - 1) as f32).powi(2)
}

fn sheen_alpha(entry: usize) -> f32 {
    let at = (entry / N_SHEEN) as f32 / (N_SHEEN - 1) as f32;
    sheen::LEAST_ALPHA + (1.0 - sheen::LEAST_ALPHA) * at * at
}

#[inline(always)]
fn sheen_entry<R: Real>(table: &[f32], cos_theta: R, alpha: R) -> R {
    let columns = Between::new(cos_theta.at_least(0.0).sqrt(), N_SHEEN);
    let spread = (alpha - sheen::LEAST_ALPHA) / (1.0 - sheen::LEAST_ALPHA);
    columns.in_rows(&Between::new(spread.at_least(0.0).sqrt(), N_SHEEN), table, N_SHEEN)
}

const N_SHEEN: usize = 48;

/// Returns ∫ 2 cos θ f(cos θ) d cos θ by Gauss–Legendre quadrature.
pub(crate) fn cosine_mean(f: impl Fn(f32) -> f32) -> f32 {
    GAUSS.iter().map(|&(x, weight)| 2.0 * x * weight * f(x)).sum()
}

/// Cosine and sine of the azimuths of the two-point Gauss–Legendre rule over a quadrant, as numbers: what a compiler
/// computes may differ in the last bit from what a library does.
const AZIMUTHS: [[f32; 2]; 2] = [[0.945_409_2, 0.325_885_6], [0.325_885_6, 0.945_409_2]];

/// Two directions whose mean is that over the azimuths, for functions that are symmetric about x and y.
#[inline(always)]
pub(crate) fn azimuths(cos: f32) -> [Vector3<f32>; 2] {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    AZIMUTHS.map(|[x, y]| Vector3 { x: sin * x, y: sin * y, z: cos })
}

/// Mean over directions, weighted by their cosine, of a function that is symmetric about x and y.
fn hemisphere_mean(f: impl Fn(Vector3<f32>) -> f32) -> f32 {
    cosine_mean(|cos| azimuths(cos).into_iter().map(&f).sum::<f32>() * 0.5)
}

/// Integrates by uniform steps of the light's angles, denser at the horizon.
fn integrate_sheen(cos_o: f32, alpha: f32, value: fn(f32, f32, f32, f32) -> f32) -> f32 {
    const N: u32 = 96;
    let sin_o = (1.0 - cos_o * cos_o).max(0.0).sqrt();
    let mut sum = 0.0;
    for i in 0..N {
        let x = (i as f32 + 0.5) / N as f32;
        // cos = x², so d cos = 2 x dx.
        let cos_i = x * x;
        let sin_i = (1.0 - cos_i * cos_i).max(0.0).sqrt();
        for k in 0..N {
            let phi = PI * (k as f32 + 0.5) / N as f32;
            let cos_between = sin_o * sin_i * phi.cos() + cos_o * cos_i;
            let half = (2.0 + 2.0 * cos_between).max(1e-12).sqrt();
            let cos_h = (cos_o + cos_i) / half;
            sum += f64::from(value(cos_o.max(1e-4), cos_i, cos_h, alpha) * cos_i * 2.0 * x);
        }
    }
    (sum * 2.0 * std::f64::consts::PI / f64::from(N * N)) as f32
}
