//! `firstlight info SCENE`: what is in it, what it uses, what is not modelled, memory.

use super::{Failure, SceneArgs};
use clap::Args;

#[derive(Args, Clone, Debug)]
pub struct InfoArgs {
    #[command(flatten)]
    scene: SceneArgs,
}

pub fn run(args: &InfoArgs) -> Result<(), Failure> {
    let scene = args.scene.load(None, &|_| ())?;
    println!("{}", scene.source.title());
    Ok(())
}
