//! Thin-lens camera: from a point on the film and a point on the lens to a ray.

use crate::sampling::{polygon_disc, uniform_disc};
use firstlight_kdtree::geometry::Ray;
use firstlight_simd::{Real, Vector3};
use glam::{Vec2, Vec3};
use thiserror::Error;

/// A thin-lens camera in the space of the snapshot. The focal *plane* is perpendicular to `forward`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of the lens, metres.
    pub eye: Vec3,
    /// To the right in the picture. The three axes are unit and mutually perpendicular; `right × up` points at the viewer.
    pub right: Vec3,
    /// Upwards in the picture.
    pub up: Vec3,
    /// Into the picture, along the optical axis.
    pub forward: Vec3,
    /// Tangent of half the vertical field of view.
    pub tan_half_vfov: f32,
    /// Metres; 0 is a pinhole, which samples no lens.
    pub lens_radius: f32,
    /// Metres along `forward` from the camera to the focal plane, positive; may be infinite.
    pub focus_distance: f32,
    /// Straight edges of the aperture; below 3 it is round.
    pub blades: u32,
    /// Radians, counter-clockwise seen from behind the camera.
    pub blade_rotation: f32,
}

/// A camera that takes no picture: which field, what it is, and what is allowed.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("camera: `{field}` is {value}, but must {allowed}")]
pub struct CameraError {
    /// Name of the field of [`Camera`].
    pub field: &'static str,
    /// Its value, as text.
    pub value: String,
    /// What it must be instead, as the end of a sentence that begins with "must".
    pub allowed: &'static str,
}

impl Camera {
    /// Whether rays through every point of the film and the lens have an origin and a direction.
    ///
    /// # Errors
    /// The first field that is out of range.
    pub fn check(&self) -> Result<(), CameraError> {
        let wrong = |field, value: &dyn std::fmt::Display, allowed| {
            let value = value.to_string();
            Err(CameraError { field, value, allowed })
        };
        let Self { eye, right, up, forward, tan_half_vfov, lens_radius, focus_distance, blades: _, blade_rotation } =
            *self;
        if !eye.is_finite() {
            return wrong("eye", &eye, "be finite");
        }
        for (field, axis) in [("right", right), ("up", up), ("forward", forward)] {
            if !((axis.length() - 1.0).abs() <= 1e-3) {
                return wrong(field, &axis, "be of length 1");
            }
        }
        if !(tan_half_vfov > 0.0 && tan_half_vfov.is_finite()) {
            return wrong("tan_half_vfov", &tan_half_vfov, "be positive and finite");
        }
        if !(lens_radius >= 0.0 && lens_radius.is_finite()) {
            return wrong("lens_radius", &lens_radius, "be 0 or positive, and finite");
        }
        if !(focus_distance > 0.0) {
            return wrong("focus_distance", &focus_distance, "be positive; infinity is allowed");
        }
        if !blade_rotation.is_finite() {
            return wrong("blade_rotation", &blade_rotation, "be finite");
        }
        Ok(())
    }

    /// The ray through a point of the film, with a unit direction.
    ///
    /// - `film`: pixels from the upper left corner; `size`: width and height of the film in pixels.
    /// - `lens`: two numbers in `[0, 1)`; unused by a pinhole.
    #[inline]
    pub fn ray(&self, film: Vec2, size: Vec2, lens: Vec2) -> Ray {
        let direction = self.film_direction(film, size);
        if self.lens_radius == 0.0 {
            return Ray::new(self.eye, direction.normalize());
        }
        let (origin, dir) = self.through_lens(direction.into(), self.aperture_point(lens).to_array());
        Ray::new(origin.into(), dir.into())
    }

    /// Origin and unit direction of the ray through a point of the lens.
    ///
    /// - `direction`: see [`Self::film_directions`]; `aperture`: the point over the radius of the lens, along `right` and `up`.
    #[inline(always)]
    pub(crate) fn through_lens<R: Real>(&self, direction: Vector3<R>, [x, y]: [R; 2]) -> (Vector3<R>, Vector3<R>) {
        let (focus, one) = (self.focus_distance, x.all(1.0));
        let offset =
            (Vector3::in_all(one, self.right) * x + Vector3::in_all(one, self.up) * y).mul_all(self.lens_radius);
        let origin = Vector3::in_all(one, self.eye) + offset;
        // Both ends divided by the focus distance: right for a plane at infinity, and no cancellation with the camera.
        if focus >= 1.0 {
            return (origin, (direction - offset * (one / one.all(focus))).normalize());
        }
        // Or the other way round, for a plane so near that the quotient would leave the range of f32.
        let towards = direction.mul_all(focus) - offset;
        (origin, (towards * (one / towards.abs().max_element())).normalize())
    }

    /// Nearest and farthest depth, metres along `forward`, at which the circle of confusion is at most one pixel of a
    /// picture so many pixels high; the farthest may be infinite, and for a pinhole everything is sharp.
    ///
    /// A point at depth z is seen from a point o of the lens at film position x + o (1/f − 1/z), in units of the plane
    /// a metre ahead, so a lens of radius R spreads it over a circle of diameter 2 R |1/f − 1/z|.
    pub fn sharp_zone(&self, height: u32) -> (f32, f32) {
        let pixel = 2.0 * self.tan_half_vfov / height.max(1) as f32;
        // For a pinhole infinite, and then nothing is subtracted from it.
        let slack = pixel / (2.0 * self.lens_radius);
        let focus = self.focus_distance.recip();
        let far = if focus > slack { (focus - slack).recip() } else { f32::INFINITY };
        ((focus + slack).recip(), far)
    }

    /// A point of the lens by its distance from the camera along `right` and `up`, metres.
    ///
    /// - `u`: two numbers in `[0, 1)`.
    #[inline]
    pub fn lens_offset(&self, u: Vec2) -> Vec2 {
        self.lens_radius * self.aperture_point(u)
    }

    /// The same over the radius of the lens.
    #[inline]
    fn aperture_point(&self, u: Vec2) -> Vec2 {
        if self.blades < 3 { uniform_disc(u) } else { polygon_disc(u, self.blades, self.blade_rotation) }
    }

    /// The point of the lens at an offset from the camera along `right` and `up`, metres; see [`Self::lens_offset`].
    #[inline]
    pub fn lens_point(&self, offset: Vec2) -> Vec3 {
        self.lens_points(offset.to_array()).into()
    }

    /// See [`Self::lens_point`].
    #[inline(always)]
    pub(crate) fn lens_points<R: Real>(&self, [x, y]: [R; 2]) -> Vector3<R> {
        let across = Vector3::in_all(x, self.right) * x + Vector3::in_all(x, self.up) * y;
        Vector3::in_all(x, self.eye) + across
    }

    /// Where in the film light ends that comes to a point of the lens, and the cosine of its way with `forward`: the
    /// inverse of [`Self::ray`]. `None` for light from behind.
    ///
    /// - `offset`: the point of the lens; `way`: from there to where the light comes from, any length.
    #[inline]
    pub fn film_point(&self, offset: Vec2, way: Vec3, size: Vec2) -> Option<(Vec2, f32)> {
        let (film, depth) = self.film_points(offset.to_array(), way.into(), size);
        (depth > 0.0).then(|| (film.into(), depth / way.length()))
    }

    /// See [`Self::film_point`]; also how far ahead along `forward` the light comes from, metres.
    #[inline(always)]
    pub(crate) fn film_points<R: Real>(&self, [x, y]: [R; 2], way: Vector3<R>, size: Vec2) -> ([R; 2], R) {
        let depth = way.dot(Vector3::in_all(x, self.forward));
        let across = way.dot(Vector3::in_all(x, self.right)) / depth + x / self.focus_distance;
        let above = way.dot(Vector3::in_all(x, self.up)) / depth + y / self.focus_distance;
        let scale = size.y / self.tan_half_vfov;
        ([(across * scale + size.x) * 0.5, (above * -scale + size.y) * 0.5], depth)
    }

    /// From the camera through a point of the film to the plane one metre ahead; not unit.
    #[inline]
    pub fn film_direction(&self, film: Vec2, size: Vec2) -> Vec3 {
        self.film_directions(film.to_array(), size).into()
    }

    /// See [`Self::film_direction`].
    #[inline(always)]
    pub(crate) fn film_directions<R: Real>(&self, [x, y]: [R; 2], size: Vec2) -> Vector3<R> {
        let across = (x * 2.0 - size.x) / size.y * self.tan_half_vfov;
        let above = (x.all(size.y) - y * 2.0) / size.y * self.tan_half_vfov;
        Vector3::in_all(x, self.forward) + Vector3::in_all(x, self.right) * across + Vector3::in_all(x, self.up) * above
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(lens_radius: f32, focus_distance: f32) -> Camera {
        Camera {
            eye: Vec3::new(1.0, 2.0, 3.0),
            right: Vec3::X,
            up: Vec3::Y,
            forward: Vec3::NEG_Z,
            tan_half_vfov: 0.5,
            lens_radius,
            focus_distance,
            blades: 0,
            blade_rotation: 0.0,
        }
    }

    #[test]
    fn a_camera_without_rays_is_refused_by_its_field() {
        let good = camera(0.3, 4.0);
        assert_eq!(good.check(), Ok(()));
        assert_eq!(camera(0.0, f32::INFINITY).check(), Ok(()));
        let (nan, inf) = (f32::NAN, f32::INFINITY);
        for (bad, field) in [
            (Camera { eye: Vec3::new(nan, 0.0, 0.0), ..good }, "eye"),
            (Camera { eye: Vec3::splat(inf), ..good }, "eye"),
            (Camera { up: Vec3::ZERO, ..good }, "up"),
            (Camera { right: Vec3::splat(nan), ..good }, "right"),
            (Camera { forward: Vec3::Z * 2.0, ..good }, "forward"),
            (Camera { tan_half_vfov: 0.0, ..good }, "tan_half_vfov"),
            (Camera { tan_half_vfov: -1.0, ..good }, "tan_half_vfov"),
            (Camera { tan_half_vfov: nan, ..good }, "tan_half_vfov"),
            (Camera { lens_radius: -0.1, ..good }, "lens_radius"),
            (Camera { lens_radius: inf, ..good }, "lens_radius"),
            (Camera { focus_distance: 0.0, ..good }, "focus_distance"),
            (Camera { focus_distance: nan, ..good }, "focus_distance"),
            (Camera { blade_rotation: inf, ..good }, "blade_rotation"),
        ] {
            assert_eq!(bad.check().unwrap_err().field, field);
        }
    }

    #[test]
    fn corners_of_the_film_span_the_field_of_view() {
        let size = Vec2::new(200.0, 100.0);
        let ray = camera(0.0, 1.0).ray(Vec2::ZERO, size, Vec2::ZERO);
        let expected = Vec3::new(-1.0, 0.5, -1.0).normalize();
        assert!((ray.dir - expected).length() < 1e-6, "{}", ray.dir);
    }

    #[test]
    fn all_points_of_the_lens_meet_in_the_focal_plane() {
        let camera = camera(0.3, 4.0);
        let (film, size) = (Vec2::new(20.0, 70.0), Vec2::new(200.0, 100.0));
        let target = camera.eye + 4.0 * camera.film_direction(film, size);
        for i in 0..64 {
            let ray = camera.ray(film, size, Vec2::new((i % 8) as f32, (i / 8) as f32) / 8.0);
            let t = (target - ray.origin).dot(ray.dir);
            assert!((ray.at(t) - target).length() < 1e-5);
            assert!((ray.origin - camera.eye).length() <= 0.3 * 1.000_001);
        }
    }

    #[test]
    fn light_goes_back_to_where_the_ray_began() {
        let size = Vec2::new(200.0, 100.0);
        for (lens_radius, focus_distance) in [(0.0, 1.0), (0.3, 4.0), (0.3, f32::INFINITY)] {
            let mut camera = camera(lens_radius, focus_distance);
            camera.blades = 6;
            for i in 0..64 {
                let (lens, film) = (Vec2::new((i % 8) as f32, (i / 8) as f32) / 8.0, Vec2::new(3.1 * i as f32, 99.0));
                let ray = camera.ray(film, size, lens);
                let offset = camera.lens_offset(lens);
                assert!((camera.lens_point(offset) - ray.origin).length() < 1e-6);
                let (found, cos) = camera.film_point(offset, 7.0 * ray.dir, size).unwrap();
                assert!((found - film).length() < 1e-3, "{found} for {film}");
                assert!((cos - ray.dir.dot(camera.forward)).abs() < 1e-6);
                assert_eq!(camera.film_point(offset, -ray.dir, size), None);
            }
        }
    }

    /// `offset / focus` left the range of `f32`, or its square did, and rays had no direction.
    #[test]
    fn no_lens_and_no_focus_leave_a_ray_without_direction() {
        for lens in [1e-30, 1e-3, 1.0, 1e12] {
            for focus in [f32::MIN_POSITIVE, 1e-30, 1e-20, 1e-3, 1.0, 1e12, f32::MAX, f32::INFINITY] {
                let ray = camera(lens, focus).ray(Vec2::new(3.0, 90.0), Vec2::new(200.0, 100.0), Vec2::new(0.1, 0.9));
                assert!((ray.dir.length() - 1.0).abs() < 1e-6, "{lens} {focus}: {}", ray.dir);
            }
        }
    }

    #[test]
    fn focus_at_infinity_gives_parallel_rays() {
        let camera = camera(0.3, f32::INFINITY);
        let (film, size) = (Vec2::new(20.0, 70.0), Vec2::new(200.0, 100.0));
        let a = camera.ray(film, size, Vec2::new(0.1, 0.9));
        let b = camera.ray(film, size, Vec2::new(0.9, 0.2));
        assert_eq!(a.dir, b.dir);
        assert_ne!(a.origin, b.origin);
    }
}
