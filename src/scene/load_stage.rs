//! The stages of opening a scene, for a display of the progress.

/// What is being done, in this order; scenes without images or without meshes skip stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LoadStage {
    /// Scene files and models.
    Reading,
    /// Images of materials and of the environment.
    Images,
    /// Kd-trees of meshes.
    Trees,
}

impl LoadStage {
    /// All stages, the first one first.
    pub const ALL: [Self; 3] = [Self::Reading, Self::Images, Self::Trees];

    /// The stage in a word, for users.
    pub fn label(self) -> &'static str {
        match self {
            Self::Reading => "reading",
            Self::Images => "images",
            Self::Trees => "kd-trees",
        }
    }
}
