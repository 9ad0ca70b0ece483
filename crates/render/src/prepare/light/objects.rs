//! Light indices of the primitives of an object.

use crate::core::color::luminance;
use crate::core::material::{ColorInput, ScalarInput};
use crate::core::material_queries::Emission;
use crate::core::snapshot::Object;
use crate::core::texture::TexturePoint;
use crate::prepare::light::emitter::Light;
use crate::prepare::light::mean_light::MeanLight;
use crate::prepare::light::shape::LightShape;
use firstlight_kdtree::Shape;
use firstlight_mesh::Mesh;
use glam::{Vec2, Vec4};

/// The lights of an object by primitive: those of its front, and those of its back.
#[derive(Clone, Debug, Default)]
pub(super) struct ObjectLights {
    front: Ids,
    back: Ids,
}

#[derive(Clone, Debug, Default)]
enum Ids {
    #[default]
    None,
    /// Primitive `i` is light `first + i`.
    All(u32),
    /// One entry per primitive; `u32::MAX` for those that do not emit.
    Some(Vec<u32>),
}

impl Ids {
    #[inline]
    fn of(&self, prim: u32) -> Option<u32> {
        match self {
            Self::None => None,
            Self::All(first) => Some(first + prim),
            Self::Some(ids) => Some(ids[prim as usize]).filter(|&id| id != u32::MAX),
        }
    }
}

impl ObjectLights {
    /// Returns the light of one side of a primitive, if it is one.
    #[inline]
    pub fn of(&self, prim: u32, front: bool) -> Option<u32> {
        if front { self.front.of(prim) } else { self.back.of(prim) }
    }

    /// Adds the lights of an object.
    ///
    /// - `emission`: per material of the object; `lights`: all lights so far, to which these are added; `means`: shared
    ///   by all objects.
    pub fn add(
        lights: &mut Vec<Light>,
        object: &Object,
        shape: &Shape,
        emission: &[Option<Emission>],
        means: &mut MeanLight,
    ) -> Self {
        if emission.iter().all(Option::is_none) {
            return Self::default();
        }
        let mut adder = Adder { lights, object, means };
        let only = emission[0].filter(|_| emission.len() == 1);
        let first = adder.lights.len() as u32;
        match (shape, only) {
            (Shape::Mesh { world_from_object, .. }, _) => {
                let mesh = object.mesh.as_ref().expect("a mesh shape brings its mesh");
                // The front stays outside under mirroring.
                let mirrored = world_from_object.matrix3.determinant() < 0.0;
                let mut side = |is_back: bool| {
                    let order = if mirrored != is_back { [0, 2, 1] } else { [0, 1, 2] };
                    let ids = (0..mesh.triangles.len()).map(|t| {
                        let slot = mesh.slots.get(t).map_or(0, |&s| usize::from(s));
                        let emission = emission.get(slot).copied().flatten();
                        let Some(emission) = emission.filter(|e| e.two_sided || !is_back) else { return u32::MAX };
                        let triangle = order.map(|k| mesh.triangles[t][k] as usize);
                        let vertices = triangle.map(|i| world_from_object.transform_point3(mesh.positions[i]));
                        let corners = || order.map(|k| corner_of(mesh, mesh.triangles[t][k] as usize, k));
                        adder.add_textured(emission, LightShape::triangle(vertices), corners)
                    });
                    ids.collect::<Vec<u32>>()
                };
                let front = side(false);
                let front = if only.is_some() { Ids::All(first) } else { Ids::Some(front) };
                let has_back = emission.iter().flatten().any(|emission| emission.two_sided);
                Self { front, back: if has_back { Ids::Some(side(true)) } else { Ids::None } }
            }
            (Shape::Spheres { tree, world_from_object }, Some(emission)) => {
                let scale = world_from_object.matrix3.x_axis.length();
                for i in 0..tree.len() as u32 {
                    let (center, radius) = tree.sphere(i);
                    let center = world_from_object.transform_point3(center);
                    adder.add(emission, LightShape::Sphere { center, radius: radius * scale });
                }
                // The inside of a sphere is found by BSDF sampling only.
                Self { front: Ids::All(first), back: Ids::None }
            }
            (Shape::Sphere { center, radius }, Some(emission)) => {
                adder.add(emission, LightShape::Sphere { center: *center, radius: *radius });
                Self { front: Ids::All(first), back: Ids::None }
            }
            (Shape::Quad { corner, edge_u, edge_v }, Some(emission)) => {
                adder.add(emission, LightShape::quad(*corner, *edge_u, *edge_v));
                let back = emission.two_sided.then(|| {
                    let shape = LightShape::quad(*corner + *edge_u, -*edge_u, *edge_v);
                    adder.add_textured(emission, shape, || [Vec2::X, Vec2::ZERO, Vec2::ONE].map(TexturePoint::from))
                });
                Self { front: Ids::All(first), back: back.map_or(Ids::None, Ids::All) }
            }
            (Shape::Triangle { vertices: [a, b, c] }, Some(emission)) => {
                adder.add(emission, LightShape::triangle([*a, *b, *c]));
                let back = emission.two_sided.then(|| {
                    let corners = || [Vec2::ZERO, Vec2::Y, Vec2::X].map(TexturePoint::from);
                    adder.add_textured(emission, LightShape::triangle([*a, *c, *b]), corners)
                });
                Self { front: Ids::All(first), back: back.map_or(Ids::None, Ids::All) }
            }
            // An infinite plane emits, but has no finite area to sample: only BSDF sampling finds it.
            _ => Self::default(),
        }
    }
}

/// Returns the texture coordinates of a mesh vertex, which is corner `k` of its triangle.
fn corner_of(mesh: &Mesh, vertex: usize, k: usize) -> TexturePoint {
    let uv = mesh.uvs.get(vertex).copied().unwrap_or([Vec2::ZERO, Vec2::X, Vec2::Y][k]);
    let second = mesh.uvs2.get(vertex).copied().unwrap_or(uv);
    TexturePoint { uv: [uv, second], color: mesh.colors.get(vertex).copied().unwrap_or(Vec4::ONE) }
}

struct Adder<'a, 'b> {
    lights: &'a mut Vec<Light>,
    object: &'a Object,
    means: &'a mut MeanLight<'b>,
}

impl Adder<'_, '_> {
    fn add(&mut self, emission: Emission, shape: LightShape) -> u32 {
        self.push(emission, shape, None)
    }

    /// - `corners`: see [`Light::corners`].
    fn add_textured(
        &mut self,
        emission: Emission,
        shape: LightShape,
        corners: impl FnOnce() -> [TexturePoint; 3],
    ) -> u32 {
        let is_textured = matches!(emission.radiance, ColorInput::Texture(_))
            || matches!(emission.opacity.0, ScalarInput::Texture(_));
        self.push(emission, shape, is_textured.then(|| Box::new(corners())))
    }

    fn push(&mut self, emission: Emission, shape: LightShape, corners: Option<Box<[TexturePoint; 3]>>) -> u32 {
        let mean_radiance = emission.scale
            * match emission.radiance {
                ColorInput::Constant(radiance) => luminance(radiance),
                ColorInput::Texture(id) => self.means.of(id, corners.as_deref()),
            };
        let (is_point, turned) = (self.object.is_point_light, self.object.turned);
        self.lights.push(Light { shape, emission, mean_radiance, is_point, turned, corners, image: None });
        self.lights.len() as u32 - 1
    }
}
