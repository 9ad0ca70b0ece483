//! Skinning: vertices that follow joints.
//!
//! Source: Khronos, "glTF 2.0 Specification", §3.7.3 (skins). The transform of the node of a skinned mesh is ignored:
//! joints transform to the world.

use crate::error::gltf::{GltfProblem, Located, item, place};
use crate::gltf::document::Document;
use crate::gltf::nodes::Tree;
use glam::{DAffine3, DMat3, DMat4, DVec3};
use std::sync::{Arc, OnceLock};

/// The joints of a skin.
pub(crate) struct Joints {
    /// From mesh coordinates to the world by each joint; none if the skin is broken.
    pub joints: Arc<[DAffine3]>,
    /// That of the node, which moves what follows no joint.
    pub of_node: DAffine3,
}

impl Document {
    /// The joints of a skin, computed once for all meshes that use it; none, and the reason, if it is broken.
    pub(crate) fn joints_in(&self, skin: u32, tree: &Tree) -> (Arc<[DAffine3]>, Option<Located>) {
        let known = tree.skins.get(skin as usize);
        if let Some(joints) = known.and_then(OnceLock::get) {
            return (joints.clone(), None);
        }
        let (joints, problem): (Arc<[DAffine3]>, _) = match self.joints(skin, &tree.worlds) {
            Ok(joints) => (joints.into(), None),
            Err(problem) => (Arc::default(), Some(problem)),
        };
        let joints = match known {
            Some(known) => known.get_or_init(|| joints).clone(),
            None => joints,
        };
        (joints, problem)
    }

    /// From mesh coordinates to the world by each joint of a skin.
    ///
    /// - `worlds`: from each node of the file to the world.
    fn joints(&self, skin: u32, worlds: &[DAffine3]) -> Result<Vec<DAffine3>, Located> {
        let here = |problem| (place("skins", skin), problem);
        let json = item(&self.root.skins, "skins", skin).map_err(here)?;
        let inverse = match json.inverse_bind_matrices {
            Some(accessor) => self.first_floats::<16>(accessor, json.joints.len())?,
            None => Vec::new(),
        };
        if json.inverse_bind_matrices.is_some() && inverse.len() < json.joints.len() {
            let what = "inverseBindMatrices".to_owned();
            let (found, expected) = (inverse.len() as u64, json.joints.len() as u64);
            return Err(here(GltfProblem::Length { what, found, expected }));
        }
        let joint = |(i, &node): (usize, &u32)| {
            let world = *item(worlds, "nodes", node).map_err(here)?;
            let bind = inverse.get(i).map_or(DAffine3::IDENTITY, |matrix| {
                DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from)))
            });
            Ok(world * bind)
        };
        json.joints.iter().enumerate().map(joint).collect()
    }
}

impl Joints {
    /// The transform of a vertex: the weighted mean of those of its joints; `None` if a joint does not exist.
    ///
    /// - `influences`: joints and weights, which need not sum to 1.
    pub(crate) fn mixed(&self, influences: impl Iterator<Item = (u32, f32)>) -> Option<DAffine3> {
        let mut mixed = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
        let mut total = 0.0;
        for (joint, weight) in influences {
            if weight == 0.0 {
                continue;
            }
            let (map, weight) = (self.joints.get(joint as usize)?, f64::from(weight));
            mixed.matrix3 += map.matrix3 * weight;
            mixed.translation += map.translation * weight;
            total += weight;
        }
        if total == 0.0 {
            // No joint has an influence.
            return Some(DAffine3::IDENTITY);
        }
        Some(DAffine3 { matrix3: mixed.matrix3 * (1.0 / total), translation: mixed.translation / total })
    }
}
