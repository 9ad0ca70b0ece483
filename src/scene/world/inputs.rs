//! All data that the image depends on, copied from the world in a fixed order.

use crate::format::bad_value::BadValue;
use crate::format::light::LightKind;
use crate::format::placement::Placement;
use crate::format::view::{Lens, Projection, View};
use crate::scene::world::components::{
    Hidden, Material, MaterialSlots, Ordinal, SceneEnvironment, Shape, SurfaceMaterial,
};
use crate::scene::world::lights::{LightParts, LightTexture, WithLight};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{Entity, Has, Query, Res, World};
use bevy_ecs::system::{SystemParam, SystemState};
use std::collections::HashSet;

/// All inputs of a snapshot. Cheap to clone: meshes, groups of spheres and images are shared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneInputs {
    /// All objects that are not hidden.
    pub objects: Vec<ObjectInput>,
    /// The materials that objects use, directly or in a blend; also those of hidden ones.
    pub materials: Vec<MaterialInput>,
    /// All lights that are not objects and not hidden.
    pub lights: Vec<LightInput>,
    /// What is left out of the image.
    pub hidden: HiddenInputs,
    /// The first camera.
    pub camera: Option<CameraInput>,
    /// The environment and the absorption of the air.
    pub environment: SceneEnvironment,
}

/// Objects and lights that are [`Hidden`], each with its rank among all of its kind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HiddenInputs {
    /// Objects, in order.
    pub objects: Vec<(usize, ObjectInput)>,
    /// Lights that are not objects, in order.
    pub lights: Vec<(usize, LightInput)>,
}

impl HiddenInputs {
    /// The entities of all of it: objects, then lights.
    pub fn entities(&self) -> impl Iterator<Item = Entity> + '_ {
        let objects = self.objects.iter().map(|(_, object)| object.entity);
        objects.chain(self.lights.iter().map(|(_, light)| light.entity))
    }
}

/// The data of an object that the image depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectInput {
    /// The entity in the world.
    pub entity: Entity,
    /// Its `Name`, if it has one.
    pub name: Option<String>,
    /// Its surface in object space.
    pub shape: Shape,
    /// From object space to the world.
    pub placement: Placement,
    /// Its material entities, by slot.
    pub slots: Vec<Entity>,
}

/// The data of a material that the image depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialInput {
    /// The entity in the world.
    pub entity: Entity,
    /// Its `Name`, if it has one.
    pub name: Option<String>,
    /// The material itself.
    pub material: Material,
}

/// The data of a light that the image depends on; for lights that are not objects.
#[derive(Clone, Debug, PartialEq)]
pub struct LightInput {
    /// The entity in the world.
    pub entity: Entity,
    /// Its `Name`, if it has one.
    pub name: Option<String>,
    /// Kind and parameters.
    pub light: LightKind,
    /// The image that it projects.
    pub texture: Option<LightTexture>,
    /// Its position and orientation in the world.
    pub placement: Placement,
}

/// The data of a camera that the image depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraInput {
    /// The entity in the world.
    pub entity: Entity,
    /// Its position and orientation.
    pub view: View,
    /// Its field of view.
    pub projection: Projection,
    /// Its aperture and focus.
    pub lens: Lens,
}

impl CameraInput {
    /// Whether an image by `other` is the same.
    pub fn shows_the_same(&self, other: &Self) -> bool {
        self.entity == other.entity
            && self.view.shows_the_same(&other.view)
            && self.projection.shows_the_same(&other.projection)
            && self.lens.shows_the_same(&other.lens)
    }

    /// # Errors
    /// If one of its components is invalid.
    pub fn check(&self) -> Result<(), BadValue> {
        self.view.check()?;
        self.projection.check()?;
        self.lens.check()
    }
}

type LightOfInput = (LightParts, Option<&'static LightTexture>, &'static Placement, Has<Hidden>);

type Ranked<'a, T> = (Entity, Option<&'a Ordinal>, Option<&'a Name>, T);

type ObjectParts = (&'static Shape, &'static Placement, &'static MaterialSlots, Has<Hidden>);

/// Read access to all data that the image depends on.
#[derive(SystemParam)]
pub struct SceneQueries<'w, 's> {
    objects: Query<'w, 's, Ranked<'static, ObjectParts>>,
    materials: Query<'w, 's, Ranked<'static, &'static SurfaceMaterial>>,
    lights: Query<'w, 's, Ranked<'static, LightOfInput>, WithLight>,
    cameras: Query<'w, 's, Ranked<'static, (&'static View, &'static Projection, &'static Lens)>>,
    environment: Option<Res<'w, SceneEnvironment>>,
}

impl SceneQueries<'_, '_> {
    /// Copies all data that the image depends on, in the order of the scene file.
    pub fn collect(&self) -> SceneInputs {
        let text = |name: Option<&Name>| name.map(|name| name.as_str().to_owned());
        let all = in_order(self.objects.iter(), |entity, name, (shape, placement, slots, is_hidden)| {
            let (name, shape, slots) = (text(name), shape.clone(), slots.0.clone());
            (is_hidden, ObjectInput { entity, name, shape, placement: *placement, slots })
        });
        let used = self.used_materials(all.iter().map(|(_, object)| object));
        let (objects, hidden_objects) = apart(all);
        let (lights, hidden_lights) =
            apart(in_order(self.lights.iter(), |entity, name, (parts, texture, placement, is_hidden)| {
                let light = LightKind::first(parts).expect("the query asks for one of them");
                let (name, texture) = (text(name), texture.cloned());
                (is_hidden, LightInput { entity, name, light, texture, placement: *placement })
            }));
        let materials = self.materials.iter().filter(|(entity, ..)| used.contains(entity));
        SceneInputs {
            materials: in_order(materials, |entity, name, material| MaterialInput {
                entity,
                name: text(name),
                material: material.0.clone(),
            }),
            objects,
            lights,
            hidden: HiddenInputs { objects: hidden_objects, lights: hidden_lights },
            camera: self.cameras.iter().min_by_key(|(entity, rank, ..)| order(*rank, *entity)).map(
                |(entity, _, _, (view, projection, lens))| CameraInput {
                    entity,
                    view: *view,
                    projection: *projection,
                    lens: *lens,
                },
            ),
            environment: self.environment(),
        }
    }

    /// The environment; the default if the resource is missing.
    pub fn environment(&self) -> SceneEnvironment {
        self.environment.as_deref().cloned().unwrap_or_default()
    }

    /// The materials of the objects, and the parts of their blends.
    fn used_materials<'a>(&self, objects: impl Iterator<Item = &'a ObjectInput>) -> HashSet<Entity> {
        let mut used = HashSet::new();
        let mut open: Vec<Entity> = objects.flat_map(|object| object.slots.iter().copied()).collect();
        while let Some(entity) = open.pop() {
            if used.insert(entity)
                && let Ok((.., SurfaceMaterial(Material::Blend { a, b, .. }))) = self.materials.get(entity)
            {
                open.extend([*a, *b]);
            }
        }
        used
    }
}

impl SceneInputs {
    /// Reads a world outside of a schedule.
    pub fn of(world: &mut World) -> Self {
        SystemState::<SceneQueries>::new(world)
            .get(world)
            .expect("queries of optional things are always valid")
            .collect()
    }

    /// The entities of all objects and lights that are not hidden: objects, then lights.
    pub fn entities(&self) -> impl Iterator<Item = Entity> + '_ {
        self.objects.iter().map(|object| object.entity).chain(self.lights.iter().map(|light| light.entity))
    }

    /// The same with all that is hidden at its place among the others.
    pub fn with_hidden(&self) -> Self {
        Self {
            objects: together(&self.objects, &self.hidden.objects),
            lights: together(&self.lights, &self.hidden.lights),
            hidden: HiddenInputs::default(),
            ..self.clone()
        }
    }
}

/// What is shown, and what is hidden with its rank among all.
fn apart<T>(all: Vec<(bool, T)>) -> (Vec<T>, Vec<(usize, T)>) {
    let (mut shown, mut hidden) = (Vec::new(), Vec::new());
    for (rank, (is_hidden, item)) in all.into_iter().enumerate() {
        if is_hidden { hidden.push((rank, item)) } else { shown.push(item) }
    }
    (shown, hidden)
}

/// The inverse of [`apart`].
fn together<T: Clone>(shown: &[T], hidden: &[(usize, T)]) -> Vec<T> {
    let mut shown = shown.iter().cloned();
    let mut all = Vec::new();
    for (rank, item) in hidden {
        all.extend(shown.by_ref().take(rank - all.len()));
        all.push(item.clone());
    }
    all.extend(shown);
    all
}

/// By the order in the file, then by entity: deterministic across processes.
fn order(rank: Option<&Ordinal>, entity: Entity) -> (u32, Entity) {
    (rank.map_or(u32::MAX, |rank| rank.0), entity)
}

fn in_order<'a, T, U>(
    items: impl Iterator<Item = Ranked<'a, T>>,
    make: impl Fn(Entity, Option<&'a Name>, T) -> U,
) -> Vec<U> {
    let mut ranked: Vec<_> =
        items.map(|(entity, rank, name, item)| (order(rank, entity), make(entity, name, item))).collect();
    ranked.sort_by_key(|(key, _)| *key);
    ranked.into_iter().map(|(_, item)| item).collect()
}
