//! What can be opened.

use crate::format::error::{SceneError, suggestion};
use crate::format::model_format::ModelFormat;
use crate::format::scene_format::SceneFormat;
use crate::scene::builtin::{BUILTIN_SCENES, builtin_text};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// What to open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SceneSource {
    /// One of [`BUILTIN_SCENES`].
    Builtin(String),
    /// A scene file (RON).
    Scene(PathBuf),
    /// A scene of another renderer, of any [`SceneFormat`].
    Foreign(PathBuf),
    /// A model of any [`ModelFormat`], in a default scene.
    Model(PathBuf),
    /// An image rendered by this program (PNG, EXR): opens its scene with its camera.
    Picture(PathBuf),
}

impl SceneSource {
    /// Parses an argument of the command line: a built-in name, unless a file of that name exists.
    ///
    /// # Errors
    /// If it is neither a built-in scene nor a file of a supported kind.
    pub fn parse(word: impl AsRef<OsStr>) -> Result<Self, SceneError> {
        let path = Path::new(word.as_ref());
        let word = &*word.as_ref().to_string_lossy();
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        if !path.is_file() && builtin_text(word).is_some() {
            return Ok(Self::Builtin(word.to_owned()));
        }
        let (scenes, models) = (SceneFormat::extensions(), ModelFormat::extensions());
        match extension.as_deref() {
            _ if is_scene(path) => Ok(Self::of_scene(path.to_path_buf())),
            _ if ModelFormat::of(path).is_some() => Ok(Self::Model(path.to_path_buf())),
            Some("png" | "exr") => Ok(Self::Picture(path.to_path_buf())),
            _ if path.is_dir() => Err(SceneError::in_file(
                path,
                format!("is a folder: expected a scene ({scenes}), a model ({models}) or an image (.png, .exr)"),
            )),
            Some("hdr") if path.exists() => {
                let message = "is an environment image: add it to a scene or a model with --env FILE.hdr";
                Err(SceneError::in_file(path, message))
            }
            Some("zip") if path.exists() => {
                let message = "is an archive: open it with `firstlight FILE.zip`, or unpack it and open what is in it";
                Err(SceneError::in_file(path, message))
            }
            _ if path.exists() => {
                let message = format!(
                    "unsupported file format: expected a scene ({scenes}), a model ({models}) or an image rendered by \
                     firstlight (.png, .exr); convert other models to .glb or .obj"
                );
                Err(SceneError::in_file(path, message))
            }
            _ => {
                let hint = suggestion(word, BUILTIN_SCENES.iter().map(|(name, _, _)| *name));
                Err(SceneError::in_file(path, format!("no such file or built-in scene{hint}")))
            }
        }
    }

    /// A file that is a scene: of another renderer if its extension says so, else our own.
    pub fn of_scene(path: PathBuf) -> Self {
        if SceneFormat::of(&path).is_some() { Self::Foreign(path) } else { Self::Scene(path) }
    }

    /// The file to open, if it is one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Builtin(_) => None,
            Self::Scene(path) | Self::Foreign(path) | Self::Model(path) | Self::Picture(path) => Some(path),
        }
    }

    /// Its name in messages and window titles.
    pub fn title(&self) -> String {
        match self {
            Self::Builtin(name) => name.clone(),
            Self::Scene(path) | Self::Foreign(path) | Self::Model(path) | Self::Picture(path) => {
                path.display().to_string()
            }
        }
    }
}

/// Whether the name of a file is one of a scene.
fn is_scene(path: &Path) -> bool {
    SceneFormat::of(path).is_some() || path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron"))
}
