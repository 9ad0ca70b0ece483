//! `--denoise` and `--denoiser`: which denoiser, and whether it can be had.

use crate::cli::failure::Failure;
use clap::{Args, ValueEnum};
use firstlight::frame::DenoiseFilter;
use firstlight::frame::oidn::Oidn;
use firstlight::render::{DenoiseSource, Denoised, Film, SurfaceGuides, denoise_source};

#[derive(Args, Clone, Copy, Debug, Default)]
pub struct DenoiseArgs {
    /// Save the image denoised: raw and filtered combined, so that it converges to the raw image
    ///
    /// Also without this option where the scene is a denoised image, unless --no-denoise or --region is given. With
    /// --layers, the denoised image is the layer `denoised`, and the others stay raw. The film stays raw, and --error
    /// counts for the raw image unless --error-of denoised is given.
    #[arg(long, conflicts_with = "region")]
    pub denoise: bool,
    /// Save the image raw, also for a scene that is a denoised image.
    #[arg(help_heading = "Output", long, conflicts_with = "denoise")]
    pub no_denoise: bool,
    /// The filter of --denoise and --layers denoised [default: own, or that of the image that is opened].
    #[arg(help_heading = "Output", long, value_enum, value_name = "FILTER")]
    pub denoiser: Option<DenoiserArg>,
    /// The image whose error --error counts [default: raw].
    #[arg(help_heading = "Rendering", long, value_enum, value_name = "IMAGE", requires = "error")]
    pub error_of: Option<ErrorOf>,
}

#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum DenoiserArg {
    /// Regression on feature buffers; the same bytes on every machine.
    Own,
    /// Open Image Denoise, if it is installed or FIRSTLIGHT_OIDN is its path.
    Oidn,
}

#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorOf {
    /// The samples themselves.
    Raw,
    /// The denoised image; it is denoised four times between two powers of two of the samples.
    Denoised,
}

impl DenoiseArgs {
    /// Checks that what is asked for belongs to an image that is denoised.
    ///
    /// - `wanted`: whether an image or a layer is denoised.
    pub fn check(&self, wanted: bool) -> Result<(), Failure> {
        let option = match self {
            _ if wanted => return Ok(()),
            Self { denoiser: Some(_), .. } => "--denoiser",
            Self { error_of: Some(ErrorOf::Denoised), .. } => "--error-of denoised",
            _ => return Ok(()),
        };
        Err(Failure::Usage(format!("{option} needs an image that is denoised: add --denoise or --layers denoised")))
    }

    /// Denoises like an image that is opened, unless it is told otherwise.
    ///
    /// - `filter`: the name in its metadata.
    pub fn like(&mut self, filter: &str) {
        self.denoise = true;
        let of_image = if filter == DenoiseFilter::Oidn.name() { DenoiserArg::Oidn } else { DenoiserArg::Own };
        self.denoiser.get_or_insert(of_image);
    }

    /// Name of the denoiser in image metadata.
    pub fn name(&self) -> String {
        let filter = if self.denoiser == Some(DenoiserArg::Oidn) { DenoiseFilter::Oidn } else { DenoiseFilter::Own };
        filter.name().to_owned()
    }
}

/// A denoiser that is ready.
pub enum ImageDenoiser {
    Own,
    Oidn(Oidn),
}

impl ImageDenoiser {
    /// The one that is asked for, for the threads of the current pool; `None` if nothing is denoised.
    ///
    /// - `wanted`: whether an image or a layer is denoised.
    pub fn of(args: &DenoiseArgs, wanted: bool) -> Result<Option<Self>, Failure> {
        Ok(match args.denoiser {
            _ if !wanted => None,
            Some(DenoiserArg::Oidn) => {
                let oidn = Oidn::load(rayon::current_num_threads());
                Some(Self::Oidn(oidn.map_err(|error| Failure::Failed(error.to_string()))?))
            }
            _ => Some(Self::Own),
        })
    }

    /// `None` if `stop` returned true.
    pub fn denoise(
        &self,
        film: &Film,
        guides: &SurfaceGuides,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Denoised>, Failure> {
        let source = DenoiseSource::of(film);
        match self {
            Self::Own => Ok(denoise_source(&source, guides, stop)),
            Self::Oidn(oidn) => oidn.denoise(&source, guides, stop).map_err(|error| Failure::Failed(error.to_string())),
        }
    }
}
