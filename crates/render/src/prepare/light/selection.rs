//! Light selection: a few lights by an estimate of the contribution of each, many by a tree of such estimates.

use crate::core::delta_light::{Cone, Falloff};
use crate::core::techniques::Techniques;
use crate::prepare::light::delta::{EVERYTHING, FAR};
use crate::prepare::light::emitter::Light;
use crate::prepare::light::shape::LightShape;
use crate::prepare::light::tree::LightTree;
use crate::prepare::light::tree_simd::LightTreeArrays;
use crate::sampling::AliasTable;
use firstlight_simd::{Real, Truth, Vector3, select};
use glam::Vec3;

/// Maximum number of lights whose contributions are estimated individually; more would cost more than they gain.
pub const MAX_ESTIMATED: usize = 16;

#[derive(Debug, Default)]
pub(crate) struct LightSelection {
    /// Bounds for the estimates; empty if there are too many lights.
    bounds: Vec<LightBounds>,
    /// Used for many lights.
    tree: LightTree,
    wide_tree: LightTreeArrays,
    /// Selection by power, without a shading point.
    alias: AliasTable,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBounds {
    center: Vec3,
    radius: f32,
    /// Normal of a flat light; zero for a sphere.
    normal: Vec3,
    /// Mean radiance times the area that can face a point.
    intensity: f32,
    /// Cone of a spot light.
    cone: Option<Cone>,
}

impl LightSelection {
    pub fn build(lights: &[Light]) -> Self {
        if lights.len() <= MAX_ESTIMATED {
            return Self { bounds: lights.iter().map(LightBounds::new).collect(), ..Self::default() };
        }
        let powers: Vec<f64> =
            lights.iter().map(|light| f64::from(light.mean_radiance) * f64::from(light.shape.area())).collect();
        let tree = LightTree::build(lights);
        let wide_tree = LightTreeArrays::new(&tree);
        Self { bounds: Vec::new(), tree, wide_tree, alias: AliasTable::new(&powers) }
    }

    /// Selects a light; returns it and the probability of the choice; `None` if no light can reach the point.
    ///
    /// A few lights are selected by `u`, which is rescaled to a uniform number again: so the points on each light stay
    /// stratified.
    #[inline]
    pub fn sample(
        &self,
        lights: &[Light],
        techniques: &Techniques,
        position: Vec3,
        normal: Vec3,
        u_select: impl FnOnce() -> f32,
        u: &mut f32,
    ) -> Option<(u32, f32)> {
        match lights.len() {
            0 => None,
            1 => Some((0, 1.0)),
            n if !techniques.light_selection => {
                let scaled = *u * n as f32;
                *u = scaled.fract();
                Some((scaled as u32, 1.0 / n as f32))
            }
            n if n <= MAX_ESTIMATED => {
                let (estimates, sum) = self.estimates(position, normal);
                let mut rest = *u * sum;
                let chosen = (0..n).find(|&i| {
                    rest -= estimates[i];
                    rest < 0.0
                });
                // Rounding may leave a remainder after the last possible light.
                let chosen = chosen.or_else(|| (0..n).rev().find(|&i| estimates[i] > 0.0))?;
                if rest < 0.0 {
                    rest += estimates[chosen];
                }
                *u = (rest / estimates[chosen]).clamp(0.0, 1.0f32.next_down());
                (estimates[chosen] > 0.0).then(|| (chosen as u32, estimates[chosen] / sum))
            }
            _ => self.tree.sample(position, normal, u_select()),
        }
    }

    /// For many lights: selects one by power; returns it and the probability of the choice.
    #[inline]
    pub fn by_power(&self, u: f32) -> Option<(u32, f32)> {
        let (id, pmf, _) = self.alias.sample(u);
        (pmf > 0.0).then_some((id, pmf))
    }

    /// Probability that light `id` is sampled, where few lights are all sampled and many by [`Self::by_power`].
    #[inline]
    pub fn pmf_each(&self, lights: &[Light], id: u32) -> f32 {
        if lights.len() <= MAX_ESTIMATED { 1.0 } else { self.alias.pmf(id) }
    }

    /// Probability that [`Self::sample`] selects light `id`.
    #[inline]
    pub fn pmf(&self, lights: &[Light], techniques: &Techniques, id: u32, position: Vec3, normal: Vec3) -> f32 {
        match lights.len() {
            0 => 0.0,
            1 => 1.0,
            n if !techniques.light_selection => 1.0 / n as f32,
            n if n <= MAX_ESTIMATED => {
                let (estimates, sum) = self.estimates(position, normal);
                if sum > 0.0 { estimates[id as usize] / sum } else { 0.0 }
            }
            _ => self.tree.pmf(id, position, normal),
        }
    }

    /// Estimate of the irradiance that a few lights together can cause; `None` for many lights.
    ///
    /// - `normal`: unit, of the side that is lit; zero if both sides are.
    #[inline(always)]
    pub fn estimate<R: Real>(&self, position: Vector3<R>, normal: Vector3<R>) -> Option<R> {
        if self.bounds.is_empty() {
            return None;
        }
        let mut sum = position.x.all(0.0);
        for bounds in &self.bounds {
            sum += bounds.estimate_on(position, normal);
        }
        Some(sum)
    }

    /// Bounds of a few lights.
    #[inline]
    pub fn bounds(&self) -> &[LightBounds] {
        &self.bounds
    }

    /// Tree of many lights.
    #[inline]
    pub fn wide_tree(&self) -> &LightTreeArrays {
        &self.wide_tree
    }

    #[inline]
    fn estimates(&self, position: Vec3, normal: Vec3) -> ([f32; MAX_ESTIMATED], f32) {
        let mut estimates = [0.0; MAX_ESTIMATED];
        let mut sum = 0.0;
        for (estimate, bounds) in estimates.iter_mut().zip(&self.bounds) {
            *estimate = bounds.estimate_on(position.into(), normal.into());
            sum += *estimate;
        }
        (estimates, sum)
    }
}

impl LightBounds {
    pub fn new(light: &Light) -> Self {
        let mut cone = None;
        let (center, radius, normal, projected) = match light.shape {
            LightShape::Sphere { center, radius } => (center, radius, Vec3::ZERO, 0.25 * light.shape.area()),
            LightShape::Quad { corner, edge_u, edge_v, normal, area, .. } => {
                let radius = 0.5 * (edge_u + edge_v).length().max((edge_u - edge_v).length());
                (corner + 0.5 * (edge_u + edge_v), radius, normal, area)
            }
            LightShape::Triangle { vertices, normal, area, .. } => {
                let center = (vertices[0] + vertices[1] + vertices[2]) / 3.0;
                let radius = vertices.iter().map(|v| v.distance(center)).fold(0.0, f32::max);
                (center, radius, normal, area)
            }
            LightShape::Point { position, cone: of_spot } => {
                cone = of_spot;
                (position, 0.0, Vec3::ZERO, 1.0)
            }
            LightShape::Directional { .. } => (light.shape.center(), EVERYTHING, Vec3::ZERO, FAR * FAR),
        };
        Self { center, radius, normal, intensity: light.mean_radiance * projected, cone }
    }

    /// Estimates the irradiance on the side of `normal`, if there is one, at one or sixteen points.
    #[inline(always)]
    pub fn estimate_at<R: Real>(&self, position: Vector3<R>, normal: Option<Vector3<R>>) -> R {
        let offset = Vector3::in_all(position.x, self.center) - position;
        let distance2 = offset.length_squared();
        self.estimate(distance2, offset * (distance2.all(1.0) / distance2.sqrt()), normal)
    }

    /// The same on the side of `normal`, or on both sides where it is zero.
    #[inline(always)]
    pub fn estimate_on<R: Real>(&self, position: Vector3<R>, normal: Vector3<R>) -> R {
        let (of_side, both_sides) = (self.estimate_at(position, Some(normal)), normal.is_zero());
        if !both_sides.any() {
            return of_side;
        }
        select(both_sides, self.estimate_at(position, None), of_side)
    }

    /// Estimates the irradiance that the light can cause, never zero if it can cause any.
    ///
    /// - `distance2`: squared distance to the centre; `wi`: unit, to the centre; `normal`: unit, of the surface, if it
    ///   has one side.
    #[inline(always)]
    fn estimate<R: Real>(&self, distance2: R, wi: Vector3<R>, normal: Option<Vector3<R>>) -> R {
        let (r2, one, distance) = (self.radius * self.radius, distance2.all(1.0), distance2.sqrt());
        let sin_u = one.all(self.radius) / distance;
        let cos_u = (one - sin_u * sin_u).at_least(0.0).sqrt();
        let receiver = match normal {
            Some(normal) => largest_cosine(wi.dot(normal), cos_u, sin_u),
            None => one,
        };
        let mut estimate = receiver * self.intensity;
        if self.normal != Vec3::ZERO {
            estimate = estimate * largest_cosine(-wi.dot(Vector3::in_all(one, self.normal)), cos_u, sin_u);
        }
        if let Some(cone) = self.cone {
            // With a margin, so that rounding excludes nothing.
            let way = wi + Vector3::in_all(one, cone.axis);
            // An angle would not be the same for sixteen directions: 1 − (a / outer)², about, is above a linear falloff.
            let slope = if cone.falloff == Falloff::Linear { 1.0 / cone.outer } else { cone.slope };
            let t = (-(way.length_squared() * 0.5) + (cone.outer + 16.0 * f32::EPSILON)) * slope;
            let t = t.at_least(0.0).at_most(1.0);
            estimate = estimate * (t * t);
        }
        // Inside of the light's bounds no estimate is possible.
        let within = one.all((self.intensity / (0.25 * r2).max(f32::MIN_POSITIVE)).min(1e30));
        select(distance2.le(one.all(r2)), within, estimate / distance2)
    }
}

/// Returns the largest cosine to any direction within the cone, with a margin for rounding.
#[inline(always)]
fn largest_cosine<R: Real>(cos: R, cos_u: R, sin_u: R) -> R {
    let one = cos.all(1.0);
    let sin = (one - cos * cos).at_least(0.0).sqrt();
    let bound = (cos * cos_u + sin * sin_u + 4.0 * f32::EPSILON).at_least(0.0).at_most(1.0);
    select(cos_u.le(cos), one, bound)
}
