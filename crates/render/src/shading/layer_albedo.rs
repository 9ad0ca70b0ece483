//! Albedos of layers, which determine how much light reaches the layers below.
//!
//! All are tables of integrals over the visible microfacets, computed at first use.

use crate::shading::anisotropic_albedo;
use crate::shading::ggx::{TABLE_LEAST_ALPHA, mean_schlick, single_scattering_albedo};
use crate::shading::integral_table::{Between, GAUSS, IntegralTable};
use crate::shading::sheen;
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};
use std::sync::OnceLock;

/// Albedo of a layer of GGX microfacets with reflectance `f0 + (f90 − f0) x`, where x is Schlick's (1 − cos θ)⁵:
/// `f0 · facing + f90 · grazing`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SchlickAlbedo {
    pub facing: f32,
    pub grazing: f32,
}

impl SchlickAlbedo {
    /// Albedo at an angle; within 10⁻³ of the integral.
    #[inline]
    pub fn new(cos_theta: f32, alpha: f32) -> Self {
        Self::of(single_scattering_albedo(cos_theta, alpha), mean_schlick(cos_theta, alpha))
    }

    /// Albedo for a direction in the frame of a surface with two widths; within 1 % of the integral in nearly all
    /// directions.
    ///
    /// - `w`: unit, above the surface; `alpha`: along x and y.
    #[inline]
    pub fn along(w: Vec3, alpha: [f32; 2]) -> Self {
        if alpha[0] == alpha[1] {
            return Self::new(w.z, alpha[0]);
        }
        let (whole, schlick) = anisotropic_albedo::albedo(w, alpha);
        Self::of(whole, schlick)
    }

    /// - `schlick`: mean of Schlick's (1 − cos)⁵ over the returned light.
    #[inline]
    fn of(whole: f32, schlick: f32) -> Self {
        let grazing = whole * schlick;
        Self { facing: whole - grazing, grazing }
    }

    /// Mean over all directions, weighted by their cosine.
    #[inline]
    pub fn mean(alpha: [f32; 2]) -> Self {
        if alpha[0] == alpha[1] { Self::isotropic_mean(alpha[0]) } else { Self::anisotropic_mean(alpha) }
    }

    fn isotropic_mean(alpha: f32) -> Self {
        static TABLE: OnceLock<Vec<SchlickAlbedo>> = OnceLock::new();
        let table = TABLE.get_or_init(|| {
            (0..N_MEANS)
                .map(|i| {
                    let alpha = (i as f32 / (N_MEANS - 1) as f32).powi(2);
                    let of = |part: fn(Self) -> f32| cosine_mean(|cos| part(Self::new(cos, alpha)));
                    Self { facing: of(|albedo| albedo.facing), grazing: of(|albedo| albedo.grazing) }
                })
                .collect()
        });
        let rows = Between::new(alpha.max(0.0).sqrt(), N_MEANS);
        let of = |part: fn(&Self) -> f32| rows.mean(|row| part(&table[row]));
        Self { facing: of(|albedo| albedo.facing), grazing: of(|albedo| albedo.grazing) }
    }

    fn anisotropic_mean(alpha: [f32; 2]) -> Self {
        static TABLE: OnceLock<Vec<SchlickAlbedo>> = OnceLock::new();
        let table = TABLE.get_or_init(|| {
            let at = |k: usize| k as f32 / (N_ANISOTROPIC - 1) as f32;
            (0..N_ANISOTROPIC * N_ANISOTROPIC)
                .map(|i| {
                    let narrow = at(i % N_ANISOTROPIC).powi(2).max(TABLE_LEAST_ALPHA);
                    let wide = narrow + (1.0 - narrow) * at(i / N_ANISOTROPIC).powi(2);
                    let of = |part: fn(Self) -> f32| hemisphere_mean(|w| part(Self::along(w, [wide, narrow])));
                    Self { facing: of(|albedo| albedo.facing), grazing: of(|albedo| albedo.grazing) }
                })
                .collect()
        });
        let (narrow, wide) = (alpha[0].min(alpha[1]), alpha[0].max(alpha[1]));
        let columns = Between::new(narrow.max(0.0).sqrt(), N_ANISOTROPIC);
        let rows = Between::new(((wide - narrow) / (1.0 - narrow).max(f32::MIN_POSITIVE)).sqrt(), N_ANISOTROPIC);
        let of =
            |part: fn(&Self) -> f32| rows.mean(|row| columns.mean(|column| part(&table[row * N_ANISOTROPIC + column])));
        Self { facing: of(|albedo| albedo.facing), grazing: of(|albedo| albedo.grazing) }
    }

    /// Albedo of a white layer.
    #[inline]
    pub fn whole(&self) -> f32 {
        self.facing + self.grazing
    }
}

const N_MEANS: usize = 65;
const N_ANISOTROPIC: usize = 17;

/// Returns f of a sheen of strength 1, sr⁻¹, reciprocal: [`sheen::value`], where its albedo would exceed 1 divided by
/// the larger albedo of both directions.
///
/// - `cos_o`, `cos_i`, `cos_h`: as of [`sheen::value`]; `alpha`: width, from [`sheen::LEAST_ALPHA`] to 1.
#[inline]
pub(crate) fn bounded_sheen(cos_o: f32, cos_i: f32, cos_h: f32, alpha: f32) -> f32 {
    let most = [cos_o, cos_i].map(|cos| sheen_entry(UNBOUNDED_SHEEN.get(), cos, alpha)).into_iter().fold(1.0, f32::max);
    sheen::value(cos_o, cos_i, cos_h, alpha) / most
}

/// Returns the albedo of [`bounded_sheen`] at an angle.
#[inline]
pub(crate) fn sheen_albedo(cos_theta: f32, alpha: f32) -> f32 {
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

#[inline]
fn sheen_entry(table: &[f32], cos_theta: f32, alpha: f32) -> f32 {
    let columns = Between::new(cos_theta.max(0.0).sqrt(), N_SHEEN);
    let spread = (alpha - sheen::LEAST_ALPHA) / (1.0 - sheen::LEAST_ALPHA);
    Between::new(spread.max(0.0).sqrt(), N_SHEEN).mean(|row| columns.mean(|column| table[row * N_SHEEN + column]))
}

const N_SHEEN: usize = 48;

/// Returns ∫ 2 cos θ f(cos θ) d cos θ by Gauss–Legendre quadrature.
pub(crate) fn cosine_mean(f: impl Fn(f32) -> f32) -> f32 {
    GAUSS.iter().map(|&(x, weight)| 2.0 * x * weight * f(x)).sum()
}

/// Mean over directions, weighted by their cosine, of a function that is symmetric about x and y.
pub(crate) fn hemisphere_mean(f: impl Fn(Vec3) -> f32) -> f32 {
    // Two-point Gauss–Legendre rule over the azimuths of a quadrant.
    const AZIMUTHS: [f32; 2] = [0.211_324_87 * FRAC_PI_2, 0.788_675_1 * FRAC_PI_2];
    cosine_mean(|cos| {
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let at = |phi: f32| f(Vec3::new(sin * phi.cos(), sin * phi.sin(), cos));
        0.5 * (at(AZIMUTHS[0]) + at(AZIMUTHS[1]))
    })
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
