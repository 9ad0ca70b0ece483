//! Saving: writes the world as a scene file that reads back as exactly this world.

use crate::files::input_file::{FileKind, InputFile};
use crate::files::relative::{path_to_text, text_to_path};
use crate::files::whole_file::{write_new, write_whole};
use crate::files::write_error::WriteError;
use crate::format::parts::ObjectPart;
use crate::format::paths::move_paths;
use crate::format::scene_file::SceneFile;
use crate::format::sources::MeshSource;
use crate::import::obj::write::{NewObj, ObjExtras, save_new_obj};
use crate::scene::describe::Description;
use crate::scene::loaded::LoadedScene;
use crate::scene::unpacked_files::{Copies, keep_unpacked};
use bevy_ecs::prelude::World;
use std::path::Path;

/// The result of saving.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SavedScene {
    /// The text of the file.
    pub text: String,
    /// Remarks for the user, one sentence each.
    pub notes: Vec<String>,
}

/// Writes the contents of `world` as a scene file; `loaded`: the scene that was opened into it, if any.
///
/// Writes atomically. Paths of meshes and images are relative to the new file; meshes that came from no file are
/// written beside it, and so are copies of the files of an archive. The text is parsed and compared before it replaces an older file.
///
/// # Errors
/// If the world holds values that a scene file must not have, or the file cannot be written.
pub fn save_scene(world: &mut World, loaded: Option<&LoadedScene>, path: &Path) -> Result<SavedScene, WriteError> {
    Description::of(world, loaded).save(path)
}

impl Description {
    /// Like [`save_scene`].
    ///
    /// # Errors
    /// Like [`save_scene`].
    pub fn save(self, path: &Path) -> Result<SavedScene, WriteError> {
        save(self, path, true, write_whole)
    }

    /// Like [`Self::save`], but replaces no file.
    ///
    /// # Errors
    /// Like [`save_scene`], and if there is a file already.
    pub fn save_new(self, path: &Path) -> Result<SavedScene, WriteError> {
        save(self, path, true, write_new)
    }

    /// Like [`Self::save`], for a scene that is saved again later: refers to the files of an archive where they are.
    ///
    /// # Errors
    /// Like [`save_scene`].
    pub fn save_draft(self, path: &Path) -> Result<SavedScene, WriteError> {
        save(self, path, false, write_whole)
    }
}

fn save(
    mut description: Description,
    path: &Path,
    keeps_files: bool,
    write: fn(&Path, &[u8]) -> Result<(), WriteError>,
) -> Result<SavedScene, WriteError> {
    let failed = |error| WriteError::Scene { path: path.to_path_buf(), source: Box::new(error) };
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    move_paths(&mut description.file, &description.folder, &folder);
    let mut notes = std::mem::take(&mut description.losses);
    let stem = path.file_stem().map_or_else(|| "scene".to_owned(), |stem| path_to_text(stem.as_ref()));
    let mut copies = match keeps_files {
        true => keep_unpacked(&mut description.file, &folder, &stem)?,
        false => Copies::default(),
    };
    notes.append(&mut copies.notes);
    let mut number = 0;
    for (object, mesh) in &description.loose_meshes {
        let comment = format!("a mesh of {}", path.display());
        let extras = ObjExtras { comment: &comment, ..ObjExtras::default() };
        let name = loop {
            number += 1;
            let name = format!("{stem}-mesh-{number}.obj");
            // An existing file may hold another mesh of this scene: it is never replaced by a different one.
            match save_new_obj(&folder.join(text_to_path(&name)), mesh, &extras)
                .map_err(|error| WriteError::Mesh(Box::new(error)))?
            {
                NewObj::Written => notes.push(format!("a mesh without a file was saved as {name}")),
                NewObj::Same => {}
                NewObj::Taken => continue,
            }
            break name;
        };
        if let Some(ObjectPart::Mesh { source, .. }) = description.file.objects.get_mut(*object) {
            *source = MeshSource::Obj(name);
        }
    }
    description.file.check().map_err(failed)?;
    let text = description.file.to_ron();
    let again = SceneFile::parse(&text, path).map_err(failed)?;
    if again != description.file {
        return Err(WriteError::WouldDiffer(path.to_path_buf()));
    }
    if InputFile::open(path, FileKind::Scene).and_then(InputFile::text).is_ok_and(|old| has_comments(&old)) {
        notes.push("comments of the previous file were removed".to_owned());
    }
    copies.finish(|| write(path, text.as_bytes()))?;
    Ok(SavedScene { text, notes })
}

/// Whether a scene file has comments outside of strings.
fn has_comments(text: &str) -> bool {
    let mut in_string = false;
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '\\' if in_string => drop(chars.next()),
            '"' => in_string = !in_string,
            '/' if !in_string && matches!(chars.peek(), Some('/' | '*')) => return true,
            _ => {}
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_are_found_and_strings_are_not_comments() {
        assert!(has_comments("(a: 1, // one\n)") && has_comments("/* one */ ()"));
        assert!(!has_comments(r#"(a: "http://x", b: "\"//")"#));
    }
}
