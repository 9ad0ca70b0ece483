//! Albedos of layers, which determine how much light reaches the layers below.
//!
//! All are tables of integrals over the visible microfacets, computed at first use.

use crate::shading::ggx::{mean_schlick, single_scattering_albedo};
use crate::shading::sheen;
use std::f32::consts::PI;
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
        let whole = single_scattering_albedo(cos_theta, alpha);
        let grazing = whole * mean_schlick(cos_theta, alpha);
        Self { facing: whole - grazing, grazing }
    }

    /// Mean over all directions, weighted by their cosine.
    #[inline]
    pub fn mean(alpha: f32) -> Self {
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
        let (i, f) = place(alpha.clamp(0.0, 1.0).sqrt(), N_MEANS);
        let between = |part: fn(&Self) -> f32| part(&table[i]) + f * (part(&table[i + 1]) - part(&table[i]));
        Self { facing: between(|albedo| albedo.facing), grazing: between(|albedo| albedo.grazing) }
    }
}

const N_MEANS: usize = 65;

/// Returns the albedo of a sheen of strength 1 at an angle; see [`sheen`].
///
/// - `alpha`: width, from [`sheen::LEAST_ALPHA`] to 1.
#[inline]
pub(crate) fn sheen_albedo(cos_theta: f32, alpha: f32) -> f32 {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        (0..N_SHEEN * N_SHEEN)
            .map(|i| {
                let at = |k: usize| k as f32 / (N_SHEEN - 1) as f32;
                integrate_sheen(at(i % N_SHEEN).powi(2), sheen_alpha(at(i / N_SHEEN)))
            })
            .collect()
    });
    let (x, fx) = place(cos_theta.clamp(0.0, 1.0).sqrt(), N_SHEEN);
    let spread = (alpha - sheen::LEAST_ALPHA) / (1.0 - sheen::LEAST_ALPHA);
    let (y, fy) = place(spread.clamp(0.0, 1.0).sqrt(), N_SHEEN);
    let at = |dx: usize, dy: usize| table[(y + dy) * N_SHEEN + x + dx];
    let row = |dy| at(0, dy) + fx * (at(1, dy) - at(0, dy));
    row(0) + fy * (row(1) - row(0))
}

const N_SHEEN: usize = 48;

fn sheen_alpha(at: f32) -> f32 {
    sheen::LEAST_ALPHA + (1.0 - sheen::LEAST_ALPHA) * at * at
}

/// Returns the table entry below a position in 0..=1, and the offset to the next entry.
#[inline]
fn place(at: f32, n: usize) -> (usize, f32) {
    let x = at * (n - 1) as f32;
    let i = (x as usize).min(n - 2);
    (i, x - i as f32)
}

/// Returns ∫ 2 cos θ f(cos θ) d cos θ by Gauss–Legendre quadrature.
pub(crate) fn cosine_mean(f: impl Fn(f32) -> f32) -> f32 {
    GAUSS.iter().map(|&(x, weight)| 2.0 * x * weight * f(x)).sum()
}

/// Eight-point Gauss–Legendre rule on 0..1: points and weights.
pub(crate) const GAUSS: [(f32, f32); 8] = [
    (0.019_855_072, 0.050_614_268),
    (0.101_666_76, 0.111_190_52),
    (0.237_233_8, 0.156_853_32),
    (0.408_282_68, 0.181_341_89),
    (0.591_717_3, 0.181_341_89),
    (0.762_766_2, 0.156_853_32),
    (0.898_333_25, 0.111_190_52),
    (0.980_144_9, 0.050_614_268),
];

/// Integrates by uniform steps of the light's angles, denser at the horizon.
fn integrate_sheen(cos_o: f32, alpha: f32) -> f32 {
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
            sum += f64::from(sheen::value(cos_o.max(1e-4), cos_i, cos_h, alpha) * cos_i * 2.0 * x);
        }
    }
    (sum * 2.0 * std::f64::consts::PI / f64::from(N * N)) as f32
}
