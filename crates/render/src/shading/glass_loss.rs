//! Energy that a rough dielectric loses in single scattering, by table.
//!
//! See [`crate::shading::rough_glass`] for its compensation.

use crate::core::material::SMALLEST_ALPHA;
use crate::shading::dielectric::{fresnel, reflect, refract};
use crate::shading::ggx;
use crate::shading::integral_table::{Between, IntegralTable};
use crate::shading::microfacets::Microfacets;
use firstlight_simd::Vector3;
use std::f32::consts::PI;

const N_COS: usize = 24;
const N_ALPHA: usize = 16;
/// Odd, so that index 1, about which losses have their largest curvature, is an entry.
const N_ETA: usize = 25;

/// Range of (η − 1) / (η + 1) in the table, on both sides of 0: indices from 1/4 to 4.
const MOST_CONTRAST: f32 = 0.6;

/// The loss has its largest curvature where the cosine is about alpha: columns are uniform in the root of
/// `cos (1 + BEND α) / (cos + BEND α)`.
const BEND: f32 = 2.0;

/// Losses by contrast of the indices, root of alpha, cosine.
pub(crate) static LOSSES: IntegralTable = IntegralTable::new(N_ETA * N_ALPHA * N_COS, |i| {
    let (layer, row, column) = (i / N_COS / N_ALPHA, i / N_COS % N_ALPHA, i % N_COS);
    lost_at(cos_of(column, row), alpha_of(row), eta_of(layer), [24, 16])
});

/// Cosine-weighted means by contrast of the indices and root of alpha.
static MEAN_LOSSES: IntegralTable = IntegralTable::new(N_ETA * N_ALPHA, |i| {
    // ∫ 2 cos · lost dcos of the interpolated table, in uniform steps of cos².
    let (n, row, losses) = (256, i % N_ALPHA, LOSSES.get());
    let at = |cos: f32| cos_at(cos, alpha_of(row)).mean(|column| losses[i * N_COS + column]);
    (0..n).map(|k| at(((k as f32 + 0.5) / n as f32).sqrt())).sum::<f32>() / n as f32
});

fn contrast_at(eta: f32) -> Between {
    let contrast = (eta - 1.0) / (eta + 1.0) / MOST_CONTRAST;
    Between::new(0.5 + 0.5 * contrast.abs().sqrt().copysign(contrast), N_ETA)
}

fn cos_at(cos: f32, alpha: f32) -> Between {
    let bend = BEND * alpha;
    Between::new((cos * (1.0 + bend) / (cos + bend)).sqrt(), N_COS)
}

fn alpha_at(alpha: f32) -> Between {
    Between::new(alpha.max(0.0).sqrt(), N_ALPHA)
}

/// Returns the share of light from one direction that single scattering loses.
///
/// - `cos`: cosine with the normal; `alpha`: GGX width; `eta`: index on the side of the light over that on the far
///   side.
pub(crate) fn lost(cos: f32, alpha: f32, eta: f32) -> f32 {
    let table = LOSSES.get();
    let columns = cos_at(cos, alpha.clamp(SMALLEST_ALPHA, 1.0));
    contrast_at(eta).mean(|layer| {
        alpha_at(alpha).mean(|row| columns.mean(|column| table[(layer * N_ALPHA + row) * N_COS + column]))
    })
}

/// Like [`lost`], for uniform light from one side.
pub(crate) fn mean_lost(alpha: f32, eta: f32) -> f32 {
    let table = MEAN_LOSSES.get();
    contrast_at(eta).mean(|layer| alpha_at(alpha).mean(|row| table[layer * N_ALPHA + row]))
}

fn alpha_of(row: usize) -> f32 {
    (row as f32 / (N_ALPHA - 1) as f32).powi(2).max(SMALLEST_ALPHA)
}

fn cos_of(column: usize, row: usize) -> f32 {
    let (x, bend) = (column as f32 / (N_COS - 1) as f32, BEND * alpha_of(row));
    // The frame is undefined at exactly grazing incidence; a value close to the limit is used.
    (bend * x * x / (1.0 + bend - x * x)).max(1e-5)
}

fn eta_of(layer: usize) -> f32 {
    // Dense near index 1.
    let root = 2.0 * layer as f32 / (N_ETA - 1) as f32 - 1.0;
    let contrast = MOST_CONTRAST * root * root.abs();
    (1.0 + contrast) / (1.0 - contrast)
}

fn lost_at(cos: f32, alpha: f32, eta: f32, n: [u32; 2]) -> f32 {
    (1.0 - scattered_once(cos, Microfacets::isotropic(alpha, false), eta, n).0).max(0.0) as f32
}

/// Returns the share of light from one direction that single scattering returns on both sides, and on its own side
/// alone.
///
/// Integrates over all visible normals by the midpoint rule, like [`ggx::single_scattering_albedo`].
///
/// - `cos`, `eta`: as of [`lost`]; `cos` above 0; `facets`: isotropic, of width [`SMALLEST_ALPHA`] or more.
/// - `n_radii`, `n_angles`: points along both axes.
pub(crate) fn scattered_once(cos: f32, facets: Microfacets, eta: f32, [n_radii, n_angles]: [u32; 2]) -> (f64, f64) {
    let wo = Vector3 { x: (1.0 - cos * cos).max(0.0).sqrt(), y: 0.0, z: cos };
    let alpha = facets.alpha[0];
    let standard = Vector3 { x: wo.x * alpha, y: 0.0, z: wo.z }.normalize();
    let lambda_o = facets.lambda(wo);
    let (mut kept, mut reflected) = (0.0, 0.0);
    for i in 0..n_radii {
        // 1 − r², by its cube root: much of the loss is at the rim of the disc.
        let rest = 1.0 - (i as f32 + 0.5) / n_radii as f32;
        let (gap, weight) = (rest.powi(3), if facets.beckmann { 1.0 } else { 3.0 * rest * rest });
        let up = gap * (1.0 + standard.z);
        let z = up - standard.z;
        let sin = (1.0 - z * z).max(0.0).sqrt();
        for k in 0..n_angles {
            // The other half is symmetric.
            let (sin_phi, cos_phi) = (PI * (k as f32 + 0.5) / n_angles as f32).sin_cos();
            let (x, y) = (sin * cos_phi + standard.x, sin * sin_phi);
            let half = if facets.beckmann {
                // Without tails: uniform in the cumulative distributions.
                facets.sample(wo, [rest, (k as f32 + 0.5) / n_angles as f32])
            } else {
                Vector3 { x: x * alpha, y: y * alpha, z: up }.normalize()
            };
            let (reflectance, cos_t) = fresnel(wo.dot(half).clamp(0.0, 1.0), eta);
            let (above, below) = (reflect(wo, half), refract(wo, half, eta, cos_t));
            let seen = 1.0 + lambda_o;
            let mut back = 0.0;
            if above.z > 0.0 {
                back += reflectance * seen / (seen + facets.lambda(above));
                reflected += f64::from(weight * back);
            }
            if below.z < 0.0 && reflectance < 1.0 {
                let both = ggx::above_and_below(lambda_o, facets.lambda(Vector3 { z: -below.z, ..below }));
                back += (1.0 - reflectance) * both * seen;
            }
            kept += f64::from(weight * back);
        }
    }
    let n = f64::from(n_radii * n_angles);
    (kept / n, reflected / n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_interpolates_the_integral() {
        for alpha in [0.02, 0.1, 0.2, 0.33, 0.5, 0.7, 0.9, 1.0] {
            for eta in [1.0 / 2.4, 1.0 / 1.5, 1.0 / 1.33, 0.97, 1.1, 1.33, 1.5, 1.7, 2.4] {
                for cos in [0.02, 0.1, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0] {
                    let (table, integral) = (lost(cos, alpha, eta), lost_at(cos, alpha, eta, [120, 60]));
                    assert!((table - integral).abs() < 0.016, "cos {cos}, α {alpha}, η {eta}: {table} for {integral}");
                }
            }
        }
    }
}
