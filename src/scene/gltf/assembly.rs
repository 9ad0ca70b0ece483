//! The scene of a glTF file at a moment: which meshes stand where, lights and cameras.

use super::animation::Pose;
use super::cameras::GltfCamera;
use super::document::Document;
use super::error::{GltfProblem, Located, place};
use super::lights::GltfLight;
use super::nodes::Tree;
use glam::DAffine3;

/// Which mesh of a file, and whose pose it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::scene) struct MeshKey {
    pub mesh: u32,
    /// The node whose skin or weights move its vertices.
    pub node: Option<u32>,
}

/// A mesh in the world.
#[derive(Clone, Debug)]
pub(in crate::scene) struct PlacedMesh {
    /// Of the node, else of the mesh.
    pub name: Option<String>,
    pub key: MeshKey,
    pub world: DAffine3,
}

/// A light in the world: it shines along −z of its coordinates.
#[derive(Clone, Debug)]
pub(in crate::scene) struct PlacedLight {
    /// Of the node, else of the light.
    pub name: Option<String>,
    pub light: GltfLight,
    pub world: DAffine3,
}

/// What a file shows.
#[derive(Debug, Default)]
pub(in crate::scene) struct Assembly {
    pub meshes: Vec<PlacedMesh>,
    pub lights: Vec<PlacedLight>,
    pub cameras: Vec<GltfCamera>,
    /// What was left out, one sentence each.
    pub warnings: Vec<String>,
}

/// The nodes of a file at a moment.
#[derive(Debug)]
pub(in crate::scene) struct Posed {
    pub(super) pose: Pose,
    pub(super) tree: Tree,
}

impl Document {
    /// The nodes of the file.
    ///
    /// - `at`: seconds; without it, what the file stores.
    ///
    /// # Errors
    /// When the nodes are no trees, or an animation is wrong.
    pub(in crate::scene) fn posed(&self, at: Option<f64>) -> Result<Posed, Located> {
        let pose = self.pose(at)?;
        let tree = self.placed_nodes(&pose)?;
        Ok(Posed { pose, tree })
    }

    /// Everything that the scene of the file shows.
    ///
    /// # Errors
    /// When a node names what does not exist.
    pub(in crate::scene) fn assembly(&self, posed: &Posed) -> Result<Assembly, Located> {
        let mut found = Assembly { cameras: self.cameras(&posed.tree)?, ..Assembly::default() };
        for &node in &posed.tree.scene {
            let json = self.node(node)?;
            let world = posed.tree.worlds[node as usize];
            let named = |name: &Option<String>| name.clone().filter(|name| !name.is_empty());
            if let Some(light) = self.light_of(node)? {
                let name = named(&json.name).or_else(|| light.name.clone());
                found.lights.push(PlacedLight { name, light, world });
            }
            let Some(mesh) = json.mesh else { continue };
            let name = named(&json.name).or_else(|| self.root.meshes.get(mesh as usize).and_then(|m| named(&m.name)));
            let has_targets = self.mesh(mesh)?.primitives.iter().any(|primitive| !primitive.targets.is_empty());
            let is_weighed = json.weights.is_some() || posed.pose.weights(node).is_some();
            let moves = json.skin.is_some() || (has_targets && is_weighed);
            let key = MeshKey { mesh, node: moves.then_some(node) };
            // Joints lead a skinned mesh to the world.
            let world = if json.skin.is_some() { DAffine3::IDENTITY } else { world };
            for instance in self.instances(node)? {
                if found.meshes.len() as u64 >= self.most_elements() {
                    let problem = GltfProblem::Count { count: found.meshes.len() as u64 + 1 };
                    return Err((place("nodes", node), problem));
                }
                found.meshes.push(PlacedMesh { name: name.clone(), key, world: world * instance });
            }
        }
        Ok(found)
    }
}
