//! The displayed image: raw, denoised, or both; and the filter that denoises it.

#[cfg(feature = "cli")]
use crate::frame::core::oidn::Oidn;
use crate::render::{DenoiseSource, Denoised, SurfaceGuides, denoise_source};
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

/// The filter of denoised images at full resolution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum DenoiseFilter {
    /// firstlight's own.
    #[default]
    Own,
    /// Open Image Denoise, where it is installed.
    Oidn,
}

impl DenoiseFilter {
    /// All of them, in the order of menus.
    pub const ALL: [Self; 2] = [Self::Own, Self::Oidn];

    /// Name for the user.
    pub fn label(self) -> &'static str {
        match self {
            Self::Own => "firstlight",
            Self::Oidn => "Open Image Denoise",
        }
    }

    /// Name for the user where there is little space.
    pub fn short_label(self) -> &'static str {
        match self {
            Self::Own => "firstlight",
            Self::Oidn => "OIDN",
        }
    }

    /// Name in the metadata of images.
    pub fn name(self) -> &'static str {
        match self {
            Self::Own => "own",
            Self::Oidn => "oidn",
        }
    }

    /// Whether the filter can be used here.
    ///
    /// # Errors
    /// If it cannot, with what to do.
    pub fn check(self) -> Result<(), String> {
        match self {
            Self::Own => Ok(()),
            #[cfg(feature = "cli")]
            Self::Oidn => Oidn::load(1).map(drop).map_err(|error| error.to_string()),
            #[cfg(not(feature = "cli"))]
            Self::Oidn => Err("this build has no Open Image Denoise: it needs the feature cli".to_owned()),
        }
    }

    /// Denoises on the threads of the current pool, and returns the filter that was used: firstlight's own, with a
    /// warning, where another one fails. `None` if `stop` returned true.
    pub fn denoise(
        self,
        source: &DenoiseSource,
        guides: &SurfaceGuides,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<(Self, Denoised)> {
        #[cfg(feature = "cli")]
        if self == Self::Oidn {
            match Oidn::load(rayon::current_num_threads()).and_then(|oidn| oidn.denoise(source, guides, stop)) {
                Ok(denoised) => return denoised.map(|denoised| (self, denoised)),
                Err(error) => tracing::warn!("{error}; firstlight's own filter is used"),
            }
        }
        denoise_source(source, guides, stop).map(|denoised| (Self::Own, denoised))
    }
}
