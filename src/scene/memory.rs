//! Whether a scene can be rendered in the memory that there is.

use crate::files::limits::has_room;
use crate::format::material_textures::emits;
use crate::format::parts::ObjectPart;
use crate::import::meshes::LoadedMesh;
use crate::scene::loaded::LoadedScene;
use std::collections::HashMap;

/// Bytes that an object takes to be rendered, with its share of trees and tables; a material; and a texture without the
/// pixels of its image. Measured by scenes of 60,000 spheres.
const OBJECT_BYTES: u64 = 4_500;
const MATERIAL_BYTES: u64 = 6_000;
const TEXTURE_BYTES: u64 = 3_200;
/// Bytes of a triangle or sphere that emits light, in the tables of lights. Measured by a grid of 1.1 million spheres.
const LIGHT_BYTES: u64 = 700;

/// Checks that a scene with all of its meshes can be rendered.
///
/// # Errors
/// A sentence that follows the name of the scene.
pub(super) fn check_memory(scene: &LoadedScene) -> Result<(), String> {
    let file = &scene.file;
    let (n_objects, n_materials) = (file.objects.len(), file.materials.names().count());
    let (n_textures, n_lights) = (file.textures.names().count(), n_emissive(scene));
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

/// Number of triangles and spheres of groups that emit light: each is a light of its own.
fn n_emissive(scene: &LoadedScene) -> u64 {
    let file = &scene.file;
    let emitting: HashMap<&str, bool> = file.materials.iter().map(|(name, part)| (name, emits(part))).collect();
    let is_light = |name: &str| emitting.get(name).copied().unwrap_or(false);
    let of_mesh = |object: &ObjectPart, loaded: &LoadedMesh| {
        let mesh = &loaded.mesh;
        let slots: Vec<bool> = match (object.material(), object.slot_materials()) {
            (Some(material), _) => vec![is_light(material)],
            (None, Some(materials)) => materials.iter().map(|material| is_light(material)).collect(),
            (None, None) => loaded.slots.iter().map(|(_, part)| emits(part)).collect(),
        };
        match slots[..] {
            [] => 0,
            [emits] => {
                if emits {
                    mesh.triangles.len()
                } else {
                    0
                }
            }
            _ => mesh.slots.iter().filter(|&&slot| slots.get(usize::from(slot)).is_some_and(|emits| *emits)).count(),
        }
    };
    let objects = file.objects.iter().zip(&scene.meshes).zip(&scene.balls);
    let n_of = objects.map(|((object, mesh), balls)| match (mesh, balls) {
        (Some(mesh), _) => of_mesh(object, mesh),
        (None, Some(balls)) if object.material().is_some_and(is_light) => balls.radii.len(),
        _ => 0,
    });
    n_of.map(|n| n as u64).sum()
}
