//! What shading looks up by object and by material, as arrays that sixteen lanes read at once.

use super::super::bsdf::SMALLEST_ALPHA;
use super::super::{ColorInput, Fresnel, Geometry, Material, MaterialId, ScalarInput};
use super::instances::InstanceTable;
use super::sort::Kinds;
use firstlight_kdtree::geometry::Frame;
use firstlight_kdtree::{SceneTree, Shape, quad_rim, sphere_error};
use firstlight_simd::padded;
use glam::Vec3;

/// Shapes that are looked up; all others are asked one at a time.
pub(crate) const OTHER: u32 = 0;
pub(crate) const FLAT: u32 = 1;
pub(crate) const BALL: u32 = 2;
pub(crate) const PLANE: u32 = 3;
/// What has a space of its own.
pub(crate) const MESH: u32 = 4;
pub(crate) const CLOUD: u32 = 5;

/// The objects of a scene.
#[derive(Debug, Default)]
pub(crate) struct SurfaceTable {
    pub kind: Vec<u32>,
    /// Corner of a quad, centre of a ball, point of a plane.
    pub a: [Vec<f32>; 3],
    /// The edges of a quad, the axes of a plane.
    pub b: [Vec<f32>; 3],
    pub c: [Vec<f32>; 3],
    /// How far points of a quad stay away from its rim, in its coordinates; of a ball the first is the error of a point along each
    /// axis beside the rounding, metres.
    pub least: [Vec<f32>; 2],
    pub normal: [Vec<f32>; 3],
    /// How far from a quad the next ray must start, metres along the normal; of a ball the radius.
    pub offset: Vec<f32>,
    /// Of what has a space of its own, the row in `instances`.
    pub row: Vec<u32>,
    pub instances: InstanceTable,
}

impl SurfaceTable {
    /// Whether the true normal of an object shades it, whoever looks.
    pub fn is_shaded_as_it_is(&self, object: u32) -> bool {
        [FLAT, BALL, PLANE, CLOUD].contains(&self.kind[object as usize])
    }

    pub fn build(tree: &SceneTree) -> Self {
        let mut table = Self::default();
        let mut n_instances = 0;
        for (object, shape) in tree.shapes().iter().enumerate() {
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
                Shape::Plane { point, normal } => {
                    let frame = Frame::around(*normal);
                    (PLANE, [*point, frame.x, frame.y], *normal, [0.0; 2], 0.0)
                }
                Shape::Mesh { .. } => (MESH, [Vec3::ZERO; 3], Vec3::Z, [0.0; 2], 0.0),
                Shape::Spheres { .. } => (CLOUD, [Vec3::ZERO; 3], Vec3::Z, [0.0; 2], 0.0),
                Shape::Triangle { .. } => (OTHER, [Vec3::ZERO; 3], Vec3::Z, [0.0; 2], 0.0),
            };
            table.row.push(n_instances);
            if [MESH, CLOUD].contains(&kind) {
                table.instances.add(tree, object);
                n_instances += 1;
            }
            let [a, b, c] = points;
            table.kind.push(kind);
            push(&mut table.a, a);
            push(&mut table.b, b);
            push(&mut table.c, c);
            push(&mut table.normal, normal);
            table.least.iter_mut().zip(least).for_each(|(array, least)| array.push(least));
            table.offset.push(offset);
        }
        let Self { kind, a, b, c, least, normal, offset, row, instances } = table;
        Self {
            kind: padded(kind),
            row: padded(row),
            instances: instances.padded(),
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
pub(crate) const SCHLICK: u32 = 1;
pub(crate) const COMPENSATE: u32 = 2;
pub(crate) const TEXTURED: u32 = 4;

/// The parameters of all materials of one lobe, and of the parts of those of two.
#[derive(Debug, Default)]
pub(crate) struct MaterialTable {
    /// Albedo, reflectance or emitted radiance.
    pub color: [Vec<f32>; 3],
    /// The same where it has to be looked up.
    pub inputs: Vec<ColorInput>,
    pub alpha: Vec<f32>,
    pub flags: Vec<u32>,
    /// See [`Material::kind`]; [`COATED`] for materials of two parts.
    pub kinds: Kinds,
    /// Rows of the parts, with their weights; the parts of a classic material have rows behind those of all materials.
    pub parts: [Vec<u32>; 2],
    pub weights: [Vec<f32>; 2],
    /// Whether some emission has to be looked up.
    pub textured_emission: bool,
    /// The material of each object; [`SEVERAL`] where its primitives differ.
    pub of_object: Vec<MaterialId>,
}

pub(crate) const SEVERAL: MaterialId = MaterialId::MAX;

/// Two parts of different kinds, each matte, rough metal or mirror.
pub(crate) const COATED: usize = Material::KINDS;

impl MaterialTable {
    pub fn build(geometry: &Geometry, materials: &[Material]) -> Self {
        let mut table = Self::default();
        let mut parts_of_classics = Vec::new();
        for material in materials {
            table.add(material, materials);
            let mut parts = [(0, 0.0); 2];
            match material {
                Material::Blend { weight: ScalarInput::Constant(weight), a, b } => {
                    let kinds = [a, b].map(|&id| kind_of_part(&materials[id as usize]));
                    if let [Some(first), Some(second)] = kinds
                        && first != second
                        && 0.0 < *weight
                        && *weight < 1.0
                    {
                        parts = [(*a, 1.0 - weight), (*b, *weight)];
                    }
                }
                Material::Phong { diffuse, specular: ScalarInput::Constant(specular), transparency: 0.0, .. }
                    if 0.0 < *specular && *specular < 1.0 =>
                {
                    let row = (materials.len() + parts_of_classics.len()) as u32;
                    parts_of_classics.push(Material::Diffuse { albedo: *diffuse });
                    parts_of_classics.push(Material::Mirror { reflectance: ColorInput::Constant(Vec3::ONE) });
                    parts = [(row, 1.0 - specular), (row + 1, *specular)];
                }
                _ => {}
            }
            let kind = if parts[0].1 > 0.0 { COATED } else { material.kind() };
            table.kinds.of_material.push(kind as u32);
            table.kinds.present |= 1 << kind;
            for (k, (row, weight)) in parts.into_iter().enumerate() {
                table.parts[k].push(row);
                table.weights[k].push(weight);
            }
        }
        for part in &parts_of_classics {
            table.add(part, materials);
            table.kinds.of_material.push(part.kind() as u32);
        }
        let of_object = geometry
            .objects
            .iter()
            .map(|object| if let [only] = object.materials[..] { only } else { SEVERAL })
            .collect();
        Self {
            color: table.color.map(padded),
            inputs: table.inputs,
            alpha: padded(table.alpha),
            flags: padded(table.flags),
            kinds: Kinds { of_material: padded(table.kinds.of_material), ..table.kinds },
            parts: table.parts.map(padded),
            weights: table.weights.map(padded),
            textured_emission: materials.iter().any(is_textured_emitter),
            of_object: padded(of_object),
        }
    }

    /// Color, alpha and flags.
    fn add(&mut self, material: &Material, materials: &[Material]) {
        let (color, alpha) = match material {
            Material::Diffuse { albedo: color }
            | Material::Mirror { reflectance: color }
            | Material::Emissive { radiance: color } => (*color, 0.0),
            Material::Metal { alpha, reflectance, .. } => {
                (*reflectance, if let ScalarInput::Constant(alpha) = alpha { alpha.clamp(0.0, 1.0) } else { 0.0 })
            }
            _ => (ColorInput::Constant(Vec3::ONE), 0.0),
        };
        let mut flags = if material.is_textured(materials) { TEXTURED } else { 0 };
        if let Material::Metal { fresnel, compensate, .. } = material {
            flags |= if *fresnel == Fresnel::Schlick { SCHLICK } else { 0 };
            flags |= if *compensate { COMPENSATE } else { 0 };
        }
        push(&mut self.color, if let ColorInput::Constant(color) = color { color } else { Vec3::ZERO });
        self.inputs.push(color);
        self.alpha.push(alpha);
        self.flags.push(flags);
    }
}

fn is_textured_emitter(material: &Material) -> bool {
    matches!(material, Material::Emissive { radiance: ColorInput::Texture(_) })
}

/// `None` for what cannot be a part of a [`COATED`] material.
fn kind_of_part(material: &Material) -> Option<usize> {
    match material {
        Material::Diffuse { .. } | Material::Mirror { .. } => Some(material.kind()),
        Material::Metal { alpha: ScalarInput::Constant(alpha), .. } => {
            (*alpha >= SMALLEST_ALPHA).then(|| material.kind())
        }
        _ => None,
    }
}

pub(super) fn push(to: &mut [Vec<f32>; 3], v: Vec3) {
    to.iter_mut().zip(v.to_array()).for_each(|(array, x)| array.push(x));
}
