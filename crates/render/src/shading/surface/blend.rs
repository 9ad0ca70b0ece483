//! Blends: weighted sums of BSDFs.

use crate::shading::bsdf::Lobe;
use crate::shading::interface::Interface;
use crate::shading::principled::layers::Principled;
use crate::shading::scatter::{BsdfSample, Scatter};
use crate::shading::tangent::NormalShadowing;
use glam::{Vec2, Vec3};
use smallvec::SmallVec;

/// A blend; the weights of its parts sum to at most 1.
#[derive(Debug, Default)]
pub(crate) struct Blend<'a> {
    /// At most [`MAX_LOBES`](crate::core::material::MAX_LOBES), but few in most blends, so that moving one is cheap.
    parts: SmallVec<[WeightedPart<'a>; 3]>,
    layers: Vec<Principled>,
    shadowing: Option<NormalShadowing>,
}

#[derive(Clone, Copy, Debug)]
enum Part<'a> {
    Lobe(Lobe<'a>),
    /// A layered surface, by its index in the blend's `layers`.
    Layers(u8),
}

#[derive(Clone, Copy, Debug)]
struct WeightedPart<'a> {
    part: Part<'a>,
    weight: f32,
    /// Probability of being sampled.
    pmf: f32,
}

impl<'a> Blend<'a> {
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    pub fn push(&mut self, lobe: Lobe<'a>, weight: f32) {
        self.parts.push(WeightedPart { part: Part::Lobe(lobe), weight, pmf: weight * lobe.albedo_estimate() });
    }

    pub fn push_layers(&mut self, layers: Principled, weight: f32) {
        let part = Part::Layers(self.layers.len() as u8);
        self.parts.push(WeightedPart { part, weight, pmf: weight * layers.albedo_estimate() });
        self.layers.push(layers);
    }

    /// Must be called when all parts are there.
    ///
    /// - `shadowing`: that of a mapped normal.
    pub fn finish(&mut self, shadowing: Option<NormalShadowing>) {
        self.shadowing = shadowing;
        // Sampled in proportion to their reflected light; uniformly if all are black.
        let sum: f32 = self.parts.iter().map(|p| p.pmf).sum();
        let uniform = 1.0 / self.parts.len() as f32;
        self.parts.iter_mut().for_each(|p| p.pmf = if sum > 0.0 { p.pmf / sum } else { uniform });
    }

    /// Factor of light from `wi`.
    fn lit_share(&self, wi: Vec3) -> f32 {
        self.shadowing.map_or(1.0, |shadowing| shadowing.share(wi))
    }
}

impl Part<'_> {
    /// See [`Lobe::is_thin`].
    fn is_thin(self) -> bool {
        matches!(self, Self::Lobe(lobe) if lobe.is_thin())
    }

    fn has_non_specular(self, layers: &[Principled]) -> bool {
        match self {
            Self::Lobe(lobe) => lobe.has_non_specular(),
            Self::Layers(k) => layers[usize::from(k)].has_non_specular(),
        }
    }

    fn through(self, layers: &[Principled]) -> Option<Interface> {
        match self {
            Self::Lobe(lobe) => lobe.through(),
            Self::Layers(k) => layers[usize::from(k)].through(),
        }
    }

    fn eval(self, layers: &[Principled], wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32) {
        match self {
            Self::Lobe(lobe) => lobe.eval(wo, wi, normal),
            Self::Layers(k) => layers[usize::from(k)].eval(wo, wi, normal),
        }
    }

    fn straight(self, layers: &[Principled], wo: Vec3, normal: Vec3) -> Vec3 {
        match self {
            Self::Lobe(lobe) => lobe.straight(wo, normal),
            Self::Layers(k) => layers[usize::from(k)].straight(wo, normal),
        }
    }

    fn sample(self, layers: &[Principled], wo: Vec3, normal: Vec3, fresh: f32, u: Vec2) -> Option<BsdfSample> {
        match self {
            Self::Lobe(lobe) => lobe.sample(wo, normal, || fresh, u),
            Self::Layers(k) => layers[usize::from(k)].sample(wo, normal, || fresh, u),
        }
    }
}

impl Scatter for Blend<'_> {
    fn has_non_specular(&self) -> bool {
        self.parts.iter().any(|p| p.part.has_non_specular(&self.layers))
    }

    fn eval(&self, wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32) {
        let mut sum = (Vec3::ZERO, 0.0);
        for p in self.parts.iter().filter(|p| p.part.has_non_specular(&self.layers)) {
            let leads_elsewhere = p.part.through(&self.layers).is_some() && !p.part.is_thin();
            if leads_elsewhere && (normal.dot(wi) <= 0.0 || normal.dot(wo) <= 0.0) {
                continue;
            }
            let (value, pdf) = p.part.eval(&self.layers, wo, wi, normal);
            sum.0 += p.weight * value;
            sum.1 += p.pmf * pdf;
        }
        sum.0 *= self.lit_share(wi);
        sum
    }

    fn through(&self) -> Option<Interface> {
        self.parts.iter().find(|p| p.part.is_thin()).and_then(|p| p.part.through(&self.layers))
    }

    fn straight(&self, wo: Vec3, normal: Vec3) -> Vec3 {
        let of_parts = self.parts.iter().filter(|p| p.pmf > 0.0);
        let sum: Vec3 = of_parts.map(|p| p.weight * p.part.straight(&self.layers, wo, normal)).sum();
        self.lit_share(-wo) * sum
    }

    fn sample(&self, wo: Vec3, normal: Vec3, u_lobe: impl FnOnce() -> f32, u: Vec2) -> Option<BsdfSample> {
        let mut rest = u_lobe();
        let parts = &self.parts;
        let chosen = parts
            .iter()
            .position(|p| {
                let here = rest < p.pmf;
                if !here {
                    rest -= p.pmf;
                }
                here
            })
            .or_else(|| parts.iter().rposition(|p| p.pmf > 0.0))?;
        let p = &parts[chosen];
        let fresh = (rest / p.pmf).clamp(0.0, 1.0f32.next_down());
        let mut sample = p.part.sample(&self.layers, wo, normal, fresh, u)?;
        if sample.pdf.is_finite() && (sample.through.is_none() || p.part.is_thin()) {
            // All non-specular parts could have sampled this direction: one-sample estimate over their mixture.
            let (value, pdf) = self.eval(wo, sample.wi, normal);
            sample.weight = value / pdf;
            sample.pdf = pdf;
        } else {
            sample.weight *= self.lit_share(sample.wi) * (p.weight / p.pmf);
            sample.probability *= p.pmf;
            sample.pdf = f32::INFINITY;
        }
        Some(sample)
    }
}
