//! What it saves to model only what a scene needs: `cargo bench -p firstlight-benches --bench needs`.
//!
//! Each scene is rendered twice in turns, as it is and with loops that are told that it might also have glass, absorbing
//! media, textures and an environment that shines. The images must be the same. `-- [SCENE]...` measures other scenes.

mod common;
#[path = "common/turns.rs"]
mod turns;

use common::{scenes, world_of};
use firstlight::render::{Exposed, Features, Prepared};
use firstlight::scene::{BUILTIN_SCENES, Extraction, Rendering, SceneInputs};
use turns::compare;

const SPP: u32 = 16;

fn main() {
    let scenes = scenes(|| BUILTIN_SCENES.iter().map(|(name, _, _)| (*name).to_owned()).collect());
    println!("| scene | uses | CPU s | told of everything | times as long |");
    println!("|---|---|---:|---:|---:|");
    for scene in &scenes {
        row(scene);
    }
}

fn row(name: &str) {
    let (scene, mut world) = world_of(name);
    let settings = world.resource::<Rendering>().0;
    let inputs = SceneInputs::of(&mut world);
    let needed = Extraction::new(&inputs, &scene.trees).prepared;
    let own = needed.features();
    let all = Features { glass: true, media: true, textures: true, environment: true, ..own };
    let everything = Prepared::with_features((*needed).clone(), all);
    let two = [Exposed::still(&needed), Exposed::still(&everything)];
    let [own_seconds, all_seconds, ratio] = compare(name, two, &settings, SPP);
    let uses =
        [(own.glass, "glass"), (own.media, "media"), (own.textures, "textures"), (own.environment, "environment")];
    let uses: Vec<_> = uses.iter().filter(|(used, _)| *used).map(|(_, what)| *what).collect();
    let uses = if uses.is_empty() { "none of them".to_owned() } else { uses.join(", ") };
    println!("| {name} | {uses} | {own_seconds:.3} | {all_seconds:.3} | {ratio:.2} |");
}
