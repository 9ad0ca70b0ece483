//! The vertices of a primitive, with morph targets and skin applied.
//!
//! Texture coordinates are flipped: v points down in glTF and up here. Attributes that are broken are left out: a
//! primitive can be shown by its positions alone.
//!
//! Source: Khronos, "glTF 2.0 Specification", §3.7.2 (meshes).

use crate::error::gltf::{GltfProblem, Located};
use crate::gltf::document::Document;
use crate::gltf::json;
use crate::gltf::skin::Joints;
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};

/// Texture coordinates of what has none in the file: (0, 0), with v downwards.
pub(crate) const NO_UV: Vec2 = Vec2::new(0.0, 1.0);

/// How the vertices of a mesh are deformed.
#[derive(Default)]
pub(crate) struct Deformation<'a> {
    /// Weights of the morph targets; missing ones are 0.
    pub weights: &'a [f64],
    pub joints: Option<Joints>,
}

/// Joints and weights of each vertex.
type Influences = (Vec<[u32; 4]>, Vec<[f32; 4]>);

/// The vertices of one or more primitives.
#[derive(Default)]
pub(crate) struct Vertices {
    pub positions: Vec<DVec3>,
    pub normals: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub uvs2: Vec<Vec2>,
    pub colors: Vec<[f32; 4]>,
    pub tangents: Vec<Vec4>,
    pub not_finite: usize,
}

impl Document {
    /// - `omitted`: receives the attributes that are broken, without which the primitive is shown.
    pub(crate) fn vertices(
        &self,
        primitive: &json::Primitive,
        deformation: &Deformation,
        part: &str,
        omitted: &mut Vec<(String, Located)>,
    ) -> Result<Vertices, Located> {
        let accessor = |name: &str| primitive.attributes.get(name).copied();
        let Some(position) = accessor("POSITION") else {
            return Err((part.to_owned(), GltfProblem::Missing("POSITION")));
        };
        let positions = self.raw_floats::<3>(position)?;
        let mut vertices = Vertices {
            positions: positions.into_iter().map(|p| DVec3::from(p.map(f64::from))).collect(),
            ..Vertices::default()
        };
        let count = vertices.positions.len();
        // An attribute without numbers that are not finite; counts those.
        let mut not_finite = 0;
        let mut attribute = Attributes { document: self, part, count, omitted, not_finite: &mut not_finite };
        let mut normals: Vec<Vec3> = Vec::new();
        if let Some(index) = accessor("NORMAL") {
            normals = attribute.floats::<3>("NORMAL", index).into_iter().map(Vec3::from).collect();
        }
        if let Some(index) = accessor("TANGENT").filter(|_| !normals.is_empty()) {
            let unit = |[x, y, z, w]: [f32; 4]| {
                let direction = Vec3::new(x, y, z).as_dvec3().normalize_or_zero().as_vec3();
                direction.extend(if w < 0.0 { -1.0 } else { 1.0 })
            };
            vertices.tangents = attribute.floats::<4>("TANGENT", index).into_iter().map(unit).collect();
        }
        for (name, list) in [("TEXCOORD_0", &mut vertices.uvs), ("TEXCOORD_1", &mut vertices.uvs2)] {
            if let Some(index) = accessor(name) {
                let values = attribute.floats::<2>(name, index);
                *list = values.into_iter().map(|[u, v]| Vec2::new(u, 1.0 - v)).collect();
            }
        }
        if let Some(index) = accessor("COLOR_0") {
            vertices.colors = match self.n_components(index) {
                Ok(3) => {
                    let colors = attribute.floats::<3>("COLOR_0", index).into_iter();
                    colors.map(|[r, g, b]| [r, g, b, 1.0]).collect()
                }
                _ => attribute.floats::<4>("COLOR_0", index),
            };
            vertices.colors.iter_mut().flatten().for_each(|c| *c = c.clamp(0.0, 1.0));
            // A list that an exporter reserved and never filled: as alpha it would hide the model, as color paint it black.
            if !vertices.colors.is_empty() && vertices.colors.iter().all(|color| *color == [0.0; 4]) {
                let (what, found) = ("a number in it", "only zeros, alpha included".to_owned());
                let problem = GltfProblem::Value { what, found, expected: "colours" };
                attribute.omitted.push((format!("{part}.COLOR_0"), (String::new(), problem)));
                vertices.colors.clear();
            }
        }
        for (i, (target, &weight)) in primitive.targets.iter().zip(deformation.weights).enumerate() {
            if weight == 0.0 {
                continue;
            }
            if let Some(&index) = target.get("POSITION") {
                let values = attribute.floats::<3>(&format!("targets[{i}].POSITION"), index);
                for (position, delta) in vertices.positions.iter_mut().zip(values) {
                    *position += weight * DVec3::from(delta.map(f64::from));
                }
            }
            if let Some(&index) = target.get("NORMAL").filter(|_| !normals.is_empty()) {
                let values = attribute.floats::<3>(&format!("targets[{i}].NORMAL"), index);
                for (normal, delta) in normals.iter_mut().zip(values) {
                    *normal += weight as f32 * Vec3::from(delta);
                }
            }
        }
        vertices.not_finite = not_finite;
        if let Some(joints) = &deformation.joints {
            let sets = self.influences(primitive, joints, count).unwrap_or_else(|located| {
                omitted.push((format!("{part}.JOINTS_0"), located));
                Vec::new()
            });
            let of_vertex = |i: usize| {
                let influences = sets.iter().flat_map(|(names, weights)| names[i].into_iter().zip(weights[i]));
                if sets.is_empty() { joints.of_node } else { joints.mixed(influences).unwrap_or(joints.of_node) }
            };
            vertices.transform(of_vertex, &mut normals);
        }
        vertices.normals = normals.into_iter().map(|n| n.as_dvec3().normalize_or_zero().as_vec3()).collect();
        Ok(vertices)
    }

    /// Sets of joints and weights, one of each per vertex; none if the primitive or the skin has none.
    fn influences(
        &self,
        primitive: &json::Primitive,
        joints: &Joints,
        count: usize,
    ) -> Result<Vec<Influences>, Located> {
        let here = |problem| (String::new(), problem);
        let mut sets = Vec::new();
        for set in (0..).take_while(|_| !joints.joints.is_empty()) {
            let accessor = |name: &str| primitive.attributes.get(&format!("{name}_{set}")).copied();
            let (Some(names), Some(weights)) = (accessor("JOINTS"), accessor("WEIGHTS")) else { break };
            let (names, weights) = (self.whole::<4>(names)?, self.floats::<4>(weights)?);
            if names.len() != count || weights.len() != count {
                let found = names.len().min(weights.len()) as u64;
                let what = format!("JOINTS_{set} or WEIGHTS_{set}");
                return Err(here(GltfProblem::Length { what, found, expected: count as u64 }));
            }
            let is_wrong = |(&joint, &weight): (&u32, &f32)| weight != 0.0 && joint as usize >= joints.joints.len();
            let wrong = names.iter().zip(&weights).find(|(names, weights)| names.iter().zip(*weights).any(is_wrong));
            if let Some((names, _)) = wrong {
                let (what, found) = ("a number in it", format!("{names:?}"));
                return Err(here(GltfProblem::Value { what, found, expected: "joints of the skin" }));
            }
            sets.push((names, weights));
        }
        Ok(sets)
    }
}

/// Reads the attributes without which a primitive can be shown.
struct Attributes<'a> {
    document: &'a Document,
    /// The place of the primitive.
    part: &'a str,
    /// Number of its vertices.
    count: usize,
    omitted: &'a mut Vec<(String, Located)>,
    not_finite: &'a mut usize,
}

impl Attributes<'_> {
    /// One value per vertex, with zeros for those that are not finite; none if the attribute is broken.
    fn floats<const N: usize>(&mut self, name: &str, index: u32) -> Vec<[f32; N]> {
        let read = self.document.floats_or_zero::<N>(index).and_then(|(values, wrong)| {
            let (found, expected) = (values.len() as u64, self.count as u64);
            let problem = || GltfProblem::Length { what: name.to_owned(), found, expected };
            if found == expected { Ok((values, wrong)) } else { Err((String::new(), problem())) }
        });
        match read {
            Ok((values, wrong)) => {
                *self.not_finite += wrong;
                values
            }
            Err(located) => {
                self.omitted.push((format!("{}.{name}", self.part), located));
                Vec::new()
            }
        }
    }
}

impl Vertices {
    /// Moves each vertex by its own transform.
    fn transform(&mut self, map: impl Fn(usize) -> DAffine3, normals: &mut [Vec3]) {
        for i in 0..self.positions.len() {
            let map = map(i);
            self.positions[i] = map.transform_point3(self.positions[i]);
            if let Some(normal) = normals.get_mut(i) {
                // The cofactor matrix: the inverse transpose up to a factor, but also defined for singular matrices.
                let m = map.matrix3;
                let cofactors = glam::DMat3::from_cols(
                    m.y_axis.cross(m.z_axis),
                    m.z_axis.cross(m.x_axis),
                    m.x_axis.cross(m.y_axis),
                );
                let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
                *normal = (cofactors * normal.as_dvec3() * sign).normalize_or_zero().as_vec3();
            }
            if let Some(tangent) = self.tangents.get_mut(i) {
                let turned = (map.matrix3 * tangent.truncate().as_dvec3()).normalize_or_zero().as_vec3();
                *tangent = turned.extend(tangent.w);
            }
        }
    }
}
