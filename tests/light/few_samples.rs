//! How much light images of few samples lose: adaptive ones beside even ones, and denoised ones beside raw ones. Prints the
//! figures of docs/accuracy.md and docs/denoising.md.

use crate::common::mean_of;
use firstlight::render::{
    ErrorMetric, Film, Prepared, RenderSettings, SampleAllocation, advance, denoise_film, gather_guides, guide_samples,
};
use firstlight::scene::{Extraction, LoadOptions, Rendering, SceneInputs, SceneSource, load};
use glam::{UVec2, Vec3};
use rayon::prelude::*;

const NEVER: fn() -> bool = || false;

fn prepared(name: &str) -> (Prepared, RenderSettings) {
    let scene = load(&SceneSource::Builtin(name.to_owned()), &LoadOptions::default()).unwrap();
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let prepared = Extraction::new(&SceneInputs::of(&mut world), &scene.trees).prepared;
    (prepared, world.resource::<Rendering>().0)
}

fn mean(colors: &[Vec3]) -> f64 {
    colors.iter().map(|color| color.as_dvec3().element_sum() / 3.0).sum::<f64>() / colors.len() as f64
}

#[test]
#[ignore = "takes some minutes: prints figures of the documentation"]
fn the_light_that_images_of_few_samples_lose() {
    println!("{:<12} {:>8} {:>4} {:>20} {:>20}", "scene", "size", "spp", "adaptive / even, %", "denoised / raw, %");
    let scenes = [("veach-mis", [64, 48]), ("everything", [96, 72]), ("gallery", [96, 72]), ("cornell", [64, 64])];
    for (name, size) in scenes {
        let (scene, settings) = prepared(name);
        let [width, height] = size;
        for (spp, renders) in [(8, 160), (16, 160), (64, 40)] {
            let film = |allocation, seed| {
                let mut film = Film::new(width, height);
                let settings = RenderSettings { seed, allocation, ..settings };
                assert!(advance(&scene, &settings, &mut film, spp, &NEVER).completed);
                film
            };
            let both: Vec<_> = (0..renders)
                .into_par_iter()
                .map(|seed| {
                    let ours = film(SampleAllocation::Adaptive(ErrorMetric::RelativeMse), seed);
                    let even = mean(&film(SampleAllocation::Uniform, 10_000 + seed).means());
                    let raw = mean(&ours.means());
                    let clean = (seed < 24).then(|| {
                        let (size, samples) = (UVec2::from(size), guide_samples(spp));
                        let guides = gather_guides(&scene, &settings, size, samples, &NEVER).unwrap();
                        mean(&denoise_film(&ours, &guides, &NEVER).unwrap().color) / raw
                    });
                    (raw, even, clean)
                })
                .collect();
            let (ours, our_error) = mean_of(&both.iter().map(|it| it.0).collect::<Vec<_>>());
            let (even, even_error) = mean_of(&both.iter().map(|it| it.1).collect::<Vec<_>>());
            let (clean, clean_error) = mean_of(&both.iter().filter_map(|it| it.2).collect::<Vec<_>>());
            let percent = |ratio: f64, error: f64| format!("{:+.2} ± {:.2}", 100.0 * (ratio - 1.0), 100.0 * error);
            let adaptive = percent(ours / even, (our_error.powi(2) + even_error.powi(2)).sqrt() / even);
            let size = format!("{width}x{height}");
            println!("{name:<12} {size:>8} {spp:>4} {adaptive:>20} {:>20}", percent(clean, clean_error));
        }
    }
}
