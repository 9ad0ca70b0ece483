//! Textures in place of a material's colour: existing ones, a new checker, or an image file.

use crate::frame::core::status::{MessageKind, Status};
use crate::frame::edit::projection::project_bare;
use crate::frame::edit::set::set_if_different;
use crate::frame::edit::sky;
use crate::frame::state::background::{BackgroundTasks, PicturePurpose};
use crate::frame::state::resources::{Clock, CurrentScene, RenderState};
use crate::import::builtin_images::builtin_image;
use crate::render::{ImageTexture, TexturePattern};
use crate::scene::{ColorParam, Material, SurfaceMaterial, SurfaceTexture, TextureSource, texture_of, users_of};
use bevy_ecs::prelude::{Entity, World};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Returns all textures of the world's materials.
pub fn textures(world: &mut World) -> Vec<Arc<SurfaceTexture>> {
    let mut found: Vec<Arc<SurfaceTexture>> = Vec::new();
    for SurfaceMaterial(material) in world.query::<&SurfaceMaterial>().iter(world) {
        if let Some(ColorParam::Texture(texture)) = material.color()
            && !found.iter().any(|known| Arc::ptr_eq(known, texture))
        {
            found.push(texture.clone());
        }
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    found
}

/// Replaces the colour by an existing texture.
pub fn set_texture(world: &mut World, entity: Entity, name: &str) -> Result<(), String> {
    let texture = textures(world).into_iter().find(|texture| texture.name == name);
    let texture = texture.ok_or_else(|| format!("there is no texture `{name}`"))?;
    put(world, entity, texture)
}

/// Replaces the colour by a texture of this description. An image that is already loaded is shared, another one is
/// loaded in the background.
pub fn paint(world: &mut World, entity: Entity, part: TextureSource) -> Result<(), String> {
    let colored = SurfaceMaterial::of(world, entity).is_some_and(|material| material.color().is_some());
    if !colored {
        return Err("this material has no colour".to_owned());
    }
    let known = match &part {
        TextureSource::Image { file, .. } => builtin_image(file).or_else(|| {
            textures(world).into_iter().find_map(|texture| {
                let TexturePattern::Image { image, .. } = &texture.texture.pattern else { return None };
                let same = matches!(&texture.part, TextureSource::Image { file: other, .. } if other == file);
                same.then(|| image.clone())
            })
        }),
        TextureSource::Checker { .. } | TextureSource::VertexColors { .. } => None,
    };
    if let (TextureSource::Image { file, .. }, None) = (&part, &known) {
        let path = path_in_scene(world, file);
        world.resource::<BackgroundTasks>().read_picture(PicturePurpose::Texture(entity, part), path);
        return Ok(());
    }
    make(world, entity, part, known)
}

/// Lights the scene by an image, which is loaded in the background.
pub fn light_from(world: &mut World, file: String) {
    let path = path_in_scene(world, &file);
    world.resource::<BackgroundTasks>().read_picture(PicturePurpose::Environment(file), path);
}

/// The path of a file that is named as in the open scene.
fn path_in_scene(world: &World, file: &str) -> PathBuf {
    let folder = world.get_resource::<CurrentScene>().map(|scene| scene.0.folder.clone()).unwrap_or_default();
    folder.join(crate::scene::text_to_path(file))
}

/// Applies an image that has been loaded.
pub fn take(world: &mut World, purpose: PicturePurpose, result: Result<ImageTexture, String>) {
    let put = result.map(Arc::new).and_then(|picture| match purpose {
        PicturePurpose::Texture(entity, part) => make(world, entity, part, Some(picture)),
        PicturePurpose::Environment(file) => {
            sky::set_image(world, file, picture);
            Ok(())
        }
    });
    if let Err(problem) = put {
        let now = world.resource::<Clock>().0;
        world.resource_mut::<Status>().say(now, MessageKind::Error, problem);
    }
}

fn make(
    world: &mut World,
    entity: Entity,
    part: TextureSource,
    picture: Option<Arc<ImageTexture>>,
) -> Result<(), String> {
    let texture = texture_of(&part, |_| picture).ok_or("the image has not been loaded")?;
    // A modified texture keeps its name.
    let old = SurfaceMaterial::of(world, entity).and_then(Material::color);
    let name = match (old, &part) {
        (Some(ColorParam::Texture(old)), _) if same_source(&old.part, &part) => old.name.clone(),
        (_, TextureSource::Checker { .. }) => free_name(world, "checker"),
        (_, TextureSource::VertexColors { .. }) => free_name(world, "vertex colors"),
        (_, TextureSource::Image { file, .. }) => {
            let stem = Path::new(file).file_stem().map(|stem| stem.to_string_lossy().into_owned());
            free_name(world, &stem.unwrap_or_else(|| "image".to_owned()))
        }
    };
    put(world, entity, Arc::new(SurfaceTexture { name, part, texture }))
}

fn same_source(a: &TextureSource, b: &TextureSource) -> bool {
    match (a, b) {
        (TextureSource::Checker { .. }, TextureSource::Checker { .. })
        | (TextureSource::VertexColors { .. }, TextureSource::VertexColors { .. }) => true,
        (TextureSource::Image { file: a, .. }, TextureSource::Image { file: b, .. }) => a == b,
        _ => false,
    }
}

fn put(world: &mut World, entity: Entity, texture: Arc<SurfaceTexture>) -> Result<(), String> {
    let mut material = world.get::<SurfaceMaterial>(entity).cloned().ok_or("not a material")?;
    let is_new = !matches!(material.0.color(), Some(ColorParam::Texture(_)));
    *material.0.color_mut().ok_or("this material has no colour")? = ColorParam::Texture(texture);
    set_if_different(world, entity, material);
    if is_new {
        let users = users_of(world, &world.resource::<RenderState>().inputs, entity);
        project_bare(world, entity, &users);
    }
    Ok(())
}

/// Returns `name`, or the first of `name 2`, `name 3`, … that no texture of a material has.
fn free_name(world: &mut World, name: &str) -> String {
    let taken = textures(world);
    let numbered = (2..).map(|i| format!("{name} {i}"));
    let mut names = std::iter::once(name.to_owned()).chain(numbered);
    names.find(|name| taken.iter().all(|texture| texture.name != *name)).expect("the iterator is infinite")
}
