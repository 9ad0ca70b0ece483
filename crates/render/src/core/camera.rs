//! Thin-lens camera: from a film position and a lens position to a ray.
//!
//! A perspective camera has one lens at a point. An orthographic one has a lens at every point of the film (the limit
//! of a telecentric lens): without an aperture all of its rays are parallel; with one, each point of the film sees a
//! cone whose tip lies in the focal plane.

use crate::sampling::{polygon_disc, uniform_disc};
use firstlight_kdtree::geometry::Ray;
use firstlight_simd::{Real, Vector3};
use glam::{Vec2, Vec3};
use thiserror::Error;

/// A thin-lens camera in the snapshot's frame. The focal *plane* is perpendicular to `forward`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of the lens, metres; for an orthographic camera the centre of the plane in which its rays start.
    pub eye: Vec3,
    /// Right direction of the image. The three axes are unit and mutually perpendicular; `right × up` points at the
    /// viewer.
    pub right: Vec3,
    /// Up direction of the image.
    pub up: Vec3,
    /// View direction, along the optical axis.
    pub forward: Vec3,
    /// Tangent of half the vertical field of view of a perspective camera.
    pub tan_half_vfov: f32,
    /// Half the visible height of an orthographic camera, metres; `None` for a perspective camera.
    pub orthographic: Option<f32>,
    /// Radius of the lens in metres; 0 is a pinhole, which samples no lens.
    pub lens_radius: f32,
    /// Distance from the camera to the focal plane along `forward`, metres, positive; may be infinite.
    pub focus_distance: f32,
    /// Number of aperture blades; below 3 the aperture is round.
    pub blades: u32,
    /// Rotation of the blades in radians, counter-clockwise seen from behind the camera.
    pub blade_rotation: f32,
}

/// An invalid camera: which field, its value, and what is allowed.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("camera: `{field}` is {value}, but must {allowed}")]
pub struct CameraError {
    /// Name of the field of [`Camera`].
    pub field: &'static str,
    /// Its value, as text.
    pub value: String,
    /// Requirement, as the end of a sentence that begins with "must".
    pub allowed: &'static str,
}

impl Default for Camera {
    /// A pinhole at the origin that looks along −Z, with +Y up and a vertical field of view of 90 degrees.
    fn default() -> Self {
        Self {
            eye: Vec3::ZERO,
            right: Vec3::X,
            up: Vec3::Y,
            forward: Vec3::NEG_Z,
            tan_half_vfov: 1.0,
            orthographic: None,
            lens_radius: 0.0,
            focus_distance: 1.0,
            blades: 0,
            blade_rotation: 0.0,
        }
    }
}

impl Camera {
    /// A pinhole at `eye` with `look_at` in the centre of the image and +Y up, or +Z for a view along Y.
    ///
    /// - `tan_half_vfov`: tangent of half the vertical field of view.
    pub fn looking_at(eye: Vec3, look_at: Vec3, tan_half_vfov: f32) -> Self {
        let forward = (look_at - eye).normalize();
        let right = forward.cross(if forward.y.abs() > 0.99 { Vec3::Z } else { Vec3::Y }).normalize();
        Self { eye, right, up: right.cross(forward), forward, tan_half_vfov, ..Self::default() }
    }

    /// Checks that rays through every film and lens position have an origin and a direction.
    ///
    /// # Errors
    /// The first field that is out of range.
    pub fn check(&self) -> Result<(), CameraError> {
        let wrong = |field, value: &dyn std::fmt::Display, allowed| {
            let value = value.to_string();
            Err(CameraError { field, value, allowed })
        };
        let Self { eye, right, up, forward, tan_half_vfov, orthographic, .. } = *self;
        let Self { lens_radius, focus_distance, blades: _, blade_rotation, .. } = *self;
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
        if let Some(half) = orthographic.filter(|half| !(*half > 0.0 && half.is_finite())) {
            return wrong("orthographic", &half, "be positive and finite");
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

    /// Returns the ray through a film position, with a unit direction.
    ///
    /// - `film`: pixels from the upper left corner; `size`: width and height of the film in pixels.
    /// - `lens`: two numbers in `[0, 1)`; unused by a pinhole.
    #[inline]
    pub fn ray(&self, film: Vec2, size: Vec2, lens: Vec2) -> Ray {
        let aperture = (self.lens_radius != 0.0).then(|| self.aperture_point(lens).to_array());
        let (origin, dir) = self.rays(film.to_array(), size, aperture);
        Ray::new(origin.into(), dir.into())
    }

    /// Returns the ray through a film position and the centre of the lens, with a unit direction; see [`Self::ray`].
    #[inline]
    pub fn middle_ray(&self, film: Vec2, size: Vec2) -> Ray {
        let (origin, dir) = self.rays(film.to_array(), size, None);
        Ray::new(origin.into(), dir.into())
    }

    /// Returns origin and unit direction of the ray through a film position.
    ///
    /// - `aperture`: lens position over its radius, along `right` and `up`; `None` for its centre.
    #[inline(always)]
    pub(crate) fn rays<R: Real>(&self, film: [R; 2], size: Vec2, aperture: Option<[R; 2]>) -> (Vector3<R>, Vector3<R>) {
        let eye = Vector3::in_all(film[0], self.eye);
        let (middle, direction) = match self.orthographic {
            None => {
                let [across, above] = self.film_offsets(film, size, self.tan_half_vfov);
                let (right, up) = (Vector3::in_all(across, self.right), Vector3::in_all(across, self.up));
                (eye, Vector3::in_all(across, self.forward) + right * across + up * above)
            }
            Some(half) => {
                let offsets = self.film_offsets(film, size, half);
                (eye + self.across(offsets), Vector3::in_all(film[0], self.forward))
            }
        };
        match aperture {
            None => (middle, direction.normalize()),
            Some(aperture) => self.through_lens(middle, direction, aperture),
        }
    }

    /// Returns the point at a depth that a film position shows through the middle of the lens.
    ///
    /// - `film`: pixels from the upper left corner; `depth`: metres along `forward`.
    #[inline(always)]
    pub(crate) fn points<R: Real>(&self, film: [R; 2], size: Vec2, depth: R) -> Vector3<R> {
        let (eye, forward) = (Vector3::in_all(depth, self.eye), Vector3::in_all(depth, self.forward));
        match self.orthographic {
            None => eye + (forward + self.across(self.film_offsets(film, size, self.tan_half_vfov))) * depth,
            Some(half) => eye + forward * depth + self.across(self.film_offsets(film, size, half)),
        }
    }

    /// Offsets along `right` and `up`, in units of `half`, which is half the height of the film.
    #[inline(always)]
    fn film_offsets<R: Real>(&self, [x, y]: [R; 2], size: Vec2, half: f32) -> [R; 2] {
        [(x * 2.0 - size.x) / size.y * half, (x.all(size.y) - y * 2.0) / size.y * half]
    }

    /// - `offsets`: along `right` and `up`, metres.
    #[inline(always)]
    fn across<R: Real>(&self, [x, y]: [R; 2]) -> Vector3<R> {
        Vector3::in_all(x, self.right) * x + Vector3::in_all(x, self.up) * y
    }

    /// Returns origin and unit direction of the ray through a lens position.
    ///
    /// - `direction`: to the plane one metre ahead; `aperture`: lens position over its radius, along `right` and `up`.
    #[inline(always)]
    fn through_lens<R: Real>(
        &self,
        middle: Vector3<R>,
        direction: Vector3<R>,
        aperture: [R; 2],
    ) -> (Vector3<R>, Vector3<R>) {
        let (focus, one) = (self.focus_distance, aperture[0].all(1.0));
        let offset = self.across(aperture).mul_all(self.lens_radius);
        let origin = middle + offset;
        // Both ends divided by the focus distance: valid for a plane at infinity, and without cancellation.
        if focus >= 1.0 {
            return (origin, (direction - offset * (one / one.all(focus))).normalize());
        }
        // Multiplied instead, for a plane so close that the quotient would leave the range of f32.
        let towards = direction.mul_all(focus) - offset;
        (origin, (towards * (one / towards.abs().max_element())).normalize())
    }

    /// Returns the nearest and farthest depth, metres along `forward`, at which the circle of confusion is at most one
    /// pixel of an image that is `height` pixels high; the farthest may be infinite, and for a pinhole everything is in
    /// focus.
    ///
    /// A point at depth z is projected from a point o of the lens to x + o (1/f − 1/z), in units of the plane at 1 m,
    /// so a lens of radius R spreads it over a circle of diameter 2 R |1/f − 1/z|; an orthographic camera projects it
    /// to x + o (1 − z/f), in metres.
    pub fn sharp_zone(&self, height: u32) -> (f32, f32) {
        if let Some(half) = self.orthographic {
            let tolerance = half / (height.max(1) as f32 * self.lens_radius);
            // Focused at infinity, all rays of a film position have one direction.
            if self.focus_distance.is_infinite() || tolerance.is_infinite() {
                return (0.0, f32::INFINITY);
            }
            return (self.focus_distance * (1.0 - tolerance).max(0.0), self.focus_distance * (1.0 + tolerance));
        }
        let pixel = 2.0 * self.tan_half_vfov / height.max(1) as f32;
        // Infinite for a pinhole, and then not subtracted from.
        let tolerance = pixel / (2.0 * self.lens_radius);
        let focus = self.focus_distance.recip();
        let far = if focus > tolerance { (focus - tolerance).recip() } else { f32::INFINITY };
        ((focus + tolerance).recip(), far)
    }

    /// Returns the diameter of the circle of confusion of points, in units of [`Self::pixel_size`]; see
    /// [`Self::sharp_zone`].
    ///
    /// - `depth`: metres along `forward`, may be infinite.
    #[inline(always)]
    pub(crate) fn confusion<R: Real>(&self, depth: R) -> R {
        let off = match self.orthographic {
            None => depth.all(1.0) / depth - self.focus_distance.recip(),
            Some(_) => depth / self.focus_distance - 1.0,
        };
        off.abs() * (2.0 * self.lens_radius)
    }

    /// Returns a lens position as its offset from the camera along `right` and `up`, metres.
    ///
    /// - `u`: two numbers in `[0, 1)`.
    #[inline]
    pub fn lens_offset(&self, u: Vec2) -> Vec2 {
        self.lens_radius * self.aperture_point(u)
    }

    /// Whether points of the lens are those of a disc.
    #[inline]
    pub fn has_round_lens(&self) -> bool {
        self.blades < 3
    }

    /// Like [`Self::lens_offset`], over the radius of the lens.
    #[inline]
    fn aperture_point(&self, u: Vec2) -> Vec2 {
        if self.has_round_lens() { uniform_disc(u) } else { polygon_disc(u, self.blades, self.blade_rotation) }
    }

    /// Connects a point through a lens position to the film: the inverse of [`Self::ray`]. `None` for points behind the
    /// camera.
    ///
    /// - `offset`: lens position; see [`Self::lens_offset`].
    #[inline]
    pub(crate) fn connection(&self, offset: Vec2, position: Vec3, size: Vec2) -> Option<Connection<f32>> {
        let connection = self.connections(offset.to_array(), position.into(), size);
        (connection.depth > 0.0).then_some(connection)
    }

    /// See [`Self::connection`]; points behind the camera have a depth that is not positive.
    #[inline(always)]
    pub(crate) fn connections<R: Real>(&self, offset: [R; 2], position: Vector3<R>, size: Vec2) -> Connection<R> {
        let x = offset[0];
        let eye = Vector3::in_all(x, self.eye);
        let forward = Vector3::in_all(x, self.forward);
        if let Some(half) = self.orthographic {
            // All light through one lens position has one direction.
            let from_eye = position - eye;
            let depth = from_eye.dot(forward);
            let part = depth / self.focus_distance;
            let scale = size.y / half;
            let across = from_eye.dot(Vector3::in_all(x, self.right)) + offset[0] * (part - 1.0);
            let above = from_eye.dot(Vector3::in_all(x, self.up)) + offset[1] * (part - 1.0);
            let way = forward * depth - self.across(offset) * part;
            return Connection {
                lens: position - way,
                film: [(across * scale + size.x) * 0.5, (above * -scale + size.y) * 0.5],
                depth,
            };
        }
        let lens = eye + self.across(offset);
        let way = position - lens;
        let depth = way.dot(forward);
        let across = way.dot(Vector3::in_all(x, self.right)) / depth + offset[0] / self.focus_distance;
        let above = way.dot(Vector3::in_all(x, self.up)) / depth + offset[1] / self.focus_distance;
        let scale = size.y / self.tan_half_vfov;
        Connection { lens, film: [(across * scale + size.x) * 0.5, (above * -scale + size.y) * 0.5], depth }
    }

    /// Returns the area perpendicular to the light, in square metres, per square metre of the film, for one lens
    /// position.
    ///
    /// The film of a perspective camera is the plane one metre ahead.
    ///
    /// - `distance2`: squared distance to the lens; `cos_lens`: cosine between the light's direction and `forward`.
    #[inline(always)]
    pub(crate) fn spread<R: Real>(&self, distance2: R, cos_lens: R) -> R {
        if self.orthographic.is_some() {
            return cos_lens;
        }
        distance2 * (cos_lens * cos_lens * cos_lens)
    }

    /// Returns the side length of a pixel on the film, metres; see [`Self::spread`].
    pub(crate) fn pixel_size(&self, size: Vec2) -> f32 {
        2.0 * self.orthographic.unwrap_or(self.tan_half_vfov) / size.y
    }
}

/// A connection of a point through the lens to the film.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Connection<R> {
    /// Lens position in the snapshot's frame, metres.
    pub lens: Vector3<R>,
    /// Film position, pixels.
    pub film: [R; 2],
    /// Depth of the point along `forward`, metres.
    pub depth: R,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(lens_radius: f32, focus_distance: f32) -> Camera {
        let (eye, tan_half_vfov) = (Vec3::new(1.0, 2.0, 3.0), 0.5);
        Camera { eye, tan_half_vfov, lens_radius, focus_distance, ..Camera::default() }
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
            (Camera { orthographic: Some(0.0), ..good }, "orthographic"),
            (Camera { orthographic: Some(nan), ..good }, "orthographic"),
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
        for camera in [camera, Camera { orthographic: Some(2.0), ..camera }] {
            let middle = camera.middle_ray(film, size);
            let target = middle.at(4.0 / middle.dir.dot(camera.forward));
            for i in 0..64 {
                let ray = camera.ray(film, size, Vec2::new((i % 8) as f32, (i / 8) as f32) / 8.0);
                let t = (target - ray.origin).dot(ray.dir);
                assert!((ray.at(t) - target).length() < 1e-5);
                assert!((ray.origin - middle.origin).length() <= 0.3 * 1.000_001);
            }
        }
    }

    #[test]
    fn parallel_rays_span_the_height() {
        let camera = Camera { orthographic: Some(1.5), ..camera(0.0, 1.0) };
        let (size, corner) = (Vec2::new(200.0, 100.0), camera.eye + Vec3::new(-3.0, 1.5, 0.0));
        let ray = camera.ray(Vec2::ZERO, size, Vec2::ZERO);
        assert!((ray.origin - corner).length() < 1e-6 && ray.dir == camera.forward, "{ray:?}");
    }

    #[test]
    fn light_goes_back_to_where_the_ray_began() {
        let size = Vec2::new(200.0, 100.0);
        for (lens_radius, focus_distance) in [(0.0, 1.0), (0.3, 4.0), (0.3, f32::INFINITY)] {
            for orthographic in [None, Some(2.0)] {
                let camera = Camera { blades: 6, orthographic, ..camera(lens_radius, focus_distance) };
                for i in 0..64 {
                    let lens = Vec2::new((i % 8) as f32, (i / 8) as f32) / 8.0;
                    let film = Vec2::new(3.1 * i as f32, 99.0);
                    let ray = camera.ray(film, size, lens);
                    let offset = camera.lens_offset(lens);
                    let found = camera.connection(offset, ray.at(7.0), size).unwrap();
                    assert!((Vec3::from(found.lens) - ray.origin).length() < 1e-5, "{found:?} for {ray:?}");
                    assert!((Vec2::from(found.film) - film).length() < 2e-3, "{found:?} for {film}");
                    assert!((found.depth - 7.0 * ray.dir.dot(camera.forward)).abs() < 1e-5);
                    assert!(camera.connection(offset, ray.at(-7.0), size).is_none());
                }
            }
        }
    }

    /// By finite differences: the area on the film of a square metre perpendicular to the light.
    #[test]
    fn the_spread_is_how_the_film_sees_an_area() {
        let size = Vec2::new(200.0, 100.0);
        for orthographic in [None, Some(2.0)] {
            let camera = Camera { orthographic, ..camera(0.3, 4.0) };
            let (offset, position) = (Vec2::new(0.2, -0.1), camera.eye + Vec3::new(0.4, 0.7, -6.0));
            let found = camera.connection(offset, position, size).unwrap();
            let way = position - Vec3::from(found.lens);
            let (a, b) = (way.normalize().any_orthonormal_vector(), way.normalize());
            let b = a.cross(b);
            const STEP: f32 = 1e-2;
            let film = |d: Vec3| Vec2::from(camera.connection(offset, position + d * STEP, size).unwrap().film);
            let (du, dv) = (film(a) - film(-a), film(b) - film(-b));
            let pixels = du.perp_dot(dv).abs() / (2.0 * STEP).powi(2);
            let cos = way.normalize().dot(camera.forward);
            let pixel = camera.pixel_size(size);
            let expected = 1.0 / (camera.spread(way.length_squared(), cos) * pixel * pixel);
            assert!((pixels / expected - 1.0).abs() < 1e-2, "{pixels} for {expected}");
        }
    }

    /// Regression: `offset / focus` or its square left the range of `f32`, and rays had no direction.
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
