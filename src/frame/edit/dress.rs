//! Materials for the selection.

use crate::frame::edit::new_entity::{new_material, plain_name};
use crate::frame::edit::projection::project_bare;
use crate::frame::state::selection::{ActivePart, Selection};
use crate::scene::{MaterialSlots, SurfaceMaterial, library};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};

/// Gives the selected objects the material of this name of the library.
pub fn dress(world: &mut World, name: &str) -> Result<(), String> {
    let ready = library().iter().find(|ready| ready.name == name).ok_or("there is no such ready material")?;
    let material = ready.material();
    let selected = world.resource::<Selection>().0.clone();
    let objects: Vec<Entity> =
        selected.into_iter().filter(|&entity| world.get::<MaterialSlots>(entity).is_some()).collect();
    if objects.is_empty() {
        return Err("select an object to give it a material".to_owned());
    }
    // One that the scene has already, unless it was changed since.
    let mut materials = world.query::<(Entity, &Name, &SurfaceMaterial)>();
    let known = materials.iter(world).filter(|(_, known, has)| plain_name(known.as_str()) == name && *has == material);
    let known = known.map(|(entity, ..)| entity).next();
    let material = known.unwrap_or_else(|| new_material(world, name, material.0.clone()));
    for object in objects {
        give(world, object, material);
    }
    Ok(())
}

/// Gives an object a material, or the part of it that was clicked.
pub fn give(world: &mut World, object: Entity, material: Entity) {
    let active = world.get_resource::<ActivePart>().copied().unwrap_or_default();
    let Some(mut slots) = world.get_mut::<MaterialSlots>(object) else { return };
    match active.of(object, slots.0.len()) {
        Some(part) => slots.0[part] = material,
        None => slots.0 = vec![material],
    }
    project_bare(world, material, &[object]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_ecs::prelude::With;

    #[test]
    fn objects_share_a_ready_material_until_it_is_changed() {
        let mut world = World::new();
        let objects: Vec<Entity> = (0..3).map(|_| world.spawn(MaterialSlots(Vec::new())).id()).collect();
        let dressed = |world: &mut World, i: usize, name: &str| {
            world.insert_resource(Selection(vec![objects[i]]));
            dress(world, name).map(|()| world.get::<MaterialSlots>(objects[i]).unwrap().0[0])
        };
        let gold = dressed(&mut world, 0, "gold").unwrap();
        assert_eq!(dressed(&mut world, 1, "gold"), Ok(gold));
        let glass = library().iter().find(|ready| ready.name == "glass").unwrap().material().clone();
        world.entity_mut(gold).insert(glass);
        let other = dressed(&mut world, 2, "gold").unwrap();
        assert_ne!(other, gold);
        assert_eq!(world.get::<Name>(other).unwrap().as_str(), "gold 2");
        assert_eq!(world.query_filtered::<Entity, With<SurfaceMaterial>>().iter(&world).count(), 2);
        assert!(dressed(&mut world, 0, "kryptonite").is_err());
        world.insert_resource(Selection(Vec::new()));
        assert!(dress(&mut world, "gold").is_err());
    }
}
