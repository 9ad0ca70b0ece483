//! A hash that tells whether two loaded scenes have the same contents.

use super::components::{Shape, SurfaceTexture, textures_of};
use super::describe::Description;
use super::file::{CameraPart, DisplayPart, FilmPart, ObjectPart, SceneFile};
use super::inputs::SceneInputs;
use super::loaded::LoadedScene;
use super::sources::{EnvironmentSource, MeshSource, TextureSource};
use crate::mesh::Mesh;
use crate::render::{Environment, ImageTexture, Integrator, TexturePattern};
use bevy_ecs::prelude::World;
use glam::DVec3;
use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

/// 128-bit hash of all inputs of a scene's image: the scene itself, its meshes and its images.
///
/// The same in every run and on every machine; detects changes, but is not cryptographic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Fingerprint(pub u128);

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

impl Default for Fingerprint {
    fn default() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
}

impl Fingerprint {
    /// FNV-1a (Fowler, Noll and Vo 1991), 128 bits. The length is hashed too, so that different splits into parts
    /// differ.
    #[must_use]
    pub fn with(mut self, bytes: impl IntoIterator<Item = u8>) -> Self {
        const PRIME: u128 = (1 << 88) + 0x13b;
        let mut length = 0u64;
        for byte in bytes {
            self.0 = (self.0 ^ u128::from(byte)).wrapping_mul(PRIME);
            length += 1;
        }
        for byte in length.to_le_bytes() {
            self.0 = (self.0 ^ u128::from(byte)).wrapping_mul(PRIME);
        }
        self
    }

    fn with_floats(self, numbers: impl IntoIterator<Item = f32>) -> Self {
        self.with(numbers.into_iter().flat_map(|x| x.to_bits().to_le_bytes()))
    }

    fn with_mesh(self, mesh: &Mesh) -> Self {
        let plain = self
            .with_floats(mesh.positions.iter().flat_map(|p| p.to_array()))
            .with(mesh.center.to_array().into_iter().flat_map(|x| x.to_bits().to_le_bytes()))
            .with(mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()))
            .with_floats(mesh.normals.iter().flat_map(|n| n.to_array()))
            .with_floats(mesh.uvs.iter().flat_map(|uv| uv.to_array()))
            .with(mesh.slots.iter().flat_map(|slot| slot.to_le_bytes()));
        if [mesh.uvs2.len(), mesh.colors.len(), mesh.tangents.len()] == [0; 3] {
            return plain;
        }
        plain
            .with_floats(mesh.uvs2.iter().flat_map(|uv| uv.to_array()))
            .with_floats(mesh.colors.iter().flat_map(|color| color.to_array()))
            .with_floats(mesh.tangents.iter().flat_map(|tangent| tangent.to_array()))
    }

    fn with_picture(self, picture: &ImageTexture) -> Self {
        self.with([picture.width, picture.height].into_iter().flat_map(u32::to_le_bytes))
            .with_floats((0..picture.len()).flat_map(|i| picture.linear(i).to_array()))
    }
}

impl LoadedScene {
    /// Equal for scenes with the same contents, wherever their files are.
    pub fn fingerprint(&self) -> Fingerprint {
        let mut print = Fingerprint::default().with(self.file.to_ron().bytes());
        for mesh in self.meshes.iter().flatten() {
            print = print.with_mesh(&mesh.mesh).with(format!("{:?}", mesh.slots).bytes());
        }
        let mut pictures: Vec<_> = self.pictures.iter().collect();
        pictures.sort_by_key(|(name, _)| *name);
        for (name, picture) in pictures {
            print = print.with(name.bytes()).with_picture(picture);
        }
        print
    }

    /// Of the contents without the camera and other view settings: see [`SceneContent`].
    pub fn content_fingerprint(&self) -> Fingerprint {
        let mut world = World::new();
        self.spawn(&mut world);
        let description = Description::of(&mut world, Some(self));
        SceneContent::of(&mut world, &description).fingerprint()
    }
}

/// The contents of a scene without camera, film, integrator and display: for telling whether it has changed.
#[derive(Clone, Debug)]
pub struct SceneContent {
    /// Without camera, film, integrator, display and file names: the contents of the files count instead.
    file: SceneFile,
    meshes: Vec<Arc<Mesh>>,
    pictures: Vec<Arc<ImageTexture>>,
}

impl SceneContent {
    /// The contents of `world`, which `description` describes.
    pub fn of(world: &mut World, description: &Description) -> Self {
        let mut file = description.file.clone();
        file.camera = CameraPart::looking_at(DVec3::Z, DVec3::ZERO);
        (file.cameras, file.animation.edited.camera) = Default::default();
        (file.film, file.display) = (FilmPart::default(), DisplayPart::default());
        (file.integrator, file.max_depth) = (Integrator::default(), None);
        for object in &mut file.objects {
            // The format does not count either.
            if let ObjectPart::Mesh { source, .. } = object
                && source.file().is_some()
            {
                *source = MeshSource::Obj(String::new());
            }
        }
        for (_, texture) in &mut file.textures.0 {
            if let TextureSource::Image { file, .. } = texture {
                file.clear();
            }
        }
        if let EnvironmentSource::Image { file, .. } = &mut file.environment {
            file.clear();
        }
        let inputs = SceneInputs::of(world);
        let mut meshes: Vec<Arc<Mesh>> = Vec::new();
        for object in &inputs.objects {
            if let Shape::Mesh(mesh) = &object.shape {
                meshes.push(mesh.clone());
            }
        }
        let mut pictures = Vec::new();
        let mut add = |texture: &SurfaceTexture| {
            if let TexturePattern::Image { image, .. } = &texture.texture.pattern {
                pictures.push(image.clone());
            }
        };
        for material in &inputs.materials {
            for texture in textures_of(&material.material) {
                add(texture);
            }
        }
        if let Environment::Image { image, .. } = &inputs.environment.light {
            pictures.push(image.clone());
        }
        Self { file, meshes, pictures }
    }

    /// Hashes each vertex and each texel once, however often they are used: some milliseconds for a large mesh.
    pub fn fingerprint(&self) -> Fingerprint {
        let mut print = Fingerprint::default().with(self.file.to_ron().bytes());
        let mut meshes: HashMap<*const Mesh, Fingerprint> = HashMap::new();
        for mesh in &self.meshes {
            let known = *meshes.entry(Arc::as_ptr(mesh)).or_insert_with(|| Fingerprint::default().with_mesh(mesh));
            print = print.with(known.0.to_le_bytes());
        }
        let mut pictures: HashMap<*const ImageTexture, Fingerprint> = HashMap::new();
        for picture in &self.pictures {
            let known =
                *pictures.entry(Arc::as_ptr(picture)).or_insert_with(|| Fingerprint::default().with_picture(picture));
            print = print.with(known.0.to_le_bytes());
        }
        print
    }
}

#[cfg(test)]
mod tests {
    use super::super::{LoadOptions, SceneSource, load};
    use super::*;

    #[test]
    fn bytes_hash_to_the_published_value() {
        // FNV-1a of "a" is d228cb696f1a8caf78912b704e4a8964; the eight bytes of its length follow.
        let mut expected = Fingerprint(0xd228_cb69_6f1a_8caf_7891_2b70_4e4a_8964);
        for byte in 1u64.to_le_bytes() {
            expected.0 = (expected.0 ^ u128::from(byte)).wrapping_mul((1 << 88) + 0x13b);
        }
        assert_eq!(Fingerprint::default().with(*b"a"), expected);
    }

    #[test]
    fn any_change_of_a_scene_or_its_mesh_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let (model, scene) = (folder.path().join("m.obj"), folder.path().join("s.ron"));
        let print = |corner: &str, eye: &str| {
            std::fs::write(&model, format!("v 0 0 0\nv 1 0 0\nv 0 {corner} 0\nf 1 2 3\n")).unwrap();
            let text = format!(
                "(camera: (eye: (0, 0, {eye}), look_at: (0, 0, 0)), materials: {{\"m\": diffuse(albedo: 0.5)}}, \
                 objects: [mesh(source: obj(\"m.obj\"), material: \"m\")])"
            );
            std::fs::write(&scene, text).unwrap();
            let loaded = load(&SceneSource::Scene(scene.clone()), &LoadOptions::default());
            loaded.unwrap_or_else(|error| panic!("{error}")).fingerprint()
        };
        let first = print("1", "3");
        assert_eq!(first, print("1", "3"));
        assert_ne!(first, print("1.0000001", "3"));
        assert_ne!(first, print("1", "3.5"));
    }
}
