//! Portals: rectangles through which the surfaces of a room see the environment.
//!
//! A direction towards the environment is sampled uniformly in the solid angle of a portal, as if it were a light, where
//! BSDF sampling would hit walls nearly always (Bitterli, Novák and Jarosz 2015). A portal changes nothing but where
//! directions are sampled: what is between the surface and the environment is asked by a shadow ray, and the environment
//! around a portal is left to the other techniques. So the mean of an image depends neither on their number nor on
//! their places.

use crate::core::material_queries::Emission;
use crate::prepare::light::emitter::Light;
use crate::prepare::light::flat::QuadLight;
use crate::prepare::light::selection::LightBounds;
use crate::prepare::light::shape::LightShape;
use firstlight_simd::{Elementary, Real, Truth, Vector3, select, select_vector};
use glam::Vec3;

/// The portals of a view: 1 to [`Self::MOST`].
#[derive(Debug)]
pub(crate) struct Portals(Vec<Portal>);

/// A one-sided rectangle.
#[derive(Debug)]
pub(crate) struct Portal {
    quad: QuadLight<f32>,
    bounds: LightBounds,
}

impl Portal {
    /// Creates a rectangle; its front, from which it is sampled, is that of `edge_u` × `edge_v`.
    ///
    /// - `corner`, `edge_u`, `edge_v`: metres; the edges are perpendicular and not zero;
    /// - `radiance`: luminance of the environment behind it, W·m⁻²·sr⁻¹, positive.
    pub fn new(corner: Vec3, edge_u: Vec3, edge_v: Vec3, radiance: f32) -> Option<Self> {
        let shape = LightShape::quad(corner, edge_u, edge_v);
        let LightShape::Quad { light: quad, .. } = shape else { return None };
        let bounds = LightBounds::new(&Light {
            shape,
            emission: Emission::even(Vec3::ONE),
            mean_radiance: radiance,
            is_point: false,
            turned: None,
            corners: None,
            image: None,
        });
        (quad.is_rectangle && quad.area > 0.0).then_some(Self { quad, bounds })
    }

    /// Pdf of directions that are sampled through this portal, per steradian.
    #[inline(always)]
    fn pdf<R: Elementary>(&self, position: Vector3<R>, wi: Vector3<R>) -> R {
        let zero = wi.x.all(0.0);
        let quad = self.quad.in_all(zero);
        let (relative, cos) = (quad.corner - position, wi.dot(quad.normal));
        let distance = relative.dot(quad.normal) / cos;
        let within = wi * distance - relative;
        let (x, y) = (within.dot(quad.units[0]), within.dot(quad.units[1]));
        let crosses = cos.is_negative() & distance.is_positive() & zero.le(x) & zero.le(y);
        let crosses = crosses & x.le(quad.lengths[0]) & y.le(quad.lengths[1]);
        if !crosses.any() {
            return zero;
        }
        select(crosses, quad.pdf(true, position, wi, distance), zero)
    }
}

impl Portals {
    /// Largest number: the cost of a sample grows with it.
    pub const MOST: usize = 8;

    /// Returns `None` if there are none; those beyond [`Self::MOST`] are left out.
    pub fn new(mut portals: Vec<Portal>) -> Option<Self> {
        portals.truncate(Self::MOST);
        (!portals.is_empty()).then_some(Self(portals))
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Samples a direction through one of the portals.
    ///
    /// - `asked`: lanes to sample; `normal`: unit, of the side that is lit, zero for both sides;
    /// - `u`: two independent uniform numbers in `[0, 1)`.
    ///
    /// Returns the lanes that have one, the unit directions, and [`Self::pdf`] of them if there is one portal only.
    #[inline(always)]
    pub fn sample<R: Elementary>(
        &self,
        asked: R::Mask,
        position: Vector3<R>,
        normal: Vector3<R>,
        u: [R; 2],
    ) -> (R::Mask, Vector3<R>, Option<R>) {
        let zero = u[0].all(0.0);
        if let [portal] = &self.0[..] {
            let point = portal.quad.in_all(zero).sample(true, asked, position, u);
            return (point.found, point.wi, Some(point.pdf));
        }
        let (estimates, sum) = self.estimates(position, normal);
        let (mut open, mut found) = (asked & sum.is_positive(), zero.is_positive());
        let (mut rest, mut wi) = (u[0] * sum, normal);
        for (portal, &estimate) in self.0.iter().zip(&estimates) {
            let here = open & rest.lt(estimate);
            if here.any() {
                let along = (rest / estimate).at_least(0.0).at_most(1.0f32.next_down());
                let point = portal.quad.in_all(zero).sample(true, here, position, [along, u[1]]);
                wi = select_vector(here, point.wi, wi);
                found |= here & point.found;
            }
            open &= !here;
            rest = rest - estimate;
        }
        (found, wi, None)
    }

    /// Pdf of [`Self::sample`] for the unit direction `wi`, per steradian.
    #[inline(always)]
    pub fn pdf<R: Elementary>(&self, position: Vector3<R>, normal: Vector3<R>, wi: Vector3<R>) -> R {
        let zero = wi.x.all(0.0);
        if let [portal] = &self.0[..] {
            return portal.pdf(position, wi);
        }
        let (estimates, sum) = self.estimates(position, normal);
        let mut pdf = zero;
        for (portal, &estimate) in self.0.iter().zip(&estimates) {
            pdf += estimate * portal.pdf(position, wi);
        }
        select(sum.is_positive(), pdf / sum, zero)
    }

    /// Estimate of the irradiance through all portals; zero where there can be none.
    ///
    /// - `normal`: as in [`Self::sample`].
    #[inline(always)]
    pub fn estimate<R: Real>(&self, position: Vector3<R>, normal: Vector3<R>) -> R {
        self.estimates(position, normal).1
    }

    /// Estimates of the irradiance through each portal, in proportion to which they are chosen, and their sum.
    #[inline(always)]
    fn estimates<R: Real>(&self, position: Vector3<R>, normal: Vector3<R>) -> ([R; Self::MOST], R) {
        let mut sum = position.x.all(0.0);
        let mut estimates = [sum; Self::MOST];
        for (estimate, portal) in estimates.iter_mut().zip(&self.0) {
            *estimate = portal.bounds.estimate_on(position, normal);
            sum += *estimate;
        }
        (estimates, sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    /// Two of them overlap, as seen from most places.
    fn portals() -> Portals {
        let portal = |x: f32, size: f32, radiance| {
            Portal::new(Vec3::new(x, 1.0, -2.0), size * Vec3::X, Vec3::Y, radiance).expect("a rectangle")
        };
        Portals::new(vec![portal(-1.0, 1.5, 2.0), portal(0.0, 2.0, 1.0), portal(3.0, 0.5, 5.0)]).expect("three")
    }

    #[test]
    fn the_pdf_is_that_of_the_samples() {
        let all = portals();
        for (place, normal) in [Vec3::Y, Vec3::NEG_Z, Vec3::ZERO, Vec3::new(0.6, 0.8, 0.0)].into_iter().enumerate() {
            let position = Vec3::new(0.3 * place as f32, 0.2, 0.5);
            let n = 1 << 14;
            // The mean of 1 / pdf over samples is the solid angle of all directions that have a pdf, and that of
            // functions over pdf their integral over it.
            let (mut solid_angle, mut integral) = (0.0, 0.0);
            for i in 0..n {
                let u = Sampler::new(7, place as u32, 0, i).pair(0);
                let (found, wi, _) = all.sample(true, position.into(), normal.into(), u.into());
                let pdf = all.pdf(position.into(), normal.into(), wi);
                assert!(found && (wi.length() - 1.0).abs() < 1e-5);
                solid_angle += 1.0 / f64::from(pdf) / f64::from(n);
                integral += f64::from(wi.x * wi.x / pdf) / f64::from(n);
            }
            let (steps, mut by_steps, mut squares, mut sum) = (1500, 0.0, 0.0, 0.0);
            for i in 0..steps * steps {
                let (z, phi) = ((i % steps) as f32 + 0.5, (i / steps) as f32 + 0.5);
                let (z, phi) = (z / steps as f32, std::f32::consts::PI * (phi / steps as f32));
                let r = (1.0 - z * z).sqrt();
                let wi = Vec3::new(r * phi.cos(), r * phi.sin(), -z);
                let pdf = f64::from(all.pdf(position.into(), normal.into(), wi.into()));
                let step = std::f64::consts::PI / f64::from(steps * steps);
                sum += pdf * step;
                by_steps += f64::from(pdf > 0.0) * step;
                squares += f64::from(pdf > 0.0) * f64::from(wi.x * wi.x) * step;
            }
            assert!((sum - 1.0).abs() < 5e-3, "{place}: {sum}");
            assert!((solid_angle / by_steps - 1.0).abs() < 1e-2, "{place}: {solid_angle} for {by_steps}");
            assert!((integral / squares - 1.0).abs() < 1e-2, "{place}: {integral} for {squares}");
        }
    }

    #[test]
    fn nothing_is_sampled_from_behind() {
        let behind = Vec3::new(0.0, 1.5, -4.0);
        let (found, _, _) = portals().sample(true, behind.into(), Vec3::Z.into(), [0.3, 0.4]);
        assert!(!found);
        assert_eq!(portals().pdf(behind.into(), Vec3::Z.into(), Vec3::Z.into()), 0.0);
    }
}
