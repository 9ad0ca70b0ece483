//! Arguments that several commands have.

use super::console::remark;
use super::failure::Failure;
use clap::{Args, ValueEnum};
use firstlight::frame::check_film_source;
use firstlight::render::{Integrator, PixelFilter};
use firstlight::scene::whole_file::Replace;
use firstlight::scene::{Files, LoadOptions, LoadedScene, SceneSource, UpAxis, load};
use std::ffi::OsString;
use std::path::Path;

/// What to open, and how.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// A built-in scene, a scene file (.ron), a model (.obj), or a picture (.png, .exr) that this program made.
    #[arg(value_name = "SCENE|MODEL|PICTURE", default_value = "gallery")]
    pub scene: OsString,
    /// Which axis of a model points up; guessed from how it would stand when not given.
    #[arg(long, value_enum)]
    pub up: Option<UpArg>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum UpArg {
    Y,
    Z,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum IntegratorArg {
    /// Unbiased path tracing.
    Path,
    /// The classic local model with shadows, mirrors and glass.
    Phong,
}

impl From<IntegratorArg> for Integrator {
    fn from(arg: IntegratorArg) -> Self {
        match arg {
            IntegratorArg::Path => Self::Path,
            IntegratorArg::Phong => Self::Phong,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum FilterArg {
    Box,
    Tent,
    Gaussian,
    BlackmanHarris,
    Mitchell,
}

impl From<FilterArg> for PixelFilter {
    fn from(arg: FilterArg) -> Self {
        match arg {
            FilterArg::Box => Self::Box,
            FilterArg::Tent => Self::Tent,
            FilterArg::Gaussian => Self::Gaussian,
            FilterArg::BlackmanHarris => Self::BlackmanHarris,
            FilterArg::Mitchell => Self::Mitchell,
        }
    }
}

impl SceneArgs {
    pub fn up(&self) -> Option<UpAxis> {
        self.up.map(|up| match up {
            UpArg::Y => UpAxis::Y,
            UpArg::Z => UpAxis::Z,
        })
    }

    /// Loads the scene, or says why it cannot be had; `files` learns what is read for it, and refuses when one of
    /// the outputs that it knows is among that.
    pub fn load(
        &self,
        aspect: Option<f64>,
        files: &mut Files,
        progress: &(dyn Fn(&str) + Sync),
    ) -> Result<LoadedScene, Failure> {
        let source = self.source()?;
        if let Some(path) = source.path() {
            files.read(path)?;
            check_film_source(&source).map_err(Failure::Failed)?;
        }
        let options = LoadOptions { up: self.up(), aspect, progress: Some(progress), ..LoadOptions::default() };
        let scene = load(&source, &options).map_err(Failure::from)?;
        files.read_all(scene.files())?;
        for warning in &scene.warnings {
            remark(format_args!("warning: {warning}"));
        }
        Ok(scene)
    }

    /// What the word on the command line means.
    pub fn source(&self) -> Result<SceneSource, Failure> {
        SceneSource::parse(&self.scene).map_err(|error| {
            // A word that is neither a scene nor a file is a slip of the pen; a file may be wanting or unfit.
            let is_name = Path::new(&self.scene).extension().is_none() && !Path::new(&self.scene).exists();
            if is_name { Failure::Usage(error.to_string()) } else { Failure::Failed(error.to_string()) }
        })
    }
}

/// What outputs may take the place of.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct OverwriteArgs {
    /// Let an output take the place of a film, whose samples are lost then.
    #[arg(long)]
    pub overwrite: bool,
}

impl OverwriteArgs {
    pub fn replace(self) -> Replace {
        if self.overwrite { Replace::Anything } else { Replace::AllButFilms }
    }

    /// The files of a command that writes.
    pub fn files(self) -> Files {
        Files::new(self.replace())
    }
}
