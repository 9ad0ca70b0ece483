use glam::Vec3;

/// A half-open ray segment: the points `origin + t · dir` with `0 < t < t_max`.
///
/// `t` counts lengths of `dir`; the integrator always passes unit directions, so there `t` is in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the ray starts, metres.
    pub origin: Vec3,
    /// Where the ray goes; any length but 0.
    pub dir: Vec3,
    /// Excluded; `f32::INFINITY` for a ray without an end.
    pub t_max: f32,
}

impl Ray {
    /// A ray without an end.
    pub fn new(origin: Vec3, dir: Vec3) -> Self {
        Self { origin, dir, t_max: f32::INFINITY }
    }

    /// The point `origin + t · dir`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.dir
    }
}
