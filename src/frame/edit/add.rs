//! Adding, copying and removing objects and lights.
//!
//! A removed entity stays and only loses its components, so that undo restores the same entity and all references to it
//! are valid again.

use crate::frame::edit::new_entity::{first_and_more, free_name, new_material, next_ordinal, plain_name, sized, spawn};
use crate::frame::edit::spot;
use crate::frame::edit::spot::Spot;
use crate::frame::edit::standing::lowest;
use crate::frame::state::history::History;
use crate::frame::state::selection::{ActivePart, Selection};
use crate::mesh::procedural;
use crate::scene::light_of;
use crate::scene::world::entity_state::EntityState;
use crate::scene::{
    DirectionalLight, DisplaySettings, GREY, Material, MaterialSlots, MeshOptions, MeshOrigin, MeshShading, MeshSource,
    Placement, PointLight, Shape, SpotLight, SurfaceMaterial,
};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_PI, PI};

/// What can be added. `spot` finds its position.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NewThing {
    /// A diffuse sphere on the ground.
    Sphere,
    /// A horizontal, infinite plane.
    Plane,
    /// An emissive square above what is selected or seen, facing it; the camera sees its front.
    AreaLight,
    /// A point light beside it.
    PointLight,
    /// A spot light beside it, pointing at it.
    SpotLight,
    /// Parallel light from above, from the right of the camera.
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
        ("Ground plane", Self::Plane),
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

/// - `at`: position in the image, see [`Edit::AddAt`](crate::frame::Edit::AddAt).
pub fn add(world: &mut World, new: &NewThing, at: [f64; 2]) {
    let entity = match add_light(world, new, at) {
        Some(light) => light,
        None => match add_object(world, new, at) {
            Some(object) => object,
            // It comes later.
            None => return,
        },
    };
    world.resource_mut::<Selection>().choose(entity, false);
}

/// Irradiance of what a new light is made for, W/m²: white becomes twice as bright as the white of the display, so that
/// the difference is seen in other light. In a room, no more than a quarter of what is around becomes brighter.
const NEW_IRRADIANCE: f64 = 2.0 * PI;

/// Adds a light, as bright as its distance needs; `None` for everything else.
fn add_light(world: &mut World, new: &NewThing, at: [f64; 2]) -> Option<Entity> {
    use NewThing::{AreaLight, DirectionalLight as Parallel, PointLight as Point, SpotLight as Spot};
    if !matches!(new, AreaLight | Point | Spot | Parallel) {
        return None;
    }
    let spot = spot::find_for_light(world, matches!(new, AreaLight), at);
    let (way, distance) = (spot.way(), spot.way().length());
    let direction = way.try_normalize().unwrap_or(DVec3::NEG_Y);
    let irradiance = NEW_IRRADIANCE / f64::from(world.resource::<DisplaySettings>().0.exposure_stops).exp2();
    let front = matches!(new, AreaLight | Spot).then_some(direction);
    let reach = spot::room_around(world, spot.place, front).map_or(distance, |room| distance.min(room));
    let intensity = Vec3::splat((irradiance * reach * reach) as f32);
    let placement = Placement::at(spot.place);
    Some(match new {
        AreaLight => {
            // u × v points to what it lights.
            let u = direction.cross(DVec3::Y).try_normalize().unwrap_or(DVec3::X);
            let v = direction.cross(u);
            // Its light is soft, and its own shadow small.
            let edge = spot::free_edge(world, spot.place, [u, v], 0.8 * spot.radius);
            // A large square nearby is all around: its irradiance is π times its radiance.
            let white = (irradiance * (reach / edge).powi(2).max(FRAC_1_PI)) as f32;
            let material = new_material(world, "light", Material::emissive(white * Vec3::new(1.0, 0.92, 0.8)));
            let (edge_u, edge_v) = (edge * u, edge * v);
            let corner = Placement::at(spot.place - 0.5 * (edge_u + edge_v));
            spawn(world, "area light", (Shape::Quad { edge_u, edge_v }, corner, MaterialSlots(vec![material])))
        }
        Point => {
            let light = PointLight { intensity, radius: 0.1 * spot.radius };
            spawn(world, "point light", (light, placement))
        }
        Spot => {
            let angles = SpotLight { inner_angle_deg: 30.0, outer_angle_deg: 40.0, ..SpotLight::default() };
            spawn(world, "spot light", (SpotLight { intensity, direction, ..angles }, placement))
        }
        _ => {
            let light = DirectionalLight { irradiance: Vec3::splat(irradiance as f32), direction };
            spawn(world, "directional light", (light, placement))
        }
    })
}

/// Adds an object; `None` for one that is loaded in the background.
fn add_object(world: &mut World, new: &NewThing, at: [f64; 2]) -> Option<Entity> {
    let Spot { foot: place, size } = spot::find(world, at);
    let up = DVec3::Y * size;
    Some(match new {
        NewThing::Sphere => {
            let material = new_material(world, "ball", Material::diffuse(Vec3::new(0.7, 0.35, 0.2)));
            spawn(
                world,
                "ball",
                (Shape::Sphere { radius: size }, Placement::at(place + up), MaterialSlots(vec![material])),
            )
        }
        NewThing::Plane => {
            // It has no end: in the middle of things it would hide half of them.
            let place = place.with_y(lowest(world, &[]).unwrap_or(place.y));
            let material = new_material(world, "ground", Material::diffuse(Vec3::splat(0.5)));
            let shape = Shape::Plane { normal: DVec3::Y };
            spawn(world, "ground", (shape, Placement::at(place), MaterialSlots(vec![material])))
        }
        NewThing::Cube => {
            let material = new_material(world, "cube", Material::diffuse(Vec3::new(0.25, 0.4, 0.6)));
            let mesh = procedural::cube();
            let shape = Shape::Mesh(std::sync::Arc::new(mesh));
            let placement = sized(Placement::at(place + up), 2.0 * size);
            let origin = MeshOrigin {
                source: MeshSource::Builtin("cube".to_owned()),
                options: MeshOptions { shading: MeshShading::Flat, ..MeshOptions::default() },
                own_materials: false,
            };
            spawn(world, "cube", (shape, placement, MaterialSlots(vec![material]), origin))
        }
        NewThing::Mesh(source) => {
            crate::frame::edit::remesh::start_new(world, source.clone(), place, size);
            return None;
        }
        _ => return None,
    })
}

/// Deletes what is selected, and says what that was: it may be behind something, or all around.
pub fn delete(world: &mut World) {
    let selected = std::mem::take(&mut world.resource_mut::<Selection>().0);
    let Some(what) = first_and_more(world, &selected) else { return };
    for entity in selected {
        EntityState::default().put(world, entity);
    }
    crate::frame::edit::keys::say(world, format!("deleted: {what}"));
}

/// Copies the selection, and selects the copies.
///
/// - `step`: from an original to its copy, metres.
pub fn duplicate(world: &mut World, step: DVec3) {
    let selected = world.resource::<Selection>().0.clone();
    let mut copies = Vec::new();
    for entity in selected {
        let mut state = EntityState::of(world, entity);
        let name = state.name.as_ref().map_or("copy", |name| plain_name(name.as_str()));
        (state.name, state.ordinal) = (Some(Name::new(free_name(world, name, false))), Some(next_ordinal(world)));
        state.placement.get_or_insert_default().translation += step;
        let copy = world.spawn_empty().id();
        state.put(world, copy);
        world.resource_mut::<History>().add_to_begin(copy, state);
        copies.push(copy);
    }
    world.resource_mut::<Selection>().0 = copies;
}

/// Gives `object` its own copy of its first material, or of that of the clicked part; plain grey if it has none.
pub fn own_material(world: &mut World, object: Entity) -> Result<(), String> {
    let slots = world.get::<MaterialSlots>(object).ok_or("this object has no material")?;
    let part = world.resource::<ActivePart>().of(object, slots.0.len()).unwrap_or(0);
    let old = slots.0.get(part).copied();
    let material = old.and_then(|old| SurfaceMaterial::of(world, old)).cloned().unwrap_or(GREY);
    let name = old.and_then(|old| world.get::<Name>(old)).map(|name| plain_name(name.as_str()).to_owned());
    let material = new_material(world, &name.unwrap_or_else(|| "material".to_owned()), material);
    let mut slots = world.get_mut::<MaterialSlots>(object).ok_or("this object has no material")?;
    match slots.0.get_mut(part) {
        Some(old) => *old = material,
        None => slots.0.push(material),
    }
    Ok(())
}
