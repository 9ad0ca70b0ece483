//! The world as a scene with all its data, for the formats of other renderers.

use crate::export::{WholeScene, WholeTexture};
use crate::files::warnings::Warnings;
use crate::format::animation::AnimationPart;
use crate::format::camera::camera_part;
use crate::format::sources::{EnvironmentSource, TextureSource};
use crate::scene::animation::Animation;
use crate::scene::describe::Description;
use crate::scene::loaded::LoadedScene;
use crate::scene::world::components::Shape;
use crate::scene::world::inputs::SceneInputs;
use bevy_ecs::prelude::World;
use std::path::PathBuf;

/// The contents of `world` at the moment that it shows; `loaded`: the scene that was opened into it.
pub fn whole_scene(world: &mut World, loaded: &LoadedScene) -> WholeScene {
    let (Description { mut file, losses, .. }, textures) = Description::with_textures(world, Some(loaded), true);
    let mut losses: Warnings = losses.into_iter().collect();
    if world.get_resource::<Animation>().is_some() {
        losses.push("the animation is left out: the scene shows one moment of it");
    }
    let inputs = SceneInputs::of(world);
    let n_all = file.objects.len() + file.lights.len();
    file.objects.retain(|object| !object.is_hidden());
    file.lights.retain(|light| !light.is_hidden());
    let n_hidden = n_all - file.objects.len() - file.lights.len();
    if n_hidden > 0 {
        losses.push(format!("what is hidden is left out: {n_hidden} of {n_all} objects and lights"));
    }
    file.animation = AnimationPart::default();
    if let Some(camera) = inputs.camera {
        file.camera = camera_part(&camera.view, &camera.projection, &camera.lens, None);
    }
    let on_disk = |file: &str| -> Option<PathBuf> { loaded.picture_files.get(file).map(|(path, _)| path.clone()) };
    let texture = |(texture, name): (std::sync::Arc<crate::scene::SurfaceTexture>, String)| {
        let file = match &texture.part {
            TextureSource::Image { file, .. } => on_disk(file),
            _ => None,
        };
        (name, WholeTexture { texture: texture.texture.clone(), file })
    };
    let environment_file = match &inputs.environment.part {
        EnvironmentSource::Image { file, .. } => on_disk(file),
        _ => None,
    };
    let mesh = |shape: &Shape| match shape {
        Shape::Mesh(mesh) => Some(mesh.clone()),
        _ => None,
    };
    WholeScene {
        file,
        meshes: inputs.objects.iter().map(|object| mesh(&object.shape)).collect(),
        textures: textures.into_iter().map(texture).collect(),
        environment: inputs.environment.light,
        environment_file,
        losses,
    }
}
