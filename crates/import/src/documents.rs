//! The glTF files and the scenes of other renderers that a scene uses, while it is loaded: each file is read once, and
//! each of its meshes is built once.

use crate::error::gltf::{GltfError, GltfProblem, Located};
use crate::error::together::MeshesTooLarge;
use crate::gltf::assembly::{MeshKey, Posed};
use crate::gltf::document::{Document, ReadOptions};
use crate::gltf::images::part_of_model;
use crate::gltf::mesh::BuiltMesh;
use crate::gltf::surfaces::Surfaces;
use crate::model::foreign::{ForeignOptions, ForeignScene};
use crate::model::imported::ModelNormals;
use crate::model::mesh_budget::MeshBudget;
use crate::model::projection::LightImages;
use crate::picture::{ImageBudget, PictureError, picture_of_bytes, read_picture_of_scene};
use crate::read_scene::read_scene;
use firstlight_files::limits::Limits;
use firstlight_files::relative::place;
use firstlight_files::stamp::{Stamp, stamp};
use firstlight_format::choice::ModelChoice;
use firstlight_format::error::SceneError;
use firstlight_render::ImageTexture;
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// An image with an optional warning, or why it could not be read.
type ReadPicture = Result<(ImageTexture, Option<String>), PictureError>;

type ReadScene = Result<Arc<ForeignScene>, SceneError>;

/// Sets of parameters that a scene is read with: it takes its memory for each.
const MAX_VARIANTS: usize = 16;

/// Scenes of other renderers that a scene reads parts of, each with all of its meshes.
const MAX_SCENES: usize = 32;

/// Open files, by place.
#[derive(Debug, Default)]
pub struct Documents {
    options: ReadOptions,
    open: Mutex<HashMap<[PathBuf; 2], Arc<Opened>>>,
    /// The folder and the canonical path of a file, by each of its names.
    places: Mutex<HashMap<PathBuf, [PathBuf; 2]>>,
    /// Scenes of other renderers by that path, with the names and values of their parameters.
    scenes: Mutex<HashMap<(PathBuf, Vec<(String, String)>), ReadScene>>,
    /// Of all images that are decoded.
    pixels: ImageBudget,
    /// Of all meshes.
    meshes: Arc<MeshBudget>,
    /// Images that were decoded and not yet taken, by path.
    decoded: Mutex<HashMap<PathBuf, (Stamp, ReadPicture)>>,
}

/// An open file.
#[derive(Debug)]
pub struct Opened {
    /// The file.
    pub document: Document,
    /// All files that were read for it, each with its stamp from before it was read.
    pub files: Arc<[(PathBuf, Stamp)]>,
    /// By the bits of the time.
    posed: Mutex<HashMap<Option<u64>, Arc<Posed>>>,
    /// By the path of the model in texture paths.
    surfaces: Mutex<HashMap<String, Arc<Surfaces>>>,
    meshes: Mutex<HashMap<(MeshKey, Option<u64>), Arc<BuiltMesh>>>,
    /// Number of their vertices and indices, as the file states it.
    made: AtomicU64,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Documents {
    /// No file yet.
    pub fn new(choice: &ModelChoice) -> Self {
        let options = ReadOptions { allow_outside: choice.allow_outside, ..ReadOptions::default() };
        Self { options, ..Self::default() }
    }

    /// Whether models may refer to files outside of their folders.
    pub(crate) fn allow_outside(&self) -> bool {
        self.options.allow_outside
    }

    /// What all meshes may take.
    pub(crate) fn mesh_budget(&self) -> &MeshBudget {
        &self.meshes
    }

    /// One file may have many names, and each may be asked for by many objects.
    fn place(&self, path: &Path) -> [PathBuf; 2] {
        lock(&self.places).entry(path.to_owned()).or_insert_with(|| place(path)).clone()
    }

    /// The file at `path`, read on first use.
    pub(crate) fn open(&self, path: &Path) -> Result<Arc<Opened>, GltfError> {
        let place = self.place(path);
        let mut open = lock(&self.open);
        if let Some(opened) = open.get(&place) {
            return Ok(opened.clone());
        }
        // Taken before reading, so that a change in the meantime is noticed.
        let before = stamp(path);
        let whole = |error: MeshesTooLarge| GltfError::at(path, (String::new(), error.into()));
        let length = self.meshes.before(path).map_err(whole)?;
        let document = Document::read(path, self.options)?;
        self.meshes.take(document.n_bytes().saturating_sub(length)).map_err(whole)?;
        let others = document.files()[1..].iter().map(|file| (file.clone(), stamp(file)));
        let files = std::iter::once((path.to_owned(), before)).chain(others).collect();
        let opened = Arc::new(Opened {
            document,
            files,
            posed: Mutex::default(),
            surfaces: Mutex::default(),
            meshes: Mutex::default(),
            made: AtomicU64::default(),
        });
        open.insert(place, opened.clone());
        Ok(opened)
    }

    /// The scene of another renderer at `path`, read on first use.
    ///
    /// - `defines`: names and values of parameters that it leaves open.
    pub fn scene(&self, path: &Path, defines: &[(String, String)]) -> ReadScene {
        let [_, real] = self.place(path);
        let key = (real, defines.to_vec());
        if let Some(scene) = lock(&self.scenes).get(&key) {
            return scene.clone();
        }
        if lock(&self.scenes).keys().filter(|(known, _)| *known == key.0).count() >= MAX_VARIANTS {
            let message = format!("is read with more than {MAX_VARIANTS} sets of parameters");
            return Err(SceneError::in_file(path, message));
        }
        if lock(&self.scenes).len() >= MAX_SCENES {
            let message = format!("is one of more than {MAX_SCENES} scenes of other renderers in one scene");
            return Err(SceneError::in_file(path, message));
        }
        let budget = ImageBudget::default();
        let light_images =
            LightImages::new(move |path| read_picture_of_scene(path, &budget).ok().map(|(image, _)| image));
        let options = ForeignOptions {
            allow_outside: self.options.allow_outside,
            defines: key.1.clone(),
            light_images,
            meshes: self.meshes.clone(),
        };
        let scene = read_scene(path, &options).map(Arc::new);
        lock(&self.scenes).entry(key).or_insert(scene).clone()
    }

    /// A mesh with the normals of its file.
    pub(crate) fn mesh(&self, opened: &Opened, key: MeshKey, at: Option<f64>) -> Result<Arc<BuiltMesh>, Located> {
        let known = (key, at.map(f64::to_bits));
        if let Some(mesh) = lock(&opened.meshes).get(&known) {
            return Ok(mesh.clone());
        }
        let limit = opened.document.most_own_numbers();
        let (built, kept) = opened.document.numbers_of(key.mesh);
        if built > limit || opened.made.fetch_add(kept, Ordering::Relaxed).saturating_add(kept) > limit {
            return Err((String::new(), GltfProblem::TooLarge { limit }));
        }
        let posed = opened.posed(at);
        let mesh =
            Arc::new(opened.document.mesh_of(key, &posed, &ModelNormals::FileOrComputed { crease_angle: 0.0 })?);
        Ok(lock(&opened.meshes).entry(known).or_insert(mesh).clone())
    }

    /// An image in a file of its own, or inside a model.
    pub fn picture(&self, path: &Path) -> ReadPicture {
        let Some((model, number)) = part_of_model(path) else { return read_picture_of_scene(path, &self.pixels) };
        let failed = |error: GltfError| PictureError::Model(error.to_string());
        let opened = self.open(&model).map_err(failed)?;
        let bytes = opened.document.picture_bytes(number).map_err(|located| failed(opened.document.error(located)))?;
        picture_of_bytes(&bytes, &Limits::of_this_process(), &self.pixels)
    }

    /// Decodes images in parallel, for [`take_picture`](Self::take_picture).
    pub fn decode(&self, paths: Vec<PathBuf>) {
        paths.into_par_iter().for_each(|path| {
            let before = stamp(&part_of_model(&path).map_or_else(|| path.clone(), |(model, _)| model));
            let read = self.picture(&path);
            lock(&self.decoded).insert(path, (before, read));
        });
    }

    /// Removes and returns a decoded image, with the stamp of its file from before it was read.
    pub fn take_picture(&self, path: &Path) -> Option<(Stamp, ReadPicture)> {
        lock(&self.decoded).remove(path)
    }

    /// Builds meshes in parallel; errors are reported when a mesh is requested individually.
    pub(crate) fn make(&self, wanted: &[(Arc<Opened>, MeshKey, Option<f64>)]) {
        wanted.par_iter().for_each(|(opened, key, at)| {
            let _ = self.mesh(opened, *key, *at);
        });
    }
}

impl Opened {
    pub(crate) fn posed(&self, at: Option<f64>) -> Arc<Posed> {
        let key = at.map(f64::to_bits);
        if let Some(posed) = lock(&self.posed).get(&key) {
            return posed.clone();
        }
        let posed = Arc::new(self.document.posed(at));
        lock(&self.posed).entry(key).or_insert(posed).clone()
    }

    /// - `file`: path of the model in texture paths.
    pub(crate) fn surfaces(&self, file: &str) -> Arc<Surfaces> {
        if let Some(surfaces) = lock(&self.surfaces).get(file) {
            return surfaces.clone();
        }
        let surfaces = Arc::new(self.document.surfaces(file));
        lock(&self.surfaces).entry(file.to_owned()).or_insert(surfaces).clone()
    }
}
