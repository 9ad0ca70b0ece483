//! Hiding objects and lights, and showing them again.

use crate::frame::edit::keys::say;
use crate::frame::edit::new_entity::first_and_more;
use crate::frame::state::resources::RenderState;
use crate::frame::state::selection::Selection;
use crate::scene::Hidden;
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
            let all = world.resource::<RenderState>().inputs.entities();
            all.filter(|entity| !selected.contains(entity)).collect()
        }
    };
    let what = first_and_more(world, &wanted).ok_or("there is nothing else that could be hidden")?;
    for entity in wanted {
        set_hidden(world, entity, true);
    }
    say(world, format!("hidden: {what} (Edit > Show all that is hidden)"));
    Ok(())
}

/// Shows all that is hidden, and selects it.
pub fn show_all(world: &mut World) -> Result<(), String> {
    let all: Vec<Entity> = world.resource::<RenderState>().inputs.hidden.entities().collect();
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
