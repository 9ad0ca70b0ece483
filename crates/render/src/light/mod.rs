//! Finite lights: what shines, which of them to ask at a point, and where on it.
//!
//! [`LightTable::sample`] and [`LightTable::pdf`] are one family: the second gives the density with which the first
//! would have found a point that a ray hit by itself, which is what multiple importance sampling needs.

mod selection;
mod shape;
mod tree;
mod wide;
mod wide_tree;
mod wide_triangle;

use super::color::luminance;
use super::{ColorInput, Emission, Geometry, Techniques, Texture};
use crate::sampling::Sampler;
use firstlight_kdtree::Shape;
use glam::{Mat3, Vec2, Vec3};
use selection::Selection;
pub(super) use shape::LightShape;
pub(super) use shape::sphere_uv;
pub(super) use wide::LightLanes;
use wide::WideLights;

/// How many sample dimensions [`LightTable::sample_each`] uses.
pub(super) const EACH_DIMENSIONS: u32 = selection::MAX_ESTIMATED as u32;

/// One emitter: a sphere, a quad or a triangle.
#[derive(Clone, Debug)]
pub(super) struct Light {
    pub shape: LightShape,
    pub emission: Emission,
    /// Mean over the surface, luminance.
    pub mean_radiance: f32,
    /// Stands for a point light, see [`super::Object::is_point_light`].
    pub is_point: bool,
    /// See [`super::Object::turned`].
    turned: Option<Mat3>,
    /// Surface coordinates at the vertices of a triangle of a mesh, where its emission is textured.
    corner_uvs: Option<[Vec2; 3]>,
}

/// All finite emitters of a scene.
#[derive(Debug, Default)]
pub struct LightTable {
    lights: Vec<Light>,
    /// For each object: where its primitives stand among the lights.
    by_object: Vec<ObjectLights>,
    selection: Selection,
    wide: Option<WideLights>,
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

/// A point on a light as seen from a shading point.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightSample {
    /// Where a shadow ray ends: on the light, lifted off its front by the bound of its own error.
    pub target: Vec3,
    /// Unit, towards the light.
    pub wi: Vec3,
    /// Per steradian at the shading point, the choice of the light included.
    pub pdf: f32,
    /// W·m⁻²·sr⁻¹, towards the shading point.
    pub radiance: Vec3,
}

impl LightTable {
    /// Finds the emitters among the objects; `emission` of each material.
    pub(super) fn build(geometry: &Geometry, emission: &[Option<Emission>], textures: &[Texture]) -> Self {
        let mut lights = Vec::new();
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
                            ColorInput::Texture(id) => luminance(textures[id as usize].mean()),
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
                                let uv = |k: usize| match mesh.uvs.get(triangle[k] as usize) {
                                    Some(uv) => *uv,
                                    None => [Vec2::ZERO, Vec2::X, Vec2::Y][k],
                                };
                                let is_textured = matches!(emission.radiance, ColorInput::Texture(_));
                                let vertices = order.map(|k| corner(triangle[k]));
                                push_with(emission, LightShape::triangle(vertices), is_textured.then(|| order.map(uv)))
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
        let selection = Selection::build(&lights);
        let wide = WideLights::build(&lights);
        Self { lights, by_object, selection, wide }
    }

    pub fn len(&self) -> usize {
        self.lights.len()
    }

    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    #[inline]
    pub(super) fn light(&self, id: u32) -> &Light {
        &self.lights[id as usize]
    }

    /// The light that a primitive is, if it is one.
    #[inline]
    pub(super) fn light_of(&self, object: u32, prim: u32) -> Option<u32> {
        match &self.by_object[object as usize] {
            ObjectLights::None => None,
            ObjectLights::All(first) => Some(first + prim),
            ObjectLights::Some(ids) => Some(ids[prim as usize]).filter(|&id| id != u32::MAX),
        }
    }

    /// A point on some light, or `None` when the choice fell on one that cannot be seen from `position`.
    ///
    /// - `normal`: unit; only light from its side matters.
    /// - `u_select`, `u`: independent uniform numbers in `[0, 1)`; `u_select` is asked for where there are many lights.
    #[inline]
    pub(super) fn sample(
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
    pub(super) fn sample_each(
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
                    shape::sphere_as_point(center, radius, position).map(|point| light.shining(textures, &point, pmf))
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
    pub(super) fn pdf_each(&self, id: u32, position: Vec3, wi: Vec3, distance: f32) -> f32 {
        let by_angle = Techniques::default().solid_angle;
        self.selection.pmf_each(&self.lights, id) * self.lights[id as usize].shape.pdf(position, by_angle, wi, distance)
    }

    #[inline]
    pub(super) fn is_point(&self, id: u32) -> bool {
        self.lights[id as usize].is_point
    }

    /// The density with which [`Self::sample`] at `position` finds the point of light `id` in direction `wi`,
    /// `distance` metres away; per steradian.
    #[inline]
    pub(super) fn pdf(
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

impl Light {
    #[inline]
    fn sample(
        &self,
        textures: &[Texture],
        techniques: &Techniques,
        position: Vec3,
        u: Vec2,
        pmf: f32,
    ) -> Option<LightSample> {
        self.shape.sample(position, techniques.solid_angle, u).map(|point| self.shining(textures, &point, pmf))
    }

    /// What the point with this normal and these surface coordinates sends out, W·m⁻²·sr⁻¹.
    #[inline]
    pub fn radiance(&self, textures: &[Texture], normal: Vec3, uv: Vec2) -> Vec3 {
        let radiance = match self.emission.radiance {
            ColorInput::Constant(radiance) => radiance,
            ColorInput::Texture(texture) => {
                let uv = match (&self.shape, &self.turned) {
                    (LightShape::Sphere { .. }, Some(turn)) => sphere_uv(*turn * normal),
                    (LightShape::Sphere { .. }, None) => sphere_uv(normal),
                    _ => match self.corner_uvs {
                        Some([a, b, c]) => a + uv.x * (b - a) + uv.y * (c - a),
                        None => uv,
                    },
                };
                textures[texture as usize].eval(uv)
            }
        };
        self.emission.scale * radiance
    }

    #[inline]
    fn shining(&self, textures: &[Texture], point: &shape::LightPoint, pmf: f32) -> LightSample {
        let radiance = self.radiance(textures, point.normal, point.uv);
        LightSample { target: point.target, wi: point.wi, pdf: pmf * point.pdf, radiance }
    }
}
