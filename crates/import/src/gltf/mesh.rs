//! From the triangles of a file to a checked [`Mesh`], with tangents if a material needs them.

use crate::error::gltf::{GltfProblem, Located, place};
use crate::gltf::animation::Pose;
use crate::gltf::assembly::{MeshKey, Posed};
use crate::gltf::document::Document;
use crate::gltf::nodes::Tree;
use crate::gltf::omissions::omission;
use crate::gltf::primitives::{SlotKey, Triangles};
use crate::gltf::skin::Joints;
use crate::gltf::vertices::{Deformation, NO_UV};
use crate::model::imported::{ModelNormals, has_area};
use firstlight_mesh::Mesh;
use glam::Vec4;

/// A mesh of a file.
#[derive(Debug)]
pub(crate) struct BuiltMesh {
    pub mesh: Mesh,
    /// One per slot.
    pub keys: Vec<SlotKey>,
    /// Omissions and replacements, one sentence each.
    pub warnings: Vec<String>,
}

impl Document {
    /// The posed mesh of this key.
    ///
    /// # Errors
    /// Like [`Self::built_mesh`].
    pub(crate) fn mesh_of(&self, key: MeshKey, posed: &Posed, normals: &ModelNormals) -> Result<BuiltMesh, Located> {
        self.built_mesh(key.mesh, key.node.map(|node| (node, &posed.tree, &posed.pose)), normals)
    }

    /// The mesh `index`, deformed by the morph weights and the skin of `node`; without a node, by the weights of the
    /// mesh.
    ///
    /// # Errors
    /// If it has no triangles or is invalid.
    pub(crate) fn built_mesh(
        &self,
        index: u32,
        node: Option<(u32, &Tree, &Pose)>,
        normals: &ModelNormals,
    ) -> Result<BuiltMesh, Located> {
        let json = self.mesh(index)?;
        let mut deformation = Deformation { weights: &json.weights, joints: None };
        let mut warnings = Vec::new();
        if let Some((node, tree, pose)) = node {
            let json = self.node(node)?;
            if let Some(weights) = pose.weights(node).or(json.weights.as_deref()) {
                deformation.weights = weights;
            }
            if let Some(skin) = json.skin {
                let (joints, problem) = self.joints_in(skin, tree);
                warnings.extend(problem.map(|located| omission(&place("skins", skin), &located)));
                deformation.joints = Some(Joints { joints, of_node: tree.worlds[node as usize] });
            }
        }
        let mut triangles = self.triangles(index, &deformation)?;
        let here = |problem| (place("meshes", index), problem);
        if triangles.triangles.is_empty() {
            let (lines, degenerate) = (triangles.points_or_lines > 0, triangles.degenerate > 0);
            return Err(match triangles.omitted.into_iter().next() {
                Some((_, located)) => located,
                None if degenerate => here(GltfProblem::NoArea),
                None if lines => here(GltfProblem::OnlyLines),
                None => here(GltfProblem::NoTriangles),
            });
        }
        warnings.extend(triangles.omitted.iter().map(|(part, located)| omission(part, located)));
        warnings.extend(triangles.warnings(&place("meshes", index)));
        let keys = std::mem::take(&mut triangles.keys);
        let has_tangents = std::mem::take(&mut triangles.has_tangents);
        let needs: Vec<bool> = keys
            .iter()
            .map(|key| {
                self.needs_tangents(key.material) || key.variants.values().any(|&each| self.needs_tangents(Some(each)))
            })
            .collect();
        let from_file = needs.iter().zip(&has_tangents).all(|(needs, has)| !needs || *has);
        let wrong = |error: firstlight_mesh::MeshError| here(GltfProblem::Mesh(error));
        let list = std::mem::take(&mut triangles.triangles);
        let mut mesh = Mesh::from_f64(&triangles.positions, list).map_err(wrong)?;
        if !mesh.triangles.iter().any(|&triangle| has_area(&mesh, triangle)) {
            return Err(here(GltfProblem::NoArea));
        }
        mesh.uvs = triangles.uvs;
        mesh.uvs2 = triangles.uvs2;
        mesh.colors = triangles.colors.into_iter().map(Vec4::from).collect();
        mesh.slots = if keys.len() > 1 { triangles.slots } else { Vec::new() };
        match normals {
            ModelNormals::FileOrComputed { .. } => mesh.normals = triangles.normals,
            ModelNormals::OfPositions => {
                let welding = firstlight_mesh::Welding::of_f64(&triangles.positions);
                mesh = mesh.with_normals_of_vertices(|vertex| welding.place[vertex as usize]);
            }
            ModelNormals::Ignore => {}
        }
        if needs.contains(&true) && *normals != ModelNormals::Ignore && !mesh.normals.is_empty() {
            let own = matches!(normals, ModelNormals::FileOrComputed { .. }) && from_file;
            if own && triangles.tangents.len() == mesh.positions.len() {
                // Vertices of materials that need no tangents may have none.
                let unit = |(tangent, normal): (&Vec4, &glam::Vec3)| match tangent.truncate() {
                    glam::Vec3::ZERO => normal.any_orthonormal_vector().extend(1.0),
                    _ => *tangent,
                };
                mesh.tangents = triangles.tangents.iter().zip(&mesh.normals).map(unit).collect();
            } else if mesh.uvs.is_empty() {
                warnings.push(format!("{}: has no texture coordinates for its tangents", place("meshes", index)));
            } else {
                mesh = mesh.with_tangents();
            }
        }
        // Otherwise the texture would be spread over each triangle.
        let used = keys.iter().flat_map(|key| key.variants.values().copied().map(Some).chain([key.material]));
        let sets = used.map(|material| self.uv_sets(material)).fold([false; 2], |a, b| [a[0] | b[0], a[1] | b[1]]);
        for (is_used, uvs) in sets.into_iter().zip([&mut mesh.uvs, &mut mesh.uvs2]) {
            if is_used && uvs.is_empty() {
                *uvs = vec![NO_UV; mesh.positions.len()];
            }
        }
        mesh.validate().map_err(wrong)?;
        Ok(BuiltMesh { mesh, keys, warnings })
    }
}

impl Triangles {
    fn warnings(&self, place: &str) -> Vec<String> {
        let mut warnings = Vec::new();
        let mut add = |count: usize, what: &str| {
            if count > 0 {
                warnings.push(format!("{place}: {count} {what}"));
            }
        };
        add(self.points_or_lines, "primitives of points or lines have no area and are left out");
        add(self.degenerate, "triangles use a vertex twice and were removed");
        add(self.torn, "triangles have a corner that does not exist, or is NaN or infinite, and were removed");
        add(self.not_finite, "normals, tangents or texture coordinates are no numbers and are 0");
        warnings
    }
}
