//! The three components of a camera entity.
//!
//! [`View`] is the pose, [`Projection`] the field of view, [`Lens`] aperture and focus. All are in world space (metres,
//! right-handed, Y up) and `f64`, so that a camera far from the origin moves as smoothly as one at the origin. The
//! interactive moves of a view are in `frame::navigation`; the camera of the renderer is `render::Camera`.

use crate::bad_value::BadValue;
use crate::bounds::triple;
use crate::units::LEAST_SINE;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// The pose of a camera.
///
/// `forward` and `up` are unit vectors and perpendicular; all constructors and all functions of `frame::navigation`
/// preserve this. The pivot is the point on the view axis about which the view orbits; it does not affect the image, so
/// a change of `pivot_distance` alone does not restart it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "ecs", derive(bevy_ecs::component::Component))]
#[cfg_attr(feature = "ecs", require(Projection, Lens))]
pub struct View {
    /// Centre of the lens in the world, metres.
    pub eye: DVec3,
    /// View direction, unit vector.
    pub forward: DVec3,
    /// Up direction of the image, unit vector, perpendicular to `forward`.
    pub up: DVec3,
    /// Metres along `forward` from the camera to the pivot; positive and finite.
    pub pivot_distance: f64,
}

impl View {
    /// A view from `eye` with `look_at` in the centre of the image and as the pivot.
    ///
    /// `up` need not be a unit vector or perpendicular to the view direction, but must not be parallel to it.
    ///
    /// # Errors
    /// If a number is not finite, the two points are equal, or `up` is zero or parallel to the view direction.
    pub fn look_at(eye: DVec3, look_at: DVec3, up: DVec3) -> Result<Self, BadValue> {
        for (field, value) in [("eye", eye), ("look_at", look_at), ("up", up)] {
            if !value.is_finite() {
                return Err(BadValue::out_of_range(field, triple(value), "be three finite numbers"));
            }
        }
        let towards = look_at - eye;
        // Lengths are computed on a copy scaled to about 1, since squares of tiny or huge coordinates would leave the
        // range of `f64`.
        let (forward, scale) = direction(towards).ok_or_else(same_point)?;
        let pivot_distance = (towards / scale).length() * scale;
        if !pivot_distance.is_finite() {
            return Err(BadValue::out_of_range("look_at", triple(look_at), "be nearer to `eye`"));
        }
        let up = check_direction("up", up)?;
        check_not_parallel(forward, up)?;
        Ok(Self { eye, forward, up, pivot_distance }.orthonormalized())
    }

    /// Unit vector to the right in the image.
    pub fn right(&self) -> DVec3 {
        self.forward.cross(self.up)
    }

    /// The point about which the view orbits.
    pub fn pivot(&self) -> DVec3 {
        self.eye + self.forward * self.pivot_distance
    }

    /// Whether an image of `other` is the same: all is equal but the pivot.
    pub fn shows_the_same(&self, other: &Self) -> bool {
        *self == Self { pivot_distance: self.pivot_distance, ..*other }
    }

    /// The view with its axes made orthonormal; `forward` keeps its direction.
    ///
    /// Precondition: `up` is not parallel to `forward`.
    pub fn orthonormalized(self) -> Self {
        let forward = self.forward.normalize();
        let right = forward.cross(self.up).normalize();
        // Twice: if `up` is nearly parallel to `forward`, the first `right` has lost digits.
        let up = right.cross(forward).normalize();
        let right = forward.cross(up).normalize();
        Self { forward, up: right.cross(forward), ..self }
    }

    /// Whether all of its numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.eye.is_finite() && self.forward.is_finite() && self.up.is_finite() && self.pivot_distance.is_finite()
    }
}

/// The unit vector along `v`, whatever its length; `None` if it is zero or not finite.
///
/// If the squared length is a normal number, the result is bitwise equal to `normalize`.
pub(crate) fn unit_direction(v: DVec3) -> Option<DVec3> {
    let squared = v.length_squared();
    if squared.is_normal() { Some(v.normalize()) } else { direction(v).map(|(unit, _)| unit) }
}

/// The unit vector along `v` and its largest absolute coordinate; `None` if it is zero or not finite.
fn direction(v: DVec3) -> Option<(DVec3, f64)> {
    let scale = v.abs().max_element();
    // `max_element` may ignore a NaN.
    (scale > 0.0 && v.is_finite()).then(|| ((v / scale).normalize(), scale))
}

/// Of a camera that has no direction to look in.
pub(crate) fn same_point() -> BadValue {
    BadValue::unfit("look_at", "`eye` and `look_at` are the same point: move one of them")
}

/// The unit vector along `vector`, which may have any finite length but 0.
pub(crate) fn check_direction(field: &'static str, vector: DVec3) -> Result<DVec3, BadValue> {
    let unit = unit_direction(vector);
    unit.ok_or_else(|| BadValue::out_of_range(field, triple(vector), "be finite and have a length"))
}

/// Both are unit vectors.
pub(crate) fn check_not_parallel(view: DVec3, up: DVec3) -> Result<(), BadValue> {
    if view.cross(up).length() >= LEAST_SINE {
        return Ok(());
    }
    // What is across most views that go up or down, and up in all others.
    let other = if view.y.abs() > 0.5 { "(0, 0, -1)" } else { "(0, 1, 0)" };
    let message =
        format!("`up` is parallel to the view direction (within {LEAST_SINE:e} rad): set it, such as `up: {other}`");
    Err(BadValue::unfit("up", message))
}

impl Default for View {
    /// 5 m in front of the origin, looking at it.
    fn default() -> Self {
        Self { eye: DVec3::new(0.0, 0.0, 5.0), forward: DVec3::NEG_Z, up: DVec3::Y, pivot_distance: 5.0 }
    }
}

/// The projection of a camera: perspective or orthographic.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "ecs", derive(bevy_ecs::component::Component))]
pub struct Projection {
    /// Vertical field of view of a perspective projection, degrees, in `(0, 180)`.
    pub vfov_deg: f64,
    /// Height of the image of an orthographic projection, metres; `None`: perspective. Orthographic rays are parallel
    /// to the view direction and start in the plane through the camera perpendicular to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orthographic_height: Option<f64>,
}

impl Projection {
    /// Perspective, with a vertical field of view in degrees.
    pub fn perspective(vfov_deg: f64) -> Self {
        Self { vfov_deg, orthographic_height: None }
    }

    /// Interpolates to another projection, `t` in 0..=1. A perspective and an orthographic one cannot be interpolated:
    /// the kind of the first is used.
    #[must_use]
    pub fn between(&self, other: &Self, t: f64) -> Self {
        let heights = self.orthographic_height.zip(other.orthographic_height);
        Self {
            vfov_deg: by_factor(self.vfov_deg, other.vfov_deg, t),
            orthographic_height: heights.map_or(self.orthographic_height, |(a, b)| Some(by_factor(a, b, t))),
        }
    }

    /// Whether an image by `other` is the same: an orthographic one has no field of view.
    pub fn shows_the_same(&self, other: &Self) -> bool {
        self.orthographic_height == other.orthographic_height
            && (self.orthographic_height.is_some() || self.vfov_deg == other.vfov_deg)
    }

    /// Half the height of the visible region at a depth along the view direction; both metres.
    pub fn half_height(&self, depth: f64) -> f64 {
        self.orthographic_height.map_or_else(|| self.tan_half_vfov() * depth, |height| 0.5 * height)
    }

    /// Tangent of half the vertical field of view of a perspective projection.
    pub fn tan_half_vfov(&self) -> f64 {
        (0.5 * self.vfov_deg).to_radians().tan()
    }
}

impl Default for Projection {
    fn default() -> Self {
        Self::perspective(40.0)
    }
}

/// A thin lens: the plane at `focus_distance` is in focus, blur increases with `radius`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "ecs", derive(bevy_ecs::component::Component))]
pub struct Lens {
    /// Radius of the aperture, metres, at least 0; 0 is a pinhole.
    pub radius: f64,
    /// Metres along the view axis to the focal *plane*; positive, may be infinite.
    pub focus_distance: f64,
    /// If false, the camera is a pinhole and `radius` has no effect.
    pub enabled: bool,
    /// Number of straight edges of the aperture; below 3 it is round.
    pub blades: u32,
    /// Counter-clockwise as seen from behind the camera.
    pub blade_rotation_deg: f64,
}

impl Lens {
    /// A pinhole; `focus_distance` takes effect when the aperture is opened.
    pub fn pinhole(focus_distance: f64) -> Self {
        Self { radius: 0.0, focus_distance, enabled: false, blades: 0, blade_rotation_deg: 0.0 }
    }

    /// A round aperture of `radius`, focused on the plane at `focus_distance`; both metres.
    pub fn thin(radius: f64, focus_distance: f64) -> Self {
        Self { radius, enabled: radius > 0.0, ..Self::pinhole(focus_distance) }
    }

    /// Whether an image by `other` is the same: a pinhole has no focus.
    pub fn shows_the_same(&self, other: &Self) -> bool {
        let is_pinhole = |lens: &Self| !lens.enabled || lens.radius == 0.0;
        self == other || is_pinhole(self) && is_pinhole(other)
    }

    /// Interpolates to another lens, `t` in 0..=1: the focus in the reciprocal of its distance, as one focuses by hand.
    #[must_use]
    pub fn between(&self, other: &Self, t: f64) -> Self {
        let even = |a: f64, b: f64| a + t * (b - a);
        Self {
            radius: even(self.effective_radius(), other.effective_radius()),
            focus_distance: even(self.focus_distance.recip(), other.focus_distance.recip()).recip(),
            enabled: self.enabled || other.enabled,
            blade_rotation_deg: even(self.blade_rotation_deg, other.blade_rotation_deg),
            ..*self
        }
    }

    /// The radius for rendering: 0 if depth of field is off.
    pub fn effective_radius(&self) -> f64 {
        if self.enabled { self.radius } else { 0.0 }
    }
}

impl Default for Lens {
    fn default() -> Self {
        Self::pinhole(View::default().pivot_distance)
    }
}

/// Interpolates two positive numbers by a factor, `t` in 0..=1.
pub fn by_factor(a: f64, b: f64, t: f64) -> f64 {
    a * (b / a).powf(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_orthonormal(view: &View) {
        assert!((view.forward.length() - 1.0).abs() < 4.0 * f64::EPSILON, "{view:?}");
        assert!((view.up.length() - 1.0).abs() < 4.0 * f64::EPSILON, "{view:?}");
        assert!(view.forward.dot(view.up).abs() < 4.0 * f64::EPSILON, "{view:?}");
    }

    #[test]
    fn look_at_puts_the_target_in_the_middle() {
        for scale in [1e-200, 1e-6, 1.0, 5e6, 1e200] {
            let eye = DVec3::new(1.0, 2.0, 3.0) * scale;
            let target = DVec3::new(-4.0, 0.5, 2.0) * scale;
            let view = View::look_at(eye, target, DVec3::new(0.0, 3.0, 0.1)).unwrap();
            assert_orthonormal(&view);
            assert!((view.pivot() - target).abs().max_element() < 1e-14 * scale, "{view:?}");
            assert!(view.right().dot(DVec3::Y).abs() < 0.1, "up is up in the picture: {view:?}");
            assert!(view.up.y > 0.9);
        }
    }

    #[test]
    fn an_up_that_is_nearly_along_the_view_still_gives_clean_axes() {
        let view = View::look_at(DVec3::ZERO, DVec3::Z, DVec3::new(1e-7, 0.0, 1.0)).unwrap();
        assert_orthonormal(&view);
        assert!(view.up.x > 0.999_999);
    }

    #[test]
    fn degenerate_cameras_are_refused_with_advice() {
        let p = DVec3::new(1.0, 2.0, 3.0);
        let problem = |eye, look_at, up| View::look_at(eye, look_at, up).unwrap_err().to_string();
        let same = problem(p, p, DVec3::Y);
        assert!(same.contains("`eye` and `look_at` are the same point"), "{same}");
        for up in [DVec3::Y, DVec3::NEG_Y, DVec3::new(0.0, 1.0, 1e-9)] {
            let along = problem(p, p - DVec3::Y, up);
            assert!(along.contains("parallel to the view direction") && along.contains("up: (0, 0, -1)"), "{along}");
            assert!(View::look_at(p, p - DVec3::Y, DVec3::NEG_Z).is_ok(), "the advice works");
        }
        let none = problem(p, DVec3::ZERO, DVec3::ZERO);
        assert!(none.contains("`up`") && none.contains("length"), "{none}");
        let nan = problem(DVec3::new(f64::NAN, 0.0, 0.0), p, DVec3::Y);
        assert!(nan.contains("`eye`") && nan.contains("finite"), "{nan}");
    }
}
