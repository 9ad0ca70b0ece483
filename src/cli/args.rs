//! Arguments shared by several commands.

use crate::cli::console::{remark, tell};
use crate::cli::failure::Failure;
use crate::cli::number::{parse_define, parse_seconds, parse_shutter};
use clap::{Args, ValueEnum};
use firstlight::cluster::job_option::{JobOption, OptionName};
use firstlight::cluster::pack::Opening;
use firstlight::cluster::unpack::{UnpackError, Unpacked, is_archive, unpack};
use firstlight::frame::check_film_source;
use firstlight::render::{Integrator, PixelFilter};
use firstlight::scene::model::ModelFormat;
use firstlight::scene::whole_file::Replace;
use firstlight::scene::{Files, LoadOptions, LoadedScene, ModelChoice, SceneSource, UpAxis, archive_cache, load};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The scene to open, and how.
#[derive(Args, Clone, Debug, Default)]
pub struct SceneArgs {
    /// Built-in scene, scene file (.ron, .pbrt, .xml, .json), model (.obj, .ply, .stl, .glb, .gltf, .vrm), image
    /// rendered by firstlight (.png, .exr), or archive of `firstlight pack` (.zip).
    #[arg(value_name = "SCENE|MODEL|IMAGE", default_value = "gallery")]
    pub scene: OsString,
    #[command(flatten)]
    pub how: OpenArgs,
}

/// Several scenes to open with the same options.
#[derive(Args, Clone, Debug)]
pub struct ScenesArgs {
    /// Built-in scenes, scene files (.ron, .pbrt, .xml, .json), models (.obj, .ply, .stl, .glb, .gltf, .vrm), images
    /// rendered by firstlight (.png, .exr), or archives of `firstlight pack` (.zip).
    #[arg(value_name = "SCENE|MODEL|IMAGE", default_value = "gallery")]
    pub scenes: Vec<OsString>,
    #[command(flatten)]
    pub how: OpenArgs,
}

/// Reports all files that do not exist, before work begins.
pub fn check_scenes<'a>(scenes: impl Iterator<Item = &'a SceneArgs>) -> Result<(), Failure> {
    let mut problems = Vec::new();
    for scene in scenes {
        let source = scene.source()?;
        // Other problems are found when the file is read.
        if let Some(path) = source.path().filter(|path| !path.exists()) {
            problems.push(format!("{}: cannot be read: no such file", path.display()));
        }
    }
    if problems.is_empty() { Ok(()) } else { Err(Failure::Problems(problems)) }
}

impl ScenesArgs {
    pub fn each(&self) -> impl Iterator<Item = SceneArgs> {
        self.scenes.iter().map(|scene| SceneArgs { scene: scene.clone(), how: self.how.clone() })
    }
}

/// How to open a scene.
#[derive(Args, Clone, Debug, Default)]
pub struct OpenArgs {
    /// Up axis of a model [default: detected from its shape].
    #[arg(long, value_enum, help_heading = "Scene")]
    pub up: Option<UpArg>,
    /// Camera of a glTF model or of `cameras` in a scene file, by name [default: the first, or `camera`].
    #[arg(long, value_name = "NAME", help_heading = "Scene")]
    pub camera: Option<String>,
    /// Moment of the animation, in seconds [default: that of the scene file; the stored pose of a glTF model].
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, allow_negative_numbers = true, help_heading = "Scene")]
    pub at: Option<f64>,
    /// Exposure time as a share of the time of a frame, 0 to 1: what moves in it is blurred [default: that of the scene file]
    #[arg(long, value_name = "SHARE", value_parser = parse_shutter, allow_negative_numbers = true, help_heading = "Scene")]
    pub shutter: Option<f64>,
    /// Variant of a glTF model's materials, by name.
    #[arg(long, value_name = "NAME", help_heading = "Scene")]
    pub variant: Option<String>,
    /// Allow models to read files outside of their own folders.
    #[arg(long, help_heading = "Scene")]
    pub allow_outside: bool,
    /// Value of a parameter of a Mitsuba scene, in place of its default.
    #[arg(short = 'D', long = "define", value_name = "NAME=VALUE", value_parser = parse_define, help_heading = "Scene")]
    pub defines: Vec<(String, String)>,
    /// Environment image (.hdr, .exr, .png, .jpg) that lights the scene instead of its own environment.
    #[arg(long, value_name = "FILE", visible_alias = "environment")]
    pub env: Option<PathBuf>,
}

impl OpenArgs {
    /// The chosen camera, time and variant of a model.
    pub fn choice(&self) -> ModelChoice {
        ModelChoice {
            camera: self.camera.clone(),
            at: self.at,
            shutter: self.shutter,
            variant: self.variant.clone(),
            allow_outside: self.allow_outside,
            defines: self.defines.clone(),
        }
    }
}

/// The options for opening a scene like this.
pub fn open_options(Opening { up, choice }: &Opening) -> impl Iterator<Item = JobOption> {
    let up = up.map(|up| match up {
        UpAxis::Y => "y",
        UpAxis::Z => "z",
    });
    [
        up.map(|up| OptionName::Up.with(up)),
        choice.camera.as_ref().map(|camera| OptionName::Camera.with(camera)),
        choice.at.map(|at| OptionName::At.with(at)),
        choice.shutter.map(|share| OptionName::Shutter.with(share)),
        choice.variant.as_ref().map(|variant| OptionName::Variant.with(variant)),
        choice.allow_outside.then(|| OptionName::AllowOutside.flag()),
    ]
    .into_iter()
    .flatten()
    .chain(choice.defines.iter().map(|(name, value)| OptionName::Define.with(format!("{name}={value}"))))
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
    /// Phong shading with shadows, mirrors and glass.
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
    // As scene files spell it.
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
    /// What to open of it, and the up axis: as the options say, or else the archive.
    pub fn opening(&self) -> Result<Opening, Failure> {
        let path = Path::new(&self.scene);
        let packed = if is_archive(path) && path.is_file() { unpacked(path)?.opening } else { Opening::default() };
        let up = self.how.up.map(|up| match up {
            UpArg::Y => UpAxis::Y,
            UpArg::Z => UpAxis::Z,
        });
        Ok(Opening { up: up.or(packed.up), choice: self.how.choice().or(&packed.choice) })
    }

    /// Loads the scene; registers all files that are read in `files`, which rejects them if one of them is also an
    /// output.
    pub fn load(
        &self,
        aspect: Option<f64>,
        files: &mut Files,
        progress: &(dyn Fn(&str) + Sync),
    ) -> Result<LoadedScene, Failure> {
        let source = self.source()?;
        files.read_all(self.own_files(&source))?;
        if source.path().is_some() {
            check_film_source(&source)?;
        }
        self.tell_ignored(&source);
        let scene = self.opened(&source, aspect, progress)?;
        files.read_all(scene.files())?;
        tell(&scene.warnings);
        Ok(scene)
    }

    /// All files that [`load`](Self::load) reads.
    pub fn files(&self) -> Result<Vec<PathBuf>, Failure> {
        let source = self.source()?;
        let mut files = self.own_files(&source);
        files.extend(self.opened(&source, None, &|_| ())?.files());
        Ok(files)
    }

    /// Files of the scene of an image or a film that an output of this path would replace; none where there is no such
    /// output yet, or the scene is not there.
    pub fn files_behind(image: &Path, output: &Path) -> Vec<PathBuf> {
        let scene = Self { scene: image.as_os_str().to_owned(), ..Self::default() };
        if output.exists() { scene.files().unwrap_or_default() } else { Vec::new() }
    }

    /// The files of the command line.
    fn own_files(&self, source: &SceneSource) -> Vec<PathBuf> {
        let given = Path::new(&self.scene);
        let archive = (is_archive(given) && given.is_file()).then_some(given);
        archive.into_iter().chain(source.path()).map(Path::to_path_buf).collect()
    }

    fn opened(
        &self,
        source: &SceneSource,
        aspect: Option<f64>,
        progress: &(dyn Fn(&str) + Sync),
    ) -> Result<LoadedScene, Failure> {
        let environment = self.environment()?;
        let environment = environment.as_deref();
        let Opening { up, choice } = self.opening()?;
        let told = |_, text: &str| progress(text);
        let (progress, choice): (Option<&(dyn Fn(_, &str) + Sync)>, _) = (Some(&told), Some(&choice));
        let options = LoadOptions { up, aspect, environment, progress, choice, ..LoadOptions::default() };
        load(source, &options).map_err(Failure::from)
    }

    /// The image that lights the scene instead of its own environment: of the option, or of the archive.
    pub fn environment(&self) -> Result<Option<PathBuf>, Failure> {
        let path = Path::new(&self.scene);
        Ok(match &self.how.env {
            None if is_archive(path) && path.is_file() => unpacked(path)?.environment,
            given => given.clone(),
        })
    }

    /// Warns of options that have no effect on this source.
    pub fn tell_ignored(&self, source: &SceneSource) {
        let what = match source {
            _ if self.how.up.is_none() => return,
            SceneSource::Model(path) if ModelFormat::of(path) == Some(ModelFormat::Gltf) => {
                "a glTF model, which is Y up"
            }
            SceneSource::Model(_) | SceneSource::Picture(_) => return,
            SceneSource::Builtin(_) => "a built-in scene",
            SceneSource::Scene(_) | SceneSource::Foreign(_) => "a scene file",
        };
        remark(format_args!("warning: {}: --up has no effect on {what}", source.title()));
    }

    /// The source that the argument names. An archive is unpacked, once in a process.
    pub fn source(&self) -> Result<SceneSource, Failure> {
        let path = Path::new(&self.scene);
        if is_archive(path) && path.is_file() {
            let scene = unpacked(path)?.scene;
            return SceneSource::parse(&scene).map_err(Failure::from);
        }
        SceneSource::parse(&self.scene).map_err(|error| {
            // A word without extension that is no file is a typing error (usage); otherwise the file is missing or
            // invalid.
            let is_name = Path::new(&self.scene).extension().is_none() && !Path::new(&self.scene).exists();
            if is_name { Failure::Usage(error.to_string()) } else { Failure::Failed(error.to_string()) }
        })
    }
}

/// Unpacks an archive into the cache folder of the platform, or into one for temporary files.
fn unpacked(archive: &Path) -> Result<Unpacked, Failure> {
    static KNOWN: Mutex<BTreeMap<PathBuf, Unpacked>> = Mutex::new(BTreeMap::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(unpacked) = known.get(archive) {
        return Ok(unpacked.clone());
    }
    let failed = |error: UnpackError| match error {
        UnpackError::Write(error) => error.into(),
        UnpackError::Read(error) if error.may_pass() => Failure::Passing(format!("{}: {error}", archive.display())),
        error => Failure::Failed(format!("{}: {error}", archive.display())),
    };
    let unpacked = unpack(archive, &archive_cache()).map_err(failed)?;
    known.insert(archive.to_path_buf(), unpacked.clone());
    Ok(unpacked)
}

/// What outputs may replace.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct OverwriteArgs {
    /// Allow an output to replace an existing film, whose samples are lost.
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,
}

impl OverwriteArgs {
    pub fn replace(self) -> Replace {
        if self.overwrite { Replace::Anything } else { Replace::AllButFilms }
    }

    /// The file registry of a command that writes.
    pub fn files(self) -> Files {
        Files::new(self.replace())
    }
}

/// The end of a message, which names the files that were replaced.
pub fn replaced(paths: &[PathBuf]) -> String {
    if paths.is_empty() {
        return String::new();
    }
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    format!(", replaced the existing {}", names.join(", "))
}
