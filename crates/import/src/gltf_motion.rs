//! What the animations of a glTF file move in the scene that was made of it ([`crate::gltf_scene`]), at any moment: nodes are
//! placed again, and nothing is read or built but the meshes of skins and morph targets.

use crate::documents::Opened;
use crate::error::gltf::Located;
use crate::gltf::assembly::{MeshKey, Posed};
use crate::gltf_parts::{camera_of, extend, light_of};
use crate::model::imported::ModelNormals;
use crate::model::placing::transform;
use firstlight_files::hash::Fingerprint;
use firstlight_format::camera::CameraPart;
use firstlight_format::light::LightKind;
use firstlight_format::parts::LightPart;
use firstlight_format::placement::Placement;
use firstlight_mesh::Mesh;
use glam::DVec3;
use std::collections::HashMap;
use std::sync::Arc;

/// Which of the objects, lights and cameras of a scene are moved, by what they are in their file.
#[derive(Debug)]
pub struct GltfMotion {
    /// The file.
    pub opened: Arc<Opened>,
    /// Of each object that is a mesh of the file, in the order of the scene: its index among the placed meshes.
    pub objects: Vec<usize>,
    /// Corners of their boxes, in their own coordinates.
    pub boxes: Vec<(DVec3, DVec3)>,
    /// Of the first lights of the scene: their indices among the placed lights.
    pub lights: Vec<usize>,
    /// Index of the camera that is looked through, if it moves.
    pub camera: Option<usize>,
    /// By node.
    pub moved: Vec<bool>,
    /// Seconds.
    pub length: f64,
}

/// The scene of a file at a moment.
#[derive(Default)]
pub struct GltfMoment {
    /// By the index of the object of the file.
    pub objects: Vec<(usize, Placement)>,
    /// By the index of the light.
    pub lights: Vec<(usize, LightKind, Placement)>,
    /// The camera, if it moves.
    pub camera: Option<CameraPart>,
}

impl GltfMotion {
    /// Where everything that moves is at a moment; seconds. `None` for a moment at which a mesh cannot be built.
    pub fn at(&self, seconds: f64) -> Option<GltfMoment> {
        let document = &self.opened.document;
        let posed = document.posed(Some(seconds));
        let assembly = document.assembly(&posed).ok()?;
        let mut moment = GltfMoment::default();
        let mut bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (i, &index) in self.objects.iter().enumerate() {
            let placed = assembly.meshes.get(index)?;
            extend(&mut bounds, self.boxes[i], &placed.world);
            if self.moved[placed.node as usize] {
                moment.objects.push((i, Placement::from_part(&transform(&placed.world))));
            }
        }
        for (i, &index) in self.lights.iter().enumerate() {
            let placed = assembly.lights.get(index)?;
            if self.moved[placed.node as usize] {
                let part: LightPart = light_of(placed, None);
                let (light, placement) = LightKind::from_part(&part);
                moment.lights.push((i, light, placement));
            }
        }
        moment.camera =
            self.camera.and_then(|camera| Some(camera_of(assembly.cameras.get(camera)?, 0.5 * (bounds.0 + bounds.1))));
        Some(moment)
    }

    /// Of all animations of the file, and of which camera is looked through.
    pub fn fingerprint(&self) -> Fingerprint {
        self.opened.document.animation_fingerprint().with(format!("{:?}", self.camera).as_bytes())
    }

    /// The meshes of skins and morph targets at a moment, by the index of their object.
    pub fn meshes_at(&self, seconds: f64) -> Vec<(usize, Arc<Mesh>)> {
        let document = &self.opened.document;
        let posed = document.posed(Some(seconds));
        let Ok(assembly) = document.assembly(&posed) else { return Vec::new() };
        let mut built: HashMap<MeshKey, Option<Arc<Mesh>>> = HashMap::new();
        let deformed = self.objects.iter().enumerate().filter_map(|(i, &index)| {
            let key = assembly.meshes.get(index).map(|placed| placed.key).filter(|key| key.node.is_some())?;
            Some((i, key))
        });
        let mesh = |key: MeshKey, posed: &Posed| -> Result<Mesh, Located> {
            Ok(document.mesh_of(key, posed, &ModelNormals::FileOrComputed { crease_angle: 0.0 })?.mesh)
        };
        deformed
            .filter_map(|(i, key)| {
                let built = built.entry(key).or_insert_with(|| mesh(key, &posed).ok().map(Arc::new));
                Some((i, built.clone()?))
            })
            .collect()
    }
}
