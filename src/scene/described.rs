//! The open scene again, with its unsaved edits: for work that goes on while the first one changes.

use crate::files::warnings::Warnings;
use crate::format::error::SceneError;
use crate::import::documents::Documents;
use crate::scene::describe::Description;
use crate::scene::load::{LoadOptions, resolve};
use crate::scene::loaded::LoadedScene;
use crate::scene::world::trees::Trees;

impl LoadedScene {
    /// The scene of `description`, which is what became of this one. Meshes, images and trees are shared as far as their
    /// files have not changed.
    ///
    /// - `trees`: of what is in the world now.
    ///
    /// # Errors
    /// If a file that was read before is gone or damaged, or the scene has meshes that are in no file.
    pub fn described(&self, description: &Description, trees: Trees) -> Result<Self, SceneError> {
        if !description.loose_meshes.is_empty() {
            return Err(SceneError::new("some of its meshes are in no file: save the scene first"));
        }
        let known = Self { trees, ..self.clone() };
        let options = LoadOptions { up: self.up, known: Some(&known), ..LoadOptions::default() };
        let documents = Documents::new(&self.choice);
        let (file, folder) = (description.file.clone(), description.folder.clone());
        let mut scene = resolve(&self.source, file, None, folder, &options, &documents)?;
        scene.build_trees(&options)?;
        // They were told when it was opened.
        scene.warnings = Warnings::default();
        Ok(scene)
    }
}
