//! The command line: one file a command. Exit status 0: done; 1: it failed; 2: the command was not
//! understood; 130: stopped by Ctrl+C, what there was is saved.
//!
//! A command is obedient by construction: it runs where it can be left behind (see `stop`).

mod animate;
mod console;
mod explain;
mod info;
mod merge;
mod number;
mod progress;
mod render;
mod report;
mod save;
mod show;
mod simplify;
mod stability;
mod stop;
mod trees;
mod waiting;

use clap::{Args, Parser, Subcommand, ValueEnum};
use console::{lines, remark};
use firstlight::console::LogWriter;
use firstlight::kdtree::InstructionSet;
use firstlight::printable;
use firstlight::render::{Integrator, PixelFilter};
use firstlight::scene::whole_file::Replace;
use firstlight::scene::{
    BUILTIN_SCENES, Files, FilesError, LoadOptions, LoadedScene, SceneError, SceneSource, UpAxis, load,
};
use number::{parse_positive, parse_size};
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;
use stop::Stop;

/// An interactive, progressive path tracer: open a model, fly through it, watch it converge.
#[derive(Parser)]
#[command(name = "firstlight", bin_name = "firstlight", version, args_conflicts_with_subcommands = true, after_help = builtin_help())]
struct CommandLine {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    show: show::ShowArgs,
    /// Instruction set of the renderer; the pictures are the same. Without it: the widest of the processor.
    #[arg(long, value_name = "SET", value_enum, global = true)]
    simd: Option<SimdArg>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SimdArg {
    Avx512,
    Avx2,
    Portable,
}

impl SimdArg {
    /// Makes it the one of this process.
    fn choose(self) -> Result<(), Failure> {
        let set = match self {
            Self::Avx512 => InstructionSet::Avx512,
            Self::Avx2 => InstructionSet::Avx2,
            Self::Portable => InstructionSet::Portable,
        };
        let missing = || Failure::Failed(format!("this processor does not have {set:?}: leave out --simd"));
        set.set_default().then_some(()).ok_or_else(missing)
    }
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene to a picture, without a window.
    Render(render::RenderArgs),
    /// Measure speed against error: how fast scenes get right, and what each technique is worth.
    Report(report::ReportArgs),
    /// Add up films of one picture that have different samples.
    Merge(merge::MergeArgs),
    /// Write a scene file of a model, a built-in scene, or of what a picture shows.
    Save(save::SaveArgs),
    /// Count failures on hard cases: leaks, self-hits, missed hits, wrong depths, bad samples, lost light.
    Stability(stability::StabilityArgs),
    /// Tell what is in a scene, what it uses and what is not modelled.
    Info(info::InfoArgs),
    /// Tell why a pixel looks as it does: which lights reach it, after how many bounces, and along which paths.
    Explain(explain::ExplainArgs),
    /// Write a model with fewer triangles, and measure how far it is from the original.
    Simplify(simplify::SimplifyArgs),
}

impl Command {
    fn run(&self, stop: &Stop) -> Result<(), Failure> {
        match self {
            Self::Render(args) => render::run(args, stop),
            Self::Report(args) => report::run(args, stop),
            Self::Merge(args) => merge::run(args),
            Self::Save(args) => save::run(args),
            Self::Stability(args) => stability::run(args),
            Self::Info(args) => info::run(args),
            Self::Explain(args) => explain::run(args),
            Self::Simplify(args) => simplify::run(args, stop),
        }
    }
}

/// What to open, and how.
#[derive(Args, Clone, Debug)]
struct SceneArgs {
    /// A built-in scene, a scene file (.ron), a model (.obj), or a picture (.png, .exr) that this program made.
    #[arg(value_name = "SCENE|MODEL|PICTURE", default_value = "gallery")]
    scene: OsString,
    /// Which axis of a model points up; guessed from how it would stand when not given.
    #[arg(long, value_enum)]
    up: Option<UpArg>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum UpArg {
    Y,
    Z,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum IntegratorArg {
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
enum FilterArg {
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
    fn up(&self) -> Option<UpAxis> {
        self.up.map(|up| match up {
            UpArg::Y => UpAxis::Y,
            UpArg::Z => UpAxis::Z,
        })
    }

    /// Loads the scene, or says why it cannot be had; `files` learns what is read for it, and refuses when one of
    /// the outputs that it knows is among that.
    fn load(
        &self,
        aspect: Option<f64>,
        files: &mut Files,
        progress: &(dyn Fn(&str) + Sync),
    ) -> Result<LoadedScene, Failure> {
        let source = self.source()?;
        if let Some(path) = source.path() {
            files.read(path)?;
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
    fn source(&self) -> Result<SceneSource, Failure> {
        SceneSource::parse(&self.scene).map_err(|error| {
            // A word that is neither a scene nor a file is a slip of the pen; a file may be wanting or unfit.
            let is_name = Path::new(&self.scene).extension().is_none() && !Path::new(&self.scene).exists();
            if is_name { Failure::Usage(error.to_string()) } else { Failure::Failed(error.to_string()) }
        })
    }
}

/// Why a command did not do its work; a message of one line, but for [`Failure::Problems`].
enum Failure {
    /// The command itself cannot be right.
    Usage(String),
    Failed(String),
    /// It failed for several reasons; each is a message of its own.
    Problems(Vec<String>),
    /// Somebody pressed Ctrl+C; says what was saved.
    Stopped(String),
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::Problems(error.problems.iter().map(ToString::to_string).collect())
    }
}

impl From<FilesError> for Failure {
    fn from(error: FilesError) -> Self {
        match error {
            FilesError::Collision(message) => Self::Usage(message),
            FilesError::Unwritable(message) => Self::Failed(message),
        }
    }
}

/// What outputs may take the place of.
#[derive(Args, Clone, Copy, Debug, Default)]
struct OverwriteArgs {
    /// Let an output take the place of a film, whose samples are lost then.
    #[arg(long)]
    overwrite: bool,
}

impl OverwriteArgs {
    fn replace(self) -> Replace {
        if self.overwrite { Replace::Anything } else { Replace::AllButFilms }
    }

    /// The files of a command that writes.
    fn files(self) -> Files {
        Files::new(self.replace())
    }
}

/// Runs what the command line asks for.
pub fn main() -> ExitCode {
    firstlight::console::tell_panics();
    start_log();
    let line = match CommandLine::try_parse() {
        Ok(line) => line,
        Err(error) => return not_understood(error),
    };
    let result = line.simd.map_or(Ok(()), SimdArg::choose).and_then(|()| match line.command {
        Some(command) => Stop::obeyed_by(move |stop| command.run(stop)),
        None => show::run(&line.show),
    });
    let (messages, code) = match result {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Usage(message)) => (vec![message], 2),
        Err(Failure::Failed(message)) => (vec![message], 1),
        Err(Failure::Problems(messages)) => (messages, 1),
        Err(Failure::Stopped(message)) => {
            remark(message);
            return ExitCode::from(stop::STOPPED);
        }
    };
    for message in messages {
        remark(format_args!("error: {message}"));
    }
    ExitCode::from(code)
}

/// What clap has to say: help on standard output, or what it did not understand, with status 2 and the nearest known
/// option.
fn not_understood(error: clap::Error) -> ExitCode {
    if !error.use_stderr() {
        // The program's own words. Whoever closed the pipe has read enough.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    // It quotes what was typed, and a line end in that would begin a line of its own: asked again with words that are fit
    // to be printed, it says the same of those.
    let words: Vec<_> = std::env::args_os().collect();
    let shown: Vec<String> = words.iter().map(|word| printable::name(&word.to_string_lossy()).into_owned()).collect();
    let error = match words.iter().zip(&shown).all(|(word, shown)| word == shown.as_str()) {
        true => error,
        false => CommandLine::try_parse_from(shown).err().filter(clap::Error::use_stderr).unwrap_or(error),
    };
    remark(lines(error.render().to_string().trim_end()));
    ExitCode::from(2)
}

/// Warnings go to the terminal, those of the window libraries only when something fails; `RUST_LOG` asks for more.
fn start_log() {
    use tracing_subscriber::EnvFilter;
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| {
        EnvFilter::new("warn,winit=error,egui_wgpu=error,wgpu_core=error,wgpu_hal=error,naga=error")
    });
    // Only a second logger can fail, and then the first one does the work.
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_ansi(false).with_writer(|| LogWriter);
    let _ = log.try_init();
}

fn builtin_help() -> String {
    let width = BUILTIN_SCENES.iter().map(|(name, _, _)| name.len()).max().unwrap_or(0);
    let rows: String = BUILTIN_SCENES.iter().map(|(name, about, _)| format!("\n  {name:width$}  {about}")).collect();
    format!("Built-in scenes:{rows}")
}
