//! `firstlight render SCENE -o out.png`: a picture without a window, and the film that it can go on from.

use super::animate::{animate, frames};
use super::console::{print, remark};
use super::number::{parse_share, parse_stops};
use super::progress::Progress;
use super::stop::Stop;
use super::{Failure, FilterArg, IntegratorArg, OverwriteArgs, SceneArgs, parse_positive, parse_size};
use bevy_ecs::prelude::World;
use clap::Args;
use firstlight::frame::navigation::Rig;
use firstlight::frame::{
    FilmFile, OfflineReport, PictureFormat, Print, Target, read_film_file, render_offline_until, render_region_until,
    write_errors, write_film_into,
};
use firstlight::render::{BadSample, Display, Film, NoRoom, Purpose, Region, RenderSettings, Room};
use firstlight::report::cpu_seconds;
use firstlight::scene::whole_file::{Replace, WholeFile};
use firstlight::scene::{
    Developing, Extraction, Files, FilmSize, LoadedScene, Part, Rendering, SceneInputs, SceneSource, Shot, ShotDraft,
    ShotSamples,
};
use glam::UVec2;

use std::mem::ManuallyDrop;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Samples per pixel when neither a number, a time nor an error is given.
const DEFAULT_SPP: u32 = 256;

#[derive(Args, Clone, Debug)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// The picture: .png is developed, .exr is linear light.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Width and height in pixels; the scene's own when not given.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<(u32, u32)>,
    /// So many times as wide and as high.
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, value_parser = parse_positive)]
    pub scale: Option<f64>,
    /// Samples per pixel; 256 unless a time or an error is given.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=i64::from(Film::MAX_SAMPLES)))]
    pub spp: Option<u32>,
    /// Samples A to B-1 of each pixel: ranges that do not overlap can be added up with `firstlight merge`.
    #[arg(long, value_name = "A..B", value_parser = parse_range, conflicts_with_all = ["spp", "resume"])]
    pub samples: Option<Range<u32>>,
    /// Keep the film as well, an .exr to go on from.
    #[arg(long, value_name = "FILE.exr")]
    pub film: Option<PathBuf>,
    /// The relative error of each pixel as well, as the picture itself tells it: an .exr in which 0.05 is 5 %, the mean over
    /// 5 x 5 pixels. The root of the mean of its squares is the error of the whole picture.
    #[arg(long, value_name = "FILE.exr", conflicts_with_all = ["turntable", "bookmarks", "region"])]
    pub error_picture: Option<PathBuf>,
    /// Once around what the camera looks at, in so many pictures: FILE-0001.png and so on.
    #[arg(long, value_name = "FRAMES", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=100_000), conflicts_with_all = ["film", "resume", "samples", "json"])]
    pub turntable: Option<u32>,
    /// Left, top, width and height of a part of the picture, pixels: it gets all samples but the first, with whole tiles
    /// of 32 pixels around it, and what is left is as it was, with --resume too.
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_region, conflicts_with_all = ["turntable", "bookmarks", "samples"])]
    pub region: Option<[u32; 4]>,
    /// From bookmark to bookmark of the scene, by their numbers: 1,2,3.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', requires = "frames", conflicts_with_all = ["turntable", "film", "resume", "samples", "json"])]
    pub bookmarks: Option<Vec<u8>>,
    /// In how many pictures.
    #[arg(long, value_name = "FRAMES", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=100_000), requires = "bookmarks")]
    pub frames: Option<u32>,
    /// Go on with the film that is there: with --film, or with the film that is named as the scene.
    #[arg(long)]
    pub resume: bool,
    #[command(flatten)]
    pub overwrite: OverwriteArgs,
    /// Stop after so many seconds of rendering.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = parse_positive)]
    pub time: Option<f64>,
    /// Stop when the picture's relative error, by its own estimate, is down to this: 0.01 or 1% is one per cent.
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = parse_share)]
    pub error: Option<f64>,
    /// Worker threads; all cores when not given. The picture does not depend on it.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Another seed gives other noise; 0 when not given.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub seed: Option<u32>,
    /// The light model; the scene's own when not given.
    #[arg(long, value_enum)]
    pub integrator: Option<IntegratorArg>,
    /// How the light around a pixel is weighted; the scene's own when not given.
    #[arg(long, value_enum)]
    pub filter: Option<FilterArg>,
    /// Longest path in segments; 1 shows lights alone.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub max_depth: Option<u32>,
    /// Brighter or darker by factors of two, on top of the scene's own exposure; .exr keeps the linear light.
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, default_value_t = 0.0, value_parser = parse_stops)]
    pub exposure: f32,
    /// Print one JSON object with times and counts as the last line.
    #[arg(long)]
    pub json: bool,
    /// Said once the scene has been read.
    #[arg(skip)]
    pub announcement: Option<String>,
}

pub fn run(args: &RenderArgs, stop: &Stop) -> Result<(), Failure> {
    PictureFormat::of(&args.output).map_err(Failure::Usage)?;
    let film_path = film_path(args)?;
    // A picture that cannot be written is not worth the wait.
    let mut files = args.overwrite.files();
    if let Some(path) = args.scene.source()?.path() {
        files.read(path)?;
    }
    let film = match film_path {
        None => None,
        Some(path) if args.resume => Some(files.go_on(&path)?),
        Some(path) if path.exists() && files.replace() == Replace::AllButFilms => {
            let message =
                "is there already: go on with it by --resume, name another file, or replace it by --overwrite";
            return Err(Failure::Failed(format!("{}: {message}", path.display())));
        }
        Some(path) => Some(files.claim(&path, files.replace())?),
    };
    match frames(args) {
        Some(frames) => files.write_all(frames)?,
        None => files.write(&args.output)?,
    }
    if let Some(path) = &args.error_picture {
        if !is_exr(path) {
            return Err(Failure::Usage(format!(
                "{}: errors are written as OpenEXR: end the name in .exr",
                path.display()
            )));
        }
        files.write(path)?;
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads.map_or(0, usize::from))
        .build()
        .map_err(|error| Failure::Failed(format!("the worker threads cannot be started: {error}")))?;
    pool.install(|| render(args, film, &mut files, stop))
}

fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"))
}

/// Where the film is kept, if it is.
fn film_path(args: &RenderArgs) -> Result<Option<PathBuf>, Failure> {
    match &args.film {
        Some(path) if !is_exr(path) => {
            Err(Failure::Usage(format!("{}: films are OpenEXR pictures: end the name in .exr", path.display())))
        }
        Some(path) => Ok(Some(path.clone())),
        None if !args.resume => Ok(None),
        None => match args.scene.source()? {
            SceneSource::Picture(path) if is_exr(&path) => Ok(Some(path)),
            _ => Err(Failure::Usage("--resume goes on with a film: name it with --film FILE.exr".to_owned())),
        },
    }
}

/// A scene and how it is to be rendered.
pub(super) struct Job {
    pub scene: LoadedScene,
    world: World,
    extraction: Extraction,
    settings: RenderSettings,
    display: Display,
    size: (u32, u32),
    build_seconds: f64,
    draft: ShotDraft,
}

impl Job {
    fn new(args: &RenderArgs, kept: Option<&Shot>, files: &mut Files, progress: &Progress) -> Result<Self, Failure> {
        let aspect = args.size.map(|(width, height)| f64::from(width) / f64::from(height));
        let scene = args.scene.load(aspect, files, &|text| progress.stage(text.to_owned()))?;
        if let Some(announcement) = &args.announcement {
            progress.suspend(|| remark(announcement));
        }
        let mut world = bevy_ecs::world::World::new();
        scene.spawn(&mut world);
        let start = Instant::now();
        let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
        let build_seconds = scene.build_seconds + start.elapsed().as_secs_f64();
        for problem in &extraction.problems {
            remark(format_args!("warning: {problem}"));
        }
        // What is not asked for is as the film has it that is gone on with, then as the scene has it.
        let Rendering(of_scene) = *world.resource();
        let settings = RenderSettings {
            integrator: (args.integrator.map(Into::into))
                .or(kept.map(|kept| kept.integrator.into()))
                .unwrap_or(of_scene.integrator),
            max_depth: (args.max_depth)
                .or(kept.map(|kept| kept.max_depth.unwrap_or(u32::MAX)))
                .unwrap_or(of_scene.max_depth),
            seed: args.seed.or(kept.map(|kept| kept.seed)).unwrap_or(of_scene.seed),
            filter: (args.filter.map(Into::into))
                .or(kept.map(|kept| kept.film.filter.into()))
                .unwrap_or(of_scene.filter),
            ..of_scene
        };
        let FilmSize { width, height } = *world.resource();
        let size = args.size.or(kept.map(|kept| (kept.film.width, kept.film.height))).unwrap_or((width, height));
        let size = scaled(size, args.scale)?;
        let mut display = world.resource::<Developing>().0;
        display.exposure_stops += args.exposure;
        world.insert_resource(Rendering(settings));
        let draft = ShotDraft::of(&mut world, Some(&scene));
        Ok(Self { scene, world, extraction, settings, display, size, build_seconds, draft })
    }

    /// The camera, as it is.
    pub fn rig(&mut self) -> Option<Rig> {
        let camera = SceneInputs::of(&mut self.world).camera?;
        Some(Rig { view: camera.view, projection: camera.projection, lens: camera.lens })
    }

    /// Looks from there from now on.
    pub fn set_rig(&mut self, rig: &Rig) {
        if let Some(camera) = SceneInputs::of(&mut self.world).camera {
            self.world.entity_mut(camera.entity).insert((rig.view, rig.projection, rig.lens));
        }
        let inputs = SceneInputs::of(&mut self.world);
        self.extraction.update(Part::Camera, &inputs, &self.scene.trees);
        self.draft = ShotDraft::of(&mut self.world, Some(&self.scene)).prepared_as(&self.draft);
    }

    /// Renders a whole picture.
    pub fn picture(&self, args: &RenderArgs, target: Target) -> Result<Film, Failure> {
        let mut film = self.new_film(&purposes(args))?;
        render_offline_until(&self.extraction.snapshot, &self.settings, &mut film, target, &|| false, |_| true);
        Ok(film)
    }

    /// A film, and the certainty that there is memory for all that it is made for: before any ray is traced.
    fn new_film(&self, purposes: &[Purpose]) -> Result<Film, Failure> {
        let (width, height) = self.size;
        let no_room = |error: NoRoom| Failure::Failed(error.to_string());
        let from_lamps = self.extraction.snapshot.shading.features.caustics;
        drop(Room::for_film(width, height, from_lamps, purposes).map_err(no_room)?);
        let mut film = Film::try_new(width, height).map_err(no_room)?;
        if from_lamps {
            film.reserve_light().map_err(no_room)?;
        }
        Ok(film)
    }

    /// Writes a picture with its note.
    pub fn write(&self, film: &Film, path: &Path, replace: Replace) -> Result<(), Failure> {
        let note = self.note(film, path);
        let picture = Print { film, display: &self.display, size: self.size, note: Some(&note) };
        picture.write(path, replace).map_err(Failure::Failed)
    }

    /// The note of a picture of this film at `path`.
    fn note(&self, film: &Film, path: &Path) -> String {
        let samples = ShotSamples { first: film.first_sample(), spp: film.spp(), uneven: film.max_spp() > film.spp() };
        self.draft.note(path, self.size, samples, self.display.into())
    }

    /// An empty film, or the one that is gone on with.
    fn film(&self, args: &RenderArgs, kept: Option<(FilmFile, &Path)>) -> Result<Film, Failure> {
        let shot = self.scene.shot.as_ref();
        let first = args.samples.as_ref().map(|samples| samples.start).or(shot.map(|shot| shot.first_sample));
        let Some((FilmFile { film, shot, .. }, path)) = kept else {
            return Ok(self.new_film(&purposes(args))?.starting_at(first.unwrap_or(0)));
        };
        let ours = Shot::from_note(&self.note(&film, path)).map_err(Failure::Failed)?;
        match ours.differs_from(&shot) {
            None => Ok(film),
            Some(what) => Err(Failure::Failed(format!(
                "{}: is a film of another {what}: go on with it as it was begun, or keep a new film",
                path.display()
            ))),
        }
    }

    /// When it is good enough.
    pub fn target(&self, args: &RenderArgs) -> Target {
        let open_ended = args.time.is_none() && args.error.is_none();
        let of_picture = self.scene.shot.as_ref().filter(|_| !args.resume).map(|shot| shot.spp.max(1));
        let default = open_ended.then(|| of_picture.unwrap_or(DEFAULT_SPP));
        let of_range = args.samples.as_ref().map(|samples| samples.end - samples.start);
        Target { spp: args.spp.or(of_range).or(default), seconds: args.time, error: args.error }
    }
}

/// - `film_file`: where the film is kept, if it is; nobody else writes to it in the meantime.
fn render(args: &RenderArgs, film_file: Option<WholeFile>, files: &mut Files, stop: &Stop) -> Result<(), Failure> {
    let mut progress = Progress::new();
    let film_path = film_file.as_ref().map(|file| file.path().to_path_buf());
    let film_path = film_path.as_deref();
    let kept = match film_path.filter(|_| args.resume) {
        Some(path) => Some((read_film_file(path).map_err(Failure::Failed)?, path)),
        None => None,
    };
    if let Some(warning) = kept.as_ref().and_then(|(kept, _)| kept.warning.as_ref()) {
        progress.suspend(|| remark(format_args!("warning: {warning}")));
    }
    let job = Job::new(args, kept.as_ref().map(|(kept, _)| &kept.shot), files, &progress)?;
    // The program ends after this: taking a large scene apart piece by piece would only make people wait for that.
    let job = ManuallyDrop::new(job);
    if let Some(shot) = job.scene.shot.as_ref().filter(|shot| shot.uneven && !args.resume) {
        let message = format!("the picture was stopped in the middle of a pass; the new one has {} samples", shot.spp);
        progress.suspend(|| remark(format_args!("warning: {message} in every pixel")));
    }
    if args.turntable.is_some() || args.bookmarks.is_some() {
        return animate(args, ManuallyDrop::into_inner(job), progress, files.replaced().len(), stop);
    }
    let mut film = job.film(args, kept)?;
    if let Some(path) = film_path.filter(|_| args.resume) {
        let (path, spp) = (path.display(), film.spp());
        progress.suspend(|| remark(format_args!("going on with {path}, which has {spp} samples per pixel")));
    }
    let room = room_to_write(args, job.size)?;
    let target = job.target(args);
    let bad_before = film.n_bad();
    let cpu_before = cpu_seconds();
    let region = args.region.map(|region| region_in(&film, region)).transpose()?;
    // From here on a stop saves what there is, which must not take long.
    job.draft.prepare();
    stop.attend();
    let asked = || stop.is_asked();
    if region.is_some() && film.spp() == 0 {
        // A pixel without a sample shows nothing.
        let once = Target { spp: Some(1), ..Target::default() };
        render_offline_until(&job.extraction.snapshot, &job.settings, &mut film, once, &asked, |_| true);
    }
    let region = region.as_ref();
    let Job { extraction, settings, .. } = &*job;
    let report = render_region_until(&extraction.snapshot, settings, &mut film, region, target, &asked, |now| {
        let by_spp = target.spp.map_or(0.0, |spp| f64::from(now.spp) / f64::from(spp));
        let by_time = target.seconds.map_or(0.0, |seconds| now.seconds / seconds);
        let by_error = target
            .error
            .zip(now.error)
            .map_or(0.0, |(goal, error)| f64::from(now.spp) / f64::from(error.spp_for(goal)));
        let mrays = now.rays.total() as f64 / now.seconds.max(1e-9) * 1e-6;
        let share = by_spp.max(by_time).max(by_error);
        progress.at(share, format!("{} samples per pixel, {mrays:.1} Mrays/s", now.spp));
        true
    });
    let cpu_seconds = cpu_seconds().zip(cpu_before).map(|(after, before)| after - before);
    progress.finish();
    let error = film.error_estimate_in(region).map(|error| error.relative);
    let reached = target.reached(film.spp_in(region), report.seconds, error);
    let stopped = stop.is_asked() && !reached;
    if film.spp() == 0 {
        let message = "stopped before every pixel had a sample: there is nothing to save";
        return Err(Failure::Stopped(message.to_owned()));
    }

    drop(room);
    // The film first: a picture can be made of it.
    if let Some(file) = film_file {
        let note = job.note(&film, file.path());
        write_film_into(&film, &note, file).map_err(Failure::Failed)?;
    }
    job.write(&film, &args.output, files.replace())?;
    if let Some(path) = &args.error_picture {
        write_errors(&film, path, files.replace()).map_err(Failure::Failed)?;
    }
    if film.n_bad() > bad_before {
        let total = report.rays.camera;
        let n_bad = film.n_bad() - bad_before;
        remark(format_args!(
            "warning: {n_bad} of {total} samples were not finite and were left out{}",
            first_of(&report.bad)
        ));
    }
    if report.n_above > 0 {
        let (n_above, total) = (report.n_above, report.rays.camera);
        remark(format_args!(
            "warning: {n_above} of {total} samples are brighter than anything in the scene can be{}: \
             this is a fault of the program, please report it with the scene",
            first_of(&report.above)
        ));
    }
    if let (false, Some(wanted), Some(error)) = (stopped, target.error, error)
        && error > wanted
    {
        remark(format_args!(
            "warning: the error is {error:.3} still, not {wanted}: more time or samples would lower it"
        ));
    }
    if args.json {
        print(json(&job, &report, cpu_seconds, &film, files.replaced(), stopped))?;
    } else {
        let (output, (width, height)) = (args.output.display(), job.size);
        let (spp, seconds) = (film.spp(), report.seconds);
        let error = error.map_or(String::new(), |error| format!(", error about {:.2} %", 100.0 * error));
        let kept = film_path.map_or(String::new(), |path| format!(", the film kept in {}", path.display()));
        let replaced = replaced(files.replaced(), &args.output);
        remark(format_args!(
            "{output}: {width} x {height}, {spp} samples per pixel in {seconds:.1} s{error}{kept}{replaced}"
        ));
    }
    match (stopped, film_path) {
        (false, _) => Ok(()),
        (true, Some(path)) => Err(Failure::Stopped(format!(
            "stopped after {} samples per pixel; {} and the film {} are saved: go on with --resume --film {}",
            film.spp(),
            args.output.display(),
            path.display(),
            path.display()
        ))),
        (true, None) => Err(Failure::Stopped(format!(
            "stopped after {} samples per pixel; {} is saved (keep a film with --film to be able to go on)",
            film.spp(),
            args.output.display()
        ))),
    }
}

/// What is written at the end.
fn purposes(args: &RenderArgs) -> Vec<Purpose> {
    let film = args.film.is_some() || args.resume;
    let picture = match PictureFormat::of(&args.output) {
        Ok(PictureFormat::Exr) => Purpose::Exr,
        _ => Purpose::Png,
    };
    std::iter::once(picture).chain(film.then_some(Purpose::FilmFile)).collect()
}

/// Memory kept free for what is written at the end: a picture that cannot be written is not worth the wait.
fn room_to_write(args: &RenderArgs, (width, height): (u32, u32)) -> Result<Room, Failure> {
    Room::for_files(width, height, &purposes(args)).map_err(|error| Failure::Failed(error.to_string()))
}

/// `size` times `scale`, if that is a film that can be had.
fn scaled((width, height): (u32, u32), scale: Option<f64>) -> Result<(u32, u32), Failure> {
    let Some(scale) = scale else { return Ok((width, height)) };
    // Numbers out of range become the largest one, which is too large.
    let side = |side: u32| (f64::from(side) * scale).round().max(1.0) as u32;
    let (width, height) = (side(width), side(height));
    firstlight::scene::file::check_film_size(width, height)
        .map_err(|error| Failure::Usage(format!("--scale: {error}")))?;
    Ok((width, height))
}

/// `64..128` as sample numbers.
fn parse_range(text: &str) -> Result<Range<u32>, String> {
    let (start, end) =
        text.split_once("..").ok_or("write it as A..B, such as 64..128: from A up to, not including, B")?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| format!("`{text}` is not the number of a sample"));
    let range = number(start)?..number(end)?;
    if range.is_empty() {
        Err(format!("there is no sample from {} up to {}", range.start, range.end))
    } else if range.end > Film::MAX_SAMPLES {
        Err(format!("samples are numbered below {}", Film::MAX_SAMPLES))
    } else {
        Ok(range)
    }
}

/// `X,Y,W,H` as four numbers of pixels.
fn parse_region(text: &str) -> Result<[u32; 4], String> {
    let wrong = || format!("`{text}` is not a rectangle: write it as X,Y,W,H in pixels, such as 640,360,200,100");
    let numbers: Option<Vec<u32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let region = numbers.and_then(|numbers| <[u32; 4]>::try_from(numbers).ok()).ok_or_else(wrong)?;
    if region[2] == 0 || region[3] == 0 { Err(wrong()) } else { Ok(region) }
}

/// The tiles around a rectangle, if the film has any.
fn region_in(film: &Film, [x, y, width, height]: [u32; 4]) -> Result<Region, Failure> {
    let start = UVec2::new(x, y);
    film.region(start, start.saturating_add(UVec2::new(width, height))).ok_or_else(|| {
        let (width, height) = (film.width(), film.height());
        Failure::Usage(format!("--region: begins at {x},{y}, but the picture has {width} x {height} pixels"))
    })
}

/// Where the first sample of a list is, for people who want to look into it.
fn first_of(samples: &[BadSample]) -> String {
    let place = |&BadSample { x, y, sample }: &BadSample| format!(" (pixel {x},{y}, sample {sample})");
    samples.first().map(place).unwrap_or_default()
}

/// Tells which files are not there any more.
fn replaced(paths: &[PathBuf], output: &Path) -> String {
    match paths {
        [] => String::new(),
        [path] if path == output => ", in place of the file that was there".to_owned(),
        paths => {
            let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
            format!(", in place of what was there: {}", names.join(", "))
        }
    }
}

/// One line for machines.
fn json(
    job: &Job,
    report: &OfflineReport,
    cpu_seconds: Option<f64>,
    film: &Film,
    replaced: &[PathBuf],
    stopped: bool,
) -> serde_json::Value {
    let replaced: Vec<_> = replaced.iter().map(|path| path.to_string_lossy()).collect();
    let error = film.error_estimate();
    let places = |samples: &[BadSample]| -> Vec<_> {
        samples.iter().map(|bad| serde_json::json!([bad.x, bad.y, bad.sample])).collect()
    };
    serde_json::json!({
        "scene": job.scene.source.title(),
        "width": film.width(),
        "height": film.height(),
        "spp": film.spp(),
        "first_sample": film.first_sample(),
        "seed": job.settings.seed,
        "stopped": stopped,
        "load_s": job.scene.load_seconds,
        "build_s": job.build_seconds,
        "render_s": report.seconds,
        "cpu_s": cpu_seconds,
        "threads": rayon::current_num_threads(),
        "rays": {
            "camera": report.rays.camera,
            "bounce": report.rays.bounce,
            "shadow": report.rays.shadow,
        },
        "mrays_per_s": report.rays.total() as f64 / report.seconds.max(1e-9) * 1e-6,
        "estimated_error": error.map(|error| error.relative),
        "estimated_error_95": error.map(|error| [error.low, error.high]),
        "bad_samples": report.n_bad,
        "bad_samples_at": places(&report.bad),
        "samples_above_bound": report.n_above,
        "samples_above_bound_at": places(&report.above),
        "replaced": replaced,
    })
}
