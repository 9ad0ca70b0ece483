//! What of a model is shown, where its file has more than one of it.

/// Which camera, moment and variant of a glTF file to open, and what it may read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelChoice {
    /// Name of the camera that is looked through; the first one when not given.
    pub camera: Option<String>,
    /// Seconds into the animations; what the file stores when not given.
    pub at: Option<f64>,
    /// Name of the variant of materials; the usual materials when not given.
    pub variant: Option<String>,
    /// A model may name files of this computer that are not in its folder or below.
    pub allow_outside: bool,
}

impl ModelChoice {
    /// Nothing is chosen.
    pub const DEFAULT: Self = Self { camera: None, at: None, variant: None, allow_outside: false };
}
