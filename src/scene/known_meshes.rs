//! Meshes and groups of spheres of the scene that was open before, for one that is read again.

use crate::format::parts::{ObjectPart, RadiiPart};
use crate::format::sources::MeshSource;
use crate::import::meshes::LoadedMesh;
use crate::scene::load_meshes::{LoadedMeshKey, mesh_key};
use crate::scene::loaded::LoadedScene;
use crate::scene::world::components::Balls;
use glam::DVec3;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// The data that was read before, by the objects that it was read for.
pub(super) struct KnownMeshes<'a> {
    scene: &'a LoadedScene,
    meshes: HashMap<LoadedMeshKey, usize>,
    balls: HashMap<BallsKey, usize>,
}

/// First centre, steps, radii and other centres, as bits.
#[derive(PartialEq, Eq, Hash)]
enum BallsKey {
    Grid([u64; 4], Vec<(u32, [u64; 3])>),
    Spheres(Vec<[u64; 3]>, Vec<u64>, bool),
}

impl<'a> KnownMeshes<'a> {
    pub(super) fn new(scene: &'a LoadedScene) -> Self {
        let mut known = Self { scene, meshes: HashMap::new(), balls: HashMap::new() };
        for (i, object) in scene.file.objects.iter().enumerate() {
            if let Some(key) = mesh_key(object) {
                known.meshes.entry(key).or_insert(i);
            } else if let Some(key) = Self::balls_key(object) {
                known.balls.entry(key).or_insert(i);
            }
        }
        known
    }

    fn balls_key(object: &ObjectPart) -> Option<BallsKey> {
        let bits = |v: &DVec3| v.to_array().map(f64::to_bits);
        match object {
            ObjectPart::BallGrid { first, steps, radius, .. } => {
                let [x, y, z] = bits(first);
                let steps = steps.iter().map(|(count, step)| (*count, bits(step))).collect();
                Some(BallsKey::Grid([x, y, z, radius.to_bits()], steps))
            }
            ObjectPart::Spheres { centers, radii, .. } => {
                let (radii, each) = match radii {
                    RadiiPart::All(radius) => (vec![radius.to_bits()], false),
                    RadiiPart::Each(radii) => (radii.iter().map(|radius| radius.to_bits()).collect(), true),
                };
                Some(BallsKey::Spheres(centers.iter().map(bits).collect(), radii, each))
            }
            _ => None,
        }
    }

    /// Whether the mesh of an equal object could be read.
    pub(super) fn has_mesh(&self, wanted: &ObjectPart) -> bool {
        let known = mesh_key(wanted).and_then(|key| self.scene.meshes[*self.meshes.get(&key)?].as_ref());
        known.is_some_and(|mesh| !mesh.mesh.triangles.is_empty())
    }

    /// The mesh of an equal object, if its files have not changed.
    pub(super) fn fresh_mesh(&self, folder: &Path, wanted: &ObjectPart) -> Option<LoadedMesh> {
        let key = mesh_key(wanted)?;
        let is_builtin = matches!(key.0, MeshSource::Builtin(_));
        let mesh = self.scene.meshes[*self.meshes.get(&key)?].as_ref()?;
        ((is_builtin || self.scene.folder == folder) && mesh.is_fresh()).then(|| mesh.clone())
    }

    /// The spheres of an equal object.
    pub(super) fn same_balls(&self, wanted: &ObjectPart) -> Option<Arc<Balls>> {
        self.scene.balls[*self.balls.get(&Self::balls_key(wanted)?)?].clone()
    }
}
