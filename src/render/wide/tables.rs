//! What shading looks up by object and by material, as arrays that sixteen lanes read at once.

use super::super::{ColorInput, Fresnel, Geometry, Material, MaterialId, ScalarInput};
use crate::kdtree::{SceneTree, Shape, quad_rim, sphere_error};
use crate::lanes::padded;
use glam::Vec3;

/// Shapes that are looked up; all others are asked one at a time.
pub(in crate::render) const OTHER: u32 = 0;
pub(in crate::render) const FLAT: u32 = 1;
pub(in crate::render) const BALL: u32 = 2;

/// The lone quads and spheres among the objects of a scene.
#[derive(Debug, Default)]
pub(in crate::render) struct SurfaceTable {
    pub kind: Vec<u32>,
    /// Corner of a quad, centre of a ball.
    pub a: [Vec<f32>; 3],
    /// The edges of a quad.
    pub b: [Vec<f32>; 3],
    pub c: [Vec<f32>; 3],
    /// How far points of a quad stay away from its rim, in its coordinates; of a ball the first is the error of a point along each
    /// axis beside the rounding, metres.
    pub least: [Vec<f32>; 2],
    pub normal: [Vec<f32>; 3],
    /// How far from a quad the next ray must start, metres along the normal; of a ball the radius.
    pub offset: Vec<f32>,
}

impl SurfaceTable {
    pub fn build(tree: &SceneTree) -> Self {
        let mut table = Self::default();
        for shape in tree.shapes() {
            let (kind, points, normal, least, offset) = match shape {
                Shape::Quad { corner, edge_u, edge_v } => {
                    let rim = quad_rim(*corner, *edge_u, *edge_v);
                    let offset = rim.normal.abs().dot(rim.error);
                    (FLAT, [*corner, *edge_u, *edge_v], rim.normal, rim.least, offset)
                }
                Shape::Sphere { center, radius } => {
                    let error = sphere_error(*center, *radius);
                    (BALL, [*center, Vec3::ZERO, Vec3::ZERO], Vec3::Z, [error, 0.0], *radius)
                }
                _ => (OTHER, [Vec3::ZERO; 3], Vec3::Z, [0.0; 2], 0.0),
            };
            let [a, b, c] = points;
            table.kind.push(kind);
            push(&mut table.a, a);
            push(&mut table.b, b);
            push(&mut table.c, c);
            push(&mut table.normal, normal);
            table.least.iter_mut().zip(least).for_each(|(array, least)| array.push(least));
            table.offset.push(offset);
        }
        let Self { kind, a, b, c, least, normal, offset } = table;
        Self {
            kind: padded(kind),
            a: a.map(padded),
            b: b.map(padded),
            c: c.map(padded),
            least: least.map(padded),
            normal: normal.map(padded),
            offset: padded(offset),
        }
    }
}

/// Of a material in a [`MaterialTable`].
pub(in crate::render) const SCHLICK: u32 = 1;
pub(in crate::render) const COMPENSATE: u32 = 2;
pub(in crate::render) const TEXTURED: u32 = 4;

/// The parameters of all materials of one lobe.
#[derive(Debug, Default)]
pub(in crate::render) struct MaterialTable {
    /// Albedo, reflectance or emitted radiance.
    pub color: [Vec<f32>; 3],
    pub alpha: Vec<f32>,
    pub flags: Vec<u32>,
    /// See [`Material::kind`].
    pub kind: Vec<u32>,
    /// One bit a kind, for those that there are.
    pub kinds: u32,
    /// The material of each object; [`SEVERAL`] where its primitives differ.
    pub of_object: Vec<MaterialId>,
}

pub(in crate::render) const SEVERAL: MaterialId = MaterialId::MAX;

impl MaterialTable {
    pub fn build(geometry: &Geometry, materials: &[Material]) -> Self {
        let mut table = Self::default();
        for material in materials {
            let (color, alpha) = match material {
                Material::Diffuse { albedo: color }
                | Material::Mirror { reflectance: color }
                | Material::Emissive { radiance: color } => (color, 0.0),
                Material::Metal { alpha, reflectance, .. } => {
                    (reflectance, if let ScalarInput::Constant(alpha) = alpha { alpha.clamp(0.0, 1.0) } else { 0.0 })
                }
                _ => (&ColorInput::Constant(Vec3::ONE), 0.0),
            };
            let mut flags = if material.is_textured(materials) { TEXTURED } else { 0 };
            if let Material::Metal { fresnel, compensate, .. } = material {
                flags |= if *fresnel == Fresnel::Schlick { SCHLICK } else { 0 };
                flags |= if *compensate { COMPENSATE } else { 0 };
            }
            push(&mut table.color, if let ColorInput::Constant(color) = color { *color } else { Vec3::ZERO });
            table.alpha.push(alpha);
            table.flags.push(flags);
            table.kind.push(material.kind() as u32);
            table.kinds |= 1 << material.kind();
        }
        let Self { color, alpha, flags, kind, kinds, .. } = table;
        let of_object = geometry
            .objects
            .iter()
            .map(|object| if let [only] = object.materials[..] { only } else { SEVERAL })
            .collect();
        Self {
            color: color.map(padded),
            alpha: padded(alpha),
            flags: padded(flags),
            kind: padded(kind),
            kinds,
            of_object: padded(of_object),
        }
    }
}

fn push(to: &mut [Vec<f32>; 3], v: Vec3) {
    to.iter_mut().zip(v.to_array()).for_each(|(array, x)| array.push(x));
}
