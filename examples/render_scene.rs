//! Renders a scene to an image: `cargo run --release --example render_scene -- cornell out.png`.

use firstlight::prelude::*;

fn main() -> Result<(), Error> {
    let mut words = std::env::args().skip(1);
    let scene = words.next().unwrap_or_else(|| "cornell".to_owned());
    let output = words.next().unwrap_or_else(|| "render_scene.png".to_owned());

    // A built-in scene, a scene file, a model or a saved image; meshes, images and kd-trees come with it.
    let scene = Scene::open(scene)?;
    let options = RenderOptions::default().spp(64).on_progress(|now| {
        eprint!("\r{} samples per pixel", now.spp);
        Flow::Continue
    });
    let image = scene.render(&options)?;
    let error = image.error().map_or(String::new(), |error| format!(", error about {:.1} %", 100.0 * error.relative));
    eprintln!("\r{} samples per pixel in {:.1} s{error}", image.spp(), image.report().seconds);
    image.save(output)
}
