//! The primitives of a mesh as one list of triangles.
//!
//! Strips and fans become triangles; points and lines are only counted. Vertices that primitives share stay shared. A
//! primitive without normals is flat-shaded, as the specification requires.
//!
//! Source: Khronos, "glTF 2.0 Specification", §3.7.2 (meshes).

use crate::error::gltf::{GltfProblem, Located, item, place};
use crate::gltf::document::Document;
use crate::gltf::json;
use crate::gltf::vertices::{Deformation, NO_UV, Vertices};
use crate::model::unused::{keep, renumber};
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::collections::{BTreeMap, HashMap};

/// Identity of a slot: its material, and its materials by variant.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct SlotKey {
    /// `None`: the default material.
    pub material: Option<u32>,
    /// Material by index of the variant.
    pub variants: BTreeMap<u32, u32>,
}

/// The triangles of a mesh. Lists of vertex attributes are empty or as long as `positions`.
#[derive(Debug, Default)]
pub(crate) struct Triangles {
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
    /// Number of triangles with a corner that does not exist or is not finite.
    pub torn: usize,
    /// Primitives and attributes that are broken.
    pub omitted: Vec<(String, Located)>,
    /// Number of normals, tangents and texture coordinates that were not finite.
    pub not_finite: usize,
    /// Whether some triangles had normals and others had none.
    pub flat_parts: bool,
}

impl Document {
    pub(crate) fn mesh(&self, index: u32) -> Result<&json::Mesh, Located> {
        item(&self.root.meshes, "meshes", index).map_err(|problem| (place("meshes", index), problem))
    }

    /// Number of vertices and indices of a mesh, as its accessors state them: of those that are built, and of those that
    /// remain, since vertices that no index uses are left out.
    pub(crate) fn numbers_of(&self, mesh: u32) -> (u64, u64) {
        let most = self.most_elements();
        let count = |accessor: Option<u32>| {
            // More than can be, and data that is missing, are told when they are read.
            let accessor = accessor.and_then(|accessor| self.root.accessors.get(accessor as usize));
            let accessor = accessor.filter(|accessor| accessor.buffer_view.is_none_or(|view| self.view(view).is_ok()));
            accessor.map_or(0, |accessor| accessor.count.min(most))
        };
        let primitives = self.root.meshes.get(mesh as usize).map_or(&[][..], |mesh| &mesh.primitives);
        // Primitives with the same attributes share their vertices.
        let mut sets: HashMap<_, (u64, u64)> = HashMap::new();
        for primitive in primitives {
            let vertices = count(primitive.attributes.get("POSITION").copied());
            let indices = primitive.indices.map_or(vertices, |indices| count(Some(indices)));
            let set = sets.entry((&primitive.attributes, &primitive.targets[..])).or_insert((vertices, 0));
            set.1 = set.1.saturating_add(indices);
        }
        sets.into_values().fold((0, 0), |(built, kept), (vertices, indices)| {
            let of = |vertices: u64| vertices.saturating_add(indices);
            (built.saturating_add(of(vertices)), kept.saturating_add(of(vertices.min(indices))))
        })
    }

    /// All triangles of a mesh. Broken primitives and attributes are left out.
    ///
    /// # Errors
    /// If there is no such mesh.
    pub(crate) fn triangles(&self, mesh: u32, deformation: &Deformation) -> Result<Triangles, Located> {
        let json = self.mesh(mesh)?;
        let mut found = Triangles::default();
        let mut known = Known::default();
        for (i, primitive) in json.primitives.iter().enumerate() {
            let part = format!("{}.{}", place("meshes", mesh), place("primitives", i));
            if let Err(located) = self.add_primitive(primitive, deformation, &part, &mut known, &mut found) {
                found.omitted.push((part, located));
            }
        }
        found.leave_out_unused();
        found.split_flat_parts();
        Ok(found)
    }

    fn add_primitive<'a>(
        &'a self,
        primitive: &'a json::Primitive,
        deformation: &Deformation,
        part: &str,
        known: &mut Known<'a>,
        found: &mut Triangles,
    ) -> Result<(), Located> {
        let here = |problem| (part.to_owned(), problem);
        let mode = primitive.mode.unwrap_or(4);
        if mode < 4 {
            found.points_or_lines += 1;
            return Ok(());
        }
        if mode > 6 {
            let (what, found, expected) = ("mode", mode.to_string(), "0 to 6");
            return Err(here(GltfProblem::Value { what, found, expected }));
        }
        let key = (&primitive.attributes, &primitive.targets[..]);
        let (first, count) = match known.vertices.get(&key) {
            Some(&range) => range,
            None => {
                let vertices = self.vertices(primitive, deformation, part, &mut found.omitted)?;
                let range = (found.positions.len() as u32, vertices.positions.len() as u32);
                let total = found.positions.len() + vertices.positions.len();
                if u32::try_from(total).is_err() {
                    return Err(here(GltfProblem::Count { count: total as u64 }));
                }
                found.append(vertices);
                known.vertices.insert(key, range);
                range
            }
        };
        let indices = match primitive.indices {
            Some(accessor) => self.indices(accessor)?,
            None => (0..count).collect(),
        };
        let slot_key = SlotKey { material: primitive.material, variants: variants_of(primitive) };
        let next = known.slots.len();
        let slot = match known.slots.get(&slot_key) {
            Some(&slot) => slot,
            None => {
                let slot = u16::try_from(next).map_err(|_| here(GltfProblem::Count { count: next as u64 }))?;
                known.slots.insert(slot_key.clone(), slot);
                found.keys.push(slot_key);
                found.has_tangents.push(true);
                slot
            }
        };
        found.has_tangents[slot as usize] &= primitive.attributes.contains_key("TANGENT");
        let before = (found.triangles.len(), found.torn);
        let corner = |i: usize| indices[i];
        let mut torn = None;
        let mut add = |corners: [u32; 3]| {
            let [a, b, c] = corners;
            // The maximum of an index type means primitive restart in other APIs and is not allowed in glTF.
            let is_torn = |&c: &u32| c >= count || !found.positions[(first + c) as usize].is_finite();
            if a == b || b == c || c == a {
                found.degenerate += 1;
            } else if let Some(corner) = corners.into_iter().find(is_torn) {
                found.torn += 1;
                torn.get_or_insert(corner);
            } else {
                found.triangles.push(corners.map(|corner| first + corner));
            }
        };
        let last = indices.len().saturating_sub(2);
        match mode {
            4 => (0..indices.len() / 3).for_each(|t| add([corner(3 * t), corner(3 * t + 1), corner(3 * t + 2)])),
            // Every other triangle of a strip is reversed.
            5 => (0..last).for_each(|t| add([corner(t), corner(t + 1 + t % 2), corner(t + 2 - t % 2)])),
            _ => (0..last).for_each(|t| add([corner(t + 1), corner(t + 2), corner(0)])),
        }
        let added = found.triangles.len() - before.0;
        found.slots.extend(std::iter::repeat_n(slot, added));
        match (torn, primitive.attributes.get("POSITION")) {
            (Some(index), Some(position)) if added == 0 => {
                found.torn = before.1;
                Err(match index < count {
                    true => (place("accessors", position), GltfProblem::NotFinite { element: u64::from(index) }),
                    false => (format!("{part}.indices"), GltfProblem::Vertex { index, count: count as usize }),
                })
            }
            _ => Ok(()),
        }
    }
}

/// What the primitives of a mesh share.
#[derive(Default)]
struct Known<'a> {
    slots: HashMap<SlotKey, u16>,
    /// First vertex and number of vertices of each set of attributes.
    vertices: HashMap<(&'a BTreeMap<String, u32>, &'a [BTreeMap<String, u32>]), (u32, u32)>,
}

/// Material by index of the variant.
pub(crate) fn variants_of(primitive: &json::Primitive) -> BTreeMap<u32, u32> {
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
        join(&mut self.uvs, before, vertices.uvs, count, NO_UV);
        join(&mut self.uvs2, before, vertices.uvs2, count, NO_UV);
        join(&mut self.colors, before, vertices.colors, count, [1.0; 4]);
        join(&mut self.tangents, before, vertices.tangents, count, Vec4::ZERO);
        self.not_finite += vertices.not_finite;
    }

    /// Removes unused vertices; the others keep their order.
    fn leave_out_unused(&mut self) {
        let Some(used) = renumber(&mut self.triangles, self.positions.len()) else { return };
        keep(&mut self.positions, &used);
        keep(&mut self.normals, &used);
        keep(&mut self.uvs, &used);
        keep(&mut self.uvs2, &used);
        keep(&mut self.colors, &used);
        keep(&mut self.tangents, &used);
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
