//! Rays per second of a mesh with a base colour, roughness, metallic and normals from pictures, beside the same without any.

use super::files::{glb, png, torus};
use bevy_ecs::world::World;
use firstlight::render::{Film, Prepared, RenderSettings, advance};
use firstlight::report::cpu_seconds;
use firstlight::scene::{Extraction, LoadOptions, SceneInputs, SceneSource, load};

const ROUNDS: usize = 7;
const SPP: u32 = 16;

pub fn run() {
    let mesh = torus([500, 200]);
    let pictures = [0, 1, 2].map(|seed| png(2048, seed, seed == 2));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [plain, textured] = [("plain.glb", &[][..]), ("textured.glb", &pictures[..])].map(|(name, pictures)| {
        let path = folder.path().join(name);
        std::fs::write(&path, glb(&mesh, pictures)).expect("a file that can be written");
        let source = SceneSource::parse(&path).unwrap_or_else(|error| panic!("{error}"));
        let scene = load(&source, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let mut world = World::new();
        scene.spawn(&mut world);
        Extraction::new(&SceneInputs::of(&mut world), &scene.trees).prepared
    });
    let (mut rates, mut ratios) = ([vec![], vec![]], vec![]);
    for round in 0..=ROUNDS {
        let [a, b] = [&plain, &textured].map(rays_per_second);
        // The first round warms up.
        if round > 0 {
            rates[0].push(a);
            rates[1].push(b);
            ratios.push(b / a);
        }
    }
    println!("| mesh of {} triangles | M rays per CPU second |\n|---|---:|", mesh.triangles.len());
    println!("| without textures | {:.2} |", median(&mut rates[0]) / 1e6);
    println!("| base colour, roughness, metallic, normals | {:.2} |", median(&mut rates[1]) / 1e6);
    println!("| ratio | {:.2} |", median(&mut ratios));
}

fn rays_per_second(prepared: &Prepared) -> f64 {
    let mut film = Film::new(320, 240);
    let before = cpu_seconds().expect("a system that tells CPU time");
    let report = advance(prepared, &RenderSettings::default(), &mut film, SPP, &|| false);
    let seconds = cpu_seconds().expect("a system that tells CPU time") - before;
    report.rays.total() as f64 / seconds
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}
