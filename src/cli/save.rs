//! `firstlight save SCENE -o out.ron`: a model, a built-in scene or what a picture shows, as a scene file.

use super::args::{OverwriteArgs, SceneArgs};
use super::console::remark;
use super::failure::Failure;
use clap::Args;
use firstlight::scene::save_scene;
use std::path::PathBuf;

#[derive(Args, Clone, Debug)]
pub struct SaveArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// The scene file; meshes and pictures are named by their paths from it.
    #[arg(short, long, value_name = "OUT.ron")]
    output: PathBuf,
}

pub fn run(args: &SaveArgs) -> Result<(), Failure> {
    if !args.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron")) {
        return Err(Failure::Usage(format!("{}: scene files end in .ron", args.output.display())));
    }
    let mut files = OverwriteArgs::default().files();
    files.write(&args.output)?;
    let scene = args.scene.load(None, &mut files, &|_| ())?;
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let saved = save_scene(&mut world, Some(&scene), &args.output).map_err(Failure::Failed)?;
    if !files.replaced().is_empty() {
        remark(format_args!("{}: written in place of the file that was there", args.output.display()));
    }
    for note in &saved.notes {
        remark(format_args!("note: {note}"));
    }
    Ok(())
}
