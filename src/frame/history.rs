//! Undo and redo: what the world was, step by step.
//!
//! Nobody has to tell what they are about to change. When a frame has touched anything, the scene is read and compared
//! with what it was; a difference becomes a step. So commands, panels and a user's own systems can all be undone
//! alike. A drag that goes on ([`super::Edit::Begin`] to [`super::Edit::End`]) is one step, and so is a walk of the
//! camera between two edits.
//!
//! States share what is equal between them, entity by entity, and meshes and pictures are shared anyway.

use super::rig::Rig;
use super::selection::Selection;
use crate::render::{Display, RenderSettings};
use crate::scene::{
    DirectionalLight, DisplaySettings, Lens, LightKind, MaterialSlots, MeshOrigin, Ordinal, Placement, PointLight,
    Projection, Rendering, SceneEnvironment, Shape, SpotLight, SurfaceMaterial, View, WithLight,
};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::{
    Changed, Component, DetectChanges, Entity, Local, Mut, Or, Query, RemovedComponents, Res, ResMut, Resource, With,
    World,
};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Everything of one entity that makes it a part of the scene.
#[derive(Clone, Debug, Default, PartialEq)]
struct EntityState {
    name: Option<Name>,
    ordinal: Option<Ordinal>,
    shape: Option<Shape>,
    placement: Option<Placement>,
    slots: Option<MaterialSlots>,
    material: Option<SurfaceMaterial>,
    light: Option<LightKind>,
    origin: Option<MeshOrigin>,
}

/// All that can be undone.
#[derive(Clone, Debug, Default, PartialEq)]
struct State {
    entities: Arc<BTreeMap<Entity, Arc<EntityState>>>,
    environment: Option<SceneEnvironment>,
    settings: Option<RenderSettings>,
    display: Option<Display>,
    camera: Option<(Entity, Rig)>,
}

impl State {
    fn content(&self) -> Content {
        Content { entities: self.entities.clone(), environment: self.environment.clone() }
    }
}

/// A state that can be gone back to, and what was done in it.
#[derive(Clone, Debug)]
struct UndoStep {
    before: State,
    /// What was selected then.
    selected: Vec<Entity>,
    label: String,
    /// Steps of one kind that follow each other are one.
    merge: Option<String>,
}

/// What a scene file holds of a state beside the view and how it is shown.
#[derive(Clone, Debug, Default)]
pub(super) struct Content {
    entities: Arc<BTreeMap<Entity, Arc<EntityState>>>,
    environment: Option<SceneEnvironment>,
}

/// The steps that can be undone and redone, and whether the scene has changes that are not saved.
#[derive(Resource, Default)]
pub struct History {
    now: Option<State>,
    /// What was opened or saved last.
    clean: Option<Content>,
    unsaved: bool,
    /// What was selected when that was read.
    selected: Vec<Entity>,
    undo: Vec<UndoStep>,
    redo: Vec<UndoStep>,
    /// Grows with every change.
    revision: u64,
    /// A change is under way; what the entities were when it began, and whether it has a step yet.
    begun: Option<(Arc<BTreeMap<Entity, Arc<EntityState>>>, bool)>,
    /// Nothing is read while nothing has been touched.
    touched: bool,
    camera_touched: bool,
}

impl History {
    const MAX_STEPS: usize = 500;

    /// What the next undo takes back.
    pub fn undo_label(&self) -> Option<&str> {
        self.undo.last().map(|step| step.label.as_str())
    }

    /// What the next redo does again.
    pub fn redo_label(&self) -> Option<&str> {
        self.redo.last().map(|step| step.label.as_str())
    }

    /// Everything until [`Self::end`] is one step.
    pub fn begin(world: &mut World) {
        Self::remember_now(world);
        let mut history = world.resource_mut::<Self>();
        let entities = history.now.as_ref().map(|now| now.entities.clone()).unwrap_or_default();
        history.begun = Some((entities, false));
    }

    /// Ends the step that [`Self::begin`] began.
    pub fn end(world: &mut World) {
        Self::remember_now(world);
        world.resource_mut::<Self>().begun = None;
    }

    /// Without waiting for the end of the frame.
    fn remember_now(world: &mut World) {
        let mut history = world.resource_mut::<Self>();
        (history.touched, history.camera_touched) = (true, true);
        remember(world);
    }

    /// Whether the scene is neither what was opened nor what was saved last; the view and how it is shown do not count.
    pub fn is_unsaved(&self) -> bool {
        self.unsaved
    }

    /// For [`Self::mark_clean`].
    pub(super) fn content(world: &mut World) -> Content {
        Self::remember_now(world);
        world.resource::<Self>().now.as_ref().map(State::content).unwrap_or_default()
    }

    /// This is on disk now.
    pub(super) fn mark_clean(&mut self, content: Content) {
        self.clean = Some(content);
        self.compare();
    }

    fn compare(&mut self) {
        let Some(now) = &self.now else { return };
        let clean = self.clean.get_or_insert_with(|| now.content());
        let same = Arc::ptr_eq(&now.entities, &clean.entities) || now.entities == clean.entities;
        self.unsaved = !same || now.environment != clean.environment;
    }

    /// How many changes there have been.
    pub fn revision(world: &mut World) -> u64 {
        Self::remember_now(world);
        world.resource::<Self>().revision
    }

    /// Where the entity was when the change that is under way began.
    pub fn placement_at_begin(&self, entity: Entity) -> Option<Placement> {
        self.begun.as_ref().and_then(|(entities, _)| entities.get(&entity)?.placement)
    }

    /// Another scene is open: there is nothing to go back to.
    pub fn forget(&mut self) {
        *self = Self { touched: true, camera_touched: true, ..Self::default() };
    }

    /// Makes the world what it was before the last step.
    pub fn step_back(world: &mut World) -> Option<()> {
        Self::remember_now(world);
        let mut history = world.resource_mut::<Self>();
        let step = history.undo.pop()?;
        history.revision += 1;
        let now = history.now.replace(step.before.clone())?;
        history.redo.push(UndoStep { before: now.clone(), ..step.clone() });
        history.begun = None;
        history.compare();
        restore(world, &now, &step.before);
        select_what_came(world, &now, &step.before, &step.selected);
        Some(())
    }

    /// Does again what was undone last.
    pub fn step_on(world: &mut World) -> Option<()> {
        Self::remember_now(world);
        let mut history = world.resource_mut::<Self>();
        let step = history.redo.pop()?;
        history.revision += 1;
        let now = history.now.replace(step.before.clone())?;
        history.undo.push(UndoStep { before: now.clone(), ..step.clone() });
        history.begun = None;
        history.compare();
        restore(world, &now, &step.before);
        select_what_came(world, &now, &step.before, &[]);
        Some(())
    }

    fn record(&mut self, new: State) {
        let Some(old) = self.now.take() else {
            self.now = Some(new);
            return self.compare();
        };
        if old == new {
            self.now = Some(old);
            return;
        }
        self.revision += 1;
        let (label, merge) = what_changed(&old, &new);
        // Merging over a redo would lose where it came from.
        let goes_on = match &mut self.begun {
            Some((_, has_step)) => std::mem::replace(has_step, true),
            None => merge.is_some() && self.redo.is_empty() && self.undo.last().is_some_and(|last| last.merge == merge),
        };
        if !goes_on {
            self.undo.push(UndoStep { before: old, selected: self.selected.clone(), label, merge });
            if self.undo.len() > Self::MAX_STEPS {
                self.undo.remove(0);
            }
        }
        self.redo.clear();
        self.now = Some(new);
        self.compare();
    }
}

type UndoParts = Or<(
    Changed<Name>,
    Changed<Ordinal>,
    Changed<Shape>,
    Changed<Placement>,
    Changed<MaterialSlots>,
    Changed<SurfaceMaterial>,
    Changed<PointLight>,
    Changed<SpotLight>,
    Changed<DirectionalLight>,
    Changed<MeshOrigin>,
)>;

/// Notes that there may be something to remember, without reading the scene.
///
/// Reads change ticks; writes [`History`].
#[allow(clippy::too_many_arguments, clippy::type_complexity)] // A system says what it reads.
pub fn notice(
    parts: Query<(), UndoParts>,
    camera: Query<(), Or<(Changed<View>, Changed<Projection>, Changed<Lens>)>>,
    mut shapes: RemovedComponents<Shape>,
    mut materials: RemovedComponents<SurfaceMaterial>,
    mut point_lights: RemovedComponents<PointLight>,
    mut spot_lights: RemovedComponents<SpotLight>,
    mut directional_lights: RemovedComponents<DirectionalLight>,
    mut names: RemovedComponents<Name>,
    environment: Option<Res<SceneEnvironment>>,
    rendering: Option<Res<Rendering>>,
    developing: Option<Res<DisplaySettings>>,
    mut had_environment: Local<bool>,
    mut history: ResMut<History>,
) {
    let lights = point_lights.read().count() + spot_lights.read().count() + directional_lights.read().count();
    let removed = shapes.read().count() + materials.read().count() + lights + names.read().count();
    let environment_changed = environment.as_ref().is_some_and(|environment| environment.is_changed())
        || std::mem::replace(&mut *had_environment, environment.is_some()) != environment.is_some();
    let settings_changed = rendering.is_some_and(|rendering| rendering.is_changed())
        || developing.is_some_and(|developing| developing.is_changed());
    if removed > 0 || environment_changed || !parts.is_empty() {
        history.touched = true;
    }
    if settings_changed || !camera.is_empty() {
        history.camera_touched = true;
    }
}

/// Reads what was touched, and keeps a step if it is not as it was.
///
/// Reads the scene; writes [`History`].
pub fn remember(world: &mut World) {
    let mut history = world.resource_mut::<History>();
    let (touched, camera_touched) = (std::mem::take(&mut history.touched), std::mem::take(&mut history.camera_touched));
    if !touched && !camera_touched && history.now.is_some() {
        return remember_selection(world);
    }
    let old = history.now.clone().unwrap_or_default();
    let entities = if touched || old.entities.is_empty() { read_entities(world, &old.entities) } else { old.entities };
    let camera = world
        .query::<(Entity, Option<&Ordinal>, &View, &Projection, &Lens)>()
        .iter(world)
        .min_by_key(|(entity, ordinal, ..)| (ordinal.map_or(u32::MAX, |ordinal| ordinal.0), *entity))
        .map(|(entity, _, view, projection, lens)| (entity, Rig { view: *view, projection: *projection, lens: *lens }));
    let state = State {
        entities,
        environment: world.get_resource::<SceneEnvironment>().cloned(),
        settings: world.get_resource::<Rendering>().map(|rendering| rendering.0),
        display: world.get_resource::<DisplaySettings>().map(|developing| developing.0),
        camera,
    };
    world.resource_mut::<History>().record(state);
    remember_selection(world);
}

fn remember_selection(world: &mut World) {
    world.resource_scope(|world, mut history: Mut<History>| {
        let selected = &world.resource::<Selection>().0;
        if history.selected != *selected {
            history.selected.clone_from(selected);
        }
    });
}

fn read_entities(
    world: &mut World,
    old: &Arc<BTreeMap<Entity, Arc<EntityState>>>,
) -> Arc<BTreeMap<Entity, Arc<EntityState>>> {
    type UndoPart = Or<(With<Shape>, With<SurfaceMaterial>, WithLight)>;
    let entities: Vec<Entity> = world.query_filtered::<Entity, UndoPart>().iter(world).collect();
    let read = |entity: Entity| {
        let state = EntityState {
            name: world.get(entity).cloned(),
            ordinal: world.get(entity).copied(),
            shape: world.get(entity).cloned(),
            placement: world.get(entity).copied(),
            slots: world.get(entity).cloned(),
            material: world.get(entity).cloned(),
            light: LightKind::of(world, entity),
            origin: world.get(entity).cloned(),
        };
        match old.get(&entity) {
            Some(known) if **known == state => (entity, known.clone()),
            _ => (entity, Arc::new(state)),
        }
    };
    Arc::new(entities.into_iter().map(read).collect())
}

/// Makes the world `wanted`, which is `now`. Values that are as they should be are not touched.
fn restore(world: &mut World, now: &State, wanted: &State) {
    let nothing = Arc::new(EntityState::default());
    let both = now.entities.keys().chain(wanted.entities.keys());
    let entities: std::collections::BTreeSet<Entity> = both.copied().collect();
    for entity in entities {
        let target = wanted.entities.get(&entity).unwrap_or(&nothing);
        if now.entities.get(&entity).is_some_and(|state| Arc::ptr_eq(state, target)) {
            continue;
        }
        // What code has despawned stays away: its number may be another's by now.
        if world.get_entity(entity).is_err() {
            continue;
        }
        put(world, entity, &target.placement);
        put(world, entity, &target.slots);
        put(world, entity, &target.shape);
        put(world, entity, &target.material);
        LightKind::put(target.light, world, entity);
        put(world, entity, &target.origin);
        put(world, entity, &target.ordinal);
        put(world, entity, &target.name);
    }
    if let Some(environment) = &wanted.environment
        && wanted.environment != now.environment
    {
        world.insert_resource(environment.clone());
    }
    if let Some(settings) = wanted.settings.filter(|_| wanted.settings != now.settings) {
        world.insert_resource(Rendering(settings));
    }
    if let Some(display) = wanted.display.filter(|_| wanted.display != now.display) {
        world.insert_resource(DisplaySettings(display));
    }
    if let Some((entity, rig)) = wanted.camera.filter(|_| wanted.camera != now.camera) {
        put(world, entity, &Some(rig.view));
        put(world, entity, &Some(rig.projection));
        put(world, entity, &Some(rig.lens));
    }
}

/// What has come is selected, as it was when it came first. Where things only went, what was `selected` before is.
fn select_what_came(world: &mut World, now: &State, wanted: &State, selected: &[Entity]) {
    let is_thing = |state: &State, entity: &Entity| {
        state.entities.get(entity).is_some_and(|state| state.shape.is_some() || state.light.is_some())
    };
    let missing = |of: &State, other: &State| -> Vec<Entity> {
        of.entities.keys().copied().filter(|entity| is_thing(of, entity) && !is_thing(other, entity)).collect()
    };
    let came = missing(wanted, now);
    if !came.is_empty() {
        world.resource_mut::<Selection>().0 = came;
    } else if !selected.is_empty() && !missing(now, wanted).is_empty() {
        world.resource_mut::<Selection>().0 = selected.to_vec();
    }
}

fn put<T: Component<Mutability = bevy_ecs::component::Mutable> + Clone + PartialEq>(
    world: &mut World,
    entity: Entity,
    value: &Option<T>,
) {
    let Ok(mut entity) = world.get_entity_mut(entity) else { return };
    match value {
        Some(value) if entity.get::<T>() != Some(value) => drop(entity.insert(value.clone())),
        None if entity.contains::<T>() => drop(entity.remove::<T>()),
        _ => {}
    }
}

/// In words, and by what the step is known as one that goes on.
fn what_changed(old: &State, new: &State) -> (String, Option<String>) {
    if !Arc::ptr_eq(&old.entities, &new.entities) && old.entities != new.entities {
        return what_changed_in_entities(&old.entities, &new.entities);
    }
    let (label, goes_on) = if old.environment != new.environment {
        ("sky", false)
    } else if old.settings != new.settings {
        ("render settings", false)
    } else if old.camera != new.camera {
        ("camera", true)
    } else {
        ("display", true)
    };
    (label.to_owned(), goes_on.then(|| label.to_owned()))
}

fn what_changed_in_entities(
    old: &BTreeMap<Entity, Arc<EntityState>>,
    new: &BTreeMap<Entity, Arc<EntityState>>,
) -> (String, Option<String>) {
    let name = |state: &EntityState| state.name.as_ref().map_or("something".to_owned(), |name| format!("`{name}`"));
    let nothing = EntityState::default();
    let (mut label, mut merge, mut n) = (String::new(), None, 0);
    let both: std::collections::BTreeSet<&Entity> = old.keys().chain(new.keys()).collect();
    for entity in both {
        let is_object = |state: &&Arc<EntityState>| state.shape.is_some() || state.light.is_some();
        let (before, after) = (old.get(entity), new.get(entity));
        let what = match (before, after) {
            (Some(a), Some(b)) if a == b => continue,
            // A new object and its new material are one thing.
            (None, Some(b)) if !is_object(&b) && !label.is_empty() => continue,
            (None, Some(b)) => format!("add {}", name(b)),
            (Some(a), None) => format!("delete {}", name(a)),
            (a, b) => {
                let (a, b) = (a.map_or(&nothing, |a| &**a), b.map_or(&nothing, |b| &**b));
                let label = name(b);
                if a.shape != b.shape && matches!(b.shape, Some(Shape::Mesh(_))) {
                    merge = Some(format!("mesh {entity}"));
                    format!("mesh of {label}")
                } else if a.placement != b.placement {
                    format!("move {label}")
                } else if a.material != b.material {
                    format!("material {label}")
                } else if a.slots != b.slots {
                    format!("material of {label}")
                } else if a.light != b.light {
                    format!("light {label}")
                } else if a.shape != b.shape {
                    format!("shape of {label}")
                } else {
                    format!("name of {label}")
                }
            }
        };
        n += 1;
        // Objects say more than the materials that came with them.
        if label.is_empty() || after.as_ref().is_some_and(is_object) && label.starts_with("add") && n == 2 {
            label = what;
        }
    }
    (label, merge.filter(|_| n == 1))
}
