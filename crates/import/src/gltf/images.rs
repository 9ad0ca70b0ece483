//! Images inside a model: in a buffer view or a data URI.

use crate::error::gltf::{GltfError, GltfProblem, Located, item, place};
use crate::gltf::document::{Document, ReadOptions};
use crate::gltf::uri::Uri;
use firstlight_format::model_format::ModelFormat;
use std::path::{Path, PathBuf};

/// Model and image index of a path such as `model.glb#3`; `None` for other paths, and if a file of exactly that name
/// exists.
pub fn part_of_model(path: &Path) -> Option<(PathBuf, u32)> {
    let text = path.to_str()?;
    let (model, number) = text.rsplit_once('#')?;
    let number: u32 = number.parse().ok()?;
    let is_model = ModelFormat::of(Path::new(model)) == Some(ModelFormat::Gltf);
    (is_model && !path.exists()).then(|| (PathBuf::from(model), number))
}

impl Document {
    /// The encoded bytes of an image inside the file.
    ///
    /// # Errors
    /// If there is no such image, or it is a separate file.
    pub(crate) fn picture_bytes(&self, number: u32) -> Result<Vec<u8>, Located> {
        let here = |problem| (place("images", number), problem);
        let image = item(&self.root.images, "images", number).map_err(here)?;
        if let Some(view) = image.buffer_view {
            return self.view(view).map(|(bytes, _)| bytes.to_vec());
        }
        let uri = image.uri.as_deref().ok_or_else(|| here(GltfProblem::Missing("its uri or bufferView")))?;
        match self.resolved(uri, &place("images", number)).map_err(here)? {
            Uri::Data(bytes) => Ok(bytes),
            Uri::File(_) => Err(here(GltfProblem::Missing("its image: it is a file of its own, and"))),
        }
    }
}

/// The encoded bytes of an image inside a model that is not open.
///
/// # Errors
/// If the model cannot be read or has no such image.
pub(crate) fn picture_of(model: &Path, number: u32) -> Result<Vec<u8>, GltfError> {
    let document = Document::read(model, ReadOptions::default())?;
    document.picture_bytes(number).map_err(|located| document.error(located))
}
