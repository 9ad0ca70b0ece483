//! Light sampling: the emitters of a scene, which of them to sample from a point, and a point on it.
//!
//! [`LightTable::sample`] and [`LightTable::pdf`] are one family: the latter is the pdf with which the former would
//! have sampled a point that a ray has hit, as multiple importance sampling needs.

pub(crate) mod arrays;
pub(crate) mod delta;
pub(crate) mod emitter;
pub(crate) mod flat;
mod mean_light;
mod objects;
mod sample_simd;
pub(crate) mod selection;
pub(crate) mod shape;
mod tree;
mod tree_build;
mod tree_simd;

use crate::core::delta_light::DeltaLight;
use crate::core::material_queries::Emission;
use crate::core::snapshot::Geometry;
use crate::core::techniques::Techniques;
use crate::core::texture::Texture;
use crate::prepare::light::arrays::LightArrays;
use crate::prepare::light::delta::EVERYTHING;
use crate::prepare::light::emitter::{Light, LightSample};
use crate::prepare::light::mean_light::MeanLight;
use crate::prepare::light::objects::ObjectLights;
use crate::prepare::light::selection::LightSelection;
use crate::prepare::light::shape::{LightShape, sphere_as_point};
use crate::sampling::Sampler;
use glam::{Vec2, Vec3};

/// Number of sample dimensions of [`LightTable::sample_each`].
pub(crate) const EACH_DIMENSIONS: u32 = selection::MAX_ESTIMATED as u32;

/// All finite emitters of a scene, and its delta lights.
#[derive(Debug, Default)]
pub struct LightTable {
    pub(crate) lights: Vec<Light>,
    /// Per object: the light indices of its primitives.
    by_object: Vec<ObjectLights>,
    pub(crate) selection: LightSelection,
    pub(crate) lanes: Option<LightArrays>,
}

/// Radius of a scene, metres.
pub(crate) fn reach_of(geometry: &Geometry) -> f32 {
    let reach = (0.5 * geometry.tree.bounds().size().length()).clamp(1e-12, EVERYTHING);
    if geometry.objects.is_empty() { 1.0 } else { reach }
}

impl LightTable {
    /// Finds the emitters among the objects; `emission` per material. Delta lights follow after them.
    pub(crate) fn build(
        geometry: &Geometry,
        emission: &[Option<Emission>],
        textures: &[Texture],
        delta_lights: &[DeltaLight],
    ) -> Self {
        let mut lights = Vec::new();
        let mut means = MeanLight::new(textures);
        let by_object = geometry
            .objects
            .iter()
            .zip(geometry.tree.shapes())
            .map(|(object, shape)| {
                let emission: Vec<_> = object.materials.iter().map(|&m| emission[m as usize]).collect();
                ObjectLights::add(&mut lights, object, shape, &emission, &mut means)
            })
            .collect();
        let reach = reach_of(geometry);
        lights.extend(delta_lights.iter().map(|light| Light::without_size(light, reach, &mut means)));
        let selection = LightSelection::build(&lights);
        let lanes = LightArrays::build(&lights);
        Self { lights, by_object, selection, lanes }
    }

    /// Number of lights that can be sampled; each triangle of a mesh and each sphere of a group counts separately.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Whether no light can be sampled.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Whether there are delta lights.
    pub(crate) fn has_delta(&self) -> bool {
        self.lights.iter().any(|light| light.shape.delta().is_some())
    }

    #[inline]
    pub(crate) fn light(&self, id: u32) -> &Light {
        &self.lights[id as usize]
    }

    /// Returns the light of one side of a primitive, if it is one.
    #[inline]
    pub(crate) fn light_of(&self, object: u32, prim: u32, front: bool) -> Option<u32> {
        self.by_object[object as usize].of(prim, front)
    }

    /// Whether either side of a primitive is a light.
    pub(crate) fn shines(&self, object: u32, prim: u32) -> bool {
        [true, false].into_iter().any(|front| self.light_of(object, prim, front).is_some())
    }

    /// Samples a point on some light; `None` if the chosen light is not visible from `position`.
    ///
    /// - `normal`: unit; only light from its side matters. Zero if light from both sides does, here and in
    ///   [`Self::pdf`].
    /// - `u_select`, `u`: independent uniform numbers in `[0, 1)`; `u_select` is used only if there are many lights.
    #[inline]
    pub(crate) fn sample(
        &self,
        textures: &[Texture],
        techniques: &Techniques,
        position: Vec3,
        normal: Vec3,
        u_select: impl FnOnce() -> f32,
        mut u: Vec2,
    ) -> Option<LightSample> {
        let (id, pmf) = self.selection.sample(&self.lights, techniques, position, normal, u_select, &mut u.x)?;
        self.lights[id as usize].sample(textures, techniques, position, u, pmf)
    }

    /// Samples one point on every light, or on one of them if there are many, and calls `found` with the index of the
    /// sample and whether the light is a point; point lights have no radius here.
    ///
    /// Uses [`EACH_DIMENSIONS`] dimensions of `sampler`, starting at `dimension`.
    #[inline]
    pub(crate) fn sample_each(
        &self,
        textures: &[Texture],
        position: Vec3,
        sampler: &Sampler,
        dimension: u32,
        mut found: impl FnMut(usize, LightSample, bool),
    ) {
        let mut ask = |k: u32, id: u32, pmf: f32, dimension: u32| {
            let light = &self.lights[id as usize];
            let sample = match light.shape {
                LightShape::Sphere { center, radius } if light.is_point => {
                    sphere_as_point(center, radius, position).map(|point| light.shining(textures, &point, pmf))
                }
                _ => light.sample(textures, &Techniques::default(), position, sampler.pair(dimension), pmf),
            };
            if let Some(sample) = sample {
                found(k as usize, sample, light.is_point);
            }
        };
        if self.lights.len() <= selection::MAX_ESTIMATED {
            for id in 0..self.lights.len() as u32 {
                ask(id, id, 1.0, dimension + id);
            }
        } else if let Some((id, pmf)) = self.selection.by_power(sampler.single(dimension)) {
            ask(0, id, pmf, dimension + 1);
        }
    }

    /// Pdf of [`Self::sample_each`] at `position` for the point of light `id`, not a point light, in direction `wi`,
    /// `distance` metres away; per steradian.
    #[inline]
    pub(crate) fn pdf_each(&self, id: u32, position: Vec3, wi: Vec3, distance: f32) -> f32 {
        let by_angle = Techniques::default().solid_angle;
        self.selection.pmf_each(&self.lights, id) * self.lights[id as usize].shape.pdf(position, by_angle, wi, distance)
    }

    #[inline]
    pub(crate) fn is_point(&self, id: u32) -> bool {
        self.lights[id as usize].is_point
    }

    /// Pdf of [`Self::sample`] at `position` for the point of light `id` in direction `wi`, `distance` metres away; per
    /// steradian.
    #[inline]
    pub(crate) fn pdf(
        &self,
        techniques: &Techniques,
        id: u32,
        position: Vec3,
        normal: Vec3,
        wi: Vec3,
        distance: f32,
    ) -> f32 {
        let pmf = self.selection.pmf(&self.lights, techniques, id, position, normal);
        pmf * self.lights[id as usize].shape.pdf(position, techniques.solid_angle, wi, distance)
    }
}
