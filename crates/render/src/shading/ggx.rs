//! Isotropic and anisotropic GGX microfacets: distribution, masking, visible normals, and the energy lost by single
//! scattering.
//!
//! All vectors are unit and in the shading frame, with the normal along +z.

use crate::sampling::warp::uniform_disc;
use crate::shading::integral_table::{Between, GAUSS, IntegralTable};
use firstlight_simd::{Real, Vector3, select, select_vector};
use glam::Vec3;
use std::f32::consts::PI;

/// Distribution of normals D, per steradian (Walter et al. 2007, equation 33).
#[inline(always)]
pub fn distribution<R: Real>(h: Vector3<R>, alpha: R) -> R {
    // cos²(α² − 1) + 1 rearranged to α²cos² + sin²: near the peak of a smooth surface the first form cancels.
    let a2 = alpha * alpha;
    let d = a2 * h.z * h.z + (h.x * h.x + h.y * h.y);
    a2 / (d * d * PI)
}

/// Smith's Λ.
#[inline(always)]
pub fn lambda<R: Real>(w: Vector3<R>, alpha: R) -> R {
    let tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    // (√(1 + a²tan²) − 1) / 2 without cancellation for small slopes.
    let x = alpha * alpha * tan2;
    x * 0.5 / ((x + 1.0).sqrt() + 1.0)
}

/// Like [`distribution`], with a width per axis (Heitz 2014, equation 86).
#[inline(always)]
pub fn anisotropic_distribution<R: Real>(h: Vector3<R>, [ax, ay]: [R; 2]) -> R {
    let (x, y) = (h.x / ax, h.y / ay);
    let d = x * x + y * y + h.z * h.z;
    d.all(1.0) / (ax * ay * d * d * PI)
}

/// Like [`lambda`], with a width per axis.
#[inline(always)]
pub fn anisotropic_lambda<R: Real>(w: Vector3<R>, [ax, ay]: [R; 2]) -> R {
    let (x, y) = (ax * w.x, ay * w.y);
    let x = (x * x + y * y) / (w.z * w.z);
    x * 0.5 / ((x + 1.0).sqrt() + 1.0)
}

/// Returns G2 for one direction above the surface and one below: where a share u of the surface lies lower, they are
/// visible with probabilities u^Λₒ and (1 − u)^Λᵢ, and the mean over u is Euler's Β(1 + Λₒ, 1 + Λᵢ) (Heitz et al. 2016,
/// "Multiple-Scattering Microfacet BSDFs with the Smith Model").
pub fn above_and_below(lambda_o: f32, lambda_i: f32) -> f32 {
    beta_of_next(f64::from(lambda_o), f64::from(lambda_i)) as f32
}

/// Returns Β(1 + a, 1 + b) for `a`, `b` ≥ 0.
fn beta_of_next(a: f64, b: f64) -> f64 {
    (ln_factorial(a) + ln_factorial(b) - ln_factorial(a + b + 1.0)).exp()
}

/// Returns ln Γ(1 + x) for `x` ≥ 0 with error 1e-11: Stirling's series above 8, the recurrence below.
fn ln_factorial(x: f64) -> f64 {
    let (mut z, mut product) = (x + 1.0, 1.0);
    while z < 8.0 {
        product *= z;
        z += 1.0;
    }
    let r = 1.0 / (z * z);
    let series = (1.0 / 12.0 - r * (1.0 / 360.0 - r * (1.0 / 1260.0 - r / 1680.0))) / z;
    (z - 0.5) * z.ln() - z + 0.5 * std::f64::consts::TAU.ln() + series - product.ln()
}

/// Samples a microfacet normal among those visible from `wo`.
///
/// Its pdf is `D(h) · G1(wo) · max(0, wo·h) / wo.z` per steradian; `wo.z > 0`, `alpha`: width per axis, `u` in
/// `[0, 1)²`. Source: Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps".
#[inline(always)]
pub fn sample_visible_normal<R: Real>(wo: Vector3<R>, alpha: [R; 2], u: [R; 2]) -> Vector3<R> {
    let wo_std = stretched(wo, alpha).normalize();
    // The point on the cap is mapped from a disc, which preserves stratification and needs no sine: the squared radius
    // is uniform, and so is the height on the cap.
    let [x, y] = uniform_disc(u);
    let one = x.all(1.0);
    let r2 = (x * x + y * y).at_most(1.0);
    let z = (one - r2) * (wo_std.z + 1.0) - wo_std.z;
    // Rounding can push z² past 1, and the root of a negative number would be NaN.
    let sin_theta = (one - z * z).at_least(0.0).sqrt();
    let middle = r2.is_zero();
    let scale = sin_theta / select(middle, one, r2.sqrt());
    let wi_std = Vector3 { x: select(middle, sin_theta, x * scale), y: y * scale, z };
    let h = stretched(wo_std + wi_std, alpha);
    let length = h.length();
    // Opposite vectors: at the rim of the visible hemisphere any normal is valid.
    let up = Vector3 { x: x.all(0.0), y: x.all(0.0), z: one };
    select_vector(length.is_positive(), h * (one / length), up)
}

#[inline(always)]
fn stretched<R: Real>(v: Vector3<R>, [x, y]: [R; 2]) -> Vector3<R> {
    Vector3 { x: v.x * x, y: v.y * y, z: v.z }
}

/// Returns the single-scattering albedo of a surface with reflectance 1, seen at `cos_theta`.
///
/// From a table, within 5 · 10⁻⁴ of the integral for every angle and every `alpha` ≥ 10⁻⁴.
#[inline(always)]
pub fn single_scattering_albedo<R: Real>(cos_theta: R, alpha: R) -> R {
    let alpha = alpha.at_least(0.0).at_most(1.0);
    let (cos, bend) = (cos_theta.at_least(1e-6).at_most(1.0), alpha * BEND);
    let columns = Between::new((cos * (bend + 1.0) / (cos + bend)).sqrt(), N);
    columns.in_rows(&Between::new(alpha.sqrt(), N), ALBEDOS.get(), N)
}

/// See [`single_scattering_albedo`].
pub(crate) static ALBEDOS: IntegralTable =
    IntegralTable::new(N * N, |i| integrate_isotropic(table_cos(i % N, i / N), table_alpha(i / N), 12, 32).0);

/// Returns lost energy over returned energy of single scattering, for [`crate::shading::metal::Metal`]; arguments as
/// for [`single_scattering_albedo`].
#[inline(always)]
pub fn lost_over_returned<R: Real>(cos_theta: R, alpha: R) -> R {
    let albedo = single_scattering_albedo(cos_theta, alpha);
    (albedo.all(1.0) - albedo) / albedo
}

/// Entries per side of the albedo table.
const N: usize = 50;

/// The albedo has its largest curvature where the cosine is about alpha: columns are uniform in the root of
/// `cos (1 + BEND α) / (cos + BEND α)`.
const BEND: f32 = 2.0;

fn table_cos(column: usize, row: usize) -> f32 {
    let (x, alpha) = (column as f32 / (N - 1) as f32, table_alpha(row));
    // The frame is undefined at exactly grazing incidence; a value close to the limit is used.
    (BEND * alpha * x * x / (1.0 + BEND * alpha - x * x)).max(1e-6)
}

fn table_alpha(row: usize) -> f32 {
    (row as f32 / (N - 1) as f32).powi(2).max(TABLE_LEAST_ALPHA)
}

/// Returns the mean of Schlick's (1 − cos)⁵ of the angle with the microfacet normal, over the light returned by single
/// scattering.
///
/// From a table, within 10⁻³ of the integral.
#[inline(always)]
pub(crate) fn mean_schlick<R: Real>(cos_theta: R, alpha: R) -> R {
    let columns = Between::new(cos_theta.at_least(0.0).sqrt(), N_MEANS);
    let rows = Between::new(alpha.at_least(0.0).sqrt(), N_MEANS);
    columns.in_rows(&rows, SCHLICK_MEANS.get(), N_MEANS)
}

/// Entries per side of the table of means.
const N_MEANS: usize = 64;

/// See [`mean_schlick`].
pub(crate) static SCHLICK_MEANS: IntegralTable = IntegralTable::new(N_MEANS * N_MEANS, |i| {
    let at = |k: usize| k as f32 / (N_MEANS - 1) as f32;
    let (cos, alpha) = (at(i % N_MEANS).powi(2).max(1e-6), at(i / N_MEANS).powi(2).max(TABLE_LEAST_ALPHA));
    let (whole, of_schlick) = integrate_isotropic(cos, alpha, 4, 16);
    of_schlick / whole
});

/// Smoother surfaces have the same values, to the accuracy of the tables.
pub(crate) const TABLE_LEAST_ALPHA: f32 = 1e-4;

/// [`integrate_albedo`] of an isotropic surface.
fn integrate_isotropic(cos_theta: f32, alpha: f32, panels: u32, n_angles: u32) -> (f32, f32) {
    let wo = Vec3::new((1.0 - cos_theta * cos_theta).max(0.0).sqrt(), 0.0, cos_theta);
    // The other half is symmetric.
    integrate_albedo(wo, [alpha; 2], panels, n_angles, PI)
}

/// Integrates the single-scattering albedo, and the same with the factor (1 − cos)⁵ of Schlick for the angle with the
/// microfacet normal: over all visible normals, on the disc that [`sample_visible_normal`] maps from. Most of the loss
/// of a smooth surface is in the long tail of its normals, at the rim of the disc, so the radii are dense there.
///
/// - `panels`: of eight radii each, by Gauss–Legendre quadrature; `n_angles`: by the midpoint rule; `turn`: range of
///   the angles, 2π or a symmetric part of it.
pub(crate) fn integrate_albedo(wo: Vec3, alpha: [f32; 2], panels: u32, n_angles: u32, turn: f32) -> (f32, f32) {
    let stretch = Vec3::new(alpha[0], alpha[1], 1.0);
    let wo_std = (wo * stretch).normalize();
    let lambda_o = anisotropic_lambda(wo.into(), alpha);
    let (mut sum, mut sum_of_schlick) = (0.0, 0.0);
    for (i, (at, share)) in (0..panels).flat_map(|i| GAUSS.map(|point| (i, point))) {
        // 1 − r², by its cube root.
        let rest = (i as f32 + at) / panels as f32;
        let (gap, weight) = (rest.powi(3), 3.0 * rest * rest * share);
        let z = gap * (1.0 + wo_std.z) - wo_std.z;
        let sin_theta = (1.0 - z * z).max(0.0).sqrt();
        for k in 0..n_angles {
            let (sin_phi, cos_phi) = (turn * (k as f32 + 0.5) / n_angles as f32).sin_cos();
            // `z + wo_std.z` without cancellation.
            let up = gap * (1.0 + wo_std.z);
            let h = (Vec3::new(sin_theta * cos_phi + wo_std.x, sin_theta * sin_phi + wo_std.y, up) * stretch)
                .normalize_or(Vec3::Z);
            let wi = 2.0 * wo.dot(h) * h - wo;
            if wi.z > 0.0 {
                // G2 / G1, see [`crate::shading::microfacets::Reflection`].
                let masking = lambda_o + 1.0;
                let returned = f64::from(weight * (masking / (masking + anisotropic_lambda(wi.into(), alpha))));
                sum += returned;
                sum_of_schlick += returned * f64::from((1.0 - wo.dot(h)).max(0.0).powi(5));
            }
        }
    }
    let n = f64::from(panels * n_angles);
    ((sum / n) as f32, (sum_of_schlick / n) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projected_normals_cover_the_surface_once() {
        // ∫ D(h) cos θ_h dh = 1 by definition.
        for alpha in [0.01_f32, 0.1, 0.5, 1.0] {
            let n = 20_000;
            let mut sum = 0.0_f64;
            for i in 0..n {
                // Uniform steps in the angle of the peak: tan θ = α tan φ.
                let phi = (f64::from(i) + 0.5) / f64::from(n) * std::f64::consts::FRAC_PI_2;
                let theta = (f64::from(alpha) * phi.tan()).atan();
                let d_theta = f64::from(alpha) / (phi.cos().powi(2) * (1.0 + (f64::from(alpha) * phi.tan()).powi(2)));
                let h = Vec3::new(theta.sin() as f32, 0.0, theta.cos() as f32);
                sum += f64::from(distribution(h.into(), alpha)) * theta.cos() * theta.sin() * d_theta;
            }
            let integral = sum * std::f64::consts::TAU * std::f64::consts::FRAC_PI_2 / f64::from(n);
            assert!((integral - 1.0).abs() < 2e-3, "α {alpha}: {integral}");
        }
    }

    #[test]
    fn albedo_table_interpolates_the_integral() {
        let steps = [1e-3, 3e-3, 0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.73, 0.85, 0.93, 1.0];
        for (cos_theta, alpha) in steps.into_iter().flat_map(|cos| steps.map(|alpha| (cos, alpha))) {
            let table = single_scattering_albedo(cos_theta, alpha);
            let integral = integrate_isotropic(cos_theta, alpha, 25, 100).0;
            assert!((table / integral - 1.0).abs() < 5e-4, "cos {cos_theta}, α {alpha}: {table} for {integral}");
            assert!(integral <= 1.0 + 1e-6, "a surface must not make light");
        }
    }

    #[test]
    fn betas_are_what_tables_say() {
        for (a, b, expected) in
            [(0.0, 0.0, 1.0), (1.0, 1.0, 1.0 / 6.0), (2.0, 3.0, 1.0 / 60.0), (0.5, 0.5, std::f64::consts::PI / 8.0)]
        {
            assert!((beta_of_next(a, b) / expected - 1.0).abs() < 1e-9, "{a}, {b}");
        }
        for a in [1e-9, 0.1, 5.0, 7.5, 1e3, 1e7] {
            assert!((beta_of_next(a, 0.0) * (1.0 + a) - 1.0).abs() < 1e-6, "{a}");
            assert!(beta_of_next(a, 1e7) < 1e-6);
        }
    }
}
