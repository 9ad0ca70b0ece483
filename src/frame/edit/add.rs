//! Adding, copying and removing objects and lights.
//!
//! A removed entity stays and only loses its components, so that undo restores the same entity and all references to it
//! are valid again.

use crate::frame::edit::new_entity::{free_name, new_material, next_ordinal, plain_name, sized, spawn};
use crate::frame::edit::spot;
use crate::frame::edit::spot::Spot;
use crate::frame::state::selection::Selection;
use crate::mesh::procedural;
use crate::scene::light_of;
use crate::scene::world::entity_state::EntityState;
use crate::scene::{
    DirectionalLight, GREY, Material, MaterialSlots, MeshOrigin, MeshShading, MeshSource, Placement, PointLight, Shape,
    SpotLight, SurfaceMaterial,
};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// What can be added. `spot` finds its position.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NewThing {
    /// A diffuse sphere on the ground.
    Sphere,
    /// A horizontal, infinite plane.
    Plane,
    /// An emissive square above, facing down.
    AreaLight,
    /// A point light above.
    PointLight,
    /// A spot light above, pointing straight down.
    SpotLight,
    /// Parallel light from above, at an angle.
    DirectionalLight,
    /// A diffuse cube on the ground.
    Cube,
    /// A built-in mesh or a model file, loaded in the background.
    Mesh(MeshSource),
}

impl NewThing {
    /// What can be added without a file, by its name in the window.
    pub const NAMED: [(&str, Self); 7] = [
        ("Sphere", Self::Sphere),
        ("Plane", Self::Plane),
        ("Cube", Self::Cube),
        ("Area light", Self::AreaLight),
        ("Point light", Self::PointLight),
        ("Spot light", Self::SpotLight),
        ("Directional light", Self::DirectionalLight),
    ];
}

/// Whether the entity is an object or a light of the scene.
pub fn is_thing(world: &World, entity: Entity) -> bool {
    world.get::<Shape>(entity).is_some() || light_of(world, entity).is_some()
}

pub fn add(world: &mut World, new: &NewThing) {
    let Spot { foot: place, size } = spot::find(world);
    let up = DVec3::Y * size;
    let entity = match new {
        NewThing::Sphere => {
            let material = new_material(world, "ball", Material::diffuse(Vec3::new(0.7, 0.35, 0.2)));
            spawn(
                world,
                "ball",
                (Shape::Sphere { radius: size }, Placement::at(place + up), MaterialSlots(vec![material])),
            )
        }
        NewThing::Plane => {
            let material = new_material(world, "ground", Material::diffuse(Vec3::splat(0.5)));
            let shape = Shape::Plane { normal: DVec3::Y };
            spawn(world, "ground", (shape, Placement::at(place), MaterialSlots(vec![material])))
        }
        NewThing::AreaLight => {
            let material = new_material(world, "light", Material::emissive(Vec3::new(12.0, 11.0, 9.5)));
            let edge = 2.0 * size;
            // u × v points down.
            let shape = Shape::Quad { edge_u: edge * DVec3::X, edge_v: edge * DVec3::Z };
            let corner =
                place + spot::headroom(world, place, 6.0 * size) * DVec3::Y - 0.5 * edge * (DVec3::X + DVec3::Z);
            spawn(world, "area light", (shape, Placement::at(corner), MaterialSlots(vec![material])))
        }
        NewThing::PointLight => {
            let intensity = Vec3::splat((50.0 * size * size) as f32);
            let light = PointLight { intensity, radius: 0.1 * size };
            spawn(
                world,
                "point light",
                (light, Placement::at(place + spot::headroom(world, place, 5.0 * size) * DVec3::Y)),
            )
        }
        NewThing::SpotLight => {
            let light = SpotLight {
                intensity: Vec3::splat((100.0 * size * size) as f32),
                direction: DVec3::NEG_Y,
                inner_angle_deg: 20.0,
                outer_angle_deg: 30.0,
                ..SpotLight::default()
            };
            let above = spot::headroom(world, place, 5.0 * size) * DVec3::Y;
            spawn(world, "spot light", (light, Placement::at(place + above)))
        }
        NewThing::DirectionalLight => {
            let direction = DVec3::new(-1.0, -2.0, -1.0).normalize();
            let light = DirectionalLight { irradiance: Vec3::splat(3.0), direction };
            let above = spot::headroom(world, place, 5.0 * size) * DVec3::Y;
            spawn(world, "directional light", (light, Placement::at(place + above)))
        }
        NewThing::Cube => {
            let material = new_material(world, "cube", Material::diffuse(Vec3::new(0.25, 0.4, 0.6)));
            let mesh = procedural::cuboid(DVec3::ONE);
            let shape = Shape::Mesh(std::sync::Arc::new(mesh));
            let placement = sized(Placement::at(place + up), 2.0 * size);
            let origin = MeshOrigin {
                source: MeshSource::Builtin("cube".to_owned()),
                shading: MeshShading::Flat,
                simplify: None,
                own_materials: false,
            };
            spawn(world, "cube", (shape, placement, MaterialSlots(vec![material]), origin))
        }
        NewThing::Mesh(source) => {
            crate::frame::edit::remesh::start_new(world, source.clone(), place, size);
            return;
        }
    };
    world.resource_mut::<Selection>().choose(entity, false);
}

pub fn delete(world: &mut World) {
    for entity in std::mem::take(&mut world.resource_mut::<Selection>().0) {
        EntityState::default().put(world, entity);
    }
}

pub fn duplicate(world: &mut World) {
    let selected = world.resource::<Selection>().0.clone();
    let step = spot::find(world).size;
    let mut copies = Vec::new();
    for entity in selected {
        let mut state = EntityState::of(world, entity);
        let name = state.name.as_ref().map_or("copy", |name| plain_name(name.as_str()));
        (state.name, state.ordinal) = (Some(Name::new(free_name(world, name, false))), Some(next_ordinal(world)));
        // Offset, because the copy would otherwise be invisible.
        state.placement.get_or_insert_default().translation.x += step;
        let copy = world.spawn_empty().id();
        state.put(world, copy);
        copies.push(copy);
    }
    world.resource_mut::<Selection>().0 = copies;
}

/// Gives `object` its own copy of its first material; plain grey if it has none.
pub fn own_material(world: &mut World, object: Entity) -> Result<(), String> {
    let old = world.get::<MaterialSlots>(object).and_then(|slots| slots.0.first().copied());
    let material = old.and_then(|old| SurfaceMaterial::of(world, old)).cloned().unwrap_or(GREY);
    let name = old.and_then(|old| world.get::<Name>(old)).map(|name| plain_name(name.as_str()).to_owned());
    let material = new_material(world, &name.unwrap_or_else(|| "material".to_owned()), material);
    let mut slots = world.get_mut::<MaterialSlots>(object).ok_or("this object has no material")?;
    match slots.0.first_mut() {
        Some(first) => *first = material,
        None => slots.0.push(material),
    }
    Ok(())
}
