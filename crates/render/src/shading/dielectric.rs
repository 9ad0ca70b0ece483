//! Smooth interfaces between transparent media.

use glam::Vec3;

/// Fresnel reflectance of unpolarised light at a smooth dielectric, and the cosine of the refracted ray.
///
/// - `cos_i`: in `[0, 1]`, on the side of incidence; `eta`: index of that side over the index of the far side.
///
/// Returns (1, 0) beyond the critical angle. Exact for `eta` = 1, where nothing is reflected.
#[inline]
pub fn fresnel(cos_i: f32, eta: f32) -> (f32, f32) {
    // 1 − η²(1 − cos²) rearranged: with η near 1 the two terms of the plain form cancel.
    let cos2_t = (1.0 - eta) * (1.0 + eta) + (eta * cos_i) * (eta * cos_i);
    if cos2_t <= 0.0 {
        return (1.0, 0.0);
    }
    let cos_t = cos2_t.sqrt();
    if eta == 1.0 {
        return (0.0, cos_i);
    }
    let perpendicular = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let parallel = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    (0.5 * (perpendicular * perpendicular + parallel * parallel), cos_t)
}

/// The refracted direction, unit.
///
/// - `wo`: unit, on the side of `normal`; `eta` as in [`fresnel`], which also gives `cos_t`.
#[inline]
pub fn refract(wo: Vec3, normal: Vec3, eta: f32, cos_t: f32) -> Vec3 {
    (-eta * wo + (eta * wo.dot(normal) - cos_t) * normal).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values_of_glass() {
        // Head-on: ((n − 1) / (n + 1))².
        assert!((fresnel(1.0, 1.0 / 1.5).0 - 0.04).abs() < 1e-6);
        assert!((fresnel(1.0, 1.0 / 1.2).0 - 0.008_264_5).abs() < 1e-6);
        // Brewster's angle, tan θ = n: the parallel part vanishes, the perpendicular is ((n² − 1) / (n² + 1))².
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
            // Near grazing the way back loses digits to 1 − sin²: the bound grows with 1 / cos.
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
            let wt = refract(wo, normal, 1.0 / 1.5, cos_t);
            assert!((wt.x * 1.5 + wo.x).abs() < 1e-5 && wt.z < 0.0, "{wt}");
        }
    }
}
