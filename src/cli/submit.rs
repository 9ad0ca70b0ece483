//! `firstlight submit ENGINE SCENE --parts N`: creates the folder of a job with all of its files and submits its first
//! round to an engine.

use crate::cli::args::{FilterArg, IntegratorArg, SceneArgs, open_options};
use crate::cli::console::inform;
use crate::cli::failure::Failure;
use crate::cli::frames::{FramesArg, parse_frames};
use crate::cli::job::scaled;
use crate::cli::number::{
    at_least_one, between, counted, parse_fps, parse_positive, parse_share, parse_size, parse_stops, samples_per_pixel,
};
use crate::cli::render::Command;
use crate::cli::render_args::file_stem;
use crate::cli::work::render_words;
use clap::{Args, ValueEnum};
use firstlight::cluster::engine::{EngineOptions, SlurmOption, files, job_name, shell_word};
use firstlight::cluster::job::{Engine, Job};
use firstlight::cluster::job_option::{JobOption, OptionName};
use firstlight::cluster::pack::{PackError, Package};
use firstlight::render::Film;
use firstlight::scene::whole_file::write_whole;
use firstlight::scene::{Files, NewFolder, SceneSource, WriteError, absolute};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

pub const EXAMPLES: &str = "\
Examples:
  firstlight submit slurm scene.ron --size 3840x2160 --parts 64 --spp 1024
  firstlight submit slurm scene.ron --parts 64 --error 0.5% --max-spp 8192
  firstlight submit slurm scene.ron --frames 0..240 --parts 60 --spp 256
  firstlight submit kubernetes scene.ron --parts 20 --image registry/firstlight:1 --dry-run
  firstlight status firstlight-job-scene --image so-far.png";

#[derive(Args, Clone, Debug)]
pub struct SubmitArgs {
    /// What runs the parts.
    #[arg(value_enum)]
    engine: EngineArg,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    look: LookArgs,
    /// Number of parts of each round.
    #[arg(long, value_name = "N", value_parser = between::<u32>(1, Job::MOST_PARTS))]
    parts: u32,
    /// Folder of the job, which all machines see [default: firstlight-job-SCENE].
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Samples per pixel; of the first round where --error is given [default: 256; with --error one for each part, 16 at
    /// least].
    #[arg(long, value_name = "N", value_parser = between::<u32>(1, Film::MAX_SAMPLES))]
    spp: Option<u32>,
    /// Render in rounds until the estimated relative error is at most this: 1% or 0.01.
    #[arg(long, value_name = "ERROR", value_parser = parse_share)]
    error: Option<f64>,
    /// Samples per pixel after which no other round follows.
    #[arg(long, value_name = "N", requires = "error", default_value_t = 16_384, value_parser = between::<u32>(1, Film::MAX_SAMPLES))]
    max_spp: u32,
    /// Render frames A to B-1 of the animation to FOLDER/frames, in place of one image.
    #[arg(long, value_name = "A..B|N", value_parser = parse_frames, conflicts_with_all = ["error", "at"])]
    frames: Option<FramesArg>,
    /// Frames per second [default: from the scene file, else 24].
    #[arg(long, value_name = "N", requires = "frames", value_parser = parse_fps)]
    fps: Option<f64>,
    /// Write the folder, and submit nothing.
    #[arg(long)]
    dry_run: bool,
    /// How the program is called where parts run [default: this program; firstlight for Kubernetes].
    #[arg(long, value_name = "COMMAND")]
    program: Option<String>,
    /// Option for Slurm, such as --slurm=--partition=long; may be given several times.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    slurm: Vec<SlurmOption>,
    /// Container image for Kubernetes.
    #[arg(long, value_name = "IMAGE", default_value = "firstlight:latest")]
    image: String,
    /// Persistent volume claim for Kubernetes; the folder of the job lies at its top.
    #[arg(long, value_name = "NAME", default_value = "firstlight")]
    claim: String,
}

/// Options of the image, as for `render`.
#[derive(Args, Clone, Debug)]
struct LookArgs {
    /// Width and height in pixels [default: from the scene].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Scale width and height.
    #[arg(long, value_name = "FACTOR", value_parser = parse_positive)]
    scale: Option<f64>,
    /// Random seed [default: from the scene, else 0].
    #[arg(long, value_name = "N", value_parser = between::<u32>(0, u32::MAX))]
    seed: Option<u32>,
    /// Light transport [default: from the scene].
    #[arg(long, value_enum)]
    integrator: Option<IntegratorArg>,
    /// Pixel reconstruction filter [default: from the scene].
    #[arg(long, value_enum)]
    filter: Option<FilterArg>,
    /// Maximum path length in segments; 1 shows only emitters.
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    max_depth: Option<u32>,
    /// Exposure in stops, added to that of the scene.
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = parse_stops)]
    exposure: Option<f32>,
}

impl LookArgs {
    /// The same for the parts of a job.
    fn options(&self) -> impl Iterator<Item = JobOption> {
        [
            self.size.map(|(width, height)| OptionName::Size.with(format!("{width}x{height}"))),
            self.scale.map(|scale| OptionName::Scale.with(scale)),
            self.seed.map(|seed| OptionName::Seed.with(seed)),
            self.integrator.map(|arg| OptionName::Integrator.with(name_of(arg))),
            self.filter.map(|arg| OptionName::Filter.with(name_of(arg))),
            self.max_depth.map(|depth| OptionName::MaxDepth.with(depth)),
            self.exposure.map(|stops| OptionName::Exposure.with(stops)),
        ]
        .into_iter()
        .flatten()
    }
}

/// A value of an option, as it is written.
fn name_of(arg: impl ValueEnum) -> String {
    arg.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum EngineArg {
    /// Array jobs of Slurm.
    Slurm,
    /// Indexed jobs of Kubernetes.
    Kubernetes,
    /// A template of Open Job Description.
    Openjd,
}

impl From<EngineArg> for Engine {
    fn from(arg: EngineArg) -> Self {
        match arg {
            EngineArg::Slurm => Self::Slurm,
            EngineArg::Kubernetes => Self::Kubernetes,
            EngineArg::Openjd => Self::Openjd,
        }
    }
}

pub fn run(args: &SubmitArgs) -> Result<(), Failure> {
    let title = file_stem(&args.scene.scene).to_string_lossy().into_owned();
    let engine = Engine::from(args.engine);
    let folder = match &args.output {
        Some(folder) => folder.clone(),
        None => PathBuf::from(format!("firstlight-job-{title}")),
    };
    check_is_free(&folder)?;
    // Of a scene that says its size, at least that of one pixel.
    scaled(args.look.size.unwrap_or((1, 1)), args.look.scale)?;
    let spp = args.spp.unwrap_or(match args.error {
        Some(_) => Job::first_round(args.parts, args.max_spp),
        None => crate::cli::render_args::DEFAULT_SPP,
    });
    let frames = args.frames.map(FramesArg::range);
    if let Some(n) = frames.as_ref().map(ExactSizeIterator::len).filter(|&n| args.parts as usize > n) {
        return Err(Failure::Usage(format!("--parts: {} parts of {n} frames: use at most {n} parts", args.parts)));
    }
    if u64::from(args.parts) > u64::from(spp) && args.error.is_none() && frames.is_none() {
        return Err(Failure::Usage(format!("--parts: {} parts of {spp} samples: use at most {spp} parts", args.parts)));
    }
    let package = package(&args.scene)?;
    let inside = |name: &str| format!("scene/{name}");
    let (scene, environment) = match &package {
        Ok(package) => (inside(&package.scene), package.environment.as_deref().map(inside)),
        Err(builtin) => (builtin.clone(), None),
    };
    // A program that a module of Python runs is no executable of its own.
    let this = std::env::current_exe().ok().filter(|path| path.file_stem().is_some_and(|name| name == "firstlight"));
    let this = this.and_then(|path| path.to_str().map(str::to_owned));
    let job = Job {
        format: Job::FORMAT,
        name: job_name(&title),
        engine,
        program: args.program.clone().unwrap_or_else(|| match engine {
            Engine::Kubernetes => "firstlight".to_owned(),
            _ => this.unwrap_or_else(|| "firstlight".to_owned()),
        }),
        scene,
        options: open_options(&args.scene.opening()?)
            .chain(args.look.options())
            .chain(environment.map(|path| OptionName::Env.with(path)))
            .chain(args.fps.map(|fps| OptionName::Fps.with(fps)))
            .collect(),
        parts: args.parts,
        spp,
        error: args.error,
        max_spp: args.max_spp.max(spp),
        frames: frames.map(|frames| (frames.start, frames.end)),
    };
    // Checks that the parts will be able to parse the arguments.
    Command::parse(&render_words(&job))?;
    let options = EngineOptions {
        folder: absolute(&folder).to_str().map(str::to_owned).ok_or_else(|| not_utf8(&folder))?,
        slurm: args.slurm.clone(),
        image: args.image.clone(),
        claim: args.claim.clone(),
    };
    write_job(&folder, &job, &options, package.ok())?;
    let (name, parts) = (folder.display(), counted(job.parts as usize, "part"));
    let frames = |(start, end): (u32, u32)| counted((end - start) as usize, "frame") + ", ";
    let frames = job.frames.map_or_else(String::new, frames);
    inform(format_args!(
        "{name}: {frames}{parts}, {}{}",
        samples_per_pixel(job.spp),
        if job.error.is_some() { " in the first round" } else { "" }
    ));
    hand_over(engine, &options.folder, args.dry_run)
}

/// Writes the folder of a job, all of it or nothing.
fn write_job(folder: &Path, job: &Job, options: &EngineOptions, package: Option<Package>) -> Result<(), Failure> {
    let new = NewFolder::begin(folder)?;
    let failed = |error| Failure::from(new.error(error));
    let part = new.part();
    make_folders(part, job.frames.is_some()).map_err(failed)?;
    if let Some(package) = package {
        package.write_folder(&part.join("scene")).map_err(|error| match error {
            PackError::Write(error) => failed(error),
            error => error.into(),
        })?;
    }
    for file in files(job, options) {
        let path = part.join(file.name);
        write_whole(&path, file.text.as_bytes()).map_err(failed)?;
        #[cfg(unix)]
        if file.is_script {
            use std::os::unix::fs::PermissionsExt;
            // Without this, the script can still be run by naming the shell.
            let _ = std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755));
        }
    }
    job.write(part).map_err(failed)?;
    // This file marks the folder as a job. Another job may have come first.
    new.finish(OsStr::new("job.json")).or_else(|error| check_is_free(folder).and(Err(error.into())))
}

/// Refuses a folder that has a job, or anything that a job would replace.
fn check_is_free(folder: &Path) -> Result<(), Failure> {
    // A link to a folder would lead what is written out of the job.
    let is_empty =
        |path: &Path| !path.is_symlink() && std::fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none());
    // A folder that is not there is made, or cannot be and then says why.
    let mut entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let name = folder.display();
    if folder.join("job.json").exists() {
        let message = "has a job already: see `firstlight status`, or choose another folder with -o";
        return Err(Failure::Failed(format!("{name}: {message}")));
    }
    match entries.find(|path| !is_empty(path)) {
        None => Ok(()),
        Some(path) => {
            let found = path.file_name().unwrap_or_default().display();
            let message = "a job needs a new or an empty folder: choose another one with -o";
            Err(Failure::Failed(format!("{name}: has other files, such as {found}: {message}")))
        }
    }
}

fn not_utf8(path: &Path) -> Failure {
    Failure::Failed(format!("{}: the name of the folder is not UTF-8", path.display()))
}

fn make_folders(folder: &Path, has_frames: bool) -> Result<(), WriteError> {
    for folder in [folder.join(if has_frames { "frames" } else { "parts" }), folder.join("log")] {
        std::fs::create_dir_all(&folder).map_err(|source| WriteError::NoFolder { folder, source })?;
    }
    Ok(())
}

/// The scene with all of its files, or the name of a built-in one.
fn package(scene: &SceneArgs) -> Result<Result<Package, String>, Failure> {
    let source = scene.source()?;
    if let SceneSource::Builtin(name) = &source
        && scene.how.env.is_none()
    {
        return Ok(Err(name.clone()));
    }
    let loaded = scene.load(None, &mut Files::default(), &|_| ())?;
    let package = Package::of(&loaded, &source)?;
    crate::cli::pack::tell_outside(&package);
    if loaded.shot.as_ref().is_some_and(|image| image.denoised.is_some()) {
        let name = scene.scene.display();
        inform(format_args!(
            "note: {name} is denoised, what a job renders is raw: `merge --denoise` denoises its parts"
        ));
    }
    Ok(Ok(package))
}

/// Submits the first round if the engine is available.
///
/// - `folder`: absolute.
fn hand_over(engine: Engine, folder: &str, dry_run: bool) -> Result<(), Failure> {
    // To be copied into a shell: a name must not run anything there either.
    let quoted = |path: String| shell_word(&path);
    let (tool, line) = match engine {
        Engine::Slurm => ("sbatch", format!("{} 1", quoted(format!("{folder}/submit.sh")))),
        Engine::Kubernetes => ("kubectl", quoted(format!("{folder}/submit.sh"))),
        Engine::Openjd => {
            let template = quoted(format!("{folder}/template.yaml"));
            inform(format_args!("submit {template} to a farm, with Folder={}", quoted(folder.to_owned())));
            return Ok(());
        }
    };
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let is_there = std::env::split_paths(&paths).any(|path| path.join(tool).is_file());
    // For Kubernetes, the script waits for its rounds, so the user decides where it runs.
    if dry_run || !is_there || engine == Engine::Kubernetes {
        inform(format_args!("submit it with: {line}"));
        return Ok(());
    }
    let status = std::process::Command::new("bash").arg(format!("{folder}/submit.sh")).arg("1").status();
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Failure::Failed(format!("{line}: {status}"))),
        Err(error) => Err(Failure::Failed(format!("{line}: {error}"))),
    }
}
