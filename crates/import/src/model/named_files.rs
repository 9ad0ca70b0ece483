//! The files that a scene of another renderer names, each looked for once.

use firstlight_files::reference::References;
use firstlight_files::relative::path_to_text;
use std::collections::HashMap;
use std::path::Path;

pub(crate) struct NamedFiles<'a> {
    /// Of the scene: paths are relative to it.
    folder: &'a Path,
    pub references: References,
    /// The path in the scene file by the name, `None` if it must not be read.
    known: HashMap<String, Option<String>>,
}

impl<'a> NamedFiles<'a> {
    pub(crate) fn of(scene: &'a Path, allow_outside: bool) -> Self {
        let folder = scene.parent().unwrap_or(Path::new(""));
        Self { folder, references: References::of(scene, allow_outside), known: HashMap::new() }
    }

    /// The path of a file in the scene file, `None` if it must not be read; and what is to be told, the first time.
    pub(crate) fn find(&mut self, name: &str) -> (Option<String>, Option<String>) {
        if let Some(known) = self.known.get(name) {
            return (known.clone(), None);
        }
        let (path, told) = match self.references.resolve(self.folder, name) {
            Ok(found) => (Some(path_to_text(&found.path)), found.difference(name)),
            Err(outside) => (None, Some(outside.to_string())),
        };
        self.known.insert(name.to_owned(), path.clone());
        (path, told)
    }

    /// Likewise, of a file that was looked for before.
    pub(crate) fn known(&self, name: &str) -> Option<String> {
        self.known.get(name).cloned().flatten()
    }
}
