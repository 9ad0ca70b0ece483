//! The meshes of the objects of a scene. One that is missing or broken costs only itself.

use crate::files::relative::{place, text_to_path};
use crate::files::stamp::stamp;
use crate::format::error::SceneError;
use crate::format::parts::ObjectPart;
use crate::format::scene_file::SceneFile;
use crate::format::sources::{MeshShading, MeshSource, TextureCoordinates};
use crate::import::documents::Documents;
use crate::import::meshes::{LoadedMesh, load_mesh};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Identity of a mesh: source, shading, texture coordinates and bits of the simplification ratio.
pub(super) type LoadedMeshKey = (MeshSource, MeshShading, TextureCoordinates, Option<u64>);

/// What an object needs; `None` if it is no mesh.
pub(super) fn mesh_key(object: &ObjectPart) -> Option<LoadedMeshKey> {
    match object {
        ObjectPart::Mesh { source, shading, texture_coordinates, simplify, .. } => {
            Some((source.clone(), *shading, *texture_coordinates, simplify.map(f64::to_bits)))
        }
        _ => None,
    }
}

/// A mesh that could not be read.
pub(super) struct LostMesh {
    /// The first object that uses it.
    pub object: usize,
    pub error: SceneError,
}

/// Meshes of all objects, and what is wrong with those that are empty.
pub(super) struct ObjectMeshes {
    /// One per object; `None` for objects that are not meshes.
    pub meshes: Vec<Option<LoadedMesh>>,
    pub lost: Vec<LostMesh>,
}

/// Reads each mesh once, whatever the names of its file, those in files of their own in parallel.
///
/// - `known`: the mesh of an object that is read already; `say`: called before a mesh is read.
pub(super) fn load_meshes(
    file: &SceneFile,
    folder: &Path,
    documents: &Documents,
    known: impl Fn(&ObjectPart) -> Option<LoadedMesh> + Sync,
    say: impl Fn(&MeshSource) + Sync,
) -> ObjectMeshes {
    let mut places: HashMap<String, [PathBuf; 2]> = HashMap::new();
    let mut numbers: HashMap<(LoadedMeshKey, Option<[PathBuf; 2]>), usize> = HashMap::new();
    let mut firsts: Vec<(usize, LoadedMeshKey)> = Vec::new();
    let number_of = |(i, object)| {
        let key = mesh_key(object)?;
        let mut nameless = key.clone();
        let place = nameless.0.file_mut().map(|file| {
            let name = std::mem::take(file);
            places.entry(name).or_insert_with_key(|name| place(&folder.join(text_to_path(name)))).clone()
        });
        Some(*numbers.entry((nameless, place)).or_insert_with(|| {
            firsts.push((i, key));
            firsts.len() - 1
        }))
    };
    let number_of: Vec<Option<usize>> = file.objects.iter().enumerate().map(number_of).collect();
    let read = |(object, (source, ..)): &(usize, LoadedMeshKey)| {
        let object = &file.objects[*object];
        known(object).map_or_else(
            || {
                say(source);
                load_mesh(source, object.mesh_options().unwrap_or_default(), folder, documents)
            },
            Ok,
        )
    };
    // The others share documents, which are read once, one after the other.
    let is_alone = |(_, (source, ..)): &(usize, LoadedMeshKey)| {
        matches!(source, MeshSource::Obj(_) | MeshSource::Ply(_) | MeshSource::Stl(_))
    };
    let mut loaded: Vec<Option<Result<LoadedMesh, SceneError>>> =
        firsts.par_iter().map(|first| is_alone(first).then(|| read(first))).collect();
    let mut lost = Vec::new();
    let distinct = loaded.iter_mut().zip(&firsts).map(|(loaded, first)| {
        loaded.take().unwrap_or_else(|| read(first)).unwrap_or_else(|error| {
            let (object, (source, ..)) = first;
            lost.push(LostMesh { object: *object, error });
            // Its file may appear later.
            let path = source.file().map(|file| folder.join(text_to_path(file)));
            LoadedMesh::empty(path.into_iter().map(|path| (path.clone(), stamp(&path))).collect())
        })
    });
    let distinct: Vec<LoadedMesh> = distinct.collect();
    let meshes = number_of.into_iter().map(|number| number.map(|number| distinct[number].clone())).collect();
    ObjectMeshes { meshes, lost }
}
