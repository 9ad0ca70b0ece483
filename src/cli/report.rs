//! `firstlight report [SCENES]`: error versus time, as an HTML page, a table and a few lines of text.

use crate::cli::args::{OpenArgs, OverwriteArgs, SceneArgs};
use crate::cli::console::{Bar, inform, lines, print, remark};
use crate::cli::failure::Failure;
use crate::cli::number::{between, parse_positive, parse_size};
use crate::cli::stop::Stop;
use crate::cli::words;
use clap::Args;
use firstlight::cluster::engine::shell_word;
use firstlight::frame::PictureFormat;
use firstlight::frame::oidn::{Oidn, OidnError};
use firstlight::render::{
    ErrorMetric, GuideGatherer, Prepared, Purpose, RenderSettings, Room, SampleAllocation, Techniques, worker_threads,
};
use firstlight::report::{
    Ablation, ConvergenceCurve, CurveLimits, CurveStep, LinearPicture, ReferenceImage, ReferenceKey, ReferenceStore,
    SceneOutcome, ZTest, against_text, csv, denoised_curves, denoised_text, foreign_share, is_csv, is_page,
    measure_curve, page, summary_text, timed, write_difference,
};
use firstlight::scene::whole_file::{check_own, write_whole};
use firstlight::scene::{
    Animation, BUILTIN_SCENES, DisplaySettings, Extraction, Files, FilmSize, LoadedScene, Moment, Rendering,
    SceneInputs, Trees,
};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Default number of samples per pixel of the last step.
const DEFAULT_SPP: u32 = 256;

/// Samples of a rendered reference, as a multiple of those of the last step.
const REFERENCE_FACTOR: u32 = 16;

/// The minimum for an interrupted reference: a fifth of the measured error is then its own.
const LEAST_REFERENCE_FACTOR: u32 = 4;

/// Approximate default number of pixels: enough for a measurement, and quick to render.
const DEFAULT_PIXELS: f64 = 50_000.0;

#[derive(Args, Clone, Debug)]
pub struct ReportArgs {
    /// Built-in scenes, scene files (.ron, .pbrt, .xml, .json) or models (.obj, .ply, .stl, .glb, .gltf, .vrm)
    /// [default: all built-in scenes].
    #[arg(value_name = "SCENES")]
    scenes: Vec<OsString>,
    #[command(flatten)]
    how: OpenArgs,
    /// Converged linear image (.exr) of the scene [default: rendered with 16 times the samples and cached].
    ///
    /// Rendering the default reference takes about 16 times as long as the last step; it is cached for the next report.
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Variance of one sample of the reference per pixel (.exr), as the render tests of Mitsuba store it: adds a z-test.
    ///
    /// All pixels get the same number of samples then.
    #[arg(long, value_name = "FILE", requires = "reference")]
    reference_variance: Option<PathBuf>,
    /// Also save the relative difference from the reference: red is brighter, blue is darker (.png), or as numbers
    /// with their sign (.exr).
    #[arg(long, value_name = "FILE", requires = "reference")]
    difference: Option<PathBuf>,
    /// Output folder for the HTML page and the CSV table.
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
    /// Maximum samples per pixel [default: 256, unless --time is given].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = between::<u32>(1, 1 << 20))]
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
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = between::<u16>(1, 1024))]
    threads: Option<u16>,
    /// Random seed.
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 1, value_parser = between::<u32>(0, u32::MAX))]
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
            "--reference is an image of one scene, but {} scenes are given: name the scene it shows",
            names.len()
        )));
    }
    let given = args.reference.as_deref().map(ReferenceImage::read).transpose().map_err(Failure::Failed)?;
    let variance = args.reference_variance.as_deref().map(LinearPicture::read_exr).transpose();
    let variance = variance.map_err(Failure::Failed)?;
    if let (Some(variance), Some(given)) = (&variance, &given)
        && (variance.width, variance.height) != (given.picture.width, given.picture.height)
    {
        return Err(Failure::Usage("the reference and its variance have different sizes".to_owned()));
    }
    if let Some(path) = &args.difference {
        PictureFormat::of(path)?;
    }
    let folder = OutFolder::new(&args.output)?;
    let again = folder.clone();
    stop.undo(move || drop(again));
    let (html, table) = (args.output.join("index.html"), args.output.join("steps.csv"));
    let mut files = OverwriteArgs::default().files();
    files.read_all(args.reference.iter().chain(&args.reference_variance).cloned())?;
    check_own(&html, is_page).and_then(|()| check_own(&table, is_csv))?;
    files.write_all([html.clone(), table.clone()].into_iter().chain(args.difference.clone()), files.replace())?;
    let pool = worker_threads()
        .num_threads(args.threads.map_or(0, usize::from))
        .build()
        .map_err(|error| Failure::Failed(format!("cannot start worker threads: {error}")))?;
    let (outcomes, missing) = pool.install(|| measure_all(args, &names, given.as_ref(), &mut files, stop))?;
    if let (true, Some(missing)) = (outcomes.is_empty(), &missing) {
        return Err(Failure::Stopped(format!("stopped before anything was measured: nothing was written ({missing})")));
    }
    folder.keep();

    write_whole(
        &html,
        page(&outcomes, &command_line(words::given().iter().skip(1).cloned()), missing.as_deref()).as_bytes(),
    )?;
    write_whole(&table, csv(&outcomes).as_bytes())?;
    print(lines(summary_text(&outcomes).trim_end()))?;
    print(lines(denoised_text(&outcomes).trim_end()))?;
    if let (Some(_), [outcome]) = (&given, &outcomes[..]) {
        let test = |variance| ZTest::of(&outcome.last, outcome.curve.last().spp, &outcome.reference, variance);
        print(lines(against_text(outcome, variance.as_ref().map(test).as_ref()).trim_end()))?;
        if let Some(path) = &args.difference {
            write_difference(&outcome.last, &outcome.reference, path)?;
        }
    }
    print(vec![html.display().to_string(), table.display().to_string()])?;
    for mismatch in outcomes.iter().filter_map(SceneOutcome::mismatch) {
        remark(format_args!("warning: {mismatch}"));
    }
    match missing {
        None => Ok(()),
        Some(missing) => Err(Failure::Stopped(format!("stopped: the measurements so far were written; {missing}"))),
    }
}

/// The folder of the report; on drop it is removed if it is new and empty.
#[derive(Clone)]
struct OutFolder {
    /// The folders that were created, innermost first.
    made: Vec<PathBuf>,
}

impl OutFolder {
    /// Creates the folder and tests writing to it, before rendering.
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
            // Fails if it is not empty.
            let _ = std::fs::remove_dir(folder);
        }
    }
}

/// The measurements, and what is missing if they were stopped.
fn measure_all(
    args: &ReportArgs,
    names: &[OsString],
    given: Option<&ReferenceImage>,
    files: &mut Files,
    stop: &Stop,
) -> Result<(Vec<SceneOutcome>, Option<String>), Failure> {
    // All scenes are loaded first, so that an error in the last argument is reported at once.
    let mut scenes = Vec::new();
    for name in names {
        let scene = SceneArgs { scene: name.clone(), how: args.how.clone() };
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
    // Compared where it is installed.
    let oidn = match Oidn::load(rayon::current_num_threads()) {
        Ok(oidn) => Some(oidn),
        Err(OidnError::Missing) => None,
        Err(error) => return Err(Failure::Failed(error.to_string())),
    };
    stop.attend();
    let mut outcomes = Vec::new();
    let mut missing: Option<String> = None;
    for (i, scene) in scenes.iter().enumerate() {
        let (outcome, lacks) = scene.measure(args, limits, given, oidn.as_ref(), &mut progress, stop);
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

/// A duration in a suitable unit.
fn duration(seconds: f64) -> String {
    match seconds {
        ..90.0 => format!("{seconds:.0} s"),
        ..5400.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

/// A scene that is ready to be rendered.
struct ReportScene {
    title: String,
    inputs: SceneInputs,
    animation: Option<Animation>,
    moment: Moment,
    trees: Trees,
    settings: RenderSettings,
    display_settings: DisplaySettings,
    size: (u32, u32),
    key: ReferenceKey,
}

impl ReportScene {
    fn new(args: &ReportArgs, scene: &LoadedScene, given: Option<&ReferenceImage>) -> Result<Self, Failure> {
        let mut world = bevy_ecs::world::World::new();
        scene.spawn(&mut world);
        let inputs = SceneInputs::of(&mut world);
        let extraction = Extraction::of_world(&mut world, &inputs, &scene.trees);
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
        let allocation = match args.reference_variance {
            Some(_) => SampleAllocation::Uniform,
            None => SampleAllocation::Adaptive(ErrorMetric::RelativeMse),
        };
        let settings = RenderSettings { seed: args.seed, allocation, ..world.resource::<Rendering>().0 };
        Ok(Self {
            title: scene.source.title(),
            inputs,
            animation: world.get_resource().cloned(),
            moment: world.get_resource().copied().unwrap_or_default(),
            trees: scene.trees.clone(),
            settings,
            display_settings: *world.resource(),
            size,
            key: ReferenceKey::new(&scene.source.title(), scene.fingerprint(), &settings, size),
        })
    }

    /// Measures a scene; the result may be missing, or incomplete with a description of what is missing, after a stop.
    fn measure(
        &self,
        args: &ReportArgs,
        limits: CurveLimits,
        given: Option<&ReferenceImage>,
        oidn: Option<&Oidn>,
        progress: &mut ReportProgress,
        stop: &Stop,
    ) -> (Option<SceneOutcome>, Option<String>) {
        let steps = self.measure_curve(limits, self.settings, "all techniques", progress, stop);
        let mut missing =
            stop.is_asked().then(|| "its later steps and the comparison of techniques are missing".to_owned());
        let Some(last_step) = steps.last() else { return (None, Some("no step was completed".to_owned())) };
        let reference = match given {
            Some(given) => given.clone(),
            None => match self.reference(last_step, progress, stop) {
                Some(reference) => reference,
                None => return (None, Some("its reference was not completed".to_owned())),
            },
        };
        let display = self.display_settings.0;
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
                    // Comparing a partial curve with a complete one would be misleading.
                    if stop.is_asked() {
                        missing.get_or_insert_with(|| {
                            format!("the comparison of {technique} and later techniques is missing")
                        });
                        return None;
                    }
                    // Only steps that both curves have can be compared.
                    let is_unused = steps.iter().zip(&others).all(|(a, b)| a.picture == b.picture);
                    Some(Ablation { technique, curve: measure(&others), is_unused })
                })
                .collect()
        };
        let prepared = self.prepared();
        let (mut gatherer, mut took) = (GuideGatherer::default(), 0.0);
        gatherer.start(self.size.into());
        let mut gather = |samples| {
            let (_, more) = timed(|| gatherer.gather(&prepared, &self.settings, samples, &|| false));
            took += more;
            (gatherer.guides().clone(), took)
        };
        let denoised = denoised_curves(&steps, &mut gather, oidn, &reference.picture, &display);
        let denoised = denoised.unwrap_or_else(|error| {
            remark(format_args!("warning: {error}"));
            Vec::new()
        });
        let outcome = SceneOutcome {
            title: self.title.clone(),
            width: self.size.0,
            height: self.size.1,
            display,
            curve: measure(&steps),
            denoised,
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

    /// The settings to compare: each technique disabled on its own.
    fn ablations(&self) -> Vec<(&'static str, RenderSettings)> {
        let with = |techniques| RenderSettings { techniques, ..self.settings };
        let even = RenderSettings { allocation: SampleAllocation::Uniform, ..self.settings };
        let techniques = Techniques::ablations().map(|(name, techniques)| (name, with(techniques)));
        techniques.into_iter().chain([("adaptive allocation of samples", even)]).collect()
    }

    /// A new snapshot each time: data that a rendering gathers about a scene and caches (such as the sources of
    /// caustics) must be gathered, and its time counted, for each curve.
    fn prepared(&self) -> Prepared {
        let mut extraction = Extraction::new(&self.inputs, &self.trees);
        extraction.expose(self.animation.as_ref(), self.moment.0, &self.inputs, &self.trees);
        extraction.prepared
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

    /// A cached reference, or a new one; `None` if it was stopped too early to be useful.
    fn reference(&self, last: &CurveStep, progress: &mut ReportProgress, stop: &Stop) -> Option<ReferenceImage> {
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

/// A size of about [`DEFAULT_PIXELS`] with the aspect ratio of `width` × `height`; that size itself if it is smaller.
fn modest(width: u32, height: u32) -> (u32, u32) {
    let scale = (DEFAULT_PIXELS / (f64::from(width) * f64::from(height))).sqrt().min(1.0);
    let scaled = |side: u32| (f64::from(side) * scale).round().max(1.0) as u32;
    (scaled(width), scaled(height))
}

/// Progress of the whole report; a curve is weighted by its pixels, a reference by several curves.
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

    /// Begins a task, which counts as done when the next one begins; returns a function that sets its progress, 0..1.
    fn task(&mut self, message: String, weight: f64, (width, height): (u32, u32)) -> impl FnMut(f64) {
        let (bar, before) = (self.bar.clone(), self.done);
        let share = weight * f64::from(width) * f64::from(height);
        self.done += share;
        bar.set_message(message);
        move |done| bar.set_position((before + share * done) as u64)
    }
}

/// The command line for the page, with the program's plain name, to be copied into a shell.
///
/// - `words`: the arguments.
fn command_line(words: impl Iterator<Item = OsString>) -> String {
    let words = words.map(|word| shell_word(&word.to_string_lossy()));
    std::iter::once("firstlight".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_the_command_run_nothing() {
        let words = ["report", "./x';touch PWNED;'.ron", "$(id)", "a b", "-o", "out"].map(OsString::from);
        let line = command_line(words.clone().into_iter());
        let again = shlex::split(&line).unwrap();
        assert_eq!(again[1..], words.map(|word| word.into_string().unwrap()), "{line}");
    }
}
