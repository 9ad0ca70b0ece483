//! Lights that are chosen one by one: what shines, which of them to ask at a point, and where on it.
//!
//! [`LightTable::sample`] and [`LightTable::pdf`] are one family: the second gives the density with which the first
//! would have found a point that a ray hit by itself, which is what multiple importance sampling needs.

pub(crate) mod arrays;
pub(crate) mod delta;
pub(crate) mod emitter;
pub(crate) mod flat;
mod sample_simd;
mod selection;
pub(crate) mod shape;
mod tree;
mod tree_simd;

use crate::core::color::luminance;
use crate::core::delta_light::DeltaLight;
use crate::core::material::{ColorInput, Emission};
use crate::core::snapshot::Geometry;
use crate::core::techniques::Techniques;
use crate::core::texture::Texture;
use crate::prepare::light::arrays::LightArrays;
use crate::prepare::light::delta::EVERYTHING;
use crate::prepare::light::emitter::{Light, LightSample};
use crate::prepare::light::selection::LightSelection;
use crate::prepare::light::shape::{LightShape, sphere_as_point};
use crate::sampling::Sampler;
use firstlight_kdtree::Shape;
use glam::{Vec2, Vec3};
use std::cell::OnceCell;

/// How many sample dimensions [`LightTable::sample_each`] uses.
pub(crate) const EACH_DIMENSIONS: u32 = selection::MAX_ESTIMATED as u32;

/// All finite emitters of a scene, and lights without size.
#[derive(Debug, Default)]
pub struct LightTable {
    pub(crate) lights: Vec<Light>,
    /// For each object: where its primitives stand among the lights.
    by_object: Vec<ObjectLights>,
    pub(crate) selection: LightSelection,
    pub(crate) lanes: Option<LightArrays>,
}

/// Which lights the primitives of an object are.
#[derive(Clone, Debug)]
enum ObjectLights {
    None,
    /// Primitive `i` is light `first + i`.
    All(u32),
    /// One entry a primitive; `u32::MAX` for those that do not shine.
    Some(Vec<u32>),
}

impl LightTable {
    /// Finds the emitters among the objects; `emission` of each material. Lights without size follow behind them.
    pub(crate) fn build(
        geometry: &Geometry,
        emission: &[Option<Emission>],
        textures: &[Texture],
        delta_lights: &[DeltaLight],
    ) -> Self {
        let mut lights = Vec::new();
        // A picture is gone through once, however many triangles show it.
        let means: Vec<OnceCell<f32>> = textures.iter().map(|_| OnceCell::new()).collect();
        let mean_of = |id: u32| *means[id as usize].get_or_init(|| luminance(textures[id as usize].mean()));
        let by_object = geometry
            .objects
            .iter()
            .zip(geometry.tree.shapes())
            .map(|(object, shape)| {
                let emission: Vec<_> = object.materials.iter().map(|&m| emission[m as usize]).collect();
                if emission.iter().all(Option::is_none) {
                    return ObjectLights::None;
                }
                let mean = |emission: Emission| {
                    emission.scale
                        * match emission.radiance {
                            ColorInput::Constant(radiance) => luminance(radiance),
                            ColorInput::Texture(id) => mean_of(id),
                        }
                };
                let first = lights.len() as u32;
                let mut push_with = |emission: Emission, shape: LightShape, corner_uvs: Option<[Vec2; 3]>| {
                    let (is_point, turned, mean_radiance) = (object.is_point_light, object.turned, mean(emission));
                    lights.push(Light { shape, emission, mean_radiance, is_point, turned, corner_uvs });
                    lights.len() as u32 - 1
                };
                let mut push = |emission, shape| push_with(emission, shape, None);
                let only = emission[0].filter(|_| emission.len() == 1);
                match (shape, only) {
                    (Shape::Mesh { tree: _, world_from_object }, _) => {
                        let mesh = object.mesh.as_ref().expect("a mesh shape brings its mesh");
                        let corner = |i: u32| world_from_object.transform_point3(mesh.positions[i as usize]);
                        // The front stays outside under mirroring.
                        let order = if world_from_object.matrix3.determinant() < 0.0 { [0, 2, 1] } else { [0, 1, 2] };
                        let ids: Vec<u32> = (0..mesh.triangles.len())
                            .map(|t| {
                                let slot = mesh.slots.get(t).map_or(0, |&s| usize::from(s));
                                let Some(emission) = emission.get(slot).copied().flatten() else { return u32::MAX };
                                let triangle = mesh.triangles[t];
                                let uv = |k: usize, set: u8| {
                                    let second = mesh.uvs2.get(triangle[k] as usize).filter(|_| set > 0);
                                    match second.or(mesh.uvs.get(triangle[k] as usize)) {
                                        Some(uv) => *uv,
                                        None => [Vec2::ZERO, Vec2::X, Vec2::Y][k],
                                    }
                                };
                                let corner_uvs = match emission.radiance {
                                    ColorInput::Constant(_) => None,
                                    ColorInput::Texture(id) => Some(order.map(|k| uv(k, textures[id as usize].uv_set))),
                                };
                                let vertices = order.map(|k| corner(triangle[k]));
                                push_with(emission, LightShape::triangle(vertices), corner_uvs)
                            })
                            .collect();
                        if only.is_some() { ObjectLights::All(first) } else { ObjectLights::Some(ids) }
                    }
                    (Shape::Spheres { tree, world_from_object }, Some(emission)) => {
                        let scale = world_from_object.matrix3.x_axis.length();
                        for i in 0..tree.len() as u32 {
                            let (center, radius) = tree.sphere(i);
                            let center = world_from_object.transform_point3(center);
                            push(emission, LightShape::Sphere { center, radius: radius * scale });
                        }
                        ObjectLights::All(first)
                    }
                    (Shape::Sphere { center, radius }, Some(emission)) => {
                        push(emission, LightShape::Sphere { center: *center, radius: *radius });
                        ObjectLights::All(first)
                    }
                    (Shape::Quad { corner, edge_u, edge_v }, Some(emission)) => {
                        push(emission, LightShape::quad(*corner, *edge_u, *edge_v));
                        ObjectLights::All(first)
                    }
                    (Shape::Triangle { vertices }, Some(emission)) => {
                        push(emission, LightShape::triangle(*vertices));
                        ObjectLights::All(first)
                    }
                    // An infinite plane shines, but has no area to choose from: rays find it by themselves.
                    _ => ObjectLights::None,
                }
            })
            .collect();
        let reach = (0.5 * geometry.tree.bounds().size().length()).clamp(1e-12, EVERYTHING);
        let reach = if geometry.objects.is_empty() { 1.0 } else { reach };
        lights.extend(delta_lights.iter().map(|light| Light::without_size(light, reach)));
        let selection = LightSelection::build(&lights);
        let lanes = LightArrays::build(&lights);
        Self { lights, by_object, selection, lanes }
    }

    /// Number of lights that can be sampled; each triangle of a mesh and each of many spheres counts by itself.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Whether no light can be sampled.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    #[inline]
    pub(crate) fn light(&self, id: u32) -> &Light {
        &self.lights[id as usize]
    }

    /// The light that a primitive is, if it is one.
    #[inline]
    pub(crate) fn light_of(&self, object: u32, prim: u32) -> Option<u32> {
        match &self.by_object[object as usize] {
            ObjectLights::None => None,
            ObjectLights::All(first) => Some(first + prim),
            ObjectLights::Some(ids) => Some(ids[prim as usize]).filter(|&id| id != u32::MAX),
        }
    }

    /// A point on some light, or `None` when the choice fell on one that cannot be seen from `position`.
    ///
    /// - `normal`: unit; only light from its side matters. Zero where light from both does, here and in [`Self::pdf`].
    /// - `u_select`, `u`: independent uniform numbers in `[0, 1)`; `u_select` is asked for where there are many lights.
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

    /// Tells `found` of one point on every light, or on one of them where there are many, by the number of the question, and
    /// whether the light is a point: those are points here.
    ///
    /// Uses [`EACH_DIMENSIONS`] dimensions of `sampler`, `dimension` being the first.
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

    /// The density with which [`Self::sample_each`] at `position` finds the point of light `id`, not a point light, in
    /// direction `wi`, `distance` metres away; per steradian.
    #[inline]
    pub(crate) fn pdf_each(&self, id: u32, position: Vec3, wi: Vec3, distance: f32) -> f32 {
        let by_angle = Techniques::default().solid_angle;
        self.selection.pmf_each(&self.lights, id) * self.lights[id as usize].shape.pdf(position, by_angle, wi, distance)
    }

    #[inline]
    pub(crate) fn is_point(&self, id: u32) -> bool {
        self.lights[id as usize].is_point
    }

    /// The density with which [`Self::sample`] at `position` finds the point of light `id` in direction `wi`,
    /// `distance` metres away; per steradian.
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
