//! `firstlight save SCENE -o out.ron`: saves a model, a built-in scene or the scene of an image as a scene file, or as
//! one of pbrt or Mitsuba.

use crate::cli::args::{OverwriteArgs, SceneArgs, replaced};
use crate::cli::console::{inform, tell};
use crate::cli::failure::Failure;
use crate::cli::waiting::Waiting;
use clap::Args;
use firstlight::export::{ExportFormat, export};
use firstlight::scene::{Description, WriteError, whole_scene};
use std::path::PathBuf;

#[derive(Args, Clone, Debug)]
pub struct SaveArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Scene file (.ron), whose paths are relative to its folder; or scene of pbrt (.pbrt) or Mitsuba (.xml), with its
    /// meshes and images in a folder beside it.
    #[arg(short, long, value_name = "OUT.ron|.pbrt|.xml")]
    output: PathBuf,
    /// Replace an existing scene file, whose comments and layout are lost. The folder of a scene of pbrt or Mitsuba
    /// stays; the new one has another name.
    #[arg(long)]
    overwrite: bool,
}

pub fn run(args: &SaveArgs) -> Result<(), Failure> {
    let format = ExportFormat::of(&args.output);
    if format.is_none() && !args.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron")) {
        let path = args.output.display();
        return Err(Failure::Usage(format!("{path}: the name of a scene must end in .ron, .pbrt, .xml")));
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
    if let Some(format) = format {
        let waiting = Waiting::new(format!("writing {}", args.output.display()));
        let exported = export(&whole_scene(&mut world, &scene), format, &args.output, args.overwrite)?;
        drop(waiting);
        tell(&exported.warnings);
        let folder = exported.folder.map(|folder| format!(", its meshes and images in {}", folder.display()));
        let folder = folder.unwrap_or_default();
        inform(format_args!("{}: scene saved{folder}{}", args.output.display(), replaced(files.replaced())));
        return Ok(());
    }
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
