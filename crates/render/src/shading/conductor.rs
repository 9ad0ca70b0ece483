//! The Fresnel term of metals, for one point or sixteen.

use firstlight_simd::{Real, Vector3, select};

/// Larger indices reflect all light, and their squares would overflow.
const LARGEST: f32 = 1e4;

/// Returns the reflectance of unpolarised light at a smooth metal in air, per channel.
///
/// - `cos`: cosine of incidence, in `[0, 1]`; `eta`, `k`: index of refraction and extinction coefficient, at least 0.
///   Exactly 1 for an index of 0.
///
/// Source: the formulas of Fresnel for a complex index η + ik, as in Born and Wolf, "Principles of Optics", section
/// 14.2.
#[inline(always)]
pub(crate) fn conductor<R: Real>(cos: R, eta: Vector3<R>, k: Vector3<R>) -> Vector3<R> {
    let cos = cos.at_least(0.0).at_most(1.0);
    Vector3 { x: of_channel(cos, eta.x, k.x), y: of_channel(cos, eta.y, k.y), z: of_channel(cos, eta.z, k.z) }
}

#[inline(always)]
fn of_channel<R: Real>(cos: R, eta: R, k: R) -> R {
    let one = cos.all(1.0);
    let (cos2, sin2) = (cos * cos, (one - cos) * (one + cos));
    let (eta, k) = (eta.at_most(LARGEST), k.at_most(LARGEST));
    // (a + ib)² = (η + ik)² − sin².
    let (real, imaginary) = ((eta - k) * (eta + k) - sin2, eta * k * 2.0);
    let square = (real * real + imaginary * imaginary).sqrt();
    let a = ((square + real) * 0.5).at_least(0.0).sqrt();
    let twice = a * cos * 2.0;
    let perpendicular = share(square + cos2, twice);
    let parallel = perpendicular * share(square * cos2 + sin2 * sin2, twice * sin2);
    ((perpendicular + parallel) * 0.5).at_least(0.0).at_most(1.0)
}

/// (sum − twice) / (sum + twice); where nothing is left of either, at grazing incidence, all is reflected.
#[inline(always)]
fn share<R: Real>(sum: R, twice: R) -> R {
    let whole = sum + twice;
    select(whole.is_positive(), (sum - twice) / whole, whole.all(1.0))
}

#[cfg(test)]
mod tests {
    use crate::shading::dielectric::fresnel;
    use glam::{DVec2, Vec3};

    fn conductor(cos: f32, eta: Vec3, k: Vec3) -> Vec3 {
        super::conductor(cos, eta.into(), k.into()).into()
    }

    /// ((η − 1)² + k²) / ((η + 1)² + k²), and gold as tables of its reflectance have it.
    #[test]
    fn gold_is_gold_at_normal_incidence() {
        let (eta, k) = (Vec3::new(0.143, 0.375, 1.442), Vec3::new(3.983, 2.386, 1.603));
        let closed = ((eta - 1.0).powf(2.0) + k * k) / ((eta + 1.0).powf(2.0) + k * k);
        let found = conductor(1.0, eta, k);
        assert!((found - closed).abs().max_element() < 1e-6, "{found} for {closed}");
        assert!((found - Vec3::new(0.967, 0.802, 0.324)).abs().max_element() < 1e-3, "{found}");
    }

    #[test]
    fn without_extinction_it_is_a_dielectric() {
        for eta in [1.0, 1.33, 1.5, 2.4] {
            for i in 0..=50 {
                let cos = i as f32 / 50.0;
                let (expected, found) = (fresnel(cos, 1.0 / eta).0, conductor(cos, Vec3::splat(eta), Vec3::ZERO).x);
                assert!((found - expected).abs() < 2e-5, "η {eta}, cos {cos}: {found} for {expected}");
            }
        }
    }

    /// The amplitudes of both polarisations with complex numbers, in `f64`.
    #[test]
    fn amplitudes_of_complex_numbers_give_the_same() {
        let times = |a: DVec2, b: DVec2| DVec2::new(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
        let share = |a: DVec2, b: DVec2| a.length_squared() / b.length_squared();
        for (eta, k) in [(0.143, 3.983), (1.442, 1.603), (0.04, 5.0), (2.9, 3.1), (60.0, 0.5)] {
            for cos in [1.0, 0.8, 0.4, 0.1, 0.02] {
                let index = DVec2::new(eta, k);
                let square = times(index, index) - DVec2::new(1.0 - cos * cos, 0.0);
                // Principal root: η cos θₜ.
                let inside = DVec2::from_angle(0.5 * square.to_angle()) * square.length().sqrt();
                let perpendicular = share(DVec2::new(cos, 0.0) - inside, DVec2::new(cos, 0.0) + inside);
                let bent = times(index, index) * cos;
                let expected = 0.5 * (perpendicular + share(bent - inside, bent + inside));
                let found = conductor(cos as f32, Vec3::splat(eta as f32), Vec3::splat(k as f32)).x;
                assert!((f64::from(found) - expected).abs() < 2e-5, "{eta} + {k}i, {cos}: {found} for {expected}");
            }
        }
    }

    #[test]
    fn no_indices_give_what_is_no_number() {
        let all = [0.0, f32::MIN_POSITIVE, 1e-3, 1.0, 3.0, 1e4, f32::MAX];
        for (eta, k) in all.into_iter().flat_map(|eta| all.map(|k| (eta, k))) {
            for cos in [0.0, 1e-30, 1e-6, 0.3, 1.0] {
                let found = conductor(cos, Vec3::splat(eta), Vec3::splat(k)).x;
                assert!((0.0..=1.0).contains(&found), "{eta} + {k}i, cos {cos}: {found}");
            }
        }
    }
}
