//! A spot light that is aimed at what is seen at a place of the image.

use crate::frame::edit::spot;
use crate::scene::{LightKind, Placement, light_of, put_light};
use bevy_ecs::prelude::{Entity, World};

/// - `at`: fractions of the image, from its upper left corner.
///
/// # Errors
/// If the entity is no spot light, or nothing is seen there.
pub fn aim(world: &mut World, entity: Entity, at: [f64; 2]) -> Result<(), String> {
    let target = spot::surface_at(world, at).ok_or("nothing is there to aim a light at")?;
    let (Some(LightKind::Spot(light)), Some(placement)) = (light_of(world, entity), world.get::<Placement>(entity))
    else {
        return Err("only spot lights can be aimed".to_owned());
    };
    // In object space: the placement rotates it.
    let way = placement.affine().matrix3.inverse() * (target - placement.translation);
    let direction = way.try_normalize().ok_or("the light is where it is to be aimed at")?;
    put_light(world, entity, LightKind::Spot(crate::scene::SpotLight { direction, ..light }));
    Ok(())
}
