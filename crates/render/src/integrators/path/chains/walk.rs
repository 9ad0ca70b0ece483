//! Newton's method for the direction from which a chain of specular surfaces leads to a light.
//!
//! The unknowns are the two coordinates of the direction, whatever the number of surfaces. The residual is the offset of
//! the last ray from the light, across it; the derivatives are differences of rays on either side.

use crate::integrators::path::chains::chain::{ChainEnd, ChainTracer, Events};
use crate::prepare::light::delta::DeltaSource;
use crate::shading::interface::MediumId;
use firstlight_kdtree::geometry::{Frame, Ray};
use glam::{Mat2, Vec2, Vec3};

/// Distance of the rays for differences, as a fraction of the angle that the caster fills: its square is the relative
/// error of the derivatives, and the rounding of directions over it another one.
const STEP: f32 = 2e-3;

/// A step of less than this fraction of that angle is the last one.
const CLOSE: f32 = 1e-4;

/// Maximum number of steps, and of halvings of a step that leads nowhere.
const MOST_STEPS: u32 = 20;
const MOST_HALVINGS: u32 = 5;

/// The search for one light.
pub(super) struct Walk {
    pub light: DeltaSource<f32>,
    /// The angle that the caster fills, radians.
    pub angle: f32,
}

/// A direction whose ray leads to the light.
pub(super) struct Solution {
    pub dir: Vec3,
    pub chain: Events,
    pub end: Ray,
    pub media: MediumId,
    /// Light at the vertex over light at the end.
    pub weight: Vec3,
    /// Area across the end of the ray at the light, square metres, over solid angle at the vertex; for a light at
    /// infinity, solid angle over solid angle.
    pub spread: f32,
}

impl Solution {
    /// - `within`: radians.
    pub fn is_same(&self, other: &Self, within: f32) -> bool {
        let passes = self.chain.iter().map(|event| event.passes);
        passes.eq(other.chain.iter().map(|event| event.passes)) && self.dir.distance(other.dir) < within
    }
}

/// A direction on the way.
struct Place {
    dir: Vec3,
    end: ChainEnd,
    /// Offset at the light, and its derivatives by the coordinates of the direction.
    offset: Vec2,
    slope: Mat2,
}

impl Walk {
    /// - `start`: returns the first ray in a direction, and its media.
    pub fn run(
        &self,
        tracer: &mut ChainTracer,
        mut dir: Vec3,
        chain: &Events,
        light_media: MediumId,
        start: &impl Fn(Vec3) -> Option<(Ray, MediumId)>,
    ) -> Option<Solution> {
        let mut place = self.place(tracer, dir, chain, start)?;
        for _ in 0..MOST_STEPS {
            let determinant = place.slope.determinant();
            if determinant == 0.0 || !determinant.is_finite() {
                return None;
            }
            let mut step = -(place.slope.inverse() * place.offset);
            let length = step.length();
            if length < CLOSE * self.angle {
                let is_there = place.end.media.of_all_channels() == light_media;
                let Place { end: ChainEnd { ray: end, media, weight }, .. } = place;
                let solution = Solution {
                    dir: moved(place.dir, step),
                    chain: chain.clone(),
                    end,
                    media,
                    weight,
                    spread: determinant.abs(),
                };
                return is_there.then_some(solution);
            }
            step *= (0.5 * self.angle / length).min(1.0);
            let better = (0..MOST_HALVINGS).find_map(|halving| {
                let scale = 0.5f32.powi(halving as i32);
                dir = moved(place.dir, scale * step);
                let next = self.place(tracer, dir, chain, start)?;
                (next.offset.length_squared() < place.offset.length_squared()).then_some(next)
            });
            place = better?;
        }
        None
    }

    fn place(
        &self,
        tracer: &mut ChainTracer,
        dir: Vec3,
        chain: &Events,
        start: &impl Fn(Vec3) -> Option<(Ray, MediumId)>,
    ) -> Option<Place> {
        let h = STEP * self.angle;
        let [a, b, c, d] = [Vec2::X, -Vec2::X, Vec2::Y, -Vec2::Y].map(|side| start(moved(dir, h * side)));
        let ends = tracer.follow(&[start(dir)?, a?, b?, c?, d?], chain)?;
        let across = Frame::around(ends[0].ray.dir);
        let at_light = |end: &ChainEnd| self.offset(&ends[0].ray, &end.ray, &across);
        let [middle, a, b, c, d] = [0, 1, 2, 3, 4].map(|i| at_light(&ends[i]));
        let slope = Mat2::from_cols(0.5 / h * (a? - b?), 0.5 / h * (c? - d?));
        Some(Place { dir, end: ends[0], offset: middle?, slope })
    }

    /// Offset of a ray from the light across the middle ray, metres; radians for a light at infinity. `None` if it leads
    /// away from the light.
    fn offset(&self, middle: &Ray, ray: &Ray, across: &Frame) -> Option<Vec2> {
        let to = Vec3::from(self.light.origin);
        let (offset, ahead) = if self.light.is_far {
            (ray.dir - to, ray.dir.dot(to))
        } else {
            let t = (to - ray.origin).dot(middle.dir) / ray.dir.dot(middle.dir);
            (ray.origin - to + t * ray.dir, t)
        };
        (ahead > 0.0).then(|| Vec2::new(offset.dot(across.x), offset.dot(across.y)))
    }
}

/// A direction displaced in its tangent plane.
fn moved(dir: Vec3, by: Vec2) -> Vec3 {
    let frame = Frame::around(dir);
    (dir + by.x * frame.x + by.y * frame.y).normalize()
}
