//! The whole scene of a file as one mesh, for uses that need a single mesh.

use crate::error::gltf::{GltfError, GltfProblem, Located, place};
use crate::gltf::assembly::MeshKey;
use crate::gltf::document::{Document, ReadOptions};
use crate::gltf::mesh::BuiltMesh;
use crate::model::imported::{ImportedModel, ModelOptions};
use crate::model::material::ImportedMaterial;
use firstlight_files::warnings::Warnings;
use firstlight_mesh::Mesh;
use glam::{DMat3, DVec3, Vec3};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

/// All meshes of the scene of a file, as stored, in world coordinates.
///
/// # Errors
/// If the file cannot be read, or has no surface area.
pub(crate) fn load_gltf_with(path: &Path, options: &ModelOptions) -> Result<ImportedModel, Box<GltfError>> {
    let read = ReadOptions { max_bytes: options.max_bytes, ..ReadOptions::default() };
    let document = Document::read(path, read).map_err(Box::new)?;
    document.baked(options).map_err(|located| Box::new(document.error(located)))
}

impl Document {
    /// See [`load_gltf_with`].
    pub(crate) fn baked(&self, options: &ModelOptions) -> Result<ImportedModel, Located> {
        let whole = |problem| (String::new(), problem);
        let posed = self.posed(None);
        let assembly = self.assembly(&posed)?;
        let mut built: HashMap<MeshKey, Option<BuiltMesh>> = HashMap::new();
        let (mut positions, mut triangles): (Vec<DVec3>, Vec<[u32; 3]>) = (Vec::new(), Vec::new());
        let mut joined = Mesh::default();
        let mut materials: Vec<Option<u32>> = Vec::new();
        let mut warnings = Vec::new();
        let mut normals_from_file = true;
        let (limit, mut room) = (self.most_numbers(), self.most_own_numbers());
        for placed in assembly.meshes.iter().filter(|placed| !placed.is_hidden) {
            if let Entry::Vacant(entry) = built.entry(placed.key) {
                let (built, kept) = self.numbers_of(placed.key.mesh);
                let left = room.checked_sub(kept).filter(|_| built <= self.most_own_numbers());
                room = left.ok_or_else(|| whole(GltfProblem::TooLarge { limit: self.most_own_numbers() }))?;
                let node = placed.key.node.map(|node| (node, &posed.tree, &posed.pose));
                let mesh = self.built_mesh(placed.key.mesh, node, &options.normals);
                let mesh = self.omissions.kept(&place("meshes", placed.key.mesh), mesh);
                warnings.extend(mesh.iter().flat_map(|mesh| mesh.warnings.iter().cloned()));
                entry.insert(mesh);
            }
            let Some(Some(BuiltMesh { mesh, keys, .. })) = built.get(&placed.key) else { continue };
            let first = positions.len();
            let total = (first + mesh.positions.len() + 3 * (triangles.len() + mesh.triangles.len())) as u64;
            if total > limit || u32::try_from(first + mesh.positions.len()).is_err() {
                return Err(whole(GltfProblem::TooLarge { limit }));
            }
            let point = |p: &Vec3| placed.world.transform_point3(p.as_dvec3() + mesh.center);
            positions.extend(mesh.positions.iter().map(point));
            // Normals are transformed by the cofactor matrix: the inverse transpose up to a factor.
            let m = placed.world.matrix3;
            let is_mirrored = m.determinant() < 0.0;
            let sign = if is_mirrored { -1.0 } else { 1.0 };
            let cofactors =
                DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
            let turn = |n: &Vec3| (cofactors * n.as_dvec3() * sign).normalize_or(DVec3::Y).as_vec3();
            normals_from_file &= !mesh.normals.is_empty();
            joined.normals.extend(mesh.normals.iter().map(turn));
            let whole_uvs = mesh.uvs.len() == mesh.positions.len();
            joined.uvs.extend_from_slice(if whole_uvs { &mesh.uvs } else { &[] });
            joined.uvs.resize(positions.len(), glam::Vec2::ZERO);
            let mut slots = Vec::with_capacity(keys.len());
            for key in keys {
                let known = materials.iter().position(|material| *material == key.material);
                let slot = known.unwrap_or_else(|| {
                    materials.push(key.material);
                    materials.len() - 1
                });
                slots.push(u16::try_from(slot).unwrap_or(u16::MAX));
            }
            let slot = |t: usize| slots[mesh.slots.get(t).map_or(0, |&slot| slot as usize)];
            joined.slots.extend((0..mesh.triangles.len()).map(slot));
            triangles.extend(mesh.triangles.iter().map(|corners| {
                let [a, b, c] = corners.map(|corner| corner + first as u32);
                if is_mirrored { [a, c, b] } else { [a, b, c] }
            }));
        }
        if triangles.is_empty() {
            return Err(self.omissions.nothing_left());
        }
        let mut mesh = Mesh::from_f64(&positions, triangles).map_err(|error| whole(error.into()))?;
        mesh.slots = if materials.len() > 1 { joined.slots } else { Vec::new() };
        if joined.uvs.iter().any(|uv| *uv != glam::Vec2::ZERO) {
            mesh.uvs = joined.uvs;
        }
        if normals_from_file {
            mesh.normals = joined.normals;
        }
        mesh.validate().map_err(|error| whole(error.into()))?;
        let surfaces = self.surfaces("");
        let names = |material: &Option<u32>| {
            let [r, g, b, _] = self.material(*material).base_color;
            let name = surfaces.materials[surfaces.index(*material)].name.clone();
            ImportedMaterial { name, diffuse: Some(Vec3::new(r, g, b)), ..ImportedMaterial::default() }
        };
        Ok(ImportedModel {
            mesh,
            materials: materials.iter().map(names).collect(),
            libraries: self.files[1..].to_vec(),
            normals_from_file,
            polygons: 0,
            warnings: self.omissions.sentences().into_iter().chain(warnings).collect(),
            material_warnings: Warnings::default(),
        })
    }
}
