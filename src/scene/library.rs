//! Materials to choose from: `assets/materials/library.ron`, a scene with a sphere of each.

use crate::format::parts::ObjectPart;
use crate::format::scene_file::SceneFile;
use crate::scene::spawn::material;
use crate::scene::world::components::SurfaceMaterial;
use std::collections::HashMap;
use std::sync::OnceLock;

/// Materials of the scene that are not offered: what is behind the spheres.
const N_BEHIND: usize = 1;

/// The ready materials with their names, in the order of the spheres of [`LIBRARY_IMAGE`].
pub fn library() -> &'static [(String, SurfaceMaterial)] {
    static LIBRARY: OnceLock<Vec<(String, SurfaceMaterial)>> = OnceLock::new();
    LIBRARY.get_or_init(|| {
        let file = whole();
        let (textures, materials) = (HashMap::new(), HashMap::new());
        let n = file.materials.iter().count() - N_BEHIND;
        let read =
            file.materials.iter().take(n).map(|(name, part)| (name.to_owned(), material(part, &textures, &materials)));
        read.collect()
    })
}

/// The scene of the ready materials with the first of its spheres alone, and a camera before it.
pub(crate) fn library_stage() -> SceneFile {
    let mut file = whole();
    let is_sphere = |object: &ObjectPart| matches!(object, ObjectPart::Sphere { .. });
    let first = file.objects.iter().position(is_sphere).expect("there is a sphere");
    let sphere = file.objects.remove(first);
    if let ObjectPart::Sphere { center, .. } = &sphere {
        (file.camera.eye.x, file.camera.look_at) = (center.x, Some(*center));
    }
    file.objects.retain(|object| !is_sphere(object));
    file.objects.push(sphere);
    file
}

fn whole() -> SceneFile {
    SceneFile::parse(include_str!("../../assets/materials/library.ron"), "library.ron").expect("a test reads it")
}

/// An image (PNG) of a sphere of each ready material, from left to right; each is as wide as the image is high.
pub const LIBRARY_IMAGE: &[u8] = include_bytes!("../../assets/materials/library.png");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_a_sphere_of_each_material() {
        let library = library();
        let spheres = image::load_from_memory(LIBRARY_IMAGE).unwrap();
        assert_eq!(spheres.width(), spheres.height() * library.len() as u32);
        for name in ["gold", "brushed steel", "frosted glass", "water", "car paint"] {
            assert!(library.iter().any(|(known, _)| known == name), "{name}");
        }
        assert!(library.iter().all(|(name, _)| name != "backdrop"));
    }
}
