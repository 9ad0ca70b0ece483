//! Which denoiser, and the error of the denoised image as a reason to stop.

use crate::program::{Outcome, does, fails, program, run};
use std::path::Path;

/// The JSON of a command that succeeds.
fn told(folder: &Path, line: &str) -> serde_json::Value {
    does(folder, line).json()
}

#[test]
fn a_render_stops_at_the_error_of_the_denoised_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene = "render cornell --size 64x64 --denoise --json";
    let of_denoised = told(path, &format!("{scene} -o a.exr --error 10% --error-of denoised --film a-film.exr"));
    let number = |told: &serde_json::Value, key: &str| told[key].as_f64().unwrap();
    assert!(number(&of_denoised, "estimated_error_denoised") <= 0.1, "{of_denoised}");
    assert!(number(&of_denoised, "estimated_error") > 0.1, "{of_denoised}");
    let [low, high] = [0, 1].map(|i| of_denoised["estimated_error_denoised_95"][i].as_f64().unwrap());
    assert!(low < number(&of_denoised, "estimated_error_denoised"), "{of_denoised}");
    assert!(high > number(&of_denoised, "estimated_error_denoised"), "{of_denoised}");
    let of_raw = told(path, &format!("{scene} -o b.exr --error 10%"));
    assert!(number(&of_raw, "estimated_error") <= 0.1 && number(&of_raw, "spp") > number(&of_denoised, "spp"));
    // The same stop for other threads; a film that is there already gets no more samples.
    let again = told(path, &format!("{scene} -o c.exr --error 10% --error-of denoised --threads 1"));
    assert_eq!(again["spp"], of_denoised["spp"]);
    let resumed = told(path, &format!("{scene} -o d.exr --error 10% --error-of denoised --resume --film a-film.exr"));
    assert_eq!(resumed["spp"], of_denoised["spp"]);
    let same = |a: &str, b: &str| std::fs::read(path.join(a)).unwrap() == std::fs::read(path.join(b)).unwrap();
    assert!(same("a.exr", "c.exr") && same("a.exr", "d.exr"));
}

#[test]
fn a_denoised_image_opens_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let bytes = |name: &str| std::fs::read(path.join(name)).unwrap();
    let size = "--size 48x48 --spp 4";
    does(path, &format!("render cornell -o a.png {size} --denoise"));
    does(path, &format!("render cornell -o raw.png {size}"));
    does(path, &format!("render a.png -o b.png {size}"));
    assert!(bytes("a.png") == bytes("b.png") && bytes("a.png") != bytes("raw.png"));
    does(path, &format!("render a.png -o c.png {size} --no-denoise"));
    let image = |name: &str| image::open(path.join(name)).unwrap().to_rgb8();
    assert_eq!(image("c.png"), image("raw.png"));
    assert_eq!(firstlight::scene::ImageMetadata::read(&path.join("c.png")).unwrap().denoised, None);
    // A layer of an image with layers, where it would be one if it were asked for.
    does(path, &format!("render a.png -o d.exr {size} --layers albedo"));
    let layered = firstlight::scene::ImageMetadata::read(&path.join("d.exr")).unwrap();
    assert_eq!((layered.denoised, layered.denoised_layer), (None, Some("own".to_owned())));
    let said = does(path, "render a.png -o e.png --size 48x48 --spp 4 --region 0,0,9,9").err;
    assert!(said.contains("a.png is denoised: with --region, the new image is raw"), "{said}");
    let said = does(path, "submit openjd a.png --parts 2 --spp 4 --size 48x48 --dry-run").err;
    assert!(said.contains("a.png is denoised, what a job renders is raw"), "{said}");
    does(path, "work firstlight-job-a --part 1/2");
    does(path, "work firstlight-job-a --part 2/2");
    does(path, "work firstlight-job-a --merge");
    let parts = [1, 2].map(|part| format!("firstlight-job-a/parts/round-01-part-{part:04}.exr")).join(" ");
    does(path, &format!("merge {parts} -o all.exr --image all.png --denoise"));
    assert!(firstlight::scene::ImageMetadata::read(&path.join("all.png")).unwrap().denoised.is_some());
}

#[test]
fn merged_films_denoise_to_the_bytes_of_the_one_that_was_rendered_in_one_go() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene = "render cornell --size 48x40 --json";
    let whole = told(path, &format!("{scene} -o whole.exr --spp 8 --uniform --denoise"));
    told(path, &format!("{scene} -o a.png --samples 0..4 --film a.exr"));
    told(path, &format!("{scene} -o b.png --samples 4..8 --film b.exr"));
    let merged = told(path, "merge b.exr a.exr -o all.exr --image merged.exr --denoise --json");
    let bytes = |name: &str| std::fs::read(path.join(name)).unwrap();
    assert!(bytes("whole.exr") == bytes("merged.exr"), "{whole} and {merged}");
    for key in ["estimated_error", "estimated_error_denoised", "estimated_error_denoised_95"] {
        assert_eq!(whole[key], merged[key], "{key}");
    }
    told(path, &format!("{scene} -o whole.png --spp 8 --uniform --denoise"));
    let said = does(path, "merge a.exr b.exr -o again.exr --image merged.png --denoise").err;
    assert!(said.contains("(denoised: "), "{said}");
    assert!(bytes("whole.png") == bytes("merged.png"));
    // There is no image to denoise.
    fails(path, "merge a.exr b.exr -o more.exr --denoise", 2);
}

/// A scene that has changed, or is gone, since its films were rendered has no guides for them.
#[test]
fn films_of_another_version_of_a_scene_are_not_denoised() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let text = firstlight::scene::builtin_text("ball").unwrap();
    std::fs::write(path.join("scene.ron"), text).unwrap();
    for (name, samples) in [("a", "0..2"), ("b", "2..4")] {
        does(path, &format!("render scene.ron --size 32x24 -o {name}.png --samples {samples} --film {name}.exr"));
    }
    std::fs::write(path.join("scene.ron"), text.replace("intensity: 800", "intensity: 700")).unwrap();
    let said = fails(path, "merge a.exr b.exr -o all.exr --image all.png --denoise", 1);
    assert!(said.contains("a different scene"), "{said}");
    assert!(!path.join("all.png").exists());
}

#[test]
fn a_denoiser_that_is_missing_is_told_before_anything_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let line = "render cornell -o a.png --size 16x16 --spp 1 --denoise --denoiser oidn";
    let outcome = Outcome::of(program(path).args(line.split(' ')).env("FIRSTLIGHT_OIDN", "no/such/library"));
    let is_told = outcome.err.contains("FIRSTLIGHT_OIDN: no/such/library cannot be loaded");
    assert!(outcome.status != Some(0) && is_told, "{outcome:?}");
    assert!(!path.join("a.png").exists());
    for line in ["render cornell -o a.png --denoiser oidn", "render cornell -o a.png --error 1% --error-of denoised"] {
        let said = fails(path, line, 2);
        assert!(said.contains("add --denoise"), "{line}: {said}");
    }
}

/// Only where Open Image Denoise is installed, or named by the variable.
#[test]
fn open_image_denoise_takes_the_place_of_the_own_filter() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let scene = "render cornell --size 48x48 --spp 4 --denoise";
    let outcome = run(path, &format!("{scene} -o oidn.exr --denoiser oidn --json"));
    if outcome.status != Some(0) {
        let said = outcome.err;
        assert!(said.contains("Open Image Denoise is not installed") && said.contains("FIRSTLIGHT_OIDN"), "{said}");
        return;
    }
    let told = outcome.json();
    assert!(told["estimated_error_denoised"].as_f64() < told["estimated_error"].as_f64(), "{told}");
    let denoised_by = |name: &str| firstlight::scene::ImageMetadata::read(&path.join(name)).unwrap().denoised;
    assert_eq!(denoised_by("oidn.exr"), Some("oidn".to_owned()));
    let pixels = |name: &str| image::open(path.join(name)).unwrap().into_rgb32f().into_raw();
    does(path, &format!("{scene} -o own.exr"));
    let mean = |pixels: &[f32]| pixels.iter().sum::<f32>() / pixels.len() as f32;
    let (own, oidn) = (pixels("own.exr"), pixels("oidn.exr"));
    assert!(own != oidn && (mean(&own) / mean(&oidn) - 1.0).abs() < 0.05, "{} and {}", mean(&own), mean(&oidn));
}
