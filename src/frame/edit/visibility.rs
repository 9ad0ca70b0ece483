//! Hiding objects and lights, and showing them again.

use crate::frame::edit::keys::say;
use crate::frame::state::resources::RenderState;
use crate::frame::state::selection::Selection;
use crate::scene::Hidden;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, World};

/// Hides the selection, or all objects and lights but the selection, and says what that was.
pub fn hide(world: &mut World, others: bool) -> Result<(), String> {
    let selected = world.resource::<Selection>().0.clone();
    if selected.is_empty() {
        return Err("nothing is selected that could be hidden or kept".to_owned());
    }
    let wanted = match others {
        false => selected,
        true => {
            let inputs = &world.resource::<RenderState>().inputs;
            let objects = inputs.objects.iter().map(|object| object.entity);
            let all = objects.chain(inputs.lights.iter().map(|light| light.entity));
            all.filter(|entity| !selected.contains(entity)).collect()
        }
    };
    let Some(&first) = wanted.first() else { return Err("there is nothing else that could be hidden".to_owned()) };
    for &entity in &wanted {
        set_hidden(world, entity, true);
    }
    let name = world.get::<Name>(first).map_or("an object", |name| name.as_str());
    let what = match wanted.len() {
        1 => name.to_owned(),
        n => format!("{name} and {} more", n - 1),
    };
    say(world, format!("hidden: {what} (Edit > Show all that is hidden)"));
    Ok(())
}

/// Shows all that is hidden, and selects it.
pub fn show_all(world: &mut World) -> Result<(), String> {
    let hidden = &world.resource::<RenderState>().inputs.hidden;
    let objects = hidden.objects.iter().map(|(_, object)| object.entity);
    let all: Vec<Entity> = objects.chain(hidden.lights.iter().map(|(_, light)| light.entity)).collect();
    if all.is_empty() {
        return Err("nothing is hidden".to_owned());
    }
    for &entity in &all {
        set_hidden(world, entity, false);
    }
    world.resource_mut::<Selection>().0 = all;
    Ok(())
}

/// Hides an object or a light, or shows it. What is hidden is deselected: its handles would be around nothing.
pub fn set_hidden(world: &mut World, entity: Entity, hidden: bool) {
    if hidden {
        world.entity_mut(entity).insert(Hidden);
        world.resource_mut::<Selection>().0.retain(|selected| *selected != entity);
    } else {
        world.entity_mut(entity).remove::<Hidden>();
    }
}
