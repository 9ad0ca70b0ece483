//! A layered surface asked several times about one viewer.

use crate::shading::interface::Interface;
use crate::shading::principled::layers::Principled;
use crate::shading::principled::seen::Seen;
use crate::shading::scatter::{BsdfSample, Scatter};
use glam::{Vec2, Vec3};

/// A [`Principled`] together with what follows from one direction, which a light sample and a bounce both need.
pub(crate) struct Viewed<'a> {
    layers: &'a Principled,
    wo: Vec3,
    normal: Vec3,
    seen: Seen,
}

impl Principled {
    /// Scatters as the surface itself does, sooner for these two directions.
    #[inline]
    pub fn seen_along(&self, wo: Vec3, normal: Vec3) -> Viewed<'_> {
        Viewed { layers: self, wo, normal, seen: Seen::new(*self, wo.into(), normal.into()) }
    }
}

impl Viewed<'_> {
    #[inline]
    fn is_about(&self, wo: Vec3, normal: Vec3) -> bool {
        wo == self.wo && normal == self.normal
    }
}

impl Scatter for Viewed<'_> {
    fn has_non_specular(&self) -> bool {
        self.layers.has_non_specular()
    }

    fn eval(&self, wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32) {
        if !self.is_about(wo, normal) {
            return self.layers.eval(wo, wi, normal);
        }
        self.seen.eval_all(wi)
    }

    fn through(&self) -> Option<Interface> {
        self.layers.through()
    }

    fn straight(&self, wo: Vec3, normal: Vec3) -> Vec3 {
        if self.is_about(wo, normal) { self.seen.straight() } else { self.layers.straight(wo, normal) }
    }

    fn sample(&self, wo: Vec3, normal: Vec3, u_lobe: impl FnOnce() -> f32, u: Vec2) -> Option<BsdfSample> {
        if !self.is_about(wo, normal) {
            return self.layers.sample(wo, normal, u_lobe, u);
        }
        self.seen.sample(wo, u_lobe(), u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use crate::shading::sheen;

    #[test]
    fn a_viewed_surface_scatters_as_the_surface_itself() {
        let layers = Principled {
            dielectric: 0.8,
            facing: Vec3::splat(0.04).into(),
            grazing: 1.0,
            diffuse: Vec3::new(0.5, 0.3, 0.2).into(),
            metallic: 0.2,
            metal: Vec3::new(0.9, 0.6, 0.3).into(),
            alpha: [0.3, 0.1],
            tangent: Some(Vec3::X.into()),
            true_normal: Some(Vec3::new(0.6, 0.0, 0.8).into()),
            transmission: None,
            sheen: Vec3::splat(0.3).into(),
            sheen_alpha: sheen::alpha_of(0.5),
            coat: 0.5,
            coat_alpha: 0.04,
            coat_normal: Vec3::Z.into(),
        };
        let directions = |i| {
            let sampler = Sampler::new(5, 1, 0, i);
            [0, 1, 2].map(|k| crate::sampling::cosine_hemisphere(sampler.pair(k)))
        };
        for i in 0..500 {
            let [wo, wi, other] = directions(i);
            let viewed = layers.seen_along(wo, Vec3::Z);
            assert_eq!(viewed.has_non_specular(), layers.has_non_specular());
            // Also asked about another viewer, another normal, and a viewer from behind.
            for (wo, normal) in [(wo, Vec3::Z), (other, Vec3::Z), (wo, other), (-wo, Vec3::Z)] {
                assert_eq!(viewed.eval(wo, wi, normal), layers.eval(wo, wi, normal));
                let u = Vec2::new(other.x.abs(), wi.y.abs());
                let [a, b] = [viewed.sample(wo, normal, || wi.z, u), layers.sample(wo, normal, || wi.z, u)];
                assert_eq!(a.map(|sample| (sample.wi, sample.weight)), b.map(|sample| (sample.wi, sample.weight)));
            }
        }
    }
}
