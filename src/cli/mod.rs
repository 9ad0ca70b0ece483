//! The command line: one file a command. Exit status 0: done; 1: it failed; 2: the command was not
//! understood; 130: stopped by Ctrl+C, what there was is saved.
//!
//! A command is obedient by construction: it runs where it can be left behind (see `stop`).

mod animate;
mod args;
mod console;
mod explain;
mod failure;
mod info;
mod job;
mod merge;
mod number;
mod progress;
mod render;
mod render_args;
mod report;
mod save;
mod show;
mod simplify;
mod stability;
mod stop;
mod trees;
mod waiting;

use clap::{Parser, Subcommand, ValueEnum};
use console::{lines, remark};
use failure::Failure;
use firstlight::console::LogWriter;
use firstlight::kdtree::InstructionSet;
use firstlight::printable;
use firstlight::scene::{BUILTIN_SCENES, Limits};
use std::io::{ErrorKind, Write};
use std::process::ExitCode;
use stop::Stop;

/// An interactive, progressive path tracer: open a model, fly through it, watch it converge.
#[derive(Parser)]
#[command(name = "firstlight", bin_name = "firstlight", version, args_conflicts_with_subcommands = true, after_help = builtin_help())]
struct CommandLine {
    #[command(subcommand)]
    command: Option<CliCommand>,
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
enum CliCommand {
    /// Render a scene to a picture, without a window.
    Render(render_args::RenderArgs),
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

impl CliCommand {
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

/// Runs what the command line asks for.
pub fn main() -> ExitCode {
    firstlight::console::tell_panics();
    start_log();
    if let Some(warning) = Limits::misunderstood() {
        remark(format_args!("warning: {warning}"));
    }
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
        // The program's own words. Whoever closed the pipe has read enough; a full disk has not.
        return match error.print().and_then(|()| std::io::stdout().flush()) {
            Err(error) if error.kind() != ErrorKind::BrokenPipe => {
                remark(format_args!("error: the help cannot be written: {error}"));
                ExitCode::FAILURE
            }
            _ => ExitCode::SUCCESS,
        };
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
