//! What is done with bytes of unknown origin, for the fuzzers and for the test on stable (`tests/hostile.rs`).
//!
//! Each function reads the bytes as one kind of file and panics if what comes out breaks a promise; that it comes
//! back at all, and without a panic of its own, is the promise of them all.
#![allow(dead_code, reason = "each target uses its own part")]

use bevy_ecs::world::World;
use firstlight::frame::read_film_file_within;
use firstlight::render::{Film, FilmLayout, FilmRecord, N_CHANGE_PLANES, N_PLANES, Prepared, RenderSettings, advance};
use firstlight::scene::file::{ObjectPart, SceneFile};
use firstlight::scene::model::{ModelFormat, ModelNormals, ModelOptions, load_model};
use firstlight::scene::{
    Extraction, ImageMetadata, ImageScene, Limits, LoadOptions, MeshSource, ModelChoice, Rendering, SceneInputs,
    SceneSource, load, read_picture_within,
};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tempfile::TempDir;

/// Small enough for thousands of inputs a second.
pub const LIMITS: Limits = Limits {
    model_bytes: 1 << 20,
    library_bytes: 1 << 18,
    scene_bytes: 1 << 20,
    picture_pixels: 1 << 18,
    scene_image_bytes: 1 << 23,
    scene_mesh_bytes: 1 << 23,
    scene_lights: 1 << 12,
    film_pixels: 1 << 12,
    note_bytes: 1 << 18,
    recording_bytes: 1 << 18,
    archive_bytes: 1 << 20,
    settings_bytes: 1 << 16,
};

/// One folder a process, holding the file under test and what it may refer to.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder for files");
    let cube = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nf 1/1 3/1 2/1\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::fs::write(folder.path().join("model.obj"), cube).expect("a model");
    folder
});

fn write(name: &str, bytes: &[u8]) -> PathBuf {
    let path = FOLDER.path().join(name);
    // Some file systems write a file to the disk at once that is written again.
    let _ = std::fs::remove_file(&path);
    std::fs::write(&path, bytes).expect("a temporary file can be written");
    path
}

fn read_model(path: &Path, format: ModelFormat) {
    let computed = ModelOptions::default().normals;
    for normals in [computed, ModelNormals::OfPositions, ModelNormals::Ignore] {
        let (max_bytes, max_library_bytes) = (LIMITS.model_bytes, LIMITS.library_bytes);
        let options = ModelOptions { normals, max_bytes, max_library_bytes, allow_outside: false };
        match load_model(path, format, &options) {
            Ok(model) => {
                model.mesh.validate().expect("a mesh that was read is sound");
                assert!(!model.mesh.triangles.is_empty() && !model.materials.is_empty());
                let slots = model.mesh.slots.iter().map(|&slot| usize::from(slot)).max().unwrap_or(0);
                assert!(slots < model.materials.len(), "slot {slots} of {}", model.materials.len());
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}

pub fn obj(bytes: &[u8]) {
    read_model(&write("fuzz.obj", bytes), ModelFormat::Obj);
}

pub fn ply(bytes: &[u8]) {
    read_model(&write("fuzz.ply", bytes), ModelFormat::Ply);
}

pub fn stl(bytes: &[u8]) {
    read_model(&write("fuzz.stl", bytes), ModelFormat::Stl);
}

/// As one mesh, and as the scene that is made of it.
pub fn gltf(bytes: &[u8]) {
    let path = write(if bytes.starts_with(b"glTF") { "fuzz.glb" } else { "fuzz.gltf" }, bytes);
    read_model(&path, ModelFormat::Gltf);
    let choice = ModelChoice { at: Some(0.4), ..ModelChoice::default() };
    open_model(path, Some(&choice));
}

/// A scene of pbrt.
pub fn pbrt(bytes: &[u8]) {
    open(SceneSource::Foreign(write("fuzz.pbrt", bytes)), None);
}

/// A scene of Tungsten, or a mesh of one.
pub fn tungsten(bytes: &[u8]) {
    const SCENE: &[u8] = br#"{"primitives": [{"type": "mesh", "file": "fuzz.wo3", "smooth": true}]}"#;
    let is_text = bytes.first().is_some_and(|first| b"{ \n".contains(first));
    if !is_text {
        write("fuzz.wo3", bytes);
    }
    open(SceneSource::Foreign(write("fuzz.json", if is_text { bytes } else { SCENE })), None);
}

/// A scene of Mitsuba.
pub fn mitsuba(bytes: &[u8]) {
    open(SceneSource::Foreign(write("fuzz.xml", bytes)), None);
}

fn open_model(path: PathBuf, choice: Option<&ModelChoice>) {
    open(SceneSource::Model(path), choice);
}

fn open(source: SceneSource, choice: Option<&ModelChoice>) {
    match load(&source, &LoadOptions { choice, preview: true, ..LoadOptions::default() }) {
        Ok(scene) => {
            scene.file.check().expect("a scene that was made is sound");
            scene.spawn(&mut World::new());
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// The library, and the materials that are made of it.
pub fn mtl(bytes: &[u8]) {
    write("fuzz.mtl", bytes);
    let text = b"mtllib fuzz.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 2\n";
    let path = write("with-fuzz.obj", text);
    read_model(&path, ModelFormat::Obj);
    open_model(path, None);
}

pub fn scene(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match SceneFile::parse(text, "fuzz.ron") {
        Ok(file) => {
            let again = SceneFile::parse(&file.to_ron(), "again.ron").expect("what is written can be read");
            assert!(again == file, "{text:?} changed on the way through {:?}", file.to_ron());
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

pub fn picture(bytes: &[u8]) {
    // Only the beginning tells what kind it is: the name must not matter.
    match read_picture_within(&write("fuzz.picture", bytes), &LIMITS) {
        Ok((picture, _)) => {
            assert_eq!(picture.len() as u64, u64::from(picture.width) * u64::from(picture.height));
            let is_good = |texel: glam::Vec3| texel.is_finite() && texel.cmpge(glam::Vec3::ZERO).all();
            assert!((0..picture.len()).all(|i| is_good(picture.linear(i))));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// From the text of a scene to a picture of a few pixels.
pub fn render(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(file) = SceneFile::parse(text, "fuzz.ron") else { return };
    if !file.objects.iter().all(is_quick) {
        return;
    }
    let source = SceneSource::Scene(write("fuzz.ron", bytes));
    let Ok(scene) = load(&source, &LoadOptions::default()) else { return };
    let mut world = World::new();
    scene.spawn(&mut world);
    let extraction = Extraction::new(&SceneInputs::of(&mut world), &scene.trees);
    let settings = RenderSettings { max_depth: 8, ..world.resource::<Rendering>().0 };
    let mut film = Film::new(5, 3);
    let report = advance(&extraction.prepared, &settings, &mut film, 2, &|| false);
    assert!(report.completed && film.means().iter().all(|mean| mean.is_finite()));
}

/// A film, as a file or as the text of its layout alone, which no checksum keeps the fuzzer from; whatever is accepted must
/// be a film that can be gone on with.
pub fn film(bytes: &[u8]) {
    match read_film_file_within(&write("fuzz.exr", bytes), &LIMITS) {
        Ok(file) => go_on(file.film),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    let Ok(layout) = ron::de::from_bytes::<FilmLayout>(bytes) else { return };
    let n_pixels = u64::from(layout.width) * u64::from(layout.height);
    if n_pixels > LIMITS.film_pixels {
        return;
    }
    let numbers = [0.0, 1.0, -0.5, f64::INFINITY, f64::NAN, 1e300, 5e-324];
    let plane =
        |k: usize| -> Vec<f64> { (0..n_pixels as usize).map(|i| numbers[(i * 3 + k) % numbers.len()]).collect() };
    let changes = Some((0..N_CHANGE_PLANES).map(|k| plane(k).iter().map(|&number| number as f32).collect()).collect());
    let mut record = FilmRecord { layout, planes: (0..N_PLANES).map(plane).collect(), changes };
    match Film::from_record(&record) {
        Ok(film) => {
            // The sums to the last bit, NaN included; what there is no light or no doubling for is not kept.
            let again = film.to_record();
            // What a block is due is written for rounds that allocate, and for these always.
            let is_uneven = record.layout.round.as_ref().is_some_and(|round| !round.even);
            for block in record.layout.tiles.iter_mut().flat_map(|tile| &mut tile.blocks) {
                block.due = is_uneven.then(|| block.due.take().unwrap_or_default());
            }
            assert_eq!(again.layout, record.layout);
            assert_eq!(format!("{:?}", &again.planes[..6]), format!("{:?}", &record.planes[..6]));
            go_on(film);
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fn go_on(mut film: Film) {
    let spp = film.spp();
    drop((film.means(), film.error_estimate(), film.half_steps(), film.n_bad(), film.max_spp()));
    // Films that were stopped in the middle of a pass have tiles that must catch up first: that may be long.
    let (least, _, most) = film.sample_counts();
    if film.max_spp() - spp > 8 || spp - spp.min(least) > 8 || film.first_sample() > Film::MAX_SAMPLES / 2 {
        return;
    }
    static SCENE: LazyLock<Prepared> = LazyLock::new(|| {
        let mut world = World::new();
        let source = SceneSource::Builtin("cornell-balls".to_owned());
        let scene = load(&source, &LoadOptions::default()).expect("a scene of the program's own");
        scene.spawn(&mut world);
        Extraction::new(&SceneInputs::of(&mut world), &scene.trees).prepared
    });
    let settings = RenderSettings { max_depth: 3, ..RenderSettings::default() };
    if film.width() * film.height() <= 64 {
        let report = advance(&*SCENE, &settings, &mut film, spp.saturating_add(2), &|| false);
        assert!(report.completed && film.spp() >= spp.saturating_add(2));
    }
    let twin = film.clone();
    // Every sample is in both.
    assert!(film.merge(&twin).is_err() || most == 0);
}

/// The note of a picture, in a PNG or EXR or by itself.
pub fn metadata(bytes: &[u8]) {
    let path = write("fuzz.png", bytes);
    let own_note = std::str::from_utf8(bytes).ok().map(ImageMetadata::from_note);
    for metadata in [Some(ImageMetadata::read_within(&path, &LIMITS)), own_note].into_iter().flatten().flatten() {
        let again = ImageMetadata::from_note(&metadata.to_note()).expect("what is written can be read");
        assert_eq!(format!("{again:?}"), format!("{metadata:?}"));
        drop((metadata.source(&path), metadata.up(), metadata.differs_from(&again)));
        drop(metadata.moved(&path, &FOLDER.path().join("elsewhere/other.png")));
    }
    // Whole scenes are the business of `render`.
    let shows_no_scene =
        |metadata: &ImageMetadata| metadata.text.is_none() && !matches!(metadata.scene, ImageScene::Builtin(_));
    if ImageMetadata::read_within(&path, &LIMITS).as_ref().is_ok_and(shows_no_scene)
        && let Err(error) = load(&SceneSource::Picture(path), &LoadOptions::default())
    {
        assert!(!error.to_string().is_empty());
    }
}

/// Meshes that the program makes, and clouds of millions, are sound but take their time.
fn is_quick(object: &ObjectPart) -> bool {
    match object {
        ObjectPart::Mesh { source: MeshSource::Builtin(name), .. } => name == "cube",
        ObjectPart::BallGrid { steps, .. } => {
            steps.iter().map(|step| u64::from(step.0)).try_fold(1, u64::checked_mul).is_some_and(|n| n < 1000)
        }
        _ => true,
    }
}
