//! The scene of a glTF file at a given time: placed meshes, lights and cameras.

use super::animation::Pose;
use super::cameras::GltfCamera;
use super::document::Document;
use super::error::{GltfProblem, Located, place};
use super::lights::GltfLight;
use super::nodes::Tree;
use glam::DAffine3;

/// A mesh of a file in the pose of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::scene) struct MeshKey {
    pub mesh: u32,
    /// The node whose skin or morph weights deform it.
    pub node: Option<u32>,
}

/// A mesh in the world.
#[derive(Clone, Debug)]
pub(in crate::scene) struct PlacedMesh {
    /// Name of the node, else of the mesh.
    pub name: Option<String>,
    pub key: MeshKey,
    pub world: DAffine3,
    pub node: u32,
}

/// A light in the world; its axis is −z of its own coordinates.
#[derive(Clone, Debug)]
pub(in crate::scene) struct PlacedLight {
    /// Name of the node, else of the light.
    pub name: Option<String>,
    pub light: GltfLight,
    pub world: DAffine3,
    pub node: u32,
}

/// The contents of the scene of a file.
#[derive(Debug, Default)]
pub(in crate::scene) struct Assembly {
    pub meshes: Vec<PlacedMesh>,
    pub lights: Vec<PlacedLight>,
    pub cameras: Vec<GltfCamera>,
    /// Omissions, one sentence each.
    pub warnings: Vec<String>,
}

/// The nodes of a file at a given time.
#[derive(Debug)]
pub(in crate::scene) struct Posed {
    pub(super) pose: Pose,
    pub(super) tree: Tree,
}

impl Document {
    /// The posed nodes of the file.
    ///
    /// - `at`: seconds; `None`: as stored in the file.
    ///
    /// # Errors
    /// If the nodes do not form trees, or an animation is invalid.
    pub(in crate::scene) fn posed(&self, at: Option<f64>) -> Result<Posed, Located> {
        let pose = self.pose(at)?;
        let tree = self.placed_nodes(&pose)?;
        Ok(Posed { pose, tree })
    }

    /// All contents of the scene of the file.
    ///
    /// # Errors
    /// If a node refers to something that does not exist.
    pub(in crate::scene) fn assembly(&self, posed: &Posed) -> Result<Assembly, Located> {
        let mut found = Assembly { cameras: self.cameras(&posed.tree)?, ..Assembly::default() };
        for &node in &posed.tree.scene {
            let json = self.node(node)?;
            let world = posed.tree.worlds[node as usize];
            let named = |name: &Option<String>| name.clone().filter(|name| !name.is_empty());
            if let Some(light) = self.light_of(node)? {
                let name = named(&json.name).or_else(|| light.name.clone());
                found.lights.push(PlacedLight { name, light, world, node });
            }
            let Some(mesh) = json.mesh else { continue };
            let name = named(&json.name).or_else(|| self.root.meshes.get(mesh as usize).and_then(|m| named(&m.name)));
            let has_targets = self.mesh(mesh)?.primitives.iter().any(|primitive| !primitive.targets.is_empty());
            let is_weighed = json.weights.is_some() || posed.pose.weights(node).is_some();
            let moves = json.skin.is_some() || (has_targets && is_weighed);
            let key = MeshKey { mesh, node: moves.then_some(node) };
            // The joints of a skin transform to the world already.
            let world = if json.skin.is_some() { DAffine3::IDENTITY } else { world };
            for instance in self.instances(node)? {
                if found.meshes.len() as u64 >= self.most_elements() {
                    let problem = GltfProblem::Count { count: found.meshes.len() as u64 + 1 };
                    return Err((place("nodes", node), problem));
                }
                found.meshes.push(PlacedMesh { name: name.clone(), key, world: world * instance, node });
            }
        }
        Ok(found)
    }
}
