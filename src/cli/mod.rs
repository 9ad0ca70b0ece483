//! The command line: one file per command. Exit status 0: done; 1: failed; 2: invalid command line, or invalid input of
//! a part; 75: a part should be tried again; 130: stopped by Ctrl+C, with the results so far saved.
//!
//! Every command can be interrupted, since it runs on a thread that can be abandoned (see `stop`).

mod animate;
#[cfg(feature = "viewer")]
mod arenas;
mod args;
mod completions;
mod console;
mod denoising;
mod explain;
mod failure;
mod film_denoiser;
mod frames;
mod info;
mod info_materials;
mod info_objects;
mod job;
mod layers;
mod man;
mod merge;
mod number;
mod pack;
mod part;
mod progress;
mod render;
mod render_args;
mod report;
mod save;
mod scenes;
mod sequence;
mod show;
mod simplify;
mod stability;
mod status;
mod stop;
mod submit;
mod trees;
mod video;
mod waiting;
mod words;
mod work;

use crate::cli::console::{lines, remark};
use crate::cli::failure::Failure;
use crate::cli::stop::Stop;
use clap::{CommandFactory, Parser, Subcommand, ValueEnum};
use firstlight::console::LogWriter;
use firstlight::kdtree::InstructionSet;
use firstlight::printable;
use firstlight::scene::Limits;
use std::ffi::OsString;
use std::io::ErrorKind;
use std::process::ExitCode;

/// Interactive, progressive path tracer: open a model, fly through it, watch it converge.
#[derive(Parser)]
#[command(name = "firstlight", bin_name = "firstlight", version, args_conflicts_with_subcommands = true, after_help = builtin_help())]
struct CommandLine {
    #[command(subcommand)]
    command: Option<CliCommand>,
    #[command(flatten)]
    show: show::ShowArgs,
    /// Instruction set of the renderer [default: the widest available]; the images are identical.
    #[arg(long, value_name = "SET", value_enum, global = true)]
    simd: Option<SimdArg>,
    /// Print only what was asked for, such as JSON or tables, and warnings and errors.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// List all warnings, and log details to standard error; RUST_LOG selects them exactly.
    #[arg(short, long, global = true)]
    verbose: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SimdArg {
    Avx512,
    Avx2,
    Portable,
}

impl SimdArg {
    /// Sets the instruction set of this process.
    fn choose(self) -> Result<(), Failure> {
        let set = match self {
            Self::Avx512 => InstructionSet::Avx512,
            Self::Avx2 => InstructionSet::Avx2,
            Self::Portable => InstructionSet::Portable,
        };
        let missing = || Failure::Failed(format!("this processor does not support {set:?}: omit --simd"));
        set.set_default().then_some(()).ok_or_else(missing)
    }
}

#[derive(Subcommand)]
enum CliCommand {
    /// Render a scene to an image file, without a window.
    #[command(after_help = render_args::EXAMPLES, mut_args = render_args::brief)]
    Render(Box<render_args::RenderCommand>),
    /// Measure error against time, and the benefit of each sampling technique.
    Report(report::ReportArgs),
    /// Merge films that hold different samples of the same image.
    Merge(merge::MergeArgs),
    /// Save a model, a built-in scene or the scene of an image as a scene file.
    Save(save::SaveArgs),
    /// Pack a scene with all of its files into an archive, for other machines.
    Pack(pack::PackArgs),
    /// Write a job that renders a scene in many parts, and submit it to Slurm, Kubernetes or a render farm.
    #[command(after_help = submit::EXAMPLES)]
    Submit(submit::SubmitArgs),
    /// Show the progress of a job.
    Status(status::StatusArgs),
    /// Render or merge parts in the folder of a job; engines run this.
    Work(work::WorkArgs),
    /// Stress-test the renderer: count leaks, self-intersections, missed hits, wrong depths, non-finite samples and lost energy.
    Stability(stability::StabilityArgs),
    /// Show what a scene contains, which features it uses and what is not modelled.
    Info(info::InfoArgs),
    /// List the built-in scenes.
    Scenes(scenes::ScenesCommand),
    /// Explain a pixel: what it shows, which lights contribute to it, after how many bounces, along which paths.
    #[command(after_help = explain::COLUMNS)]
    Explain(explain::ExplainArgs),
    /// Reduce the number of triangles of a model and measure the deviation from the original.
    #[command(after_help = simplify::EXAMPLES)]
    Simplify(simplify::SimplifyArgs),
    /// Print a completion script for a shell.
    Completions(completions::CompletionsArgs),
    /// Print the manual page, or write the pages of all commands to a folder.
    Man(man::ManArgs),
}

impl CliCommand {
    fn run(&self, stop: &Stop) -> Result<(), Failure> {
        match self {
            Self::Render(args) => render::run(args, stop),
            Self::Report(args) => report::run(args, stop),
            Self::Merge(args) => merge::run(args, stop),
            Self::Save(args) => save::run(args),
            Self::Pack(args) => pack::run(args),
            Self::Submit(args) => submit::run(args),
            Self::Status(args) => status::run(args),
            Self::Work(args) => work::run(args, stop),
            Self::Stability(args) => stability::run(args),
            Self::Info(args) => info::run(args),
            Self::Scenes(args) => scenes::run(args),
            Self::Explain(args) => explain::run(args),
            Self::Simplify(args) => simplify::run(args, stop),
            Self::Completions(args) => completions::run(args, CommandLine::command()),
            Self::Man(args) => man::run(args, CommandLine::command()),
        }
    }
}

/// Runs the command of this process.
pub fn main() -> ExitCode {
    ExitCode::from(run(std::env::args_os().collect()))
}

/// Runs a command and returns the exit status of the program; once per process.
///
/// - `words`: the path of the program, and its arguments.
pub fn run(words: Vec<OsString>) -> u8 {
    words::give(words);
    firstlight::console::tell_panics();
    if let Some(warning) = Limits::misunderstood() {
        remark(format_args!("warning: {warning}"));
    }
    let line = match CommandLine::try_parse_from(words::typed(&CommandLine::command())) {
        Ok(line) => line,
        Err(error) => return not_understood(error),
    };
    start_log(line.verbose);
    if line.verbose {
        firstlight::console::be_verbose();
    }
    if line.quiet {
        firstlight::console::be_quiet();
    }
    let result = line.simd.map_or(Ok(()), SimdArg::choose).and_then(|()| match line.command {
        Some(command) => Stop::obeyed_by(move |stop| command.run(stop)),
        None => match words::mistyped_command(&CommandLine::command()) {
            Some(message) => Err(Failure::Usage(message)),
            None => show::run(&line.show),
        },
    });
    let (messages, code) = match result {
        Ok(()) => return 0,
        Err(Failure::Usage(message)) => (vec![message], 2),
        Err(Failure::Failed(message) | Failure::Passing(message)) => (vec![message], 1),
        Err(Failure::Problems(messages)) => (messages, 1),
        Err(Failure::Input(messages)) => (messages, 2),
        Err(Failure::Retry(message)) => {
            remark(message);
            return failure::TRY_AGAIN;
        }
        Err(Failure::Stopped(message)) => {
            remark(message);
            return stop::STOPPED;
        }
    };
    for message in messages {
        remark(format_args!("error: {message}"));
    }
    code
}

/// Reports what clap returned: help on standard output, or an error with status 2 and the most similar option.
fn not_understood(error: clap::Error) -> u8 {
    if !error.use_stderr() {
        // A help text. A closed pipe is fine; a full disk is not.
        return match error.print().and_then(|()| firstlight::console::print_bytes(&[])) {
            Err(error) if error.kind() != ErrorKind::BrokenPipe => {
                remark(format_args!("error: cannot write the help text: {error}"));
                1
            }
            _ => 0,
        };
    }
    if let Some(message) =
        words::mistyped_command(&CommandLine::command()).or_else(|| words::second_scene(&CommandLine::command()))
    {
        remark(format_args!("error: {message}"));
        return 2;
    }
    // The message quotes the arguments, and a line break in them would begin a new line: they are parsed again with
    // such characters escaped, which gives the same message without line breaks.
    let words = words::typed(&CommandLine::command());
    let shown: Vec<String> = words.iter().map(|word| printable::name(&word.to_string_lossy()).into_owned()).collect();
    let error = match words.iter().zip(&shown).all(|(word, shown)| word == shown.as_str()) {
        true => error,
        false => CommandLine::try_parse_from(shown).err().filter(clap::Error::use_stderr).unwrap_or(error),
    };
    remark(lines(error.render().to_string().trim_end()));
    2
}

/// Starts the log: warnings go to the terminal, except those of the window libraries, which report only errors;
/// `--verbose` and `RUST_LOG` give more.
fn start_log(verbose: bool) {
    use tracing_subscriber::EnvFilter;
    let own = if verbose { "warn,firstlight=debug" } else { "warn" };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| {
        EnvFilter::new(format!("{own},winit=error,egui_wgpu=error,wgpu_core=error,wgpu_hal=error,naga=error"))
    });
    // Fails only if a logger exists, which is then used.
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_ansi(false).with_writer(|| LogWriter);
    let _ = log.try_init();
}

fn builtin_help() -> String {
    let rows: String = scenes::rows().map(|row| format!("\n  {row}")).collect();
    format!(
        "Built-in scenes:{rows}\n\nEnvironment variables:\n  \
         NO_COLOR           Print help and errors without colours\n  \
         RUST_LOG           Log filter, such as info or firstlight=debug\n  \
         FIRSTLIGHT_LIMITS  Factor for the limits on input size, such as 2\n  \
         FIRSTLIGHT_OIDN    Path of Open Image Denoise, for --denoiser oidn\n\n\
         Exit status:\n  \
         0 success, 1 failure, 2 usage error, 130 stopped by Ctrl+C (what was rendered is saved);\n  \
         of render --part: 2 wrong input, 75 interrupted or blocked, try again\n\n\
         Settings and bookmarks of the window are kept in $XDG_CONFIG_HOME/firstlight (Linux)"
    )
}
