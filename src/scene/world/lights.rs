//! Lights that are not objects: a component for each kind; of several on one entity the first counts.

use crate::format::light::{DirectionalLight, LightKind, PointLight, SpotLight};
use crate::scene::world::components::SurfaceTexture;
use bevy_ecs::prelude::{Component, Entity, Or, With, World};
use std::sync::Arc;

/// The components of a light, in a query.
pub(crate) type LightParts =
    (Option<&'static PointLight>, Option<&'static SpotLight>, Option<&'static DirectionalLight>);

/// The image that a spot light projects.
#[derive(Component, Clone, Debug)]
pub struct LightTexture(pub Arc<SurfaceTexture>);

impl PartialEq for LightTexture {
    /// Textures are equal if they are the same allocation.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

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
