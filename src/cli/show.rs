//! `firstlight [SCENE|MODEL]`: a window, or a picture where there is no display.

use super::render::{self, RenderArgs};
use super::{Failure, SceneArgs};
use clap::Args;
use std::path::PathBuf;

#[derive(Args, Clone, Debug)]
pub struct ShowArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Size of the window, or of the picture where there is no display.
    #[arg(long, value_name = "WxH", value_parser = super::parse_size)]
    size: Option<(u32, u32)>,
    /// Worker threads; one for each processor when not given.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Another number, another noise.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    seed: Option<u32>,
    /// Where the pictures go that are kept from the window.
    #[cfg(feature = "viewer")]
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    save_to: PathBuf,
}

pub fn run(args: &ShowArgs) -> Result<(), Failure> {
    #[cfg(feature = "viewer")]
    if firstlight::viewer::display::find() != firstlight::viewer::display::Display::None {
        return open_window(args);
    }
    render_instead(args)
}

#[cfg(feature = "viewer")]
fn open_window(args: &ShowArgs) -> Result<(), Failure> {
    use firstlight::viewer::{ViewerOptions, run};
    let source = args.scene.source()?;
    let (width, height) = args.size.unwrap_or((1280, 720));
    let threads = args.threads.map(usize::from);
    let folder = args.save_to.clone();
    let options =
        ViewerOptions { source, width, height, threads, seed: args.seed.unwrap_or(0), up: args.scene.up(), folder };
    run(options).map_err(|error| Failure::Failed(error.to_string()))
}

fn render_instead(args: &ShowArgs) -> Result<(), Failure> {
    let output = free_name(&args.scene.scene);
    let announcement = Some(format!("no display: rendering to {} instead", output.display()));
    render::run(&RenderArgs {
        announcement,
        scene: args.scene.clone(),
        output,
        size: args.size,
        scale: None,
        samples: None,
        film: None,
        resume: false,
        spp: None,
        time: None,
        error: None,
        threads: args.threads,
        seed: args.seed,
        integrator: None,
        filter: None,
        max_depth: None,
        exposure: 0.0,
        json: false,
    })
}

/// `firstlight-NAME.png` in the current folder, with a number when that is taken.
fn free_name(scene: &str) -> PathBuf {
    let stem = PathBuf::from(scene).file_stem().map_or("scene".into(), |stem| stem.to_string_lossy().into_owned());
    let mut name = PathBuf::from(format!("firstlight-{stem}.png"));
    let mut number = 2;
    while name.exists() {
        name = PathBuf::from(format!("firstlight-{stem}-{number}.png"));
        number += 1;
    }
    name
}
