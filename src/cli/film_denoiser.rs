//! Denoises a film that is not rendered any further: `merge --denoise`.
//!
//! A film holds light, not the surfaces that guide the denoiser. They come from its scene, which is opened as for
//! `render --resume`.

use crate::cli::denoising::DenoiserArg;
use crate::cli::failure::Failure;
use crate::cli::job::RenderJob;
use crate::cli::progress::RenderProgress;
use crate::cli::render::Command;
use crate::cli::render_args::RenderArgs;
use firstlight::render::{Denoised, Film, GuideGatherer};
use firstlight::scene::{Files, ImageMetadata};
use std::path::{Path, PathBuf};

/// The scene of a film with its denoiser.
pub struct FilmDenoiser {
    path: PathBuf,
    args: RenderArgs,
    job: RenderJob,
}

impl FilmDenoiser {
    /// Opens the scene.
    ///
    /// - `path`: of a film of it; `shot`: its metadata.
    pub fn open(
        path: &Path,
        shot: &ImageMetadata,
        denoiser: Option<DenoiserArg>,
        files: &mut Files,
    ) -> Result<Self, Failure> {
        let mut args =
            Command::parse(&["--denoise".to_owned()])?.render.jobs()?.pop().expect("there is a scene by default");
        args.scene.scene = path.as_os_str().to_owned();
        args.denoise.denoiser = denoiser;
        let job = RenderJob::new(&args, Some(shot), files, &RenderProgress::new())?;
        Ok(Self { path: path.to_path_buf(), args, job })
    }

    /// Name of the denoiser in image metadata.
    pub fn name(&self) -> String {
        self.args.denoise.name()
    }

    /// Denoises a film of the scene.
    ///
    /// - `shot`: its metadata.
    pub fn denoise(&self, film: &Film, shot: &ImageMetadata) -> Result<Denoised, Failure> {
        let note = self.job.note(film, &self.path);
        let now = ImageMetadata::from_note(&note).map_err(|error| Failure::Failed(error.into()))?;
        // Samples of both kinds have the same guides.
        let now = ImageMetadata { allocation: shot.allocation, ..now };
        if let Some(what) = now.differs_from(shot) {
            let message = "cannot be denoised: it was rendered with a different";
            return Err(Failure::Failed(format!("{}: {message} {what}", self.path.display())));
        }
        let denoised = self.job.denoised(film, &mut GuideGatherer::default(), &|| false)?;
        Ok(denoised.expect("nothing stops it"))
    }
}
