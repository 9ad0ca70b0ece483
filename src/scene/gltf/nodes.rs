//! The node hierarchy, flattened: all nodes of the scene with their world transforms.
//!
//! Trees may be arbitrarily deep, so they are traversed with an explicit stack. Transforms are multiplied in `f64`.

use super::animation::Pose;
use super::document::Document;
use super::error::{GltfProblem, Located, place};
use super::json;
use glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};

/// The nodes of a file, posed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Tree {
    /// The nodes of the displayed scene, parents before children.
    pub scene: Vec<u32>,
    /// From the coordinates of each node of the file to the world, metres.
    pub worlds: Vec<DAffine3>,
}

impl Document {
    pub(super) fn node(&self, index: u32) -> Result<&json::Node, Located> {
        let count = self.root.nodes.len();
        let problem = GltfProblem::Index { list: "nodes", index, count };
        self.root.nodes.get(index as usize).ok_or((place("nodes", index), problem))
    }

    /// The roots of the displayed scene: those of the default scene, else of the first scene, else all nodes without a
    /// parent.
    fn roots(&self, parents: &[Option<u32>]) -> Result<Vec<u32>, Located> {
        let scenes = &self.root.scenes;
        match self.root.scene.map_or(0, |scene| scene) {
            0 if scenes.is_empty() => {
                let is_root = |&(_, parent): &(usize, &Option<u32>)| parent.is_none();
                Ok(parents.iter().enumerate().filter(is_root).map(|(node, _)| node as u32).collect())
            }
            scene => match scenes.get(scene as usize) {
                Some(scene) => Ok(scene.nodes.clone()),
                None => {
                    let problem = GltfProblem::Index { list: "scenes", index: scene, count: scenes.len() };
                    Err(("scene".to_owned(), problem))
                }
            },
        }
    }

    /// Checks that no node has two parents, and returns the parent of each.
    fn parents(&self) -> Result<Vec<Option<u32>>, Located> {
        let count = self.root.nodes.len();
        let mut parents = vec![None; count];
        for (node, json) in self.root.nodes.iter().enumerate() {
            for &child in &json.children {
                let Some(parent) = parents.get_mut(child as usize) else {
                    let problem = GltfProblem::Index { list: "nodes", index: child, count };
                    return Err((format!("{}.children", place("nodes", node)), problem));
                };
                if parent.replace(node as u32).is_some() {
                    return Err((place("nodes", child), GltfProblem::NotTree));
                }
            }
        }
        Ok(parents)
    }

    /// All nodes of the scene in traversal order, and the world transform of every node of the file, in the scene or
    /// not.
    pub(super) fn placed_nodes(&self, pose: &Pose) -> Result<Tree, Located> {
        let parents = self.parents()?;
        let count = parents.len();
        let mut worlds = vec![DAffine3::IDENTITY; count];
        // Every node has at most one parent: nodes that cannot be reached from a root are on a cycle.
        let mut seen = vec![false; count];
        let mut todo: Vec<(u32, DAffine3)> = (0..count as u32)
            .filter(|&node| parents[node as usize].is_none())
            .map(|n| (n, DAffine3::IDENTITY))
            .collect();
        while let Some((index, above)) = todo.pop() {
            let world = above * self.local(index, pose)?;
            if !world.is_finite() {
                return Err((place("nodes", index), GltfProblem::NotFinite { element: 0 }));
            }
            worlds[index as usize] = world;
            seen[index as usize] = true;
            todo.extend(self.root.nodes[index as usize].children.iter().map(|&child| (child, world)));
        }
        if let Some(node) = seen.iter().position(|seen| !seen) {
            return Err((place("nodes", node), GltfProblem::NotTree));
        }
        let roots = self.roots(&parents)?;
        let mut is_root = vec![false; count];
        for &root in &roots {
            self.node(root)?;
            if std::mem::replace(&mut is_root[root as usize], true) || parents[root as usize].is_some() {
                return Err((place("nodes", root), GltfProblem::NotTree));
            }
        }
        let mut scene = Vec::new();
        let mut todo: Vec<u32> = roots.into_iter().rev().collect();
        while let Some(node) = todo.pop() {
            scene.push(node);
            todo.extend(self.root.nodes[node as usize].children.iter().rev());
        }
        Ok(Tree { scene, worlds })
    }

    /// From the coordinates of the node to those of its parent.
    fn local(&self, index: u32, pose: &Pose) -> Result<DAffine3, Located> {
        let node = self.node(index)?;
        let here =
            |what, found: String, expected| (place("nodes", index), GltfProblem::Value { what, found, expected });
        let posed = pose.of(index);
        if let Some(matrix) = node.matrix.filter(|_| posed.is_none()) {
            let matrix = DMat4::from_cols_array(&matrix);
            if matrix.row(3) != DVec4::W {
                let found = matrix.row(3).to_string();
                return Err(here("the last row of the matrix", found, "0, 0, 0, 1"));
            }
            return Ok(DAffine3::from_mat4(matrix));
        }
        let posed = posed.copied().unwrap_or_default();
        let translation = posed.translation.or(node.translation.map(DVec3::from)).unwrap_or(DVec3::ZERO);
        let scale = posed.scale.or(node.scale.map(DVec3::from)).unwrap_or(DVec3::ONE);
        let rotation = posed.rotation.or(node.rotation.map(DQuat::from_array)).unwrap_or(DQuat::IDENTITY);
        // Usually of unit length up to rounding.
        let length = rotation.length();
        if !(length > 0.0 && length.is_finite()) {
            return Err(here("the rotation", rotation.to_string(), "a quaternion of length 1"));
        }
        Ok(DAffine3::from_scale_rotation_translation(scale, rotation / length, translation))
    }
}
