//! `firstlight [SCENE|MODEL]`: a window, or a picture where there is no display.

use super::render::{self, RenderArgs};
use super::{Failure, SceneArgs};
use clap::Args;
use std::path::PathBuf;

#[derive(Args, Clone, Debug)]
pub struct ShowArgs {
    #[command(flatten)]
    scene: SceneArgs,
}

pub fn run(args: &ShowArgs) -> Result<(), Failure> {
    let output = free_name(&args.scene.scene);
    eprintln!("no display: rendering to {} instead", output.display());
    render::run(&RenderArgs {
        scene: args.scene.clone(),
        output,
        size: None,
        spp: None,
        time: None,
        error: None,
        threads: None,
        seed: 0,
        integrator: None,
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
