//! `firstlight pack SCENE -o scene.zip`: packs a scene with all of its files, for other machines.

use super::args::{OverwriteArgs, SceneArgs, replaced};
use super::console::inform;
use super::failure::Failure;
use clap::Args;
use firstlight::cluster::pack::{PackError, Package};
use firstlight::scene::whole_file::Replace;
use std::path::PathBuf;

#[derive(Args, Clone, Debug)]
pub struct PackArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Archive, replaced if it exists: meshes, textures and images, relative to each other, with their SHA-256 sums.
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

pub fn run(args: &PackArgs) -> Result<(), Failure> {
    if !args.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("zip")) {
        return Err(Failure::Usage(format!("{}: the name of an archive must end in .zip", args.output.display())));
    }
    let mut files = OverwriteArgs::default().files();
    let out = files.claim(&args.output, Replace::AllButFilms)?;
    let scene = args.scene.load(None, &mut files, &|_| ())?;
    let package = Package::of(&scene, &args.scene.source()?)?;
    package.write_zip(out)?;
    let (output, n) = (args.output.display(), package.names().count());
    let replaced = replaced(files.replaced());
    let environment = package.environment.as_ref().map(|name| format!(" --env {name}")).unwrap_or_default();
    inform(format_args!(
        "{output}: {n} files{replaced}; open it, or unpack it and open {}{environment}",
        package.scene
    ));
    Ok(())
}
