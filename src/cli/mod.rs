//! The command line: one file a command. Exit status 0: done; 1: it failed; 2: the command was not
//! understood; 130: stopped by Ctrl+C, what there was is saved.

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
use console::remark;
use firstlight::render::{Integrator, PixelFilter};
use firstlight::scene::{BUILTIN_SCENES, LoadOptions, LoadedScene, SceneSource, UpAxis, load};
use number::{parse_positive, parse_size};
use std::path::Path;
use std::process::ExitCode;

/// An interactive, progressive path tracer: open a model, fly through it, watch it converge.
#[derive(Parser)]
#[command(name = "firstlight", version, args_conflicts_with_subcommands = true, after_help = builtin_help())]
struct CommandLine {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    show: show::ShowArgs,
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

/// What to open, and how.
#[derive(Args, Clone, Debug)]
struct SceneArgs {
    /// A built-in scene, a scene file (.ron), a model (.obj), or a picture (.png, .exr) that this program made.
    #[arg(value_name = "SCENE|MODEL|PICTURE", default_value = "gallery")]
    scene: String,
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

    /// Loads the scene, or says why it cannot be had.
    fn load(&self, aspect: Option<f64>, progress: &(dyn Fn(&str) + Sync)) -> Result<LoadedScene, Failure> {
        let source = self.source()?;
        let options = LoadOptions { up: self.up(), aspect, progress: Some(progress), ..LoadOptions::default() };
        let scene = load(&source, &options).map_err(|error| Failure::Failed(error.to_string()))?;
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

/// Why a command did not do its work; each line becomes a message of its own.
enum Failure {
    /// The command itself cannot be right.
    Usage(String),
    Failed(String),
    /// Somebody pressed Ctrl+C; says what was saved.
    Stopped(String),
}

/// Runs what the command line asks for.
pub fn main() -> ExitCode {
    start_log();
    // clap itself ends with status 2 and the nearest known option when it does not understand.
    let line = CommandLine::parse();
    let result = match line.command {
        Some(Command::Render(args)) => render::run(&args),
        Some(Command::Report(args)) => report::run(&args),
        Some(Command::Merge(args)) => merge::run(&args),
        Some(Command::Save(args)) => save::run(&args),
        Some(Command::Stability(args)) => stability::run(&args),
        Some(Command::Info(args)) => info::run(&args),
        Some(Command::Explain(args)) => explain::run(&args),
        Some(Command::Simplify(args)) => simplify::run(&args),
        None => show::run(&line.show),
    };
    let (message, code) = match result {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Usage(message)) => (message, 2),
        Err(Failure::Failed(message)) => (message, 1),
        Err(Failure::Stopped(message)) => {
            remark(message);
            return ExitCode::from(stop::STOPPED);
        }
    };
    for line in message.lines() {
        remark(format_args!("error: {line}"));
    }
    ExitCode::from(code)
}

/// Warnings go to the terminal, those of the window libraries only when something fails; `RUST_LOG` asks for more.
fn start_log() {
    use tracing_subscriber::EnvFilter;
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| {
        EnvFilter::new("warn,winit=error,egui_wgpu=error,wgpu_core=error,wgpu_hal=error,naga=error")
    });
    // Only a second logger can fail, and then the first one does the work.
    let _ = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).try_init();
}

fn builtin_help() -> String {
    let width = BUILTIN_SCENES.iter().map(|(name, _, _)| name.len()).max().unwrap_or(0);
    let rows: String = BUILTIN_SCENES.iter().map(|(name, about, _)| format!("\n  {name:width$}  {about}")).collect();
    format!("Built-in scenes:{rows}")
}
