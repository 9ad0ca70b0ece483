//! `firstlight [SCENE|MODEL]`: opens a window, or renders an image if there is no display.

use crate::cli::args::{OverwriteArgs, SceneArgs, replaced};
use crate::cli::console::{inform, remark};
use crate::cli::denoising::DenoiseArgs;
use crate::cli::failure::Failure;
use crate::cli::number::{between, counted, samples_per_pixel};
use crate::cli::render;
use crate::cli::render_args::{RenderArgs, free_name};
use crate::cli::stop::Stop;
use clap::Args;
use firstlight::frame::{PictureFormat, Print, ReplayOptions, replay};
use firstlight::render::Film;
use firstlight::scene::ImageSamples;
use std::path::PathBuf;

#[derive(Args, Clone, Debug)]
pub struct ShowArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Size of the window in logical pixels, at most that of the screen; of the image if there is no display.
    #[arg(long, value_name = "WxH", value_parser = crate::cli::number::parse_size)]
    size: Option<(u32, u32)>,
    /// Number of worker threads [default: all cores].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = between::<u16>(1, 1024))]
    threads: Option<u16>,
    /// Random seed [default: 0].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = between::<u32>(0, u32::MAX))]
    seed: Option<u32>,
    /// Record the session to a file, for --replay.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Replay a recording without a window and render its final image.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["record", "scene", "size", "seed", "env"])]
    replay: Option<PathBuf>,
    /// Image file for --replay.
    #[arg(short, long, value_name = "FILE", default_value = "replay.png", requires = "replay")]
    output: PathBuf,
    #[command(flatten)]
    overwrite: OverwriteArgs,
    /// Samples per pixel for --replay [default: as recorded].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = between::<u32>(1, Film::MAX_SAMPLES), requires = "replay")]
    spp: Option<u32>,
    /// Print input latency and number of camera paths as JSON on exit; rendering does not stop at an error target.
    #[cfg(feature = "viewer")]
    #[arg(long)]
    figures: bool,
    /// Folder for screenshots and saved scenes.
    #[cfg(feature = "viewer")]
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    save_to: PathBuf,
}

pub fn run(args: &ShowArgs) -> Result<(), Failure> {
    if args.replay.is_some() {
        let args = args.clone();
        return Stop::obeyed_by(move |_| play(&args));
    }
    #[cfg(feature = "viewer")]
    if firstlight::viewer::display::find() != firstlight::viewer::display::DisplayServer::None {
        return open_window(args);
    }
    let args = args.clone();
    Stop::obeyed_by(move |stop| render_instead(&args, stop))
}

#[cfg(feature = "viewer")]
fn open_window(args: &ShowArgs) -> Result<(), Failure> {
    use crate::cli::arenas;
    use crate::cli::console::lines;
    use firstlight::frame::{SettingsStore, check_recordable};
    use firstlight::viewer::{ViewerError, ViewerOptions, run};
    arenas::limit();
    let source = args.scene.source()?;
    args.scene.tell_ignored(&source);
    if let Some(record) = &args.record {
        let mut files = OverwriteArgs::default().files();
        files.read_all(source.path().map(std::path::Path::to_path_buf))?;
        check_recordable(record)?;
        files.write(record)?;
    }
    let store = SettingsStore::of_platform();
    let (mut settings, trouble) = store.settings();
    if let Some(trouble) = trouble {
        remark(format_args!("warning: {trouble}"));
    }
    settings.remember(&source);
    let (width, height) = args.size.or(settings.window).unwrap_or((1280, 720));
    // Problems with the settings folder must not prevent rendering.
    if let Err(error) = store.keep_settings(&settings) {
        remark(format_args!("warning: {error}"));
    }
    let threads = args.threads.map(usize::from);
    let folder = args.save_to.clone();
    if !folder.is_dir() {
        return Err(Failure::Problems(vec![format!("{}: there is no such folder for --save-to", folder.display())]));
    }
    let opening = args.scene.opening()?;
    let options = ViewerOptions {
        source,
        width,
        height,
        threads,
        seed: args.seed.unwrap_or(0),
        up: opening.up,
        choice: opening.choice,
        environment: args.scene.environment()?,
        folder,
        record: args.record.clone(),
        print_figures: args.figures,
    };
    run(options).map_err(|error| match error {
        ViewerError::Stopped(message) => Failure::Stopped(message),
        error => Failure::Problems(lines(&error.to_string())),
    })
}

/// Replays a recording and saves its final image.
fn play(args: &ShowArgs) -> Result<(), Failure> {
    let Some(path) = &args.replay else { return Ok(()) };
    PictureFormat::of(&args.output).map_err(|error| Failure::Usage(error.into()))?;
    let mut files = args.overwrite.files();
    files.read(path)?;
    files.write(&args.output)?;
    let options = ReplayOptions {
        threads: args.threads.map(usize::from),
        spp: args.spp,
        allow_outside: args.scene.how.allow_outside,
    };
    let mut played = replay(path, options, &|| false).map_err(Failure::Failed)?;
    files.read_all(played.files())?;
    for warning in &played.warnings {
        remark(format_args!("warning: {warning}"));
    }
    let (film, display) = (&played.film, played.display());
    let size = (film.width(), film.height());
    let samples = ImageSamples { first: 0, spp: film.spp(), uneven: false };
    let note = played.session.shot_draft().note(&args.output, size, samples, display);
    let print = Print { film: &played.film, display: &display, size, note: Some(&note), denoised: None };
    print.write(&args.output, files.replace())?;
    let (output, (width, height), replaced) = (args.output.display(), size, replaced(files.replaced()));
    let (commands, spp) = (counted(played.commands, "command"), samples_per_pixel(film.spp()));
    inform(format_args!(
        "{output}: {width} x {height}, {spp}; replayed {commands} in {} from {}{replaced}",
        counted(played.frames as usize, "frame"),
        path.display()
    ));
    Ok(())
}

fn render_instead(args: &ShowArgs, stop: &Stop) -> Result<(), Failure> {
    if args.record.is_some() {
        let message = "--record needs a window, but there is no display";
        return Err(Failure::Failed(message.to_owned()));
    }
    let output = free_name(&args.scene.scene, "png", &[]);
    let announcement = Some(format!("no display: rendering to {} instead", output.display()));
    let args = RenderArgs {
        announcement,
        scene: args.scene.clone(),
        output,
        format: None,
        has_next: false,
        size: args.size,
        scale: None,
        samples: None,
        film: None,
        turntable: None,
        region: None,
        bookmarks: None,
        frames: None,
        fps: None,
        video: None,
        resume: false,
        overwrite: OverwriteArgs::default(),
        spp: None,
        time: None,
        error: None,
        error_image: None,
        layers: Default::default(),
        layer_samples: None,
        denoise: DenoiseArgs::default(),
        threads: args.threads,
        seed: args.seed,
        integrator: None,
        filter: None,
        max_depth: None,
        uniform: false,
        error_metric: None,
        exposure: 0.0,
        json: false,
        part: None,
        part_by: None,
        save_every: 60.0,
    };
    render::run_one(&args.of_image()?, stop)
}
