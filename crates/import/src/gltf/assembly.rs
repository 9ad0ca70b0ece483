//! The scene of a glTF file at a given time: placed meshes, lights and cameras.

use crate::error::gltf::{GltfProblem, Located, place};
use crate::gltf::animation::Pose;
use crate::gltf::cameras::GltfCamera;
use crate::gltf::document::Document;
use crate::gltf::lights::GltfLight;
use crate::gltf::nodes::Tree;
use firstlight_format::bounds;
use glam::DAffine3;
use std::collections::HashSet;

/// A mesh of a file in the pose of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct MeshKey {
    pub mesh: u32,
    /// The node whose skin or morph weights deform it.
    pub node: Option<u32>,
}

/// A mesh in the world.
#[derive(Clone, Debug)]
pub(crate) struct PlacedMesh {
    /// Name of the node, else of the mesh.
    pub name: Option<String>,
    pub key: MeshKey,
    pub world: DAffine3,
    pub node: u32,
    pub is_hidden: bool,
}

/// A light in the world; its axis is −z of its own coordinates.
#[derive(Clone, Debug)]
pub(crate) struct PlacedLight {
    /// Name of the node, else of the light.
    pub name: Option<String>,
    pub light: GltfLight,
    pub world: DAffine3,
    pub node: u32,
    pub is_hidden: bool,
}

/// The contents of the scene of a file.
#[derive(Debug, Default)]
pub(crate) struct Assembly {
    pub meshes: Vec<PlacedMesh>,
    pub lights: Vec<PlacedLight>,
    pub cameras: Vec<GltfCamera>,
}

/// The nodes of a file at a given time.
#[derive(Debug)]
pub(crate) struct Posed {
    pub(crate) pose: Pose,
    pub(crate) tree: Tree,
}

impl Document {
    /// The posed nodes of the file.
    ///
    /// - `at`: seconds; `None`: as stored in the file.
    pub(crate) fn posed(&self, at: Option<f64>) -> Posed {
        let pose = self.pose(at);
        let tree = self.placed_nodes(&pose);
        Posed { pose, tree }
    }

    /// All contents of the scene of the file. What refers to something that does not exist is left out.
    ///
    /// # Errors
    /// If there are more instances than a file of this size can have.
    pub(crate) fn assembly(&self, posed: &Posed) -> Result<Assembly, Located> {
        /// Equal meshes take no memory, but some time.
        const REPEATED: u64 = 4;
        let mut found = Assembly { cameras: self.cameras(&posed.tree), ..Assembly::default() };
        let moved = self.moved_nodes();
        let (mut places, mut repeated) = (HashSet::new(), 0_usize);
        for &node in &posed.tree.scene {
            let json = &self.root.nodes[node as usize];
            let part = |what: &str| format!("{}.{what}", place("nodes", node));
            let world = posed.tree.worlds[node as usize];
            let is_hidden = posed.tree.hidden[node as usize];
            let named = |name: &Option<String>| name.clone().filter(|name| !name.is_empty());
            let light = self.light_of(node).and_then(|light| match world.translation.abs().max_element() {
                far if far > bounds::MAX_COORDINATE && light.is_some() => Err((String::new(), GltfProblem::TooFar)),
                _ => Ok(light),
            });
            if let Some(Some(light)) = self.omissions.kept(&part("light"), light) {
                let name = named(&json.name).or_else(|| light.name.clone());
                found.lights.push(PlacedLight { name, light, world, node, is_hidden });
            }
            let Some(mesh) = json.mesh else { continue };
            let Some(json_mesh) = self.omissions.kept(&part("mesh"), self.mesh(mesh)) else { continue };
            let name = named(&json.name).or_else(|| named(&json_mesh.name));
            let has_targets = json_mesh.primitives.iter().any(|primitive| !primitive.targets.is_empty());
            let is_weighed = json.weights.is_some() || posed.pose.weights(node).is_some();
            let moves = json.skin.is_some() || (has_targets && is_weighed);
            let key = MeshKey { mesh, node: moves.then_some(node) };
            // The joints of a skin transform to the world already.
            let world = if json.skin.is_some() { DAffine3::IDENTITY } else { world };
            let instances = self.omissions.kept(&part("instances"), self.instances(node));
            for instance in instances.unwrap_or_else(|| vec![DAffine3::IDENTITY]) {
                let world = world * instance;
                // Where nothing moves, a mesh at the place of an equal one shows nothing more, and costs each ray as much.
                let here = match moved[node as usize] {
                    true => (key, is_hidden, Some(node), bits(&instance)),
                    false => (key, is_hidden, None, bits(&world)),
                };
                if found.meshes.len() as u64 + repeated as u64 / REPEATED >= self.most_elements() {
                    let problem = GltfProblem::Count { count: found.meshes.len() as u64 + 1 };
                    return Err((place("nodes", node), problem));
                }
                if !places.insert(here) {
                    repeated += 1;
                    continue;
                }
                found.meshes.push(PlacedMesh { name: name.clone(), key, world, node, is_hidden });
            }
        }
        if !found.meshes.is_empty() && found.meshes.iter().all(|placed| placed.is_hidden) {
            found.meshes.iter_mut().for_each(|placed| placed.is_hidden = false);
            self.omissions.tell("hidden meshes", "all of its meshes are hidden: they are shown".to_owned());
        }
        if repeated > 0 {
            let meshes = if repeated == 1 { "mesh lies" } else { "meshes lie" };
            let sentence = format!("{repeated} {meshes} exactly where an equal one is already: left out");
            self.omissions.tell("equal meshes", sentence);
        }
        Ok(found)
    }
}

fn bits(transform: &DAffine3) -> [u64; 12] {
    transform.to_cols_array().map(f64::to_bits)
}
