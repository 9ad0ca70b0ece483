//! The primitives of a mesh as one list of triangles, with morph targets and skin applied.
//!
//! Strips and fans become triangles; points and lines are only counted. Vertices that primitives share stay shared. A
//! primitive without normals is flat-shaded, as the specification requires. Texture coordinates are flipped: v points
//! down in glTF and up here.
//!
//! Source: Khronos, "glTF 2.0 Specification", §3.7.2 (meshes).

use super::document::Document;
use super::error::{GltfProblem, Located, place};
use super::json;
use super::skin::Joints;
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::collections::{BTreeMap, HashMap};

/// How the vertices of a mesh are deformed.
#[derive(Default)]
pub(super) struct Deformation<'a> {
    /// Weights of the morph targets; missing ones are 0.
    pub weights: &'a [f64],
    pub joints: Option<Joints>,
}

/// Identity of a slot: its material, and its materials by variant.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(in crate::scene) struct SlotKey {
    /// `None`: the default material.
    pub material: Option<u32>,
    /// Material by index of the variant.
    pub variants: BTreeMap<u32, u32>,
}

/// The triangles of a mesh. Lists of vertex attributes are empty or as long as `positions`.
#[derive(Debug, Default)]
pub(super) struct Triangles {
    pub positions: Vec<DVec3>,
    /// Unit vectors; zero if missing in the file.
    pub normals: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub uvs2: Vec<Vec2>,
    /// Linear RGBA.
    pub colors: Vec<[f32; 4]>,
    /// Unit vectors with the sign of the bitangent; all zero if missing in the file.
    pub tangents: Vec<Vec4>,
    pub triangles: Vec<[u32; 3]>,
    /// One per triangle.
    pub slots: Vec<u16>,
    pub keys: Vec<SlotKey>,
    /// Whether each slot has tangents at all corners of all of its triangles.
    pub has_tangents: Vec<bool>,
    /// Number of primitives of points or lines.
    pub points_or_lines: usize,
    /// Number of triangles that used a vertex twice.
    pub degenerate: usize,
    /// Number of normals, tangents and texture coordinates that were not finite.
    pub not_finite: usize,
    /// Whether some triangles had normals and others had none.
    pub flat_parts: bool,
}

/// The vertices of one or more primitives.
#[derive(Default)]
struct Vertices {
    positions: Vec<DVec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    uvs2: Vec<Vec2>,
    colors: Vec<[f32; 4]>,
    tangents: Vec<Vec4>,
    not_finite: usize,
}

impl Document {
    pub(super) fn mesh(&self, index: u32) -> Result<&json::Mesh, Located> {
        let count = self.root.meshes.len();
        let problem = GltfProblem::Index { list: "meshes", index, count };
        self.root.meshes.get(index as usize).ok_or((place("meshes", index), problem))
    }

    /// All triangles of a mesh.
    ///
    /// # Errors
    /// If an accessor is invalid or corresponding lists have different lengths.
    pub(super) fn triangles(&self, mesh: u32, deformation: &Deformation) -> Result<Triangles, Located> {
        let json = self.mesh(mesh)?;
        let mut found = Triangles::default();
        let mut slots: HashMap<SlotKey, u16> = HashMap::new();
        // First vertex and number of vertices of each set of attributes.
        let mut known: HashMap<(&BTreeMap<String, u32>, &[BTreeMap<String, u32>]), (u32, u32)> = HashMap::new();
        for (i, primitive) in json.primitives.iter().enumerate() {
            let here = || format!("{}.{}", place("meshes", mesh), place("primitives", i));
            let mode = primitive.mode.unwrap_or(4);
            if mode < 4 {
                found.points_or_lines += 1;
                continue;
            }
            if mode > 6 {
                let (what, found, expected) = ("mode", mode.to_string(), "0 to 6");
                return Err((here(), GltfProblem::Value { what, found, expected }));
            }
            let key = (&primitive.attributes, &primitive.targets[..]);
            let (first, count) = match known.get(&key) {
                Some(&range) => range,
                None => {
                    let vertices = self.vertices(primitive, deformation, &here)?;
                    let range = (found.positions.len() as u32, vertices.positions.len() as u32);
                    let total = found.positions.len() + vertices.positions.len();
                    if u32::try_from(total).is_err() {
                        return Err((here(), GltfProblem::Count { count: total as u64 }));
                    }
                    found.append(vertices);
                    known.insert(key, range);
                    range
                }
            };
            let indices = match primitive.indices {
                Some(accessor) => self.indices(accessor)?,
                None => (0..count).collect(),
            };
            // The maximum of an index type means primitive restart in other APIs and is not allowed in glTF.
            if let Some(&index) = indices.iter().find(|&&index| index >= count) {
                return Err((format!("{}.indices", here()), GltfProblem::Vertex { index, count: count as usize }));
            }
            let slot_key = SlotKey { material: primitive.material, variants: variants_of(primitive) };
            let next = slots.len();
            let slot = match slots.get(&slot_key) {
                Some(&slot) => slot,
                None => {
                    let slot = u16::try_from(next).map_err(|_| (here(), GltfProblem::Count { count: next as u64 }))?;
                    slots.insert(slot_key.clone(), slot);
                    found.keys.push(slot_key);
                    found.has_tangents.push(true);
                    slot
                }
            };
            found.has_tangents[slot as usize] &= primitive.attributes.contains_key("TANGENT");
            let before = found.triangles.len();
            let corner = |i: usize| first + indices[i];
            let mut add = |[a, b, c]: [u32; 3]| {
                if a != b && b != c && c != a {
                    found.triangles.push([a, b, c]);
                } else {
                    found.degenerate += 1;
                }
            };
            let last = indices.len().saturating_sub(2);
            match mode {
                4 => (0..indices.len() / 3).for_each(|t| add([corner(3 * t), corner(3 * t + 1), corner(3 * t + 2)])),
                // Every other triangle of a strip is reversed.
                5 => (0..last).for_each(|t| add([corner(t), corner(t + 1 + t % 2), corner(t + 2 - t % 2)])),
                _ => (0..last).for_each(|t| add([corner(t + 1), corner(t + 2), corner(0)])),
            }
            let added = found.triangles.len() - before;
            found.slots.extend(std::iter::repeat_n(slot, added));
        }
        found.leave_out_unused();
        found.split_flat_parts();
        Ok(found)
    }

    fn vertices(
        &self,
        primitive: &json::Primitive,
        deformation: &Deformation,
        here: &dyn Fn() -> String,
    ) -> Result<Vertices, Located> {
        let accessor = |name: &str| primitive.attributes.get(name).copied();
        let Some(position) = accessor("POSITION") else { return Err((here(), GltfProblem::Missing("POSITION"))) };
        let mut vertices = Vertices {
            positions: self.floats::<3>(position)?.into_iter().map(|p| DVec3::from(p.map(f64::from))).collect(),
            ..Vertices::default()
        };
        let count = vertices.positions.len();
        let same = |name: &str, found: usize| match found == count {
            true => Ok(()),
            false => {
                let (found, expected) = (found as u64, count as u64);
                Err((here(), GltfProblem::Length { what: name.to_owned(), found, expected }))
            }
        };
        let mut normals: Vec<Vec3> = Vec::new();
        if let Some(index) = accessor("NORMAL") {
            let (values, wrong) = self.floats_or_zero::<3>(index)?;
            same("NORMAL", values.len())?;
            vertices.not_finite += wrong;
            normals = values.into_iter().map(Vec3::from).collect();
        }
        if let Some(index) = accessor("TANGENT").filter(|_| !normals.is_empty()) {
            let (values, wrong) = self.floats_or_zero::<4>(index)?;
            same("TANGENT", values.len())?;
            vertices.not_finite += wrong;
            let unit = |[x, y, z, w]: [f32; 4]| {
                let direction = Vec3::new(x, y, z).as_dvec3().normalize_or_zero().as_vec3();
                direction.extend(if w < 0.0 { -1.0 } else { 1.0 })
            };
            vertices.tangents = values.into_iter().map(unit).collect();
        }
        for (name, list) in [("TEXCOORD_0", &mut vertices.uvs), ("TEXCOORD_1", &mut vertices.uvs2)] {
            if let Some(index) = accessor(name) {
                let (values, wrong) = self.floats_or_zero::<2>(index)?;
                same(name, values.len())?;
                vertices.not_finite += wrong;
                *list = values.into_iter().map(|[u, v]| Vec2::new(u, 1.0 - v)).collect();
            }
        }
        if let Some(index) = accessor("COLOR_0") {
            vertices.colors = match self.n_components(index)? {
                3 => self.floats_or_zero::<3>(index)?.0.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect(),
                _ => self.floats_or_zero::<4>(index)?.0,
            };
            same("COLOR_0", vertices.colors.len())?;
            vertices.colors.iter_mut().flatten().for_each(|c| *c = c.clamp(0.0, 1.0));
        }
        for (target, &weight) in primitive.targets.iter().zip(deformation.weights) {
            if weight == 0.0 {
                continue;
            }
            if let Some(&index) = target.get("POSITION") {
                let values = self.floats::<3>(index)?;
                same("POSITION of a morph target", values.len())?;
                for (position, delta) in vertices.positions.iter_mut().zip(values) {
                    *position += weight * DVec3::from(delta.map(f64::from));
                }
            }
            if let Some(&index) = target.get("NORMAL").filter(|_| !normals.is_empty()) {
                let (values, _) = self.floats_or_zero::<3>(index)?;
                same("NORMAL of a morph target", values.len())?;
                for (normal, delta) in normals.iter_mut().zip(values) {
                    *normal += weight as f32 * Vec3::from(delta);
                }
            }
        }
        if let Some(joints) = &deformation.joints {
            self.skin(primitive, joints, &mut vertices, &mut normals, here)?;
        }
        vertices.normals = normals.into_iter().map(|n| n.as_dvec3().normalize_or_zero().as_vec3()).collect();
        Ok(vertices)
    }

    fn skin(
        &self,
        primitive: &json::Primitive,
        joints: &Joints,
        vertices: &mut Vertices,
        normals: &mut [Vec3],
        here: &dyn Fn() -> String,
    ) -> Result<(), Located> {
        let count = vertices.positions.len();
        let mut sets = Vec::new();
        for set in 0.. {
            let accessor = |name: &str| primitive.attributes.get(&format!("{name}_{set}")).copied();
            let (Some(names), Some(weights)) = (accessor("JOINTS"), accessor("WEIGHTS")) else { break };
            let (names, weights) = (self.whole::<4>(names)?, self.floats::<4>(weights)?);
            if names.len() != count || weights.len() != count {
                let found = names.len().min(weights.len()) as u64;
                let what = format!("JOINTS_{set} or WEIGHTS_{set}");
                return Err((here(), GltfProblem::Length { what, found, expected: count as u64 }));
            }
            sets.push((names, weights));
        }
        for i in 0..count {
            let influences = sets.iter().flat_map(|(names, weights)| names[i].into_iter().zip(weights[i]));
            let Some(map) = joints.mixed(influences) else {
                let problem = GltfProblem::Value {
                    what: "a number in JOINTS_0",
                    found: format!("{:?}", sets[0].0[i]),
                    expected: "joints of the skin",
                };
                return Err((here(), problem));
            };
            vertices.positions[i] = map.transform_point3(vertices.positions[i]);
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
            if let Some(tangent) = vertices.tangents.get_mut(i) {
                let turned = (map.matrix3 * tangent.truncate().as_dvec3()).normalize_or_zero().as_vec3();
                *tangent = turned.extend(tangent.w);
            }
        }
        Ok(())
    }
}

/// Material by index of the variant.
pub(super) fn variants_of(primitive: &json::Primitive) -> BTreeMap<u32, u32> {
    let mut variants = BTreeMap::new();
    let mappings = primitive.extensions.get("KHR_materials_variants").and_then(|extension| extension.get("mappings"));
    for mapping in mappings.and_then(serde_json::Value::as_array).into_iter().flatten() {
        let number = |value: &serde_json::Value| value.as_u64().and_then(|number| u32::try_from(number).ok());
        let Some(material) = mapping.get("material").and_then(number) else { continue };
        let list = mapping.get("variants").and_then(serde_json::Value::as_array);
        for variant in list.into_iter().flatten().filter_map(number) {
            variants.insert(variant, material);
        }
    }
    variants
}

impl Triangles {
    fn append(&mut self, vertices: Vertices) {
        /// Extends an attribute list, which stays empty or as long as the positions.
        fn join<T: Clone>(list: &mut Vec<T>, before: usize, more: Vec<T>, count: usize, filler: T) {
            if list.is_empty() && more.is_empty() {
                return;
            }
            list.resize(before, filler.clone());
            list.extend(more);
            list.resize(before + count, filler);
        }
        let (before, count) = (self.positions.len(), vertices.positions.len());
        self.positions.extend(vertices.positions);
        join(&mut self.normals, before, vertices.normals, count, Vec3::ZERO);
        join(&mut self.uvs, before, vertices.uvs, count, Vec2::ZERO);
        join(&mut self.uvs2, before, vertices.uvs2, count, Vec2::ZERO);
        join(&mut self.colors, before, vertices.colors, count, [1.0; 4]);
        join(&mut self.tangents, before, vertices.tangents, count, Vec4::ZERO);
        self.not_finite += vertices.not_finite;
    }

    /// Removes unused vertices; the others keep their order.
    fn leave_out_unused(&mut self) {
        let mut used = vec![false; self.positions.len()];
        self.triangles.iter().flatten().for_each(|&vertex| used[vertex as usize] = true);
        if used.iter().all(|&used| used) {
            return;
        }
        fn keep<T>(list: &mut Vec<T>, used: &[bool]) {
            let mut used = used.iter();
            list.retain(|_| used.next().copied().unwrap_or(false));
        }
        keep(&mut self.positions, &used);
        keep(&mut self.normals, &used);
        keep(&mut self.uvs, &used);
        keep(&mut self.uvs2, &used);
        keep(&mut self.colors, &used);
        keep(&mut self.tangents, &used);
        let mut next = 0;
        let numbers: Vec<u32> = used
            .iter()
            .map(|&used| {
                let number = next;
                next += u32::from(used);
                number
            })
            .collect();
        self.triangles.iter_mut().flatten().for_each(|vertex| *vertex = numbers[*vertex as usize]);
    }

    /// Duplicates the vertices of triangles with a missing normal and gives them the geometric normal; if all normals
    /// are missing, the mesh gets none.
    fn split_flat_parts(&mut self) {
        if self.normals.iter().all(|&normal| normal == Vec3::ZERO) {
            self.normals.clear();
            return;
        }
        let bare = |normals: &[Vec3], triangle: &[u32; 3]| triangle.iter().any(|&v| normals[v as usize] == Vec3::ZERO);
        let flat: Vec<usize> = (0..self.triangles.len()).filter(|&t| bare(&self.normals, &self.triangles[t])).collect();
        if flat.is_empty() {
            return;
        }
        self.flat_parts = true;
        for t in flat {
            let corners = self.triangles[t].map(|vertex| vertex as usize);
            let [a, b, c] = corners.map(|vertex| self.positions[vertex]);
            let normal = (b - a).cross(c - a).normalize_or(DVec3::Y).as_vec3();
            self.triangles[t] = corners.map(|vertex| {
                let copy = self.positions.len() as u32;
                self.positions.push(self.positions[vertex]);
                let own = self.normals[vertex];
                self.normals.push(if own == Vec3::ZERO { normal } else { own });
                fn twice<T: Copy>(list: &mut Vec<T>, vertex: usize) {
                    if let Some(&value) = list.get(vertex) {
                        list.push(value);
                    }
                }
                twice(&mut self.uvs, vertex);
                twice(&mut self.uvs2, vertex);
                twice(&mut self.colors, vertex);
                twice(&mut self.tangents, vertex);
                copy
            });
        }
        self.leave_out_unused();
    }
}
