//! Smooth dielectric interfaces and mirrors, for one point or sixteen.

use firstlight_simd::{Real, Vector3, select};

/// Returns the Fresnel reflectance of unpolarised light at a smooth dielectric, and the cosine of the refracted ray.
///
/// - `cos_i`: in `[0, 1]`, on the side of incidence; `eta`: index of that side over the index of the far side.
///
/// Returns (1, 0) beyond the critical angle. Exact for `eta` = 1, where nothing is reflected.
#[inline(always)]
pub fn fresnel<R: Real>(cos_i: R, eta: R) -> (R, R) {
    let (one, zero) = (eta.all(1.0), eta.all(0.0));
    // 1 − η²(1 − cos²) rearranged: for η near 1 the two terms of the direct form cancel.
    let cos2_t = (one - eta) * (eta + 1.0) + (eta * cos_i) * (eta * cos_i);
    let total = cos2_t.le(zero);
    let cos_t = cos2_t.at_least(0.0).sqrt();
    let perpendicular = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let parallel = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let reflectance = (perpendicular * perpendicular + parallel * parallel) * 0.5;
    let alike = eta.equals(one) & !total;
    (select(total, one, select(alike, zero, reflectance)), select(alike, cos_i, cos_t))
}

/// Returns the refracted direction, unit.
///
/// - `wo`: unit, on the side of `normal`; `eta` as in [`fresnel`], which also gives `cos_t`.
#[inline(always)]
pub fn refract<R: Real>(wo: Vector3<R>, normal: Vector3<R>, eta: R, cos_t: R) -> Vector3<R> {
    (wo * -eta + normal * (eta * normal.dot(wo) - cos_t)).normalize()
}

/// Returns the mirrored direction, unit.
///
/// - `wo`, `normal`: unit.
#[inline(always)]
pub fn reflect<R: Real>(wo: Vector3<R>, normal: Vector3<R>) -> Vector3<R> {
    (normal * (normal.dot(wo) * 2.0) - wo).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn known_values_of_glass() {
        // Head-on: ((n − 1) / (n + 1))².
        assert!((fresnel(1.0, 1.0 / 1.5).0 - 0.04).abs() < 1e-6);
        assert!((fresnel(1.0, 1.0 / 1.2).0 - 0.008_264_5).abs() < 1e-6);
        // Brewster's angle, tan θ = n: the parallel component vanishes, the perpendicular one is ((n² − 1) / (n² +
        // 1))².
        let cos_b = (1.0_f32 / (1.0 + 1.5 * 1.5)).sqrt();
        assert!((fresnel(cos_b, 1.0 / 1.5).0 - 0.5 * (1.25_f32 / 3.25).powi(2)).abs() < 1e-6);
        assert_eq!(fresnel(0.0, 1.0 / 1.5).0, 1.0);
    }

    #[test]
    fn total_reflection_begins_at_the_critical_angle() {
        let critical = (1.0_f32 - 1.0 / (1.5 * 1.5)).sqrt();
        assert_eq!(fresnel(critical * 0.999, 1.5).0, 1.0);
        assert!(fresnel(critical * 1.001, 1.5).0 < 1.0);
    }

    #[test]
    fn both_sides_reflect_the_same_share() {
        for i in 1..100 {
            let cos_i = i as f32 / 100.0;
            let (from_outside, cos_t) = fresnel(cos_i, 1.0 / 1.5);
            let (from_inside, back) = fresnel(cos_t, 1.5);
            // Near grazing the reverse direction loses digits to 1 − sin²: the bound grows with 1 / cos.
            let bound = 1e-6 / cos_i;
            assert!((from_outside - from_inside).abs() < 4.0 * bound && (back - cos_i).abs() < bound);
        }
    }

    #[test]
    fn indices_that_differ_by_a_millionth_bend_nothing() {
        for cos_i in [1.0, 0.5, 0.1, 1e-2] {
            let (reflected, cos_t) = fresnel(cos_i, 1.0 / (1.0 + 1e-6));
            assert!((0.0..1e-4).contains(&reflected) && (cos_t - cos_i).abs() < 2e-4, "{reflected} {cos_t}");
            assert_eq!(fresnel(cos_i, 1.0), (0.0, cos_i));
        }
    }

    #[test]
    fn refraction_obeys_snell() {
        let normal = Vec3::Z;
        for i in 1..50 {
            let theta = i as f32 * 0.03;
            let wo = Vec3::new(theta.sin(), 0.0, theta.cos());
            let (_, cos_t) = fresnel(wo.z, 1.0 / 1.5);
            let wt = Vec3::from(refract(wo.into(), normal.into(), 1.0 / 1.5, cos_t));
            assert!((wt.x * 1.5 + wo.x).abs() < 1e-5 && wt.z < 0.0, "{wt}");
        }
    }
}
