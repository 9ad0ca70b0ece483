//! The node hierarchy, flattened: all nodes of the scene with their world transforms.
//!
//! Trees may be arbitrarily deep, so they are traversed with an explicit stack. Transforms are multiplied in `f64`.

use crate::error::gltf::{GltfProblem, Located, item, place};
use crate::gltf::animation::Pose;
use crate::gltf::document::Document;
use crate::gltf::json;
use glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};
use std::sync::{Arc, OnceLock};

/// The nodes of a file, posed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Tree {
    /// The nodes of the displayed scene, parents before children.
    pub scene: Vec<u32>,
    /// From the coordinates of each node of the file to the world, metres.
    pub worlds: Vec<DAffine3>,
    /// Whether each node of the file is hidden, by itself or by one above it.
    pub hidden: Vec<bool>,
    /// From mesh coordinates to the world by each joint of each skin, once something needs it.
    pub skins: Vec<OnceLock<Arc<[DAffine3]>>>,
}

impl Document {
    pub(crate) fn node(&self, index: u32) -> Result<&json::Node, Located> {
        item(&self.root.nodes, "nodes", index).map_err(|problem| (place("nodes", index), problem))
    }

    /// The roots of the displayed scene: those of the default scene, else of the first scene, else all nodes without a
    /// parent.
    fn roots(&self) -> Vec<u32> {
        let count = self.root.nodes.len();
        let scenes = &self.root.scenes;
        let wanted = self.root.scene.unwrap_or(0);
        let scene = scenes.get(wanted as usize).or_else(|| {
            let problem = GltfProblem::Index { list: "scenes", index: wanted, count: scenes.len() };
            // Without a list, the scene is the whole file.
            scenes.first().inspect(|_| {
                self.omissions.kept::<()>("scene", Err((String::new(), problem)));
            })
        });
        let is_node = |part: String, index: u32| {
            let problem = GltfProblem::Index { list: "nodes", index, count };
            let node = if (index as usize) < count { Ok(index) } else { Err((String::new(), problem)) };
            self.omissions.kept(&part, node)
        };
        match scene {
            Some(scene) => scene
                .nodes
                .iter()
                .enumerate()
                .filter_map(|(i, &node)| is_node(format!("scenes[{wanted}].nodes[{i}]"), node))
                .collect(),
            None => self.nodes_without_parent(),
        }
    }

    fn nodes_without_parent(&self) -> Vec<u32> {
        let count = self.root.nodes.len();
        let mut is_child = vec![false; count];
        for &child in self.root.nodes.iter().flat_map(|node| &node.children) {
            if let Some(is_child) = is_child.get_mut(child as usize) {
                *is_child = true;
            }
        }
        (0..count as u32).filter(|&node| !is_child[node as usize]).collect()
    }

    /// All nodes of the scene in traversal order, and the world transform of every node of the file, in the scene or
    /// not.
    ///
    /// A node has one place: that below the first parent through which it is reached. Roots that hang from other nodes
    /// of the scene are no roots; what is outside of the scene has no say in it.
    pub(crate) fn placed_nodes(&self, pose: &Pose) -> Tree {
        let count = self.root.nodes.len();
        let mut tree = Tree {
            scene: Vec::new(),
            worlds: vec![DAffine3::IDENTITY; count],
            hidden: vec![false; count],
            skins: vec![OnceLock::new(); self.root.skins.len()],
        };
        let mut is_placed = vec![false; count];
        let roots = self.roots();
        let (below, top): (Vec<u32>, Vec<u32>) = {
            let hangs = self.descendants(&roots);
            roots.iter().partition(|&&root| hangs[root as usize])
        };
        for root in top {
            // A root may be named twice.
            if !is_placed[root as usize] {
                self.place_below(root, pose, &mut tree, &mut is_placed, true);
            }
        }
        for root in below {
            let part = place("nodes", root);
            let why = match is_placed[root as usize] {
                true => "is a root of the scene and a child as well: it is placed as a child",
                false => "is its own descendant: it is placed as a root",
            };
            self.omissions.tell(&part, format!("{part} {why}"));
            if !is_placed[root as usize] {
                self.place_below(root, pose, &mut tree, &mut is_placed, true);
            }
        }
        // Joints of skins need not be in the scene.
        let others = self.nodes_without_parent().into_iter().chain(0..count as u32);
        for node in others {
            if !is_placed[node as usize] {
                self.place_below(node, pose, &mut tree, &mut is_placed, false);
            }
        }
        tree
    }

    /// Whether each node is below one of these.
    fn descendants(&self, roots: &[u32]) -> Vec<bool> {
        let nodes = &self.root.nodes;
        let mut is_below = vec![false; nodes.len()];
        let mut todo: Vec<u32> = roots.to_vec();
        while let Some(node) = todo.pop() {
            for &child in &nodes[node as usize].children {
                if let Some(is_below) = is_below.get_mut(child as usize).filter(|is_below| !**is_below) {
                    *is_below = true;
                    todo.push(child);
                }
            }
        }
        is_below
    }

    /// Places a node and all below it that have no place yet.
    ///
    /// - `is_shown`: whether they belong to the scene; nothing is told about others.
    fn place_below(&self, root: u32, pose: &Pose, tree: &mut Tree, is_placed: &mut [bool], is_shown: bool) {
        let count = is_placed.len();
        let mut todo = vec![(root, DAffine3::IDENTITY, false)];
        while let Some((index, above, is_above_hidden)) = todo.pop() {
            let part = place("nodes", index);
            if std::mem::replace(&mut is_placed[index as usize], true) {
                if is_shown {
                    let sentence = format!("{part} is a child more than once: it is placed below one parent only");
                    self.omissions.tell(&part, sentence);
                }
                continue;
            }
            let world = above * self.local(index, pose, is_shown);
            if !world.is_finite() {
                if is_shown {
                    let problem = GltfProblem::NotFinite { element: 0 };
                    self.omissions.kept::<()>(&part, Err((String::new(), problem)));
                }
                continue;
            }
            let is_hidden = is_above_hidden || self.root.nodes[index as usize].is_hidden();
            tree.worlds[index as usize] = world;
            tree.hidden[index as usize] = is_hidden;
            if is_shown {
                tree.scene.push(index);
            }
            for (i, &child) in self.root.nodes[index as usize].children.iter().enumerate().rev() {
                if (child as usize) < count {
                    todo.push((child, world, is_hidden));
                } else if is_shown {
                    let problem = GltfProblem::Index { list: "nodes", index: child, count };
                    self.omissions.kept::<()>(&format!("{part}.children[{i}]"), Err((String::new(), problem)));
                }
            }
        }
    }

    /// From the coordinates of the node to those of its parent.
    ///
    /// - `is_told`: whether repairs are told.
    fn local(&self, index: u32, pose: &Pose, is_told: bool) -> DAffine3 {
        /// Largest rounding error of the last row of a matrix.
        const ROUNDING: f64 = 1e-4;
        let node = &self.root.nodes[index as usize];
        let tell = |what: &str| {
            let part = place("nodes", index);
            if is_told {
                self.omissions.tell(&part, format!("{part}: {what}"));
            }
        };
        let posed = pose.of(index);
        if let Some(matrix) = node.matrix.filter(|_| posed.is_none()) {
            let matrix = DMat4::from_cols_array(&matrix);
            let last = matrix.row(3);
            if !last.abs_diff_eq(DVec4::W, ROUNDING) {
                tell(&format!("the last row of its matrix is {last}: 0, 0, 0, 1 is used"));
            }
            return DAffine3::from_mat4(matrix);
        }
        let posed = posed.copied().unwrap_or_default();
        let translation = posed.translation.or(node.translation.map(DVec3::from)).unwrap_or(DVec3::ZERO);
        let scale = posed.scale.or(node.scale.map(DVec3::from)).unwrap_or(DVec3::ONE);
        let rotation = posed.rotation.or(node.rotation.map(DQuat::from_array)).unwrap_or(DQuat::IDENTITY);
        // Usually of unit length up to rounding.
        let length = rotation.length();
        let rotation = if length > 0.0 && length.is_finite() {
            rotation / length
        } else {
            tell(&format!("its rotation is {rotation}, which is no turn: it is not rotated"));
            DQuat::IDENTITY
        };
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    }
}
