//! Lights that are not objects: a component for each kind; of several on one entity the first counts.

use crate::format::light::{DirectionalLight, LightKind, PointLight, SpotLight};
use bevy_ecs::prelude::{Entity, Or, With, World};

/// The components of a light, in a query.
pub(crate) type LightParts =
    (Option<&'static PointLight>, Option<&'static SpotLight>, Option<&'static DirectionalLight>);

/// Matches lights that are not objects.
pub type WithLight = Or<(With<PointLight>, With<SpotLight>, With<DirectionalLight>)>;

/// The light of an entity; `None` if it has none.
pub fn light_of(world: &World, entity: Entity) -> Option<LightKind> {
    LightKind::first((world.get(entity), world.get(entity), world.get(entity)))
}

/// Gives an entity this light and removes all others.
pub fn put_light(world: &mut World, entity: Entity, light: LightKind) {
    if light_of(world, entity) == Some(light) {
        return;
    }
    let Ok(mut entity) = world.get_entity_mut(entity) else { return };
    entity.remove::<(PointLight, SpotLight, DirectionalLight)>();
    match light {
        LightKind::Point(light) => drop(entity.insert(light)),
        LightKind::Spot(light) => drop(entity.insert(light)),
        LightKind::Directional(light) => drop(entity.insert(light)),
    }
}
