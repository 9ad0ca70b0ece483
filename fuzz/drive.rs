//! What is done with bytes of unknown origin, for the fuzzers and for the test on stable (`tests/hostile.rs`).
//!
//! Each function reads the bytes as one kind of file and panics if what comes out breaks a promise; that it comes
//! back at all, and without a panic of its own, is the promise of them all.
#![allow(dead_code, reason = "each target uses its own part")]

use bevy_ecs::world::World;
use firstlight::render::{Film, RenderSettings, advance};
use firstlight::scene::file::{MeshSourcePart, ObjectPart, SceneFile};
use firstlight::scene::obj::{ObjNormals, ObjOptions, load_obj_with};
use firstlight::scene::{
    Extraction, Limits, LoadOptions, Rendering, SceneInputs, SceneSource, load, read_picture_within,
};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tempfile::TempDir;

/// Small enough for thousands of inputs a second.
pub const LIMITS: Limits =
    Limits { model_bytes: 1 << 20, library_bytes: 1 << 18, scene_bytes: 1 << 20, picture_pixels: 1 << 18 };

/// One folder a process, holding the file under test and what it may refer to.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder for files");
    let cube = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nf 1/1 3/1 2/1\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::fs::write(folder.path().join("model.obj"), cube).expect("a model");
    folder
});

fn write(name: &str, bytes: &[u8]) -> PathBuf {
    let path = FOLDER.path().join(name);
    std::fs::write(&path, bytes).expect("a temporary file can be written");
    path
}

fn read_model(path: &Path) {
    let computed = ObjOptions::default().normals;
    for normals in [computed, ObjNormals::Ignore] {
        let options = ObjOptions { normals, max_bytes: LIMITS.model_bytes, max_library_bytes: LIMITS.library_bytes };
        match load_obj_with(path, &options) {
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
    read_model(&write("fuzz.obj", bytes));
}

pub fn mtl(bytes: &[u8]) {
    write("fuzz.mtl", bytes);
    let text = b"mtllib fuzz.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 2\n";
    read_model(&write("with-fuzz.obj", text));
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
            assert_eq!(picture.texels.len() as u64, u64::from(picture.width) * u64::from(picture.height));
            assert!(picture.texels.iter().all(|texel| texel.is_finite() && texel.cmpge(glam::Vec3::ZERO).all()));
        }
        Err(message) => assert!(!message.is_empty()),
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
    let report = advance(&extraction.snapshot, &settings, &mut film, 2, &|| false);
    assert!(report.completed && film.means().iter().all(|mean| mean.is_finite()));
}

/// Meshes that the program makes, and clouds of millions, are sound but take their time.
fn is_quick(object: &ObjectPart) -> bool {
    match object {
        ObjectPart::Mesh { source: MeshSourcePart::Builtin(name), .. } => name == "cube",
        ObjectPart::BallGrid { steps, .. } => {
            steps.iter().map(|step| u64::from(step.0)).try_fold(1, u64::checked_mul).is_some_and(|n| n < 1000)
        }
        _ => true,
    }
}
