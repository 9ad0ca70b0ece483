//! Selection of the contents of a scene or model file: camera, time, exposure time and variant.

/// Which camera, time and material variant of a glTF file to open, and which files it may read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelChoice {
    /// Name of the camera to use; `None`: the first one.
    pub camera: Option<String>,
    /// Time in the animations, seconds; `None`: the pose stored in the file.
    pub at: Option<f64>,
    /// Exposure time as a fraction of the frame duration, 0..1; `None`: that of the scene.
    pub shutter: Option<f64>,
    /// Name of the material variant; `None`: the default materials.
    pub variant: Option<String>,
    /// Whether the model may refer to files outside of its folder.
    pub allow_outside: bool,
    /// Names and values of parameters that a scene of another renderer leaves open.
    pub defines: Vec<(String, String)>,
}

impl ModelChoice {
    /// No selection.
    pub const DEFAULT: Self =
        Self { camera: None, at: None, shutter: None, variant: None, allow_outside: false, defines: Vec::new() };
}

/// The up axis of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpAxis {
    /// +Y, as in scene files.
    Y,
    /// +Z, as in many CAD programs.
    Z,
}
