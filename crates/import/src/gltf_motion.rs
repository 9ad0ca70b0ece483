//! What the animations of a glTF file move in the scene that was made of it ([`crate::gltf_scene`]), at any moment: nodes are
//! placed again, and nothing is read or built but the meshes of skins and morph targets.

use crate::documents::{Documents, Opened};
use crate::error::gltf::Located;
use crate::gltf::assembly::{Assembly, MeshKey, Posed};
use crate::gltf::document::Document;
use crate::gltf_parts::{camera_of, extend, light_of};
use crate::model::imported::ModelNormals;
use crate::model::placing::{corners_of, transform};
use firstlight_files::hash::Fingerprint;
use firstlight_format::animation::ModelMotionPart;
use firstlight_format::camera::CameraPart;
use firstlight_format::light::LightKind;
use firstlight_format::parts::LightPart;
use firstlight_format::placement::Placement;
use firstlight_mesh::Mesh;
use glam::DVec3;
use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Which of the objects, lights and cameras of a scene are moved, by what they are in their file.
#[derive(Debug)]
pub struct GltfMotion {
    /// Its path in the scene file.
    pub file: String,
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
    /// Whether each of the objects moves or changes its shape, and whether each of the lights moves.
    pub animated: Animated,
    /// Seconds.
    pub length: f64,
    /// What was asked for last.
    pub last: LastMoment,
}

/// What may be asked for again, by the bits of its time: worlds of one moment share its meshes.
#[derive(Debug, Default)]
pub struct LastMoment {
    moment: Mutex<Option<(u64, Arc<GltfMoment>)>>,
    meshes: Mutex<Option<(u64, DeformedMeshes)>>,
}

/// The meshes of skins and morph targets, by the index of their object.
pub type DeformedMeshes = Arc<[(usize, Arc<Mesh>)]>;

/// Returns what is kept for a time, or else makes and keeps it; who makes it at the same time gets the same.
fn kept<T: Clone>(last: &Mutex<Option<(u64, T)>>, seconds: f64, make: impl FnOnce() -> Option<T>) -> Option<T> {
    let lock = || last.lock().unwrap_or_else(PoisonError::into_inner);
    let known = |last: &Option<(u64, T)>| match last {
        Some((bits, known)) if *bits == seconds.to_bits() => Some(known.clone()),
        _ => None,
    };
    if let Some(known) = known(&lock()) {
        return Some(known);
    }
    // Not under the lock: meshes are built in parallel, and a waiting worker may take up another task that needs it.
    let made = make()?;
    let mut last = lock();
    Some(known(&last).unwrap_or_else(|| last.insert((seconds.to_bits(), made)).1.clone()))
}

/// Which of the objects and lights of a [`GltfMotion`] are not the same at all times.
#[derive(Debug)]
pub struct Animated {
    /// By their places in [`GltfMotion::objects`].
    pub objects: Vec<bool>,
    /// By their places in [`GltfMotion::lights`].
    pub lights: Vec<bool>,
}

impl Animated {
    pub(crate) fn of(document: &Document, assembly: &Assembly, objects: &[usize], lights: &[usize]) -> Self {
        let moved = document.moved_nodes();
        let is_moved = |node: u32| moved[node as usize];
        let of_object = |&index: &usize| {
            assembly.meshes.get(index).is_some_and(|placed| placed.key.node.is_some() || is_moved(placed.node))
        };
        let of_light = |&index: &usize| assembly.lights.get(index).is_some_and(|placed| is_moved(placed.node));
        Self { objects: objects.iter().map(of_object).collect(), lights: lights.iter().map(of_light).collect() }
    }
}

/// The scene of a file at a moment.
#[derive(Debug, Default)]
pub struct GltfMoment {
    /// By the index of the object of the file.
    pub objects: Vec<(usize, Placement)>,
    /// By the index of the light.
    pub lights: Vec<(usize, LightKind, Placement)>,
    /// The camera, if it moves.
    pub camera: Option<CameraPart>,
}

impl GltfMotion {
    /// What the file at `path` moves.
    ///
    /// - `part`: of the scene file.
    /// - `meshes`: of each of its objects, if there is one.
    ///
    /// # Errors
    /// In words, if the file cannot be read, has no animations, or places fewer things.
    pub fn of_part<'m>(
        documents: &Documents,
        path: &Path,
        part: &ModelMotionPart,
        meshes: impl Iterator<Item = Option<&'m Mesh>>,
    ) -> Result<Self, String> {
        let opened = documents.open(path).map_err(|error| error.to_string())?;
        let document = &opened.document;
        let failed = |what: &str| format!("{}: {what}", path.display());
        let length = document.animation_length().ok_or_else(|| failed("it has no animations"))?;
        let posed = opened.posed(Some(0.0));
        let assembly = document.assembly(&posed).map_err(|located| document.error(located).to_string())?;
        let objects: Vec<usize> = part.objects.iter().map(|(_, number)| *number).collect();
        let lights: Vec<usize> = part.lights.iter().map(|(_, number)| *number).collect();
        let is_there = objects.iter().all(|&number| number < assembly.meshes.len())
            && lights.iter().all(|&number| number < assembly.lights.len())
            && part.camera.is_none_or(|number| number < assembly.cameras.len());
        if !is_there {
            return Err(failed("it has fewer objects than the animation names"));
        }
        let boxes = meshes.map(|mesh| mesh.map_or((DVec3::ZERO, DVec3::ZERO), corners_of)).collect();
        let animated = Animated::of(document, &assembly, &objects, &lights);
        let (file, camera) = (part.file.clone(), part.camera);
        Ok(Self { file, opened, objects, boxes, lights, camera, animated, length, last: LastMoment::default() })
    }
    /// Where everything that moves is at a moment; seconds. `None` for a moment at which a mesh cannot be built.
    pub fn at(&self, seconds: f64) -> Option<Arc<GltfMoment>> {
        kept(&self.last.moment, seconds, || self.moment(seconds).map(Arc::new))
    }

    fn moment(&self, seconds: f64) -> Option<GltfMoment> {
        let document = &self.opened.document;
        let posed = document.posed(Some(seconds));
        let assembly = document.assembly(&posed).ok()?;
        let mut moment = GltfMoment::default();
        let mut bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (i, &index) in self.objects.iter().enumerate() {
            let placed = assembly.meshes.get(index)?;
            extend(&mut bounds, self.boxes[i], &placed.world);
            if self.animated.objects[i] {
                moment.objects.push((i, Placement::from_part(&transform(&placed.world))));
            }
        }
        for (i, &index) in self.lights.iter().enumerate() {
            let placed = assembly.lights.get(index)?;
            if self.animated.lights[i] {
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

    /// The meshes of skins and morph targets at a moment; none for one at which they cannot be built.
    pub fn meshes_at(&self, seconds: f64) -> DeformedMeshes {
        kept(&self.last.meshes, seconds, || Some(self.deformed_at(seconds).into())).unwrap_or_default()
    }

    fn deformed_at(&self, seconds: f64) -> Vec<(usize, Arc<Mesh>)> {
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
