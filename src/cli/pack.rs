//! `firstlight pack SCENE -o scene.zip`: packs a scene with all of its files, for other machines.

use crate::cli::args::{OverwriteArgs, SceneArgs, open_options, replaced};
use crate::cli::console::{inform, remark};
use crate::cli::failure::Failure;
use crate::cli::number::counted;
use clap::Args;
use firstlight::cluster::engine::shell_word;
use firstlight::cluster::pack::{PackError, Package};
use firstlight::scene::whole_file::Replace;
use std::path::PathBuf;

#[derive(Args, Clone, Debug)]
pub struct PackArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Archive, replaced if it exists: the scene with its meshes, textures and images, and their SHA-256 sums.
    #[arg(short, long, value_name = "OUT.zip")]
    output: PathBuf,
}

impl From<PackError> for Failure {
    fn from(error: PackError) -> Self {
        match error {
            PackError::Write(error) => error.into(),
            PackError::Scene(error) => error.into(),
            error => Self::Failed(error.to_string()),
        }
    }
}

/// Says what is taken from outside of the folder of the scene: a scene from somebody else could name any file.
pub fn tell_outside(package: &Package) {
    /// Nobody reads more.
    const MOST: usize = 10;
    for (path, name) in package.outside.iter().take(MOST) {
        remark(format_args!("warning: {} is not in the folder of the scene, and is packed as {name}", path.display()));
    }
    if let Some(more) = package.outside.len().checked_sub(MOST).filter(|&more| more > 0) {
        remark(format_args!("warning: {more} more files are not in the folder of the scene, and are packed"));
    }
}

pub fn run(args: &PackArgs) -> Result<(), Failure> {
    if !args.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("zip")) {
        return Err(Failure::Usage(format!("{}: the name of an archive must end in .zip", args.output.display())));
    }
    let mut files = OverwriteArgs::default().files();
    let out = files.claim(&args.output, Replace::AllButFilms)?;
    let scene = args.scene.load(None, &mut files, &|_| ())?;
    let mut package = Package::of(&scene, &args.scene.source()?)?;
    package.opening = args.scene.opening()?;
    tell_outside(&package);
    package.write_zip(out)?;
    let (output, files_in_it) = (args.output.display(), counted(package.names().count(), "file"));
    let replaced = replaced(files.replaced());
    let environment = package.environment.as_ref().map(|name| format!(" --env {}", shell_word(name)));
    let options = open_options(&package.opening).map(|option| format!(" {}", shell_word(&String::from(option))));
    let options = options.chain(environment);
    let options = options.collect::<String>();
    let scene = &package.scene;
    inform(format_args!("{output}: {files_in_it}{replaced}; open it, or unpack it and open {scene}{options}"));
    Ok(())
}
