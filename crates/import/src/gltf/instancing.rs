//! Instances of a node's mesh: `EXT_mesh_gpu_instancing`.

use crate::error::gltf::{GltfProblem, Located, place};
use crate::gltf::document::Document;
use glam::{DAffine3, DQuat, DVec3};
use serde_json::Value;

const NAME: &str = "EXT_mesh_gpu_instancing";

impl Document {
    /// One transform per instance, from mesh to node coordinates; the identity alone without the extension.
    pub(crate) fn instances(&self, node: u32) -> Result<Vec<DAffine3>, Located> {
        let json = &self.root.nodes[node as usize];
        let Some(extension) = json.extensions.get(NAME) else { return Ok(vec![DAffine3::IDENTITY]) };
        let accessor = |name: &str| {
            let number =
                extension.get("attributes").and_then(|attributes| attributes.get(name)).and_then(Value::as_u64);
            number.map(|number| u32::try_from(number).unwrap_or(u32::MAX))
        };
        let [moves, turns, scales] = ["TRANSLATION", "ROTATION", "SCALE"].map(accessor);
        // Compared before anything is read: many nodes may share such lists.
        let declared = [moves, turns, scales].into_iter().flatten();
        let lengths = declared.map(|index| Ok(self.accessor(index)?.count)).collect::<Result<Vec<_>, Located>>()?;
        let expected = lengths.first().copied().unwrap_or(0);
        if let Some(&found) = lengths.iter().find(|&&length| length != expected) {
            let what = format!("an attribute of {NAME}");
            return Err((place("nodes", node), GltfProblem::Length { what, found, expected }));
        }
        let moves = moves.map(|index| self.floats::<3>(index)).transpose()?;
        let turns = turns.map(|index| self.floats::<4>(index)).transpose()?;
        let scales = scales.map(|index| self.floats::<3>(index)).transpose()?;
        let lists = [moves.as_ref().map(Vec::len), turns.as_ref().map(Vec::len), scales.as_ref().map(Vec::len)];
        let count = lists.into_iter().flatten().min().unwrap_or(0);
        let three = |list: &Option<Vec<[f32; 3]>>, i: usize, default: DVec3| {
            list.as_ref().map_or(default, |list| DVec3::from(list[i].map(f64::from)))
        };
        let instance = |i: usize| {
            let turn = turns.as_ref().map_or(DQuat::IDENTITY, |turns| DQuat::from_array(turns[i].map(f64::from)));
            let length = turn.length();
            let turn = if length > 0.0 { turn / length } else { DQuat::IDENTITY };
            let (scale, moved) = (three(&scales, i, DVec3::ONE), three(&moves, i, DVec3::ZERO));
            DAffine3::from_scale_rotation_translation(scale, turn, moved)
        };
        Ok((0..count).map(instance).collect())
    }
}
