//! `firstlight save SCENE -o out.ron`: saves a model, a built-in scene or the scene of an image as a scene file.

use crate::cli::args::{OverwriteArgs, SceneArgs, replaced};
use crate::cli::console::inform;
use crate::cli::failure::Failure;
use clap::Args;
use firstlight::scene::{Description, WriteError};
use std::path::PathBuf;

#[derive(Args, Clone, Debug)]
pub struct SaveArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Scene file; mesh and image paths in it are relative to its folder.
    #[arg(short, long, value_name = "OUT.ron")]
    output: PathBuf,
    /// Replace an existing scene file, whose comments and layout are lost.
    #[arg(long)]
    overwrite: bool,
}

pub fn run(args: &SaveArgs) -> Result<(), Failure> {
    if !args.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron")) {
        return Err(Failure::Usage(format!("{}: the name of a scene file must end in .ron", args.output.display())));
    }
    let mut files = OverwriteArgs::default().files();
    if let Some(path) = args.scene.source()?.path() {
        files.read(path)?;
    }
    files.write(&args.output)?;
    // It may have been written by hand.
    if !args.overwrite && !files.replaced().is_empty() {
        return Err(WriteError::Exists(args.output.clone()).into());
    }
    let scene = args.scene.load(None, &mut files, &|_| ())?;
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let description = Description::of(&mut world, Some(&scene));
    let saved = match args.overwrite {
        true => description.save(&args.output)?,
        false => description.save_new(&args.output)?,
    };
    inform(format_args!("{}: scene saved{}", args.output.display(), replaced(files.replaced())));
    for note in &saved.notes {
        inform(format_args!("note: {note}"));
    }
    Ok(())
}
