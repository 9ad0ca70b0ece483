//! The folder of meshes and images beside a scene.

use crate::common::picture::{self, Picture};
use crate::common::ply;
use crate::common::scene::WholeScene;
use crate::common::surface::Use;
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_files::new_folder::NewFolder;
use firstlight_files::relative::{absolute, path_to_text, text_to_path};
use firstlight_files::whole_file::unwritable;
use firstlight_files::write_error::WriteError;
use firstlight_format::names::Names;
use firstlight_mesh::Mesh;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A new folder that gets its files one by one, and its name when the scene is complete. No file of another one is ever
/// replaced: an older folder may have what the scene is read from.
pub(crate) struct Folder {
    path: PathBuf,
    /// Its name, as the scene says it.
    name: String,
    /// `None` before its first file.
    new: Option<NewFolder>,
    taken: Names,
    meshes: HashMap<MeshKey, String>,
    pictures: HashMap<String, Picture>,
}

/// Which triangles of a mesh, by its address; whether mirrored along x; whether with texture coordinates that it lacks.
pub(crate) type MeshKey = (usize, Option<u16>, bool, bool);

impl Folder {
    /// The folder of a scene, named after it: `kitchen-xml` of `kitchen.xml`, or `kitchen-xml-2` if there is one.
    pub(crate) fn beside(scene: &Path) -> Self {
        // A link leads to where the scene will be.
        let scene = &absolute(scene);
        let text = |part: Option<&std::ffi::OsStr>| part.map(|part| path_to_text(part.as_ref())).unwrap_or_default();
        // Other marks mean something in one of the grammars.
        let plain = |c: char| if c.is_alphanumeric() || "-_. ".contains(c) { c } else { '_' };
        let stem =
            format!("{}-{}", text(scene.file_stem()), text(scene.extension())).chars().map(plain).collect::<String>();
        // Hidden folders are never meant.
        let stem = stem.trim_start_matches('.');
        let parent = scene.parent().unwrap_or(Path::new(""));
        let mut names = (1..).map(|n| if n == 1 { stem.to_owned() } else { format!("{stem}-{n}") });
        // A link that leads nowhere is there, too.
        let is_free = |name: &String| parent.join(text_to_path(name)).symlink_metadata().is_err();
        let name = names.find(is_free).expect("numbers do not end");
        let path = parent.join(text_to_path(&name));
        Self { path, name, new: None, taken: Names::default(), meshes: HashMap::new(), pictures: HashMap::new() }
    }

    /// Gives the folder its name; returns its path, if it has files.
    ///
    /// # Errors
    /// If there is something of this name by now.
    pub(crate) fn finish(self) -> Result<Option<PathBuf>, WriteError> {
        let Some(new) = self.new else { return Ok(None) };
        new.finish("".as_ref())?;
        Ok(Some(self.path))
    }

    /// A file of these bytes; returns its path as the scene says it.
    pub(crate) fn add(&mut self, stem: &str, extension: &str, bytes: &[u8]) -> Result<String, WriteError> {
        // What every system and every renderer takes for a name.
        let safe = |c: char| if c.is_ascii_alphanumeric() || "-_".contains(c) { c } else { '_' };
        let stem: String = stem.chars().map(safe).take(64).collect();
        // A number follows a space, which no other name has.
        let name = self.taken.free(&stem.to_lowercase()).replace(' ', ".");
        let file = format!("{name}.{extension}");
        let new = match &mut self.new {
            Some(new) => new,
            none => none.insert(NewFolder::begin(&self.path)?),
        };
        let path = new.part().join(&file);
        std::fs::write(&path, bytes).map_err(|error| new.error(unwritable(&path, error)))?;
        Ok(format!("{}/{file}", self.name))
    }

    /// A mesh as a PLY file, relative to its centre. Equal ones are written once.
    ///
    /// - `slot`: only triangles of this material slot; `is_mirrored`: mirrored along x, with the same front.
    /// - `is_textured`: whether texture coordinates matter.
    pub(crate) fn mesh(
        &mut self,
        mesh: &Arc<Mesh>,
        slot: Option<u16>,
        [is_mirrored, is_textured]: [bool; 2],
        name: &str,
    ) -> Result<String, WriteError> {
        let key = (Arc::as_ptr(mesh) as usize, slot, is_mirrored, is_textured && mesh.uvs.is_empty());
        if let Some(known) = self.meshes.get(&key) {
            return Ok(known.clone());
        }
        let file = self.add(name, "ply", &ply::bytes(mesh, slot, is_mirrored, is_textured))?;
        self.meshes.insert(key, file.clone());
        Ok(file)
    }

    /// The image of a texture for one use of it: a copy of its file, if that shows the same, else a new one.
    ///
    /// - `is_number`: whether a number is read from it; `formats`: extensions of files that are copied.
    pub(crate) fn picture(
        &mut self,
        scene: &WholeScene,
        wanted: &Use,
        is_number: bool,
        formats: &[&str],
    ) -> Result<Picture, WriteError> {
        let key = format!("{is_number} {wanted:?}");
        if let Some(known) = self.pictures.get(&key) {
            return Ok(known.clone());
        }
        let whole = &scene.textures[&wanted.name];
        let copied = whole.file.as_ref().filter(|_| picture::is_plain(&whole.texture, wanted, is_number));
        let copied = copied.and_then(|file| {
            let extension = file.extension()?.to_str()?.to_ascii_lowercase();
            formats.contains(&extension.as_str()).then_some((file, extension))
        });
        let made = match copied {
            Some((file, extension)) => {
                let copy = format!("copy of {}", file.display());
                let known = self.pictures.get(&copy).map(|known| known.file.clone());
                let name = match known {
                    Some(name) => name,
                    None => self.copy(file, &extension)?,
                };
                let made = Picture { file: name, is_linear: picture::is_linear(&whole.texture) };
                self.pictures.insert(copy, made.clone());
                made
            }
            None => {
                let image = picture::baked(&whole.texture, wanted, is_number);
                let (extension, bytes) = image.bytes().map_err(|error| unwritable(&self.path, error))?;
                Picture { file: self.add(&wanted.name, extension, &bytes)?, is_linear: image.is_linear }
            }
        };
        self.pictures.insert(key, made.clone());
        Ok(made)
    }

    /// What a square with surface coordinates from 0 to 1 shows of a texture: its image, if that is the same.
    pub(crate) fn square(&mut self, scene: &WholeScene, wanted: &Use, formats: &[&str]) -> Result<String, WriteError> {
        let texture = &scene.textures[&wanted.name].texture;
        if picture::is_placed_as_image(texture) {
            return Ok(self.picture(scene, wanted, false, formats)?.file);
        }
        let key = format!("square {wanted:?}");
        if let Some(known) = self.pictures.get(&key) {
            return Ok(known.file.clone());
        }
        let image = picture::over_square(texture, wanted.change);
        let (extension, bytes) = image.bytes().map_err(|error| unwritable(&self.path, error))?;
        let file = self.add(&wanted.name, extension, &bytes)?;
        self.pictures.insert(key, Picture { file: file.clone(), is_linear: image.is_linear });
        Ok(file)
    }

    /// A copy of a file.
    pub(crate) fn copy(&mut self, file: &Path, extension: &str) -> Result<String, WriteError> {
        let failed = |error: std::io::Error| unwritable(&self.path, error);
        let bytes = InputFile::open(file, FileKind::Image).and_then(InputFile::bytes);
        let bytes = bytes.map_err(|error| failed(std::io::Error::other(error.to_string())))?;
        let stem = file.file_stem().map(|stem| path_to_text(stem.as_ref())).unwrap_or_default();
        self.add(&stem, extension, &bytes)
    }
}
