//! Renders a scene to a picture, as a program of your own would: `cargo run --release --example render_scene -- cornell out.png`.
//!
//! What is rendered is an ECS world: between `spawn` and `Extraction::new` any system may change it.

use bevy_ecs::world::World;
use firstlight::frame::{Target, render_offline, write_film};
use firstlight::render::Film;
use firstlight::scene::{
    DisplaySettings, Extraction, FilmSize, LoadOptions, Rendering, SceneInputs, SceneSource, load,
};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let scene = words.next().unwrap_or_else(|| "cornell".to_owned());
    let output = words.next().unwrap_or_else(|| "render_scene.png".to_owned());

    // A built-in scene, a scene file or a model; meshes, pictures and kd-trees come with it.
    let loaded = load(&SceneSource::parse(&scene)?, &LoadOptions::default())?;
    let mut world = World::new();
    loaded.spawn(&mut world);

    let extraction = Extraction::new(&SceneInputs::of(&mut world), &loaded.trees);
    for problem in &extraction.problems {
        eprintln!("{problem}");
    }
    let settings = world.resource::<Rendering>().0;
    let FilmSize { width, height } = *world.resource::<FilmSize>();
    let mut film = Film::try_new(width, height)?;
    let target = Target { spp: Some(64), ..Target::default() };
    let report = render_offline(&extraction.prepared, &settings, &mut film, target, |now| {
        eprint!("\r{} samples per pixel", now.spp);
        true
    });
    let error =
        film.error_estimate().map_or(String::new(), |error| format!(", error about {:.2} %", 100.0 * error.relative));
    eprintln!("\r{} samples per pixel in {:.1} s{error}", film.spp(), report.seconds);
    write_film(&film, &world.resource::<DisplaySettings>().0, Path::new(&output))?;
    Ok(())
}
