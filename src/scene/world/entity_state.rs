//! The components of a scene, in one list: what changed, what an entity has, and giving it that.
//!
//! Change detection, undo, copying and deleting follow from the list at the end of this file. A camera is not in it: it
//! is moved without being edited, so its changes are told apart.

use crate::format::light::{DirectionalLight, LightKind, PointLight, SpotLight};
use crate::format::placement::Placement;
use crate::format::view::{Lens, Projection, View};
use crate::scene::world::components::{Hidden, MaterialSlots, MeshOrigin, Ordinal, Shape, SurfaceMaterial};
use crate::scene::world::lights::LightTexture;
use bevy_ecs::component::Mutable;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Changed, Component, Entity, Or, Query, RemovedComponents, World};
use bevy_ecs::system::SystemParam;

/// Gives an entity a component, or takes it away. An equal value is not touched.
pub fn put<T: Component<Mutability = Mutable> + Clone + PartialEq>(
    world: &mut World,
    entity: Entity,
    value: Option<&T>,
) {
    let Ok(mut entity) = world.get_entity_mut(entity) else { return };
    match value {
        Some(value) if entity.get::<T>() != Some(value) => drop(entity.insert(value.clone())),
        None if entity.contains::<T>() => drop(entity.remove::<T>()),
        _ => {}
    }
}

macro_rules! components {
    ($($(#[$doc:meta])* $name:ident: $component:ty,)*) => {
        /// All components of one entity that make it part of a scene.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct EntityState {
            $($(#[$doc])* pub $name: Option<$component>,)*
        }

        impl EntityState {
            /// Reads an entity.
            pub fn of(world: &World, entity: Entity) -> Self {
                Self { $($name: world.get(entity).cloned(),)* }
            }

            /// Gives an entity exactly these components.
            pub fn put(&self, world: &mut World, entity: Entity) {
                $(put(world, entity, self.$name.as_ref());)*
            }
        }

        /// Which components of a scene were changed, added or removed since the system last ran.
        #[derive(SystemParam)]
        pub struct SceneChanges<'w, 's> {
            changed: Query<'w, 's, (), Or<($(Changed<$component>,)*)>>,
            $($name: RemovedComponents<'w, 's, $component>,)*
            camera: Query<'w, 's, (), Or<(Changed<View>, Changed<Projection>, Changed<Lens>)>>,
            views: RemovedComponents<'w, 's, View>,
            projections: RemovedComponents<'w, 's, Projection>,
            lenses: RemovedComponents<'w, 's, Lens>,
        }

        impl SceneChanges<'_, '_> {
            /// Whether there are changes of anything but cameras. Drains the readers of removals, so that each is
            /// reported once.
            pub fn of_content(&mut self) -> bool {
                let removed = 0 $(+ self.$name.read().count())*;
                removed > 0 || !self.changed.is_empty()
            }
        }
    };
}

impl SceneChanges<'_, '_> {
    /// Whether there are changes of cameras; see [`Self::of_content`].
    pub fn of_cameras(&mut self) -> bool {
        let removed = self.views.read().count() + self.projections.read().count() + self.lenses.read().count();
        removed > 0 || !self.camera.is_empty()
    }
}

impl EntityState {
    /// Its light, if it is one that is no object.
    pub fn light(&self) -> Option<LightKind> {
        LightKind::first((self.point_light.as_ref(), self.spot_light.as_ref(), self.directional_light.as_ref()))
    }

    /// Whether it is an object or a light.
    pub fn is_thing(&self) -> bool {
        self.shape.is_some() || self.light().is_some()
    }
}

// Placement and slots come first: a shape would bring defaults of both.
components! {
    /// From object space to the world.
    placement: Placement,
    /// Its materials.
    slots: MaterialSlots,
    /// Its surface.
    shape: Shape,
    /// A material.
    material: SurfaceMaterial,
    /// A light that is no object.
    point_light: PointLight,
    /// A light that is no object.
    spot_light: SpotLight,
    /// A light that is no object.
    directional_light: DirectionalLight,
    /// The image that a light projects.
    light_texture: LightTexture,
    /// Whether it is left out of the image.
    hidden: Hidden,
    /// Where its mesh is from.
    origin: MeshOrigin,
    /// Its rank in the scene file.
    ordinal: Ordinal,
    /// Its name in lists and messages.
    name: Name,
}
