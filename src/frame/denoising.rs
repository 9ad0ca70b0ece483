//! The displayed image: raw, denoised, or both.

use serde::{Deserialize, Serialize};

/// How much noise the displayed image keeps; samples do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Denoising {
    /// The raw image.
    #[default]
    Raw,
    /// The denoised image.
    Denoised,
    /// Raw on the left, denoised on the right.
    Split,
}

impl Denoising {
    /// All of them, in the order of menus.
    pub const ALL: [Self; 3] = [Self::Raw, Self::Denoised, Self::Split];

    /// Name for the user, lower case.
    pub fn label(self) -> &'static str {
        match self {
            Self::Raw => "raw",
            Self::Denoised => "denoised",
            Self::Split => "split",
        }
    }

    /// The next one of the cycle raw, denoised, split.
    pub fn next(self) -> Self {
        match self {
            Self::Raw => Self::Denoised,
            Self::Denoised => Self::Split,
            Self::Split => Self::Raw,
        }
    }
}
