//! A hash that tells whether two loaded scenes have the same contents.

use crate::files::hash::Fingerprint;
use crate::format::animation::AnimationPart;
use crate::format::camera::CameraPart;
use crate::format::parts::{FilmPart, ObjectPart};
use crate::format::scene_file::SceneFile;
use crate::format::sources::{EnvironmentSource, MeshSource, TextureSource};
use crate::import::gltf_motion::GltfMotion;
use crate::mesh::Mesh;
use crate::render::{Display, Environment, ImageTexture, Integrator, Texels, TexturePattern};
use crate::scene::animation::Animation;
use crate::scene::describe::Description;
use crate::scene::loaded::LoadedScene;
use crate::scene::world::components::{Shape, SurfaceTexture, textures_of};
use crate::scene::world::inputs::SceneInputs;
use bevy_ecs::prelude::World;
use bytemuck::cast_slice;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

fn of_mesh(mesh: &Mesh) -> Fingerprint {
    let Mesh { positions, center, triangles, normals, uvs, slots, uvs2, colors, tangents } = mesh;
    let lists = [cast_slice(normals), cast_slice(uvs), cast_slice(slots), cast_slice(uvs2), cast_slice(colors)];
    let shape = Fingerprint::of(cast_slice(positions)).with(bytemuck::bytes_of(center)).with(cast_slice(triangles));
    lists.into_iter().chain([cast_slice(tangents)]).fold(shape, Fingerprint::with)
}

fn of_picture(picture: &ImageTexture) -> Fingerprint {
    let texels = match &picture.texels {
        Texels::U8 { channels, data } => Fingerprint::of(&[1, *channels as u8]).with(data),
        Texels::U16 { channels, data } => Fingerprint::of(&[2, *channels as u8]).with(cast_slice(data)),
        Texels::F32(data) => Fingerprint::of(&[4, 3]).with(cast_slice(data)),
    };
    texels.with(cast_slice(&[picture.width, picture.height]))
}

/// The fingerprint of each of these, which may be shared: each is read once, in parallel.
fn of_each<T: Send + Sync>(shared: &[Arc<T>], of: impl Fn(&T) -> Fingerprint + Sync) -> Vec<Fingerprint> {
    let mut first: HashMap<*const T, usize> = HashMap::new();
    let firsts: Vec<usize> =
        shared.iter().enumerate().map(|(i, it)| *first.entry(Arc::as_ptr(it)).or_insert(i)).collect();
    let known: Vec<Option<Fingerprint>> =
        shared.par_iter().enumerate().map(|(i, it)| (firsts[i] == i).then(|| of(it))).collect();
    firsts.into_iter().map(|i| known[i].expect("the first one of each was read")).collect()
}

impl LoadedScene {
    /// Equal for scenes with the same contents, wherever their files are.
    pub fn fingerprint(&self) -> Fingerprint {
        let mut print = Fingerprint::of(self.file.to_ron().as_bytes());
        let meshes: Vec<_> = self.meshes.iter().flatten().collect();
        let shared: Vec<_> = meshes.iter().map(|mesh| mesh.mesh.clone()).collect();
        for (mesh, of_mesh) in meshes.iter().zip(of_each(&shared, of_mesh)) {
            print = print.with(bytemuck::bytes_of(&of_mesh.0)).with(format!("{:?}", mesh.slots).as_bytes());
        }
        let mut pictures: Vec<_> = self.pictures.iter().collect();
        pictures.sort_by_key(|(name, _)| *name);
        let shared: Vec<_> = pictures.iter().map(|(_, picture)| (*picture).clone()).collect();
        for ((name, _), of_picture) in pictures.iter().zip(of_each(&shared, of_picture)) {
            print = print.with(name.as_bytes()).with(bytemuck::bytes_of(&of_picture.0));
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
    /// The animations of a glTF file that things move by during the exposure.
    motion: Option<Arc<GltfMotion>>,
}

impl SceneContent {
    /// The contents of `world`, which `description` describes.
    pub fn of(world: &mut World, description: &Description) -> Self {
        let mut file = description.file.clone();
        let animation = world.get_resource::<Animation>();
        let is_exposed = file.animation.shutter.is_some() || file.animation.shutter_seconds.is_some();
        let model = animation.filter(|_| is_exposed).and_then(|animation| animation.model.as_ref());
        let motion = model.map(|model| model.motion.clone());
        // What a glTF file moves counts by its animations, and only where they are seen.
        if file.animation.model.take().is_some() && file.animation.tracks.is_empty() && !is_exposed {
            file.animation = AnimationPart::default();
        }
        let CameraPart { look_at, forward, .. } = file.camera;
        file.camera = CameraPart::looking_at(DVec3::Z, DVec3::ZERO);
        if animation.is_some_and(Animation::has_camera_track) {
            // A camera on its way is turned towards a point, or is not.
            (file.camera.look_at, file.camera.forward) = (look_at, forward);
        }
        (file.cameras, file.animation.edited.camera) = Default::default();
        (file.film, file.display) = (FilmPart::default(), Display::default());
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
        inputs.lights.iter().filter_map(|light| light.texture.as_ref()).for_each(|texture| add(&texture.0));
        if let Environment::Image { image, .. } = &inputs.environment.light {
            pictures.push(image.clone());
        }
        Self { file, meshes, pictures, motion }
    }

    /// Reads each vertex and each texel once, however often they are used.
    pub fn fingerprint(&self) -> Fingerprint {
        let parts = of_each(&self.meshes, of_mesh).into_iter();
        let parts = parts.chain(of_each(&self.pictures, of_picture));
        let file = Fingerprint::of(self.file.to_ron().as_bytes());
        let parts = parts.chain(self.motion.iter().map(|motion| motion.fingerprint()));
        parts.fold(file, |print, part| print.with(bytemuck::bytes_of(&part.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;
    use crate::scene::load;
    use crate::scene::load::LoadOptions;

    #[test]
    fn the_split_into_parts_matters() {
        let of = |parts: &[&str]| parts.iter().fold(Fingerprint::of(b""), |print, part| print.with(part.as_bytes()));
        let all = [of(&[]), of(&[""]), of(&["ab"]), of(&["a", "b"]), of(&["b", "a"]), of(&["ab", ""])];
        assert!(all.iter().enumerate().all(|(i, print)| all[..i].iter().all(|other| other != print)), "{all:?}");
    }

    /// Alpha as well, which a hash of colours would miss.
    #[test]
    fn every_texel_counts() {
        let of = |data: &[u8], channels, width, height| {
            let texels = Texels::U8 { channels, data: data.to_vec() };
            of_picture(&ImageTexture { width, height, texels })
        };
        let all = [
            of(&[1, 2, 3, 4], 4, 1, 1),
            of(&[1, 2, 3, 5], 4, 1, 1),
            of(&[1, 2, 3, 4], 1, 4, 1),
            of(&[1, 2, 3, 4], 1, 1, 4),
            of(&[1, 2, 3, 4], 2, 2, 1),
        ];
        assert!(all.iter().enumerate().all(|(i, print)| all[..i].iter().all(|other| other != print)), "{all:?}");
    }

    /// The view at the moment is no content, but how the camera turns on its way is.
    #[test]
    fn the_aim_of_a_camera_counts_if_it_moves() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.ron");
        let print = |target: f64, tracks: &str| {
            let camera =
                format!("(camera: (eye: (0, 0, 4), look_at: (0, 0, {target})), animation: (tracks: [{tracks}]))");
            std::fs::write(&path, camera).unwrap();
            let loaded = load(&SceneSource::Scene(path.clone()), &LoadOptions::default());
            loaded.unwrap_or_else(|error| panic!("{error}")).content_fingerprint()
        };
        assert_eq!(print(0.0, ""), print(2.0, ""));
        let track = "camera(property: eye, keys: [(0, (0, 0, 4)), (1, (2, 0, 4))])";
        assert_eq!(print(0.0, track), print(0.0, track));
        assert_ne!(print(0.0, track), print(2.0, track));
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
