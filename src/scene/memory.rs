//! Whether a scene can be rendered in the memory that there is, and has no more lights than its files are large.

use crate::files::limits::{Limits, has_room};
use crate::files::relative::absolute;
use crate::format::material_textures::emits;
use crate::format::parts::{MaterialPart, ObjectPart};
use crate::format::scene_file::SceneFile;
use crate::import::meshes::LoadedMesh;
use crate::mesh::Mesh;
use crate::scene::loaded::LoadedScene;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Bytes that an object takes to be rendered, with its share of trees and tables; a material; and a texture without the
/// pixels of its image. Measured by scenes of 60,000 spheres.
const OBJECT_BYTES: u64 = 4_500;
const MATERIAL_BYTES: u64 = 6_000;
const TEXTURE_BYTES: u64 = 3_200;
/// Bytes of a triangle or sphere that emits light, in the tables of lights. Measured by a grid of 1.1 million spheres.
const LIGHT_BYTES: u64 = 700;
/// Bytes of a file that bring one light, so that what a file stores can shine: triangles, or spheres `(0,0,0),`.
const BYTES_OF_LIGHT: u64 = 8;

/// Checks that a scene with all of its meshes can be rendered.
///
/// - `text_bytes`: length of its own text.
///
/// # Errors
/// A sentence that follows the name of the scene.
pub(super) fn check_memory(scene: &LoadedScene, text_bytes: usize) -> Result<(), String> {
    let file = &scene.file;
    let (n_objects, n_materials) = (file.objects.len(), file.materials.names().count());
    let (n_textures, n_lights) = (file.textures.names().count(), n_emissive(scene));
    let most = Limits::of_this_process().scene_lights;
    // A file is named by its place, whatever a scene calls it.
    if n_lights > most && n_lights - most > (text_bytes as u64 + file_bytes(scene)) / BYTES_OF_LIGHT {
        return Err(format!(
            "its {n_lights} emissive triangles and spheres are too many lights: each instance of a mesh, both sides of what \
             is two-sided and each sphere of a grid count; {most} are allowed, and one for {BYTES_OF_LIGHT} bytes of its \
             files: {}",
            Limits::advice()
        ));
    }
    let bytes = n_objects as u64 * OBJECT_BYTES
        + n_materials as u64 * MATERIAL_BYTES
        + n_textures as u64 * TEXTURE_BYTES
        + n_lights * LIGHT_BYTES;
    if has_room(bytes) {
        return Ok(());
    }
    let things = format!(
        "{n_objects} objects, {n_materials} materials, {n_textures} textures and {n_lights} emissive triangles and spheres"
    );
    Err(format!("its {things} take about {} MiB to render, more than is available", bytes >> 20))
}

/// Bytes of the files of its meshes, with the text of a scene of another renderer.
fn file_bytes(scene: &LoadedScene) -> u64 {
    let mut seen = HashSet::new();
    let files = scene.mesh_files().into_iter().filter(|(path, _)| seen.insert(absolute(path)));
    files.filter_map(|(_, stamp)| stamp.map(|(_, bytes)| bytes)).sum()
}

/// Number of triangles and spheres of groups that emit light: each is a light of its own, and two where both sides emit.
fn n_emissive(scene: &LoadedScene) -> u64 {
    let file = &scene.file;
    let sides: HashMap<&str, u64> = file.materials.iter().map(|(name, part)| (name, n_sides(file, part))).collect();
    let sides_of = |name: &str| sides.get(name).copied().unwrap_or(0);
    let mut triangles_of: HashMap<*const Mesh, Vec<u64>> = HashMap::new();
    let mut of_mesh = |object: &ObjectPart, loaded: &LoadedMesh| {
        let slots: Vec<u64> = match (object.material(), object.slot_materials()) {
            (Some(material), _) => vec![sides_of(material)],
            (None, Some(materials)) => materials.iter().map(|material| sides_of(material)).collect(),
            (None, None) => loaded.slots.iter().map(|(_, part)| n_sides(file, part)).collect(),
        };
        let Some(last) = slots.last().filter(|_| slots.iter().any(|sides| *sides > 0)) else { return 0 };
        // The last material is that of all further slots.
        let triangles = triangles_of.entry(Arc::as_ptr(&loaded.mesh)).or_insert_with(|| by_slot(&loaded.mesh));
        triangles.iter().enumerate().map(|(slot, n)| n * slots.get(slot).unwrap_or(last)).sum::<u64>()
    };
    let objects = file.objects.iter().zip(&scene.meshes).zip(&scene.balls);
    let n_of = objects.map(|((object, mesh), balls)| match (mesh, balls) {
        (Some(mesh), _) => of_mesh(object, mesh),
        (None, Some(balls)) if object.material().is_some_and(|name| sides_of(name) > 0) => balls.radii.len() as u64,
        _ => 0,
    });
    n_of.sum()
}

/// Number of triangles by slot.
fn by_slot(mesh: &Mesh) -> Vec<u64> {
    let mut numbers = Vec::new();
    for triangle in 0..mesh.triangles.len() {
        let slot = mesh.slots.get(triangle).map_or(0, |&slot| usize::from(slot));
        numbers.resize(numbers.len().max(slot + 1), 0);
        numbers[slot] += 1;
    }
    numbers
}

/// On how many sides a material emits.
fn n_sides(file: &SceneFile, part: &MaterialPart) -> u64 {
    match part {
        MaterialPart::Blend { a, b, by_side, .. } => {
            let of = |name: &String| file.materials.get(name).map_or(0, |part| n_sides(file, part));
            if *by_side { of(a).min(1) } else { of(a).max(of(b)) }
        }
        MaterialPart::Principled { two_sided: true, .. } if emits(part) => 2,
        part => u64::from(emits(part)),
    }
}
