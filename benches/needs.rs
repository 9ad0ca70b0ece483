//! What it saves to model only what a scene needs: `cargo bench -p firstlight-benches --bench needs`.
//!
//! Each scene is rendered twice in turns, as it is and with loops that are told that it might also have glass, absorbing
//! media, textures and surroundings that shine. The pictures must be the same. `-- [SCENE]...` measures other scenes.

mod common;

use common::{scenes, world_of};
use firstlight::render::{Features, Film, Prepared, RenderSettings, advance};
use firstlight::report::cpu_seconds;
use firstlight::scene::{BUILTIN_SCENES, Extraction, Rendering, SceneInputs};

const ROUNDS: usize = 9;
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
    let (mut seconds, mut ratios) = ([vec![], vec![]], vec![]);
    for round in 0..=ROUNDS {
        let [(a, first), (b, second)] = [&needed, &everything].map(|prepared| render(prepared, &settings));
        assert!(first == second, "{name}: the pictures differ");
        // The first round warms up.
        if round > 0 {
            seconds[0].push(a);
            seconds[1].push(b);
            ratios.push(b / a);
        }
    }
    let uses =
        [(own.glass, "glass"), (own.media, "media"), (own.textures, "textures"), (own.environment, "surroundings")];
    let uses: Vec<_> = uses.iter().filter(|(used, _)| *used).map(|(_, what)| *what).collect();
    let uses = if uses.is_empty() { "none of them".to_owned() } else { uses.join(", ") };
    println!(
        "| {name} | {uses} | {:.3} | {:.3} | {:.2} |",
        median(&mut seconds[0]),
        median(&mut seconds[1]),
        median(&mut ratios)
    );
}

/// CPU seconds and the picture, bit by bit.
fn render(prepared: &Prepared, settings: &RenderSettings) -> (f64, Vec<[u32; 3]>) {
    let mut film = Film::new(256, 192);
    let before = cpu_seconds().expect("a system that tells CPU time");
    advance(prepared, settings, &mut film, SPP, &|| false);
    let seconds = cpu_seconds().expect("a system that tells CPU time") - before;
    (seconds, film.means().iter().map(|mean| mean.to_array().map(f32::to_bits)).collect())
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}
