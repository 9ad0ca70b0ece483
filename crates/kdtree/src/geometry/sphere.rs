//! Ray tests against spheres and planes.
//!
//! Both run in `f64`: the inputs are `f32`, so differences and products of coordinates are exact or nearly so. Neither
//! a sphere of 10 km seen from 1 m nor a sphere of 1 mm seen from 10 km loses precision.

use glam::{DVec3, Vec3};

/// Returns the two intersections of the line with the sphere, nearer first, each rounded once; `None` for a miss.
///
/// The square of the half chord comes from the perpendicular, not from `b² - 4ac`, which cancels for small spheres
/// far away (Haines, Günther and Akenine-Möller 2019, "Precision Improvements for Ray/Sphere Intersection").
///
/// - `inv_dir_squared`: `1 / (dir · dir)`.
#[inline]
pub fn intersect_sphere(
    origin: DVec3,
    dir: DVec3,
    inv_dir_squared: f64,
    center: Vec3,
    radius: f32,
) -> Option<(f32, f32)> {
    let to_center = center.as_dvec3() - origin;
    let radius = f64::from(radius);
    let t_middle = dot(to_center, dir) * inv_dir_squared;
    let perpendicular = to_center - dir * t_middle;
    let discriminant = radius * radius - dot(perpendicular, perpendicular);
    if discriminant < 0.0 {
        return None;
    }
    let half_chord = (discriminant * inv_dir_squared).sqrt();
    Some(((t_middle - half_chord) as f32, (t_middle + half_chord) as f32))
}

/// The dot product with a fixed order of sums, so that every implementation gives the same bits.
#[inline]
pub(crate) fn dot(a: DVec3, b: DVec3) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// Returns where the line crosses the plane; infinite or NaN if the line is parallel to it.
#[inline]
pub fn intersect_plane(origin: DVec3, dir: DVec3, point: Vec3, normal: Vec3) -> f32 {
    let normal = normal.as_dvec3();
    (dot(normal, point.as_dvec3() - origin) / dot(normal, dir)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use proptest::prelude::*;

    fn hits(origin: Vec3, dir: Vec3, center: Vec3, radius: f32) -> Option<(f32, f32)> {
        let dir = dir.as_dvec3();
        intersect_sphere(origin.as_dvec3(), dir, 1.0 / dir.length_squared(), center, radius)
    }

    proptest! {
        #![proptest_config(crate::geometry::robust::fixed_cases(20_000))]

        #[test]
        fn both_crossings_lie_on_the_sphere(
            o in (-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0), d in (-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0),
            c in (-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0), size in -6i32..6, length in -6i32..6, r in 0.01f32..1.5,
        ) {
            let (scale, d) = (10f32.powi(size), Vec3::from(d) * 10f32.powi(length));
            let (o, c, r) = (Vec3::from(o) * scale, Vec3::from(c) * scale, r * scale);
            prop_assume!(d != Vec3::ZERO);
            let wide = |v: Vec3| v.as_dvec3();
            let line = wide(d).normalize();
            let passes = (wide(c) - wide(o)).cross(line).length();
            match hits(o, d, c, r) {
                None => prop_assert!(passes > f64::from(r) * (1.0 - 1e-9)),
                Some((near, far)) => {
                    prop_assert!(passes < f64::from(r) * (1.0 + 1e-9) && near <= far);
                    for t in [near, far] {
                        let distance = (wide(o) + f64::from(t) * wide(d) - wide(c)).length();
                        // One rounding of t.
                        let bound = f64::from(t.abs()) * wide(d).length() * 2f64.powi(-24) + 1e-12 * f64::from(scale);
                        prop_assert!((distance - f64::from(r)).abs() <= bound, "{distance} for {r} at {t}");
                    }
                }
            }
        }

        #[test]
        fn a_crossing_lies_on_the_plane(
            o in (-1e3f32..1e3, -1e3f32..1e3, -1e3f32..1e3), d in (-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0),
            p in (-1e3f32..1e3, -1e3f32..1e3, -1e3f32..1e3), n in (-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0),
        ) {
            let [o, d, p, n] = [o, d, p, n].map(Vec3::from);
            let n = n.normalize_or(Vec3::Y);
            let t = intersect_plane(o.as_dvec3(), d.as_dvec3(), p, n);
            prop_assume!(t.is_finite());
            let height = (o.as_dvec3() + f64::from(t) * d.as_dvec3() - p.as_dvec3()).dot(n.as_dvec3());
            let bound = f64::from(t.abs()) * f64::from(d.dot(n).abs()) * 2f64.powi(-23) + 1e-9;
            prop_assert!(height.abs() <= bound, "{height} above the plane, {bound} allowed");
        }
    }

    #[test]
    fn huge_sphere_from_close_by() {
        // A planet of 10 km radius below a camera 1 m above it: f32 arithmetic would be off by millimetres to metres.
        let (near, far) = hits(vec3(0.0, 1.0, 0.0), -Vec3::Y, vec3(0.0, -1e4, 0.0), 1e4).unwrap();
        assert_eq!((near, far), (1.0, 20001.0));
    }

    #[test]
    fn small_sphere_from_afar() {
        let center = vec3(1e4, 2e4, -3e4);
        let dir = center.normalize();
        let (near, far) = hits(Vec3::ZERO, dir, center, 0.25).unwrap();
        let distance = center.as_dvec3().length() as f32;
        // The direction is rounded to f32, so the ray passes the centre within about a millimetre.
        assert!((near - (distance - 0.25)).abs() <= 2.0 * 0.00390625 && far > near, "{near} {far}");
        assert_eq!(hits(vec3(0.0, 0.2500001, -1e6), Vec3::Z, Vec3::ZERO, 0.25), None);
        assert!(hits(vec3(0.0, 0.2499999, -1e6), Vec3::Z, Vec3::ZERO, 0.25).is_some());
    }

    #[test]
    fn from_inside_and_behind() {
        assert_eq!(hits(Vec3::ZERO, 2.0 * Vec3::X, Vec3::ZERO, 3.0), Some((-1.5, 1.5)));
        assert_eq!(hits(5.0 * Vec3::X, Vec3::X, Vec3::ZERO, 3.0), Some((-8.0, -2.0)));
    }

    #[test]
    fn plane_alongside_is_not_a_finite_hit() {
        let t = |o: Vec3, d: Vec3| intersect_plane(o.as_dvec3(), d.as_dvec3(), Vec3::ZERO, Vec3::Y);
        assert_eq!(t(vec3(3.0, 2.0, 1.0), vec3(1.0, -1.0, 0.0)), 2.0);
        assert!(!t(Vec3::Y, Vec3::X).is_finite() && !t(Vec3::ZERO, Vec3::X).is_finite());
    }
}
