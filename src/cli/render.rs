//! `firstlight render SCENE -o out.png`: renders an image without a window, and a film from which it can be resumed.

use crate::cli::animate::animate;
use crate::cli::args::replaced;
use crate::cli::console::{inform, print, prints_to_terminal, remark};
use crate::cli::denoising::ErrorOf;
use crate::cli::failure::Failure;
use crate::cli::job::{RenderJob, room_to_write};
use crate::cli::number::{counted, percent, samples_per_pixel};
use crate::cli::part;
use crate::cli::progress::RenderProgress;
use crate::cli::render_args::{RenderArgs, RenderCommand};
use crate::cli::sequence::Sequence;
use crate::cli::stop::Stop;
use crate::cli::video;
use firstlight::frame::{
    OfflineReport, Progress as Measured, Target, read_film_file, render_measured_until, render_region_until,
    write_errors, write_film_with_features,
};
use firstlight::render::{BadSample, Denoised, Film, GuideGatherer, Region, worker_threads};
use firstlight::report::cpu_seconds;
use firstlight::scene::whole_file::{Replace, WholeFile};
use firstlight::scene::{Files, SceneSource};
use glam::{UVec2, Vec3};

use std::cell::Cell;
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The command, for parsing the arguments of a job.
#[derive(clap::Parser)]
#[command(name = "firstlight render", no_binary_name = true)]
pub struct Command {
    #[command(flatten)]
    pub render: RenderCommand,
}

impl Command {
    /// - `words`: the scene and the options.
    pub fn parse(words: &[String]) -> Result<Self, Failure> {
        use clap::Parser;
        Self::try_parse_from(words).map_err(|error| {
            let text = error.render().to_string();
            Failure::Usage(text.trim_start_matches("error: ").lines().next().unwrap_or_default().to_owned())
        })
    }

    /// The arguments of the part, if one is given.
    pub fn part(&self) -> Result<Option<RenderArgs>, Failure> {
        self.render.part()
    }
}

/// Renders each scene in turn.
pub fn run(command: &RenderCommand, stop: &Stop) -> Result<(), Failure> {
    if let Some(job) = command.part()? {
        return part::run(&job, None, stop);
    }
    let jobs = command.jobs()?;
    // An error in the last argument should be reported before the others are rendered.
    crate::cli::args::check_scenes(jobs.iter().map(|job| &job.scene))?;
    let jobs = jobs.iter().map(RenderArgs::of_image).collect::<Result<Vec<_>, _>>()?;
    for job in &jobs {
        job.picture_format()?;
    }
    let inputs = inputs(&jobs)?;
    for (i, job) in jobs.iter().enumerate() {
        render_one(job, &inputs, stop)?;
        if job.has_next {
            stop.has_saved(format!("{} of {} images are saved", i + 1, jobs.len()));
            stop.rest();
        }
    }
    Ok(())
}

/// All files that several scenes read, if an image of one of them may replace one: none of them is written.
fn inputs(jobs: &[RenderArgs]) -> Result<Vec<PathBuf>, Failure> {
    let may_replace = |job: &RenderArgs| job.is_sequence() || job.output.exists();
    if jobs.len() < 2 || !jobs.iter().any(may_replace) {
        return Ok(Vec::new());
    }
    let inputs = jobs.iter().map(|job| job.scene.files()).collect::<Result<Vec<_>, _>>()?.concat();
    // Before the first of them is rendered.
    let mut files = jobs[0].overwrite.files();
    files.read_all(inputs.iter().cloned())?;
    jobs.iter().filter(|job| !job.is_sequence()).try_for_each(|job| files.write(&job.output))?;
    Ok(inputs)
}

/// Renders one scene.
pub fn run_one(args: &RenderArgs, stop: &Stop) -> Result<(), Failure> {
    render_one(args, &[], stop)
}

/// - `inputs`: files that are not written, besides those of the scene.
fn render_one(args: &RenderArgs, inputs: &[PathBuf], stop: &Stop) -> Result<(), Failure> {
    args.picture_format()?;
    check_stdout(args)?;
    let sequence = Sequence::of(args)?;
    if args.video.is_some() && sequence.is_none() {
        return Err(Failure::Usage("--video needs a sequence: --frames A..B, --turntable N or --bookmarks".to_owned()));
    }
    video::check(args)?;
    // Of a sequence, each frame has a film of its own.
    let film_path = film_path(args)?.filter(|_| sequence.is_none());
    // Outputs that cannot be written are reported before rendering.
    let mut files = args.overwrite.files();
    files.read_all(inputs.iter().cloned())?;
    if let Some(path) = args.scene.source()?.path() {
        files.read(path)?;
    }
    let film = match film_path {
        None => None,
        Some(path) if args.resume => Some(files.go_on(&path)?),
        Some(path) if path.exists() && files.replace() == Replace::AllButFilms => {
            let message =
                "already exists: continue it with --resume, replace it with --overwrite, or choose another name";
            return Err(Failure::Failed(format!("{}: {message}", path.display())));
        }
        Some(path) => Some(files.claim(&path, files.replace())?),
    };
    match &sequence {
        Some(sequence) => {
            files.write_all(sequence.paths(&args.output), files.replace())?;
            // Those of frames that are complete stay; of each other one it is checked that no samples are lost.
            let films = args.film.iter().flat_map(|path| sequence.paths(path));
            files.write_all(films, Replace::Anything)?;
            args.video.iter().try_for_each(|path| files.write(path))?;
        }
        None if args.to_stdout() => {}
        None => files.write(&args.output)?,
    }
    if let Some(path) = &args.error_image {
        if !is_exr(path) {
            return Err(Failure::Usage(format!("{}: the name of an error image must end in .exr", path.display())));
        }
        files.write(path)?;
    }
    if args.spp == Some(1) && !args.resume {
        let asked = [("--error-image", args.error_image.is_some()), ("--layers error", args.layers.has_error())];
        if let Some((option, _)) = asked.iter().find(|(_, is_asked)| *is_asked) {
            let message = format!("{option} needs at least two samples per pixel: use --spp 2 or more");
            return Err(Failure::Usage(message));
        }
    }
    let pool = worker_threads()
        .num_threads(args.threads.map_or(0, usize::from))
        .build()
        .map_err(|error| Failure::Failed(format!("cannot start worker threads: {error}")))?;
    pool.install(|| match &sequence {
        Some(sequence) => render_sequence(args, sequence, &mut files, stop),
        None => render(args, film, &mut files, stop),
    })
}

fn render_sequence(args: &RenderArgs, sequence: &Sequence, files: &mut Files, stop: &Stop) -> Result<(), Failure> {
    let args = &sequence.opened(args)?;
    let progress = RenderProgress::new();
    let job = RenderJob::new(args, None, files, &progress)?;
    animate(args, job, progress, sequence, stop)
}

/// Checks that standard output is used for one image and nothing else.
fn check_stdout(args: &RenderArgs) -> Result<(), Failure> {
    let message = if !args.to_stdout() {
        return Ok(());
    } else if args.json {
        "-o - and --json both write to standard output: write the image to a file"
    } else if args.is_sequence() {
        "-o - takes one image: write the frames to files"
    } else if prints_to_terminal() {
        "standard output is a terminal: redirect it, or write the image to a file"
    } else {
        return Ok(());
    };
    Err(Failure::Usage(message.to_owned()))
}

fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"))
}

/// Path of the film, if it is saved.
fn film_path(args: &RenderArgs) -> Result<Option<PathBuf>, Failure> {
    match &args.film {
        Some(path) if !is_exr(path) => {
            Err(Failure::Usage(format!("{}: the name of a film must end in .exr", path.display())))
        }
        Some(path) => Ok(Some(path.clone())),
        None if !args.resume => Ok(None),
        None => match args.scene.source()? {
            SceneSource::Picture(path) if is_exr(&path) => Ok(Some(path)),
            _ => Err(Failure::Usage("--resume needs a film: name it with --film FILE.exr".to_owned())),
        },
    }
}

/// - `film_file`: file of the film if it is saved; no other process can write it in the meantime.
fn render(args: &RenderArgs, film_file: Option<WholeFile>, files: &mut Files, stop: &Stop) -> Result<(), Failure> {
    let mut progress = RenderProgress::new();
    let film_path = film_file.as_ref().map(|file| file.path().to_path_buf());
    let film_path = film_path.as_deref();
    let mut kept = match film_path.filter(|_| args.resume) {
        Some(path) => Some((read_film_file(path)?, path)),
        None => None,
    };
    let job = RenderJob::new(args, kept.as_ref().map(|(kept, _)| &kept.shot), files, &progress)?;
    // The process ends after this: freeing a large scene would only take time.
    let mut job = ManuallyDrop::new(job);
    if let Some(shot) = job.scene.shot.as_ref().filter(|shot| shot.uneven && !args.resume) {
        let (was, samples) = match shot.spp {
            0 => ("has pixels without a sample", "a sample".to_owned()),
            spp => ("was saved in the middle of a pass", counted(spp as usize, "sample")),
        };
        let message = format!("the image {was}; the new one has {samples} in every pixel");
        progress.suspend(|| remark(format_args!("warning: {message}")));
    }
    let kept_features = kept.as_mut().and_then(|(kept, _)| kept.features.take());
    let mut film = job.film(args, kept)?;
    if let Some(path) = film_path.filter(|_| args.resume) {
        let (path, spp) = (path.display(), samples_per_pixel(film.spp()));
        progress.suspend(|| inform(format_args!("resuming {path}, which has {spp}")));
    }
    let room = room_to_write(args, job.size)?;
    let target = job.target(args);
    let bad_before = film.n_bad();
    let cpu_before = cpu_seconds();
    let region = args.region.map(|region| region_in(&film, region)).transpose()?;
    let of_denoised = args.denoise.error_of == Some(ErrorOf::Denoised);
    let raw_error =
        |film: &Film, region| film.error_estimate_in(region).map(|error| error.relative).filter(|_| !of_denoised);
    if args.resume && target.reached(film.spp_in(region.as_ref()), 0.0, raw_error(&film, region.as_ref())) {
        let message = format!("nothing to render: the film has reached {}", target_in_words(&target));
        progress.suspend(|| inform(message));
    }
    let features_start = Instant::now();
    let features = job.features(args, kept_features)?;
    let features_seconds = features_start.elapsed().as_secs_f64();
    // From here on, a stop saves the results, which must be quick.
    job.draft.prepare();
    stop.attend();
    let asked = || stop.is_asked();
    if region.is_some() && film.spp() == 0 {
        // Pixels without samples would be black.
        let once = Target { spp: Some(1), ..Target::default() };
        render_region_until(&job.extraction.prepared, &job.settings, &mut film, None, once, &asked, |_| true);
    }
    let region = region.as_ref();
    let RenderJob { extraction, settings, .. } = &*job;
    // The denoised image with its samples per pixel, and what guides the denoiser.
    let (mut denoised, mut guides) = (None, GuideGatherer::default());
    let failure = Cell::new(None);
    let told = |now: Measured| {
        let by_spp = target.spp.map_or(0.0, |spp| f64::from(now.spp) / f64::from(spp));
        let by_time = target.seconds.map_or(0.0, |seconds| now.seconds / seconds);
        let by_error = target
            .error
            .zip(now.error.filter(|_| !of_denoised))
            .map_or(0.0, |(goal, error)| f64::from(now.spp) / f64::from(error.spp_for(goal)));
        let mrays = now.rays.total() as f64 / now.seconds.max(1e-9) * 1e-6;
        let share = by_spp.max(by_time).max(by_error);
        progress.at(share, format!("{}, {mrays:.1} Mrays/s", samples_per_pixel(now.spp)));
        // A failure of the denoiser ends the render.
        let failed = failure.take();
        let goes_on = failed.is_none();
        failure.set(failed);
        goes_on
    };
    let (scene, settings) = (&extraction.prepared, settings);
    let report = if of_denoised {
        let mut error_of = |film: &Film| {
            let found = job.denoised(film, &mut guides, &asked).unwrap_or_else(|error| {
                failure.set(Some(error));
                None
            })?;
            Some(denoised.insert((film.spp(), found)).1.error)
        };
        render_measured_until(scene, settings, &mut film, target, &mut error_of, &asked, told)
    } else {
        render_region_until(scene, settings, &mut film, region, target, &asked, told)
    };
    let cpu_seconds = cpu_seconds().zip(cpu_before).map(|(after, before)| after - before);
    progress.finish();
    // If all samples are black, the error estimate is meaningless.
    let is_dark = extraction.prepared.has_light() && is_black(&film);
    let error = film.error_estimate_in(region).map(|error| error.relative);
    let error_of_denoised = denoised.as_ref().map(|(_, found): &(u32, Denoised)| found.error);
    let counted = if of_denoised { error_of_denoised } else { error };
    let reached = target.reached(film.spp_in(region), report.seconds, counted);
    let stopped = stop.is_asked() && !reached;
    if film.spp() == 0 {
        let message = "stopped before every pixel had a sample: nothing was saved";
        return Err(Failure::Stopped(message.to_owned()));
    }

    drop(room);
    // The film first: an image can be made from it.
    if let Some(file) = film_file {
        let note = job.note(&film, file.path());
        write_film_with_features(&film, features.as_ref(), &note, file)?;
    }
    if let Some(failure) = failure.take() {
        return Err(failure);
    }
    let (denoised, denoise_seconds) = match denoised.filter(|(spp, _)| *spp == film.spp()) {
        // `--error-of denoised` has made it.
        Some((_, found)) => (Some(found), None),
        None => {
            let start = Instant::now();
            let found = job.denoised(&film, &mut guides, &asked)?;
            let seconds = found.is_some().then(|| start.elapsed().as_secs_f64());
            (found, seconds)
        }
    };
    if args.wants_denoised() && denoised.is_none() {
        remark(format_args!("warning: stopped before the image was denoised: {} is raw", args.output_name()));
    }
    job.write(args, (&film, features.as_ref()), denoised.as_ref(), &args.output, files.replace())?;
    let denoised_error = denoised.map(|denoised| (denoised.error, denoised.error_95)).filter(|_| !is_dark);
    if let Some(path) = &args.error_image {
        write_errors(&film, path, files.replace())?;
    }
    if film.n_bad() > bad_before {
        let total = report.rays.camera;
        let n_bad = film.n_bad() - bad_before;
        remark(format_args!(
            "warning: {n_bad} of {total} samples were not finite and were discarded{}",
            first_of(&report.bad)
        ));
    }
    if is_dark {
        let spp = film.spp();
        remark(format_args!(
            "warning: none of {spp} samples per pixel found any light, so the error is unknown: use more samples, or check \
             that the camera sees something lit"
        ));
    }
    if report.n_above > 0 {
        let (n_above, total) = (report.n_above, report.rays.camera);
        remark(format_args!(
            "warning: {n_above} of {total} samples are brighter than the scene allows{}: \
             this is a bug in firstlight, please report it with the scene",
            first_of(&report.above)
        ));
    }
    let counted = if of_denoised { denoised_error.map(|(error, _)| error) } else { error };
    if let (false, Some(wanted), Some(error)) = (stopped, target.error, counted)
        && error > wanted
    {
        let of_what = if of_denoised { " of the denoised image" } else { "" };
        remark(format_args!(
            "warning: the estimated error{of_what} is {}, above the target of {}: allow more time or samples",
            percent(error),
            percent(wanted)
        ));
    }
    if args.json {
        let seconds = (features_seconds, cpu_seconds, denoise_seconds);
        print(json(&job, &report, seconds, (&film, region, is_dark), denoised_error, files.replaced(), stopped))?;
    } else {
        let (output, (width, height)) = (args.output_name(), job.size);
        let seconds = report.seconds;
        let error = error.filter(|_| !is_dark);
        let error = error.map_or(String::new(), |error| format!(", estimated error {}", percent(error)));
        let denoised = match (denoised_error, denoise_seconds) {
            (Some((error, _)), Some(seconds)) if seconds > 0.05 => {
                format!(" (denoised: {}, in {seconds:.1} s)", percent(error))
            }
            (Some((error, _)), _) => format!(" (denoised: {})", percent(error)),
            (None, _) => String::new(),
        };
        let kept = film_path.map_or(String::new(), |path| format!(", film saved to {}", path.display()));
        let replaced = replaced(files.replaced());
        let spp = match region {
            None => samples_per_pixel(film.spp()),
            Some(region) => in_region(&film, region),
        };
        inform(format_args!("{output}: {width} x {height}, {spp} in {seconds:.1} s{error}{denoised}{kept}{replaced}"));
    }
    if args.has_next {
        drop(ManuallyDrop::into_inner(job));
    }
    match (stopped, film_path) {
        (false, _) => Ok(()),
        (true, Some(path)) => Err(Failure::Stopped(format!(
            "stopped after {}; saved {} and the film {}: continue with --resume --film {}",
            samples_per_pixel(film.spp()),
            args.output_name(),
            path.display(),
            path.display()
        ))),
        (true, None) => Err(Failure::Stopped(format!(
            "stopped after {}; saved {} (to be able to resume, save a film with --film)",
            samples_per_pixel(film.spp()),
            args.output_name()
        ))),
    }
}

/// The tiles that cover a rectangle, if it overlaps the film; warns if it reaches beyond the image.
fn region_in(film: &Film, [x, y, width, height]: [u32; 4]) -> Result<Region, Failure> {
    let (start, size) = (UVec2::new(x, y), UVec2::new(film.width(), film.height()));
    let end = start.saturating_add(UVec2::new(width, height));
    let region = film.region(start, end).ok_or_else(|| {
        Failure::Usage(format!("--region: {x},{y} is outside of the image of {} x {} pixels", size.x, size.y))
    })?;
    if end.cmpgt(size).any() {
        let UVec2 { x: width, y: height } = end.min(size) - start;
        remark(format_args!(
            "warning: --region reaches beyond the image of {} x {} pixels: it is cut to {x},{y},{width},{height}",
            size.x, size.y
        ));
    }
    Ok(region)
}

/// Description of the samples per pixel of an image of which a region was rendered.
fn in_region(film: &Film, region: &Region) -> String {
    let size = region.end - region.start;
    let (spp, elsewhere) = (samples_per_pixel(film.spp_in(Some(region))), film.spp());
    let (Region { start, .. }, UVec2 { x: width, y: height }) = (region, size);
    format!("{spp} in the region of {width} x {height} at {},{}, at least {elsewhere} elsewhere", start.x, start.y)
}

/// The target of a rendering as text.
fn target_in_words(target: &Target) -> String {
    let spp = target.spp.map(samples_per_pixel);
    let error = target.error.map(|error| format!("an error of {}", percent(error)));
    spp.into_iter().chain(error).collect::<Vec<_>>().join(" or ")
}

/// Location of the first sample of a list, for the user to inspect.
fn first_of(samples: &[BadSample]) -> String {
    let place = |&BadSample { x, y, sample }: &BadSample| format!(" (pixel {x},{y}, sample {sample})");
    samples.first().map(place).unwrap_or_default()
}

fn is_black(film: &Film) -> bool {
    (0..film.height()).all(|y| (0..film.width()).all(|x| film.mean(x, y) == Vec3::ZERO))
}

/// The result as one line of JSON.
fn json(
    job: &RenderJob,
    report: &OfflineReport,
    (features_seconds, cpu_seconds, denoise_seconds): (f64, Option<f64>, Option<f64>),
    (film, region, is_dark): (&Film, Option<&Region>, bool),
    denoised_error: Option<(f64, [f64; 2])>,
    replaced: &[PathBuf],
    stopped: bool,
) -> serde_json::Value {
    let replaced: Vec<_> = replaced.iter().map(|path| path.to_string_lossy()).collect();
    let error = film.error_estimate_in(region).filter(|_| !is_dark);
    let of_region = region.map(|region| {
        let size = region.end - region.start;
        serde_json::json!({
            "x": region.start.x, "y": region.start.y, "width": size.x, "height": size.y,
            "spp": film.spp_in(Some(region)),
        })
    });
    let (least, mean, most) = film.sample_counts();
    let places = |samples: &[BadSample]| -> Vec<_> {
        samples.iter().map(|bad| serde_json::json!([bad.x, bad.y, bad.sample])).collect()
    };
    serde_json::json!({
        "scene": job.scene.source.title(),
        "width": film.width(),
        "height": film.height(),
        "spp": film.spp(),
        "samples": { "least": least, "mean": mean, "most": most },
        "first_sample": film.first_sample(),
        "seed": job.settings.seed,
        "stopped": stopped,
        "load_s": job.scene.load_seconds,
        "build_s": job.build_seconds,
        "features_s": features_seconds,
        "render_s": report.seconds,
        "cpu_s": cpu_seconds,
        "denoise_s": denoise_seconds,
        "threads": rayon::current_num_threads(),
        "rays": {
            "camera": report.rays.camera,
            "bounce": report.rays.bounce,
            "shadow": report.rays.shadow,
        },
        "mrays_per_s": report.rays.total() as f64 / report.seconds.max(1e-9) * 1e-6,
        // With a region, its own error.
        "region": of_region,
        "estimated_error": error.map(|error| error.relative),
        "estimated_error_95": error.map(|error| [error.low, error.high]),
        "estimated_error_denoised": denoised_error.map(|(error, _)| error),
        "estimated_error_denoised_95": denoised_error.map(|(_, interval)| interval),
        "bad_samples": report.n_bad,
        "bad_samples_at": places(&report.bad),
        "samples_above_bound": report.n_above,
        "samples_above_bound_at": places(&report.above),
        "replaced": replaced,
    })
}
