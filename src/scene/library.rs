//! Materials to choose from: `assets/materials/library.ron`, a scene with a sphere of each.

use crate::format::material_textures::texture_names;
use crate::format::parts::{MaterialPart, ObjectPart};
use crate::format::scene_file::SceneFile;
use crate::import::builtin_images::builtin_image;
use crate::scene::spawn::{material, texture_of};
use crate::scene::world::components::{SurfaceMaterial, SurfaceTexture};
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

/// Materials of the scene that are not offered: what is behind the spheres.
const N_BEHIND: usize = 1;

/// A ready material.
pub struct ReadyMaterial {
    /// Its name.
    pub name: String,
    part: MaterialPart,
    made: OnceLock<SurfaceMaterial>,
}

/// The ready materials, in the order of the spheres of [`LIBRARY_IMAGE`].
pub fn library() -> &'static [ReadyMaterial] {
    static LIBRARY: OnceLock<Vec<ReadyMaterial>> = OnceLock::new();
    LIBRARY.get_or_init(|| {
        let n = whole().materials.iter().count() - N_BEHIND;
        let ready = |(name, part): (&str, &MaterialPart)| ReadyMaterial {
            name: name.to_owned(),
            part: part.clone(),
            made: OnceLock::new(),
        };
        whole().materials.iter().take(n).map(ready).collect()
    })
}

impl ReadyMaterial {
    /// The material, with its images, which are made when first asked for.
    pub fn material(&self) -> &SurfaceMaterial {
        self.made.get_or_init(|| {
            let named = texture_names(&self.part);
            let mut textures = HashMap::new();
            for name in &named {
                let part = whole().textures.get(name).expect("a test reads it");
                let texture = texture_of(part, builtin_image).expect("they are built in");
                let texture = SurfaceTexture { name: name.clone(), part: part.clone(), texture };
                textures.insert(name.as_str(), Arc::new(texture));
            }
            material(&self.part, &textures, &HashMap::new(), &HashMap::new())
        })
    }
}

/// The scene of the ready materials with the first of its spheres alone, and a camera before it.
pub(crate) fn library_stage() -> SceneFile {
    let mut file = whole().clone();
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

fn whole() -> &'static SceneFile {
    static WHOLE: OnceLock<SceneFile> = OnceLock::new();
    WHOLE.get_or_init(|| {
        SceneFile::parse(include_str!("../../assets/materials/library.ron"), "library.ron").expect("a test reads it")
    })
}

/// An image (PNG) of a sphere of each ready material, from left to right; each is as wide as the image is high.
pub const LIBRARY_IMAGE: &[u8] = include_bytes!("../../assets/materials/library.png");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::world::components::textures_of;

    #[test]
    fn there_is_a_sphere_of_each_material() {
        let library = library();
        let spheres = image::load_from_memory(LIBRARY_IMAGE).unwrap();
        assert_eq!(spheres.width(), spheres.height() * library.len() as u32);
        for name in ["gold", "brushed steel", "frosted glass", "water", "car paint"] {
            assert!(library.iter().any(|ready| ready.name == name), "{name}");
        }
        assert!(library.iter().all(|ready| ready.name != "backdrop"));
        let textured = |name: &str| {
            let ready = library.iter().find(|ready| ready.name == name).unwrap();
            textures_of(&ready.material().0).count()
        };
        assert_eq!(["oak", "marble", "concrete", "linen", "gold"].map(textured), [1, 1, 1, 1, 0]);
    }
}
