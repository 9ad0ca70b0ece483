//! The images of a scene: those of its textures and environment, and those of the materials of its meshes. One that is
//! missing or broken costs only itself.

use crate::files::limits::has_room;
use crate::files::relative::text_to_path;
use crate::files::stamp::{Stamp, stamp};
use crate::format::error::SceneError;
use crate::format::material_textures::without_lost_textures;
use crate::format::parts::LightPart;
use crate::format::sources::{BUILTIN_IMAGE, EnvironmentSource, TextureSource};
use crate::import::builtin_images::builtin_image;
use crate::import::documents::Documents;
use crate::import::gltf::images::part_of_model;
use crate::render::ImageTexture;
use crate::scene::load::LoadOptions;
use crate::scene::load_stage::LoadStage;
use crate::scene::loaded::LoadedScene;
use glam::Vec3;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
/// Bytes per pixel of an environment, to be sampled.
const ENVIRONMENT_BYTES: u64 = 32;

impl LoadedScene {
    /// Loads an image, unless it is known.
    pub(super) fn add_picture(
        &mut self,
        name: &str,
        path: &Path,
        options: &LoadOptions,
        documents: &Documents,
    ) -> Result<(), SceneError> {
        if self.pictures.contains_key(name) {
            return Ok(());
        }
        if let Some(image) = builtin_image(name) {
            self.pictures.insert(name.to_owned(), image);
            return Ok(());
        }
        let on_disk = file_of(path);
        let ahead = documents.take_picture(path);
        let before = ahead.as_ref().map_or_else(|| stamp(&on_disk), |(before, _)| *before);
        if let Some(picture) = known_picture(options, name, &on_disk, before) {
            self.pictures.insert(name.to_owned(), picture.clone());
            self.picture_files.insert(name.to_owned(), (on_disk.to_owned(), before));
            return Ok(());
        }
        options.say(LoadStage::Images, &format!("reading {name}"));
        // Also if it cannot be read, since it may appear later.
        self.picture_files.insert(name.to_owned(), (on_disk.to_owned(), before));
        let read = ahead.map_or_else(|| documents.picture(path), |(_, read)| read);
        let (picture, warning) = read.map_err(|reason| SceneError::in_file(path, reason))?;
        self.warnings.extend(warning.map(|warning| format!("{}: {warning}", path.display())));
        self.pictures.insert(name.to_owned(), Arc::new(picture));
        Ok(())
    }

    /// Decodes the images that are not known yet in parallel.
    pub(super) fn decode_ahead<'f>(
        &self,
        files: impl Iterator<Item = &'f str>,
        options: &LoadOptions,
        documents: &Documents,
    ) {
        let is_new = |(file, path): &(&str, PathBuf)| {
            let on_disk = file_of(path);
            known_picture(options, file, &on_disk, stamp(&on_disk)).is_none() && !self.pictures.contains_key(*file)
        };
        let files = files.filter(|file| !file.starts_with(BUILTIN_IMAGE));
        let paths = files.map(|file| (file, self.folder.join(text_to_path(file)))).filter(is_new);
        let paths: HashSet<PathBuf> = paths.map(|(_, path)| path).collect();
        documents.decode(paths.into_iter().collect());
    }

    /// Loads the images of the materials of mesh files. A missing one gives a warning: many models come without their
    /// images.
    pub(super) fn add_mesh_pictures(&mut self, options: &LoadOptions, documents: &Documents) {
        let textures = self.meshes_with_own_materials().flat_map(|mesh| &mesh.textures);
        let named = |(_, source, path): &(String, TextureSource, PathBuf)| match source {
            TextureSource::Image { file, .. } => Some((file.clone(), path.clone())),
            _ => None,
        };
        let files: Vec<(String, PathBuf)> = textures.filter_map(named).collect();
        let mut lost = HashSet::new();
        for (name, path) in files {
            if lost.contains(&name) {
                continue;
            }
            if let Err(error) = self.add_picture(&name, &path, options, documents) {
                lost.insert(name);
                self.warnings.push(format!("{error}; the texture is omitted"));
            }
        }
    }

    /// The environment image, if there is no memory for the tables from which it is sampled.
    pub(super) fn environment_without_room(&self) -> Option<String> {
        let EnvironmentSource::Image { file, .. } = &self.file.environment else { return None };
        let image = self.pictures.get(file)?;
        let pixels = u64::from(image.width) * u64::from(image.height);
        (!has_room(pixels * ENVIRONMENT_BYTES)).then(|| file.clone())
    }

    /// Removes the textures and the environment of images that cannot be read. Materials get what is shown instead, so that
    /// the scene can be saved and opened again.
    pub(super) fn leave_out_pictures(&mut self, lost: &HashSet<String>) {
        self.lost_images = lost.iter().cloned().collect();
        self.lost_images.sort();
        let file = &mut self.file;
        if let EnvironmentSource::Image { file: image, scale, .. } = &file.environment
            && lost.contains(image)
        {
            file.environment = EnvironmentSource::Constant(*scale);
        }
        let is_lost =
            |source: &TextureSource| matches!(source, TextureSource::Image { file, .. } if lost.contains(file));
        if !file.textures.iter().any(|(_, source)| is_lost(source)) {
            return;
        }
        let gone = file.textures.iter().filter(|(_, source)| is_lost(source));
        let gone: HashMap<String, Vec3> = gone.map(|(name, source)| (name.to_owned(), source.factor())).collect();
        file.textures.0.retain(|_, source| !is_lost(source));
        let names: HashSet<&str> = file.textures.names().collect();
        for (_, part) in &mut file.materials.0 {
            let factor = |name: &str| gone.get(name).copied().unwrap_or(Vec3::ONE);
            *part = without_lost_textures(part, |name| (!names.contains(name)).then(|| factor(name)));
        }
        for light in &mut file.lights {
            if let LightPart::Spot { texture, .. } = light {
                *texture = texture.take().filter(|name| names.contains(name.as_str()));
            }
        }
    }
}

/// The file on disk: for an image inside a model, the model.
fn file_of(path: &Path) -> PathBuf {
    part_of_model(path).map_or_else(|| path.to_owned(), |(model, _)| model)
}

/// An image that was read before, if its file has not changed.
fn known_picture<'a>(
    options: &LoadOptions<'a>,
    name: &str,
    on_disk: &Path,
    now: Stamp,
) -> Option<&'a Arc<ImageTexture>> {
    let known = options.known?;
    let (path, then) = known.picture_files.get(name)?;
    if path != on_disk || *then != now || now.is_none() {
        return None;
    }
    known.pictures.get(name)
}
