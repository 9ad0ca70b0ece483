use glam::Vec3;

/// A half-open ray segment: the points `origin + t · dir` with `0 < t < t_max`.
///
/// `t` counts lengths of `dir`; the integrator always passes unit directions, so there `t` is in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start of the ray, metres.
    pub origin: Vec3,
    /// Direction of the ray; any length but 0.
    pub dir: Vec3,
    /// End of the ray, excluded; `f32::INFINITY` for an unbounded ray.
    pub t_max: f32,
}

impl Ray {
    /// Creates an unbounded ray.
    pub fn new(origin: Vec3, dir: Vec3) -> Self {
        Self { origin, dir, t_max: f32::INFINITY }
    }

    /// The point `origin + t · dir`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.dir
    }
}
