//! The files that a scene was read from, by the name that the scene has for each.
//!
//! Only what was read as the kind of file that its name stands for: a texture that could not be decoded, or a library
//! without a material, may be any file of the computer.

use crate::files::relative::{path_to_text, text_to_path};
use crate::format::parts::ObjectPart;
use crate::format::sources::{EnvironmentSource, TextureSource};
use crate::import::gltf::images::part_of_model;
use crate::scene::loaded::LoadedScene;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a name in a scene stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadFiles {
    /// As in the scene: a path from the folder of the scene.
    pub name: String,
    /// The file that is named, then those that it names itself.
    pub files: Vec<PathBuf>,
}

impl LoadedScene {
    /// The files of each name in the scene, in the order of the scene: models, textures, environment.
    pub fn read_files(&self) -> Vec<ReadFiles> {
        let mut found: Vec<ReadFiles> = Vec::new();
        let mut known: HashMap<String, usize> = HashMap::new();
        if let [(first, _), ..] = &self.text_files[..] {
            let name = first.file_name().map(|name| path_to_text(name.as_ref())).unwrap_or_default();
            known.insert(name.clone(), 0);
            found.push(ReadFiles { name, files: self.text_files.iter().map(|(path, _)| path.clone()).collect() });
        }
        let mut seen = HashSet::new();
        for (object, mesh) in self.file.objects.iter().zip(&self.meshes) {
            let (ObjectPart::Mesh { source, .. }, Some(mesh)) = (object, mesh) else { continue };
            // What could not be read as a mesh may be any file of the computer.
            let Some(name) = source.file().filter(|_| !mesh.mesh.triangles.is_empty()) else { continue };
            let of_textures = mesh.textures.iter().filter_map(|(_, source, _)| match source {
                TextureSource::Image { file, .. } => self.picture_file(file),
                _ => None,
            });
            let first = *known.entry(name.to_owned()).or_insert_with(|| {
                found.push(ReadFiles { name: name.to_owned(), files: Vec::new() });
                found.len() - 1
            });
            // Those of a file with many meshes once.
            let of_mesh = Some(&mesh.files).filter(|files| seen.insert((first, Arc::as_ptr(files))));
            let of_mesh = of_mesh.into_iter().flat_map(|files| files.iter()).map(|(path, _)| path.as_path());
            found[first].files.extend(of_mesh.chain(of_textures).map(Path::to_path_buf));
        }
        // Its objects may have other meshes.
        if let (Some(motion), Some(model)) = (&self.motion, &self.file.animation.model)
            && !known.contains_key(&model.file)
        {
            known.insert(model.file.clone(), found.len());
            let files = motion.opened.files.iter().map(|(path, _)| path.clone()).collect();
            found.push(ReadFiles { name: model.file.clone(), files });
        }
        let of_textures = self.file.textures.iter().filter_map(|(_, texture)| match texture {
            TextureSource::Image { file, .. } => Some(file),
            _ => None,
        });
        let of_environment = match &self.file.environment {
            EnvironmentSource::Image { file, .. } if self.environment.is_none() => Some(file),
            _ => None,
        };
        for name in of_textures.chain(of_environment) {
            if let Some(path) = self.picture_file(name)
                && !known.contains_key(name)
            {
                known.insert(name.clone(), found.len());
                found.push(ReadFiles { name: name.clone(), files: vec![path.to_path_buf()] });
            }
        }
        for read in &mut found {
            // The order of the first, which is the one that is named, stays.
            let mut seen = HashSet::new();
            read.files.retain(|path| seen.insert(path.clone()));
        }
        found
    }

    /// The file of an image that was decoded; of one inside a model, the model.
    fn picture_file(&self, name: &str) -> Option<&Path> {
        self.pictures.contains_key(name).then(|| self.picture_files.get(name).map(|(path, _)| path.as_path()))?
    }

    /// The part of a name that is a path: of an image inside a model, the path of the model.
    pub fn path_of_name<'a>(&self, name: &'a str) -> &'a str {
        match part_of_model(&self.folder.join(text_to_path(name))) {
            Some(_) => name.rsplit_once('#').map_or(name, |(path, _)| path),
            None => name,
        }
    }
}
