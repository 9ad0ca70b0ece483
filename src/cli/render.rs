//! `firstlight render SCENE -o out.png`: a picture without a window.

use super::console::{print, remark};
use super::{Failure, FilterArg, IntegratorArg, SceneArgs, parse_positive, parse_size};
use clap::Args;
use firstlight::frame::{OfflineReport, PictureFormat, Target, render_offline, write_film};
use firstlight::render::{Film, RenderSettings};
use firstlight::report::cpu_seconds;
use firstlight::scene::whole_file::check_writable;
use firstlight::scene::{Developing, Extraction, FilmSize, LoadedScene, Rendering, SceneInputs};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::path::PathBuf;
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
    /// Samples per pixel; 256 unless a time or an error is given.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,
    /// Stop after so many seconds of rendering.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = parse_positive)]
    pub time: Option<f64>,
    /// Stop when the picture's relative error, by its own estimate, is down to this: 0.01 is one per cent.
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = parse_positive)]
    pub error: Option<f64>,
    /// Worker threads; all cores when not given. The picture does not depend on it.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Another seed gives other noise.
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 0)]
    pub seed: u32,
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
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, default_value_t = 0.0)]
    pub exposure: f32,
    /// Print one JSON object with times and counts as the last line.
    #[arg(long)]
    pub json: bool,
    /// Said once the scene has been read.
    #[arg(skip)]
    pub announcement: Option<String>,
}

pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    if !args.exposure.is_finite() {
        return Err(Failure::Usage("--exposure must be a finite number of stops".to_owned()));
    }
    PictureFormat::of(&args.output).map_err(Failure::Usage)?;
    // A picture that cannot be written is not worth the wait.
    check_writable(&args.output).map_err(Failure::Failed)?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads.map_or(0, usize::from))
        .build()
        .map_err(|error| Failure::Failed(format!("the worker threads cannot be started: {error}")))?;
    pool.install(|| render(args))
}

fn render(args: &RenderArgs) -> Result<(), Failure> {
    let bar = progress_bar();
    let aspect = args.size.map(|(width, height)| f64::from(width) / f64::from(height));
    let scene = args.scene.load(aspect, &|text| bar.set_message(text.to_owned()))?;
    if let Some(announcement) = &args.announcement {
        bar.suspend(|| remark(announcement));
    }

    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let start = Instant::now();
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
    let build_seconds = scene.build_seconds + start.elapsed().as_secs_f64();
    for problem in &extraction.problems {
        remark(format_args!("warning: {problem}"));
    }

    let settings = settings(args, world.resource::<Rendering>().0);
    let FilmSize { width, height } = *world.resource();
    let (width, height) = args.size.unwrap_or((width, height));
    let mut film = Film::new(width, height);
    let open_ended = args.time.is_none() && args.error.is_none();
    let target = Target { spp: args.spp.or(open_ended.then_some(DEFAULT_SPP)), seconds: args.time, error: args.error };
    let cpu_before = cpu_seconds();
    let report = render_offline(&extraction.snapshot, &settings, &mut film, target, |now| {
        let by_spp = target.spp.map_or(0.0, |spp| f64::from(now.spp) / f64::from(spp));
        let by_time = target.seconds.map_or(0.0, |seconds| now.seconds / seconds);
        let by_error = target
            .error
            .zip(now.error)
            .map_or(0.0, |(goal, error)| f64::from(now.spp) / f64::from(error.spp_for(goal)));
        bar.set_position((by_spp.max(by_time).max(by_error).min(1.0) * 1000.0) as u64);
        let mrays = now.rays.total() as f64 / now.seconds.max(1e-9) * 1e-6;
        bar.set_message(format!("{} samples per pixel, {mrays:.1} Mrays/s", now.spp));
        true
    });
    let cpu_seconds = cpu_seconds().zip(cpu_before).map(|(after, before)| after - before);
    bar.finish_and_clear();

    let mut display = world.resource::<Developing>().0;
    display.exposure_stops += args.exposure;
    write_film(&film, &display, &args.output).map_err(Failure::Failed)?;
    if report.n_bad > 0 {
        let total = u64::from(film.spp()) * u64::from(width) * u64::from(height);
        remark(format_args!("warning: {} of {total} samples were not finite and were left out", report.n_bad));
    }
    if args.json {
        print(json(&scene, build_seconds, &report, cpu_seconds, &film))?;
    } else if std::io::stderr().is_terminal() {
        remark(format_args!(
            "{}: {width} x {height}, {} samples per pixel in {:.1} s",
            args.output.display(),
            film.spp(),
            report.seconds
        ));
    }
    Ok(())
}

fn settings(args: &RenderArgs, of_scene: RenderSettings) -> RenderSettings {
    RenderSettings {
        integrator: args.integrator.map_or(of_scene.integrator, Into::into),
        max_depth: args.max_depth.unwrap_or(of_scene.max_depth),
        seed: args.seed,
        filter: args.filter.map_or(of_scene.filter, Into::into),
        ..of_scene
    }
}

/// One line for machines.
fn json(
    scene: &LoadedScene,
    build_seconds: f64,
    report: &OfflineReport,
    cpu_seconds: Option<f64>,
    film: &Film,
) -> serde_json::Value {
    let error = film.error_estimate();
    let bad: Vec<_> = report.bad.iter().map(|bad| serde_json::json!([bad.x, bad.y, bad.sample])).collect();
    serde_json::json!({
        "scene": scene.source.title(),
        "width": film.width(),
        "height": film.height(),
        "spp": film.spp(),
        "load_s": scene.load_seconds,
        "build_s": build_seconds,
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
        "bad_samples_at": bad,
    })
}

/// Quiet when nobody watches.
fn progress_bar() -> ProgressBar {
    let target =
        if std::io::stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let style = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}  {elapsed} (left: {eta})")
        .expect("the template is well formed");
    ProgressBar::with_draw_target(Some(1000), target).with_style(style)
}
