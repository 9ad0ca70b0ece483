//! `firstlight report [SCENES]`: speed against error, as a page, a table and a few lines of text.

use super::args::{OverwriteArgs, SceneArgs};
use super::console::{Bar, inform, lines, print, remark};
use super::failure::Failure;
use super::number::{parse_positive, parse_size};
use super::stop::Stop;
use clap::Args;
use firstlight::render::{
    ErrorMetric, Prepared, Purpose, RenderSettings, Room, SampleAllocation, Techniques, worker_threads,
};
use firstlight::report::{
    Ablation, ConvergenceCurve, CurveLimits, CurveStep, Key, LinearPicture, Reference, ReferenceStore, SceneOutcome,
    csv, foreign_share, measure_curve, page, summary_text,
};
use firstlight::scene::whole_file::write_whole;
use firstlight::scene::{
    BUILTIN_SCENES, DisplaySettings, Extraction, Files, FilmSize, LoadedScene, Rendering, SceneInputs, Trees,
};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Samples per pixel of the last step, unless given.
const DEFAULT_SPP: u32 = 256;

/// How many times the samples of the last step an own reference has.
const REFERENCE_FACTOR: u32 = 16;

/// The same for one that was stopped: a fifth of what is measured against it is then its own error.
const LEAST_REFERENCE_FACTOR: u32 = 4;

/// Pixels of a picture, about, unless a size is given: enough to tell, few enough to wait for.
const DEFAULT_PIXELS: f64 = 50_000.0;

#[derive(Args, Clone, Debug)]
pub struct ReportArgs {
    /// Built-in scenes, scene files (.ron) or models (.obj, .ply, .stl, .glb, .gltf) [default: all built-in scenes].
    #[arg(value_name = "SCENES")]
    scenes: Vec<OsString>,
    /// Converged linear picture (.exr) of the scene [default: rendered with 16 times the samples and cached].
    ///
    /// Rendering the default reference takes about 16 times as long as the last step; it is cached for the next report.
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Output folder for the HTML page and the CSV table.
    #[arg(long, value_name = "DIR", default_value = "report")]
    out: PathBuf,
    /// Maximum samples per pixel [default: 256, unless --time is given].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    spp: Option<u32>,
    /// Maximum seconds of rendering per scene.
    ///
    /// Each disabled technique takes as long again, and a reference that is neither given nor cached 16 times as long.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = parse_positive)]
    time: Option<f64>,
    /// Width and height in pixels [default: that of the reference, else about 50,000 pixels].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Number of worker threads [default: all cores].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Random seed.
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 1)]
    seed: u32,
    /// Skip the comparison with each technique disabled.
    #[arg(long)]
    no_ablation: bool,
}

pub fn run(args: &ReportArgs, stop: &Stop) -> Result<(), Failure> {
    let names: Vec<OsString> = if args.scenes.is_empty() {
        BUILTIN_SCENES.iter().map(|(name, _, _)| OsString::from(name)).collect()
    } else {
        args.scenes.clone()
    };
    if args.reference.is_some() && names.len() != 1 {
        return Err(Failure::Usage(format!(
            "--reference is a picture of one scene, but {} scenes are given: name the scene it shows",
            names.len()
        )));
    }
    let given = args.reference.as_deref().map(Reference::read).transpose().map_err(Failure::Failed)?;
    let folder = OutFolder::new(&args.out)?;
    let again = folder.clone();
    stop.undo(move || drop(again));
    let (html, table) = (args.out.join("index.html"), args.out.join("steps.csv"));
    let mut files = OverwriteArgs::default().files();
    files.read_all(args.reference.clone())?;
    files.write_all([html.clone(), table.clone()])?;
    let pool = worker_threads()
        .num_threads(args.threads.map_or(0, usize::from))
        .build()
        .map_err(|error| Failure::Failed(format!("cannot start worker threads: {error}")))?;
    let (outcomes, missing) = pool.install(|| measure_all(args, &names, given.as_ref(), &mut files, stop))?;
    if let (true, Some(missing)) = (outcomes.is_empty(), &missing) {
        return Err(Failure::Stopped(format!("stopped before anything was measured: nothing was written ({missing})")));
    }
    folder.keep();

    write_whole(&html, page(&outcomes, &command_line(), missing.as_deref()).as_bytes())?;
    write_whole(&table, csv(&outcomes).as_bytes())?;
    print(lines(summary_text(&outcomes).trim_end()))?;
    print(vec![html.display().to_string(), table.display().to_string()])?;
    for mismatch in outcomes.iter().filter_map(SceneOutcome::mismatch) {
        remark(format_args!("warning: {mismatch}"));
    }
    match missing {
        None => Ok(()),
        Some(missing) => Err(Failure::Stopped(format!("stopped: the measurements so far were written; {missing}"))),
    }
}

/// The folder of the report, taken away again where nothing came of it and it was not there before.
#[derive(Clone)]
struct OutFolder {
    /// Those that were made, the innermost first.
    made: Vec<PathBuf>,
}

impl OutFolder {
    /// A page that cannot be written is not worth the wait.
    fn new(path: &Path) -> Result<Self, Failure> {
        let made = path.ancestors().take_while(|folder| !folder.as_os_str().is_empty() && !folder.exists());
        let folder = Self { made: made.map(Path::to_path_buf).collect() };
        std::fs::create_dir_all(path)
            .and_then(|()| tempfile::tempfile_in(path))
            .map_err(|error| Failure::Failed(format!("{}: cannot be written to: {error}", path.display())))?;
        Ok(folder)
    }

    fn keep(mut self) {
        self.made.clear();
    }
}

impl Drop for OutFolder {
    fn drop(&mut self) {
        for folder in &self.made {
            // Not if somebody else has put something there.
            let _ = std::fs::remove_dir(folder);
        }
    }
}

/// What was measured, and what is missing if somebody has stopped it.
fn measure_all(
    args: &ReportArgs,
    names: &[OsString],
    given: Option<&Reference>,
    files: &mut Files,
    stop: &Stop,
) -> Result<(Vec<SceneOutcome>, Option<String>), Failure> {
    // Every scene is read first: a mistake in the last name should not cost the wait for the others.
    let mut scenes = Vec::new();
    for name in names {
        let scene = SceneArgs { scene: name.clone(), ..SceneArgs::default() };
        scenes.push(ReportScene::new(args, &scene.load(None, files, &|_| ())?, given)?);
    }
    let limits = CurveLimits {
        spp: args.spp.unwrap_or(if args.time.is_some() { 1 << 20 } else { DEFAULT_SPP }),
        seconds: args.time,
    };
    let mut progress = ReportProgress::new(&scenes, !args.no_ablation, given.is_some());
    if let (Some(seconds), None) = (limits.seconds, given) {
        let longest = duration(f64::from(REFERENCE_FACTOR) * seconds * scenes.len() as f64);
        let message = format!("references that are not cached take up to {longest} in total, in addition to --time");
        progress.bar.suspend(|| inform(message));
    }
    stop.attend();
    let mut outcomes = Vec::new();
    let mut missing: Option<String> = None;
    for (i, scene) in scenes.iter().enumerate() {
        let (outcome, lacks) = scene.measure(args, limits, given, &mut progress, stop);
        outcomes.extend(outcome);
        if let Some(lacks) = lacks {
            let others: Vec<&str> = scenes[i + 1..].iter().map(|scene| scene.title.as_str()).collect();
            let others =
                if others.is_empty() { String::new() } else { format!("; not started: {}", others.join(", ")) };
            missing = Some(format!("{}: {lacks}{others}", scene.title));
            break;
        }
    }
    progress.bar.finish_and_clear();
    Ok((outcomes, missing))
}

/// Some seconds as people say it.
fn duration(seconds: f64) -> String {
    match seconds {
        ..90.0 => format!("{seconds:.0} s"),
        ..5400.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

/// A scene, ready to be rendered.
struct ReportScene {
    title: String,
    inputs: SceneInputs,
    trees: Trees,
    settings: RenderSettings,
    developing: DisplaySettings,
    size: (u32, u32),
    key: Key,
}

impl ReportScene {
    fn new(args: &ReportArgs, scene: &LoadedScene, given: Option<&Reference>) -> Result<Self, Failure> {
        let mut world = bevy_ecs::world::World::new();
        scene.spawn(&mut world);
        let inputs = SceneInputs::of(&mut world);
        let extraction = Extraction::new(&inputs, &scene.trees);
        for problem in &extraction.problems {
            remark(format_args!("warning: {problem}"));
        }
        let FilmSize { width, height } = *world.resource();
        let of_reference = given.map(|given| (given.picture.width, given.picture.height));
        let size = match (args.size, of_reference) {
            (Some(size), Some(other)) if size != other => {
                return Err(Failure::Usage(format!(
                    "--size is {}x{}, but the reference has {}x{} pixels: omit --size",
                    size.0, size.1, other.0, other.1
                )));
            }
            (_, Some(size)) | (Some(size), None) => size,
            (None, None) => modest(width, height),
        };
        let light_traced = extraction.prepared.features().caustics;
        let room = Room::for_film(size.0, size.1, light_traced, &[Purpose::Exr]);
        drop(room.map_err(|error| Failure::Failed(error.to_string()))?);
        let allocation = SampleAllocation::Adaptive(ErrorMetric::RelativeMse);
        let settings = RenderSettings { seed: args.seed, allocation, ..world.resource::<Rendering>().0 };
        Ok(Self {
            title: scene.source.title(),
            inputs,
            trees: scene.trees.clone(),
            settings,
            developing: *world.resource(),
            size,
            key: Key::new(&scene.source.title(), scene.fingerprint(), &settings, size),
        })
    }

    /// What was found out, if it was enough to tell anything, and what is missing because somebody has stopped it.
    fn measure(
        &self,
        args: &ReportArgs,
        limits: CurveLimits,
        given: Option<&Reference>,
        progress: &mut ReportProgress,
        stop: &Stop,
    ) -> (Option<SceneOutcome>, Option<String>) {
        let steps = self.measure_curve(limits, self.settings, "all techniques", progress, stop);
        let mut missing =
            stop.is_asked().then(|| "its later steps and the comparison of techniques are missing".to_owned());
        let Some(last_rung) = steps.last() else { return (None, Some("no step was completed".to_owned())) };
        let reference = match given {
            Some(given) => given.clone(),
            None => match self.reference(last_rung, progress, stop) {
                Some(reference) => reference,
                None => return (None, Some("its reference was not completed".to_owned())),
            },
        };
        let display = self.developing.0;
        let measure = |steps: &[CurveStep]| ConvergenceCurve::measure(steps, &reference.picture, &display);
        let picture = |step: Option<&CurveStep>| step.map(|step| step.picture.clone());
        let last: LinearPicture = picture(steps.last()).expect("a curve has at least one step");
        let ablations = if args.no_ablation {
            Vec::new()
        } else {
            self.ablations()
                .into_iter()
                .map_while(|(technique, settings)| {
                    let others = self.measure_curve(limits, settings, &format!("without {technique}"), progress, stop);
                    // Half a curve would be compared with a whole one.
                    if stop.is_asked() {
                        missing.get_or_insert_with(|| {
                            format!("the comparison of {technique} and later techniques is missing")
                        });
                        return None;
                    }
                    // Only a step that both have can tell.
                    let is_unused = steps.iter().zip(&others).all(|(a, b)| a.picture == b.picture);
                    Some(Ablation { technique, curve: measure(&others), is_unused })
                })
                .collect()
        };
        let outcome = SceneOutcome {
            title: self.title.clone(),
            width: self.size.0,
            height: self.size.1,
            display,
            curve: measure(&steps),
            ablations,
            early: picture(steps.iter().rfind(|step| step.spp <= 4)).unwrap_or_else(|| last.clone()),
            foreign_share: given.map(|given| foreign_share(&last, &given.picture)),
            last,
            reference: reference.picture,
            reference_made: reference.made,
            reference_path: reference.path,
        };
        (Some(outcome), missing)
    }

    /// What is compared: each technique switched off alone.
    fn ablations(&self) -> Vec<(&'static str, RenderSettings)> {
        let with = |techniques| RenderSettings { techniques, ..self.settings };
        let even = RenderSettings { allocation: SampleAllocation::Uniform, ..self.settings };
        let techniques = Techniques::ablations().map(|(name, techniques)| (name, with(techniques)));
        techniques.into_iter().chain([("adaptive allocation of samples", even)]).collect()
    }

    /// A new one each time: what a render finds out about a scene and keeps (where caustics come from) must be found out,
    /// and paid for, by each.
    fn prepared(&self) -> Prepared {
        Extraction::new(&self.inputs, &self.trees).prepared
    }

    fn measure_curve(
        &self,
        limits: CurveLimits,
        settings: RenderSettings,
        what: &str,
        progress: &mut ReportProgress,
        stop: &Stop,
    ) -> Vec<CurveStep> {
        let mut tell = progress.task(format!("{}, {what}", self.title), ReportProgress::CURVE, self.size);
        measure_curve(&self.prepared(), &settings, self.size, limits, &mut tell, &|| stop.is_asked())
    }

    /// One that was kept, or a new one; `None` when somebody stops it before it is good for anything.
    fn reference(&self, last: &CurveStep, progress: &mut ReportProgress, stop: &Stop) -> Option<Reference> {
        let store = ReferenceStore::of_platform();
        let spp = last.spp.saturating_mul(REFERENCE_FACTOR);
        let time = duration(f64::from(REFERENCE_FACTOR) * last.spent.wall_seconds);
        let title = format!("{}, reference with {spp} samples per pixel, about {time}", self.title);
        let mut tell = progress.task(title, ReportProgress::REFERENCE, self.size);
        if let Some(kept) = store.find(&self.key, spp) {
            tell(1.0);
            return Some(kept);
        }
        let asked = || stop.is_asked();
        let made = store.make(&self.key, &self.prepared(), &self.settings, spp, &mut tell, &asked);
        let least = last.spp.saturating_mul(LEAST_REFERENCE_FACTOR);
        match made {
            Some((reference, trouble)) if reference.made.is_some_and(|made| made.spp >= least) => {
                if let Some(trouble) = trouble {
                    remark(format_args!("warning: {trouble}"));
                }
                Some(reference)
            }
            _ => store.find(&self.key, least),
        }
    }
}

/// About [`DEFAULT_PIXELS`] in the shape of `width` × `height`, or that itself if it is smaller.
fn modest(width: u32, height: u32) -> (u32, u32) {
    let scale = (DEFAULT_PIXELS / (f64::from(width) * f64::from(height))).sqrt().min(1.0);
    let scaled = |side: u32| (f64::from(side) * scale).round().max(1.0) as u32;
    (scaled(width), scaled(height))
}

/// Progress of the whole report; a curve counts by its pixels, and a reference as many curves.
struct ReportProgress {
    bar: Bar,
    done: f64,
}

impl ReportProgress {
    const CURVE: f64 = 1.0;
    const REFERENCE: f64 = REFERENCE_FACTOR as f64;

    fn new(scenes: &[ReportScene], ablation: bool, given: bool) -> Self {
        let curves = 1 + if ablation { Techniques::ablations().len() + 1 } else { 0 };
        let weight = Self::CURVE * curves as f64 + if given { 0.0 } else { Self::REFERENCE };
        let pixels: f64 = scenes.iter().map(|scene| f64::from(scene.size.0) * f64::from(scene.size.1)).sum();
        Self { bar: Bar::new((weight * pixels) as u64), done: 0.0 }
    }

    /// Begins a part of the work, and counts it as done when the next one begins.
    fn task(&mut self, message: String, weight: f64, (width, height): (u32, u32)) -> impl FnMut(f64) {
        let (bar, before) = (self.bar.clone(), self.done);
        let share = weight * f64::from(width) * f64::from(height);
        self.done += share;
        bar.set_message(message);
        move |done| bar.set_position((before + share * done) as u64)
    }
}

/// What was typed, for the page; the program by its plain name.
fn command_line() -> String {
    let quoted = |word: String| if word.contains(char::is_whitespace) { format!("'{word}'") } else { word };
    let words = std::env::args_os().skip(1).map(|word| quoted(word.to_string_lossy().into_owned()));
    std::iter::once("firstlight".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}
