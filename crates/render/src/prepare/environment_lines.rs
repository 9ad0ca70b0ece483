//! Lines from the environment towards casters.
//!
//! The direction is sampled by the brightness of the environment, and the origin uniformly over the disc that the
//! caster's bounding sphere is seen as from there.

use crate::core::environment::{Environment, EnvironmentSampler};
use crate::prepare::outside::Outside;
use firstlight_kdtree::geometry::Ray;
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

/// An environment that is not smooth: of a smooth one, camera paths find as much.
#[derive(Debug)]
pub(crate) struct EnvironmentLines {
    environment: Environment,
    sampler: Arc<EnvironmentSampler>,
}

/// A line and what it carries.
pub(crate) struct EnvironmentLine {
    pub ray: Ray,
    /// Pdf per unit of étendue, 1 / (m² sr), without the choice of light and caster.
    pub density: f32,
    /// W·m⁻²·sr⁻¹.
    pub radiance: Vec3,
}

impl EnvironmentLines {
    /// Returns `None` for environments that are smooth.
    pub fn of(environment: &Environment, sampler: Option<&Arc<EnvironmentSampler>>) -> Option<Self> {
        Some(Self { environment: environment.clone(), sampler: sampler?.clone() })
    }

    /// Luminous flux towards a caster with a bounding sphere of this radius in metres; 0 for an infinite one.
    pub fn flux(&self, radius: f32) -> f64 {
        if radius.is_finite() { self.sampler.integral() * f64::from(PI * radius * radius) } else { 0.0 }
    }

    /// Samples a line; `None` if nothing comes from its direction, or an infinite plane occludes it.
    ///
    /// - `center`, `radius`: bounding sphere of the caster, metres.
    /// - `of_direction`, `of_origin`: two independent uniform numbers in `[0, 1)` each.
    pub fn sample(
        &self,
        outside: &Outside,
        (center, radius): (Vec3, f32),
        of_direction: Vec2,
        of_origin: Vec2,
    ) -> Option<EnvironmentLine> {
        if radius.is_infinite() {
            return None;
        }
        let (to_light, pdf) = self.sampler.sample(of_direction)?;
        let ray = outside.ray_from(to_light, (center, radius), of_origin)?;
        Some(EnvironmentLine {
            ray,
            density: pdf * FRAC_1_PI / (radius * radius),
            radiance: self.environment.radiance(to_light),
        })
    }

    /// Pdf of [`Self::sample`] for a line towards a caster of this radius, per unit of étendue.
    ///
    /// - `to_light`: unit.
    pub fn density(&self, radius: f32, to_light: Vec3) -> f32 {
        self.sampler.pdf(to_light) * FRAC_1_PI / (radius * radius)
    }
}
