//! Files beside the images that another renderer made of them.
//!
//! `NAME.json` says which file, which camera and moment, the radiance of the environment, which the format has no word for,
//! and where the reference image lies. Paths in it count from its folder.

use bevy_ecs::world::World;
use firstlight::render::{Display, Environment, Film, RenderSettings, advance, develop_pixel};
use firstlight::report::{Distance, LinearPicture};
use firstlight::scene::{
    EnvironmentSource, Extraction, LoadOptions, ModelChoice, Rgb, SceneEnvironment, SceneInputs, SceneSource, load,
};
use glam::{DVec3, Vec3};
use serde_json::Value;
use std::path::{Path, PathBuf};

const SPP: u32 = 256;

/// As many segments as the references have bounces.
const DEPTH: u32 = 129;

pub fn run(folder: &Path, out: Option<&Path>) {
    let mut notes: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "json"))
        .collect();
    notes.sort();
    if let Some(out) = out {
        std::fs::create_dir_all(out).expect("a folder for the pictures");
    }
    println!("| file | reference | spp | mean, % | R, % | G, % | B, % | FLIP | relMSE | own relMSE |");
    println!("|---|---|---:|---:|---:|---:|---:|---:|---:|---:|");
    for path in notes {
        let text = std::fs::read_to_string(&path).expect("a file that can be read");
        let note: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let file = note["file"].as_str().expect("`file`");
        let stem = file.trim_end_matches(".glb");
        // The same scene in other encodings has the same picture.
        let copies = ["_meshopt", "_quantized"].map(|kind| format!("{stem}{kind}.glb"));
        let copies = copies.into_iter().filter(|copy| folder.join(copy).exists());
        for file in std::iter::once(file.to_owned()).chain(copies) {
            for reference in note["references"].as_array().expect("`references`") {
                row(folder, &file, &note, reference, out);
            }
        }
    }
}

fn row(folder: &Path, file: &str, note: &Value, reference: &Value, out: Option<&Path>) {
    let text = |value: &Value, what: &str| value[what].as_str().unwrap_or_else(|| panic!("`{what}`")).to_owned();
    let is_animated = note["animated"].as_bool() == Some(true);
    let choice = ModelChoice {
        camera: Some(text(reference, "camera")),
        at: reference["time_s"].as_f64().filter(|_| is_animated),
        ..ModelChoice::DEFAULT
    };
    let source = SceneSource::parse(folder.join(file)).unwrap_or_else(|error| panic!("{error}"));
    let options = LoadOptions { choice: Some(&choice), ..LoadOptions::default() };
    let scene = load(&source, &options).unwrap_or_else(|error| panic!("{error}"));
    let mut world = World::new();
    scene.spawn(&mut world);
    let radiance = &note["environment"]["radiance"];
    let radiance = Vec3::from_array([0, 1, 2].map(|i| radiance[i].as_f64().expect("three numbers") as f32));
    world.insert_resource(SceneEnvironment {
        light: Environment::Constant(radiance),
        part: EnvironmentSource::Constant(Rgb(radiance)),
        air: Vec3::ZERO,
    });
    let prepared = Extraction::new(&SceneInputs::of(&mut world), &scene.trees).prepared;
    let named = text(reference, "ref");
    let truth = LinearPicture::read_exr(&folder.join(&named)).unwrap_or_else(|error| panic!("{error}"));
    let mut film = Film::new(truth.width, truth.height);
    let settings = RenderSettings { max_depth: DEPTH, ..RenderSettings::default() };
    advance(&prepared, &settings, &mut film, SPP, &|| false);
    let picture = LinearPicture::of(&film);

    let mean = |picture: &LinearPicture| {
        picture.pixels.iter().map(|pixel| pixel.as_dvec3()).sum::<DVec3>() / picture.pixels.len() as f64
    };
    let (ours, theirs) = (mean(&picture), mean(&truth));
    let off = 100.0 * (ours / theirs - 1.0);
    let whole = 100.0 * (ours.element_sum() / theirs.element_sum() - 1.0);
    let distance = Distance::between(&picture, &truth, &Display::default());
    let name = Path::new(&named).file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    println!(
        "| `{file}` | `{name}` | {} | {whole:+.2} | {:+.2} | {:+.2} | {:+.2} | {:.3} | {:.2e} | {:.2e} |",
        reference["spp"],
        off.x,
        off.y,
        off.z,
        distance.flip,
        distance.relative_mse,
        reference["own_relMSE"].as_f64().unwrap_or(f64::NAN),
    );
    if let Some(out) = out {
        let copy = Path::new(file).file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
        let path = out.join(if name.starts_with(&copy) { format!("{name}.png") } else { format!("{copy}.png") });
        write_pair(&path, &picture, &truth);
    }
}

/// The second one to the right of the first.
fn write_pair(path: &Path, left: &LinearPicture, right: &LinearPicture) {
    const GAP: u32 = 4;
    let (width, height) = (left.width, left.height);
    let mut both = image::RgbImage::new(2 * width + GAP, height);
    for (picture, from) in [(left, 0), (right, width + GAP)] {
        for (i, &pixel) in picture.pixels.iter().enumerate() {
            let (x, y) = (i as u32 % width, i as u32 / width);
            both.put_pixel(from + x, y, image::Rgb(develop_pixel(pixel, &Display::default())));
        }
    }
    both.save(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}
