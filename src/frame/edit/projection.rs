//! Texture coordinates for meshes that have none, when they get a texture, or a surface that is brushed along them.

use crate::frame::core::status::{MessageKind, Status};
use crate::frame::state::resources::Clock;
use crate::mesh::Mesh;
use crate::scene::{
    Material, MeshOptions, MeshOrigin, MeshSource, ScalarParam, Shape, SurfaceMaterial, SurfaceTexture,
    TextureCoordinates, TextureSource, textures_of,
};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};
use std::collections::HashMap;
use std::sync::Arc;

/// Gives those of the objects whose meshes have no texture coordinates those of box projection, if the material has a
/// texture that needs some, or highlights that are stretched along them, and says so.
pub fn project_bare(world: &mut World, material: Entity, objects: &[Entity]) {
    let needs_coordinates = |texture: &Arc<SurfaceTexture>| !matches!(texture.part, TextureSource::VertexColors { .. });
    let Some(SurfaceMaterial(material)) = world.get(material) else { return };
    let is_brushed = match material {
        Material::Principled { anisotropy, .. } => *anisotropy != ScalarParam::Number(0.0),
        _ => false,
    };
    if !is_brushed && !textures_of(material).any(needs_coordinates) {
        return;
    }
    // Objects that share a mesh go on to share it.
    let mut made: HashMap<*const Mesh, Arc<Mesh>> = HashMap::new();
    let mut projected: Vec<Entity> = Vec::new();
    for &object in objects {
        let Some(Shape::Mesh(mesh)) = world.get(object) else { continue };
        if !is_bare(mesh) {
            continue;
        }
        let mesh = mesh.clone();
        let origin = world.get::<MeshOrigin>(object).cloned();
        // On a mesh whose shape is animated, the texture would float.
        if let Some(MeshOrigin { source: MeshSource::Gltf { node: Some(_), .. }, .. }) = origin {
            say(
                world,
                MessageKind::Warning,
                object,
                "has no texture coordinates: each of its triangles shows the image",
            );
            continue;
        }
        let new = made.entry(Arc::as_ptr(&mesh)).or_insert_with(|| Arc::new((*mesh).clone().with_box_coordinates()));
        world.entity_mut(object).insert(Shape::Mesh(new.clone()));
        if let Some(origin) = origin {
            let options = MeshOptions { texture_coordinates: TextureCoordinates::Box, ..origin.options };
            world.entity_mut(object).insert(MeshOrigin { options, ..origin });
        }
        projected.push(object);
    }
    match projected[..] {
        [] => {}
        [object] => say(
            world,
            MessageKind::Note,
            object,
            "has no texture coordinates: they are projected from six sides (panel, Mesh)",
        ),
        [object, ..] => {
            let others = projected.len() - 1;
            let what = format!(
                "and {others} more have no texture coordinates: they are projected from six sides (panel, Mesh)"
            );
            say(world, MessageKind::Note, object, &what);
        }
    }
}

/// Whether the mesh has no texture coordinates, or all at one point, which some programs write instead.
fn is_bare(mesh: &Mesh) -> bool {
    mesh.uvs.iter().all(|uv| *uv == mesh.uvs[0])
}

fn say(world: &mut World, kind: MessageKind, object: Entity, what: &str) {
    let name = world.get::<Name>(object).map_or("this mesh".to_owned(), |name| format!("`{name}`"));
    let now = world.resource::<Clock>().0;
    world.resource_mut::<Status>().say(now, kind, format!("{name} {what}"));
}
