//! What shading looks up by object and by material, as arrays that sixteen lanes read at once.

use super::super::{ColorInput, Fresnel, Geometry, Material, MaterialId, ScalarInput};
use crate::geometry::Ray;
use crate::kdtree::{Hit, SceneTree, Shape};
use crate::lanes::padded;
use glam::Vec3;

/// Shapes that are looked up; all others are asked one at a time.
pub(in crate::render) const OTHER: u32 = 0;
pub(in crate::render) const FLAT: u32 = 1;
pub(in crate::render) const BALL: u32 = 2;

/// The lone quads, triangles and spheres among the objects of a scene.
#[derive(Debug, Default)]
pub(in crate::render) struct SurfaceTable {
    pub kind: Vec<u32>,
    /// The point of a flat shape is `(1 − t u − t v) a + u b + v c`, `t` being 1 for triangles and 0 for quads; of a
    /// ball `a` is the centre and `offset` the radius.
    pub a: [Vec<f32>; 3],
    pub b: [Vec<f32>; 3],
    pub c: [Vec<f32>; 3],
    pub t: Vec<f32>,
    pub normal: [Vec<f32>; 3],
    /// How far from a flat shape the next ray must start, metres along the normal; more than its error anywhere.
    pub offset: Vec<f32>,
}

impl SurfaceTable {
    pub fn build(tree: &SceneTree) -> Self {
        let mut table = Self::default();
        for (object, shape) in (0..).zip(tree.shapes()) {
            let (kind, [a, b, c], t, corners): (_, _, _, &[(f32, f32)]) = match shape {
                Shape::Quad { corner, edge_u, edge_v } => {
                    (FLAT, [*corner, *edge_u, *edge_v], 0.0, &[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
                }
                Shape::Triangle { vertices } => (FLAT, *vertices, 1.0, &[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]),
                Shape::Sphere { center, .. } => (BALL, [*center, Vec3::ZERO, Vec3::ZERO], 0.0, &[]),
                _ => (OTHER, [Vec3::ZERO; 3], 0.0, &[]),
            };
            let (mut normal, mut offset) = (Vec3::Z, 0.0f32);
            // The error grows with the distance to the farthest corner, so nowhere is it larger than in a corner.
            for &(u, v) in corners {
                let hit = Hit { t: 1.0, u, v, prim: 0, object };
                let point = tree.surface_point(&Ray::new(Vec3::ZERO, Vec3::Z), &hit);
                normal = point.geometric_normal;
                offset = offset.max(normal.abs().dot(point.error));
            }
            if let Shape::Sphere { radius, .. } = shape {
                offset = *radius;
            }
            table.kind.push(kind);
            push(&mut table.a, a);
            push(&mut table.b, b);
            push(&mut table.c, c);
            table.t.push(t);
            push(&mut table.normal, normal);
            table.offset.push(offset);
        }
        let Self { kind, a, b, c, t, normal, offset } = table;
        Self {
            kind: padded(kind),
            a: a.map(padded),
            b: b.map(padded),
            c: c.map(padded),
            t: padded(t),
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
