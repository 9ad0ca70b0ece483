//! Selection of the contents of a scene or model file: camera, time, exposure time and variant.

use serde::{Deserialize, Serialize};

/// Which camera, time and material variant of a glTF file to open, and which files it may read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ModelChoice {
    /// Name of the camera to use; `None`: the first one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// Time in the animations, seconds; `None`: the pose stored in the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// Exposure time as a fraction of the frame duration, 0..1; `None`: that of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shutter: Option<f64>,
    /// Name of the material variant; `None`: the default materials.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// Whether the model may refer to files outside of its folder.
    #[serde(skip)]
    pub allow_outside: bool,
    /// Names and values of parameters that a scene of another renderer leaves open.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub defines: Vec<(String, String)>,
}

impl ModelChoice {
    /// No selection.
    pub const DEFAULT: Self =
        Self { camera: None, at: None, shutter: None, variant: None, allow_outside: false, defines: Vec::new() };

    /// With what `other` selects where this selects nothing; files outside of the folder only if this allows them.
    pub fn or(self, other: &Self) -> Self {
        let is_open = |(name, _): &&(String, String)| self.defines.iter().all(|(own, _)| own != name);
        let defines = other.defines.iter().filter(is_open).chain(&self.defines).cloned().collect();
        Self {
            camera: self.camera.or_else(|| other.camera.clone()),
            at: self.at.or(other.at),
            shutter: self.shutter.or(other.shutter),
            variant: self.variant.or_else(|| other.variant.clone()),
            allow_outside: self.allow_outside,
            defines,
        }
    }
}

/// The up axis of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// +Y, as in scene files.
    Y,
    /// +Z, as in many CAD programs.
    Z,
}
