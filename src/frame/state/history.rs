//! Undo and redo: past states of the world.
//!
//! Changes need not be announced. When a frame has touched anything, the scene is read and compared with its previous
//! state; a difference becomes a step. So commands, panels and user systems can all be undone. A continuous drag
//! ([`crate::frame::Edit::Begin`] to [`crate::frame::Edit::End`]) is one step, and so is camera motion between two edits, or a
//! change of the exposure. Render settings, such as the integrator, are not part of the scene, so undo keeps them.
//!
//! States share equal entities, and meshes and images are shared anyway.

use crate::frame::core::rig::Rig;
use crate::frame::state::resources::Clock;
use crate::frame::state::selection::Selection;
use crate::scene::world::entity_state::{EntityState, SceneChanges, put};
use crate::scene::{
    Animation, CameraInput, DisplaySettings, Lens, Linear, Moment, Ordinal, Placement, Projection, SceneEnvironment,
    SceneInputs, Shape, SurfaceMaterial, View, WithLight,
};
use bevy_ecs::prelude::{DetectChanges, Entity, Local, Mut, Or, Res, ResMut, Resource, With, World};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// Everything that can be undone.
#[derive(Clone, Debug, Default, PartialEq)]
struct State {
    entities: Arc<BTreeMap<Entity, Arc<EntityState>>>,
    environment: Option<SceneEnvironment>,
    camera: Option<(Entity, Rig)>,
    display: DisplaySettings,
    moment: Option<Moment>,
    animation: AnimationKeys,
}

impl State {
    fn content(&self) -> Content {
        let Self { entities, environment, animation, .. } = self.clone();
        Content { entities, environment, animation }
    }
}

/// The animation. It may be large, so a new one is made only for another value, and is compared by address.
#[derive(Clone, Debug, Default)]
struct AnimationKeys(Option<Arc<Animation>>);

impl PartialEq for AnimationKeys {
    fn eq(&self, other: &Self) -> bool {
        self.0.as_ref().map(Arc::as_ptr) == other.0.as_ref().map(Arc::as_ptr)
    }
}

impl AnimationKeys {
    /// That of a world; `known` if it has not changed.
    fn of(world: &World, known: &Self) -> Self {
        match (world.get_resource::<Animation>(), &known.0) {
            (Some(now), Some(old)) if *now == **old => known.clone(),
            (now, _) => Self(now.cloned().map(Arc::new)),
        }
    }

    /// Whether a scene file would have the same keys; the camera for properties without tracks is part of the view.
    fn is_same_content(&self, other: &Self) -> bool {
        match (&self.0, &other.0) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b) || a.has_same_keys(b),
            (a, b) => a.is_none() && b.is_none(),
        }
    }
}

/// A state that can be restored, and the description of the change.
#[derive(Clone, Debug)]
struct UndoStep {
    before: State,
    /// The selection at that time.
    selected: Vec<Entity>,
    label: String,
    /// Consecutive steps with the same key are merged.
    merge: Option<String>,
    /// When it was last added to.
    last: Duration,
    /// The state at which the time of the animation had been set.
    at_moment: State,
}

/// The part of a state that a scene file holds, except view and display settings.
#[derive(Clone, Debug, Default)]
pub(crate) struct Content {
    entities: Arc<BTreeMap<Entity, Arc<EntityState>>>,
    environment: Option<SceneEnvironment>,
    animation: AnimationKeys,
}

impl Content {
    fn is_same(&self, other: &Self) -> bool {
        let same_entities = Arc::ptr_eq(&self.entities, &other.entities) || self.entities == other.entities;
        same_entities && self.environment == other.environment && self.animation.is_same_content(&other.animation)
    }
}

/// The steps that can be undone and redone, and whether the scene has unsaved changes.
#[derive(Resource, Default)]
pub struct History {
    now: Option<State>,
    /// The state when the time of the animation was set, or its last keys.
    at_moment: State,
    /// The state that was opened or saved last.
    clean: Option<Content>,
    unsaved: bool,
    /// The selection at the time of `now`.
    selected: Vec<Entity>,
    undo: Vec<UndoStep>,
    redo: Vec<UndoStep>,
    /// Increases with every change.
    revision: u64,
    /// Set during a continuous change: the entities at its beginning, and whether it has a step yet.
    begun: Option<(Arc<BTreeMap<Entity, Arc<EntityState>>>, bool)>,
    /// Whether anything was touched; otherwise the scene is not read.
    touched: bool,
    camera_touched: bool,
}

impl History {
    const MAX_STEPS: usize = 500;
    /// After a longer pause, what goes on is a step of its own.
    const PAUSE: Duration = Duration::from_secs(2);

    /// Label of the next undo.
    pub fn undo_label(&self) -> Option<&str> {
        self.undo.last().map(|step| step.label.as_str())
    }

    /// Label of the next redo.
    pub fn redo_label(&self) -> Option<&str> {
        self.redo.last().map(|step| step.label.as_str())
    }

    /// Starts a step that ends with [`Self::end`].
    pub fn begin(world: &mut World) {
        Self::remember_now(world);
        let mut history = world.resource_mut::<Self>();
        let entities = history.now.as_ref().map(|now| now.entities.clone()).unwrap_or_default();
        history.begun = Some((entities, false));
    }

    /// Ends the step of [`Self::begin`].
    pub fn end(world: &mut World) {
        Self::remember_now(world);
        world.resource_mut::<Self>().begun = None;
    }

    /// Ends the step of [`Self::begin`], and restores what was before it.
    pub fn cancel(world: &mut World) {
        Self::remember_now(world);
        let begun = world.resource_mut::<Self>().begun.take();
        if begun.is_some_and(|(_, has_step)| has_step) {
            Self::step_back(world);
            world.resource_mut::<Self>().redo.pop();
        }
    }

    /// Adds a new entity to what was there at the beginning of a continuous change, so that it can be moved in it.
    pub(crate) fn add_to_begin(&mut self, entity: Entity, state: EntityState) {
        if let Some((entities, _)) = &mut self.begun {
            Arc::make_mut(entities).insert(entity, Arc::new(state));
        }
    }

    /// Records changes now instead of at the end of the frame.
    fn remember_now(world: &mut World) {
        let mut history = world.resource_mut::<Self>();
        (history.touched, history.camera_touched) = (true, true);
        remember(world);
    }

    /// Whether the scene differs from its opened and its last saved state; view and display settings do not count.
    pub fn is_unsaved(&self) -> bool {
        self.unsaved
    }

    /// The present content, for [`Self::mark_clean`].
    pub(crate) fn content(world: &mut World) -> Content {
        Self::remember_now(world);
        world.resource::<Self>().now.as_ref().map(State::content).unwrap_or_default()
    }

    /// Marks this content as saved.
    pub(crate) fn mark_clean(&mut self, content: Content) {
        self.clean = Some(content);
        self.compare();
    }

    fn compare(&mut self) {
        let Some(now) = &self.now else { return };
        let now = now.content();
        self.unsaved = !now.is_same(self.clean.get_or_insert_with(|| now.clone()));
    }

    /// Whether the world is as it was opened or saved last, without recording how it is.
    pub(crate) fn is_clean_as_it_is(world: &mut World) -> bool {
        let Some(clean) = world.resource::<Self>().clean.clone() else { return true };
        let now = Content {
            entities: read_entities(world, &clean.entities),
            environment: world.get_resource::<SceneEnvironment>().cloned(),
            animation: AnimationKeys::of(world, &clean.animation),
        };
        now.is_same(&clean)
    }

    /// The inputs of an image as they were when the time of the animation was set, or its last keys; what was added since
    /// is as in `now`.
    pub(crate) fn inputs_at_moment(&self, mut now: SceneInputs) -> SceneInputs {
        let state = |entity: Entity| self.at_moment.entities.get(&entity);
        for object in &mut now.objects {
            object.placement = state(object.entity).and_then(|state| state.placement).unwrap_or(object.placement);
        }
        for light in &mut now.lights {
            if let Some(state) = state(light.entity) {
                light.placement = state.placement.unwrap_or(light.placement);
                light.light = state.light().unwrap_or(light.light);
            }
        }
        for material in &mut now.materials {
            if let Some(SurfaceMaterial(old)) = state(material.entity).and_then(|state| state.material.as_ref()) {
                material.material = old.clone();
            }
        }
        if let (Some((entity, Rig { view, projection, lens })), Some(camera)) = (self.at_moment.camera, &mut now.camera)
            && entity == camera.entity
        {
            *camera = CameraInput { entity, view, projection, lens };
        }
        now
    }

    /// Number of changes so far.
    pub fn revision(world: &mut World) -> u64 {
        Self::remember_now(world);
        world.resource::<Self>().revision
    }

    /// Placement of the entity at the beginning of the continuous change.
    pub fn placement_at_begin(&self, entity: Entity) -> Option<Placement> {
        self.begun.as_ref().and_then(|(entities, _)| entities.get(&entity)?.placement)
    }

    /// Removes all steps, because another scene was opened.
    pub fn forget(&mut self) {
        *self = Self { touched: true, camera_touched: true, ..Self::default() };
    }

    /// Undoes the last step.
    pub fn step_back(world: &mut World) -> Option<()> {
        Self::step(world, |history| (&mut history.undo, &mut history.redo), true)
    }

    /// Redoes the step that was undone last.
    pub fn step_on(world: &mut World) -> Option<()> {
        Self::step(world, |history| (&mut history.redo, &mut history.undo), false)
    }

    /// Moves the last step of one list to the other, and restores what was before it.
    ///
    /// - `selects`: whether what was selected at the step is selected again.
    fn step(
        world: &mut World,
        lists: fn(&mut Self) -> (&mut Vec<UndoStep>, &mut Vec<UndoStep>),
        selects: bool,
    ) -> Option<()> {
        Self::remember_now(world);
        let mut history = world.resource_mut::<Self>();
        let step = lists(&mut history).0.pop()?;
        history.revision += 1;
        let now = history.now.replace(step.before.clone())?;
        let at_moment = std::mem::replace(&mut history.at_moment, step.at_moment.clone());
        lists(&mut history).1.push(UndoStep { before: now.clone(), at_moment, ..step.clone() });
        history.begun = None;
        history.compare();
        restore(world, &now, &step.before);
        select_what_came(world, &now, &step.before, if selects { &step.selected } else { &[] });
        Some(())
    }

    /// - `time`: since the session began.
    fn record(&mut self, new: State, time: Duration) {
        let Some(old) = self.now.take() else {
            self.at_moment = new.clone();
            self.now = Some(new);
            return self.compare();
        };
        if old == new {
            self.now = Some(old);
            return;
        }
        self.revision += 1;
        let (label, merge) = what_changed(&old, &new);
        // Merging after an undo would lose the step that can be redone.
        let is_same = |step: &UndoStep| step.merge == merge && time.saturating_sub(step.last) < Self::PAUSE;
        let goes_on = match &mut self.begun {
            Some((_, has_step)) => std::mem::replace(has_step, true),
            None => merge.is_some() && self.redo.is_empty() && self.undo.last().is_some_and(is_same),
        };
        if let Some(step) = self.undo.last_mut().filter(|_| goes_on) {
            step.last = time;
        } else if !goes_on {
            let (selected, at_moment) = (self.selected.clone(), self.at_moment.clone());
            self.undo.push(UndoStep { before: old.clone(), selected, label, merge, last: time, at_moment });
            if self.undo.len() > Self::MAX_STEPS {
                self.undo.remove(0);
            }
        }
        if old.moment != new.moment || old.animation != new.animation {
            self.at_moment = new.clone();
        }
        self.redo.clear();
        self.now = Some(new);
        self.compare();
    }
}

/// Records that something may have changed, without reading the scene.
///
/// Reads change ticks; writes [`History`].
pub fn notice(
    mut changes: SceneChanges,
    environment: Option<Res<SceneEnvironment>>,
    (moment, animation): (Option<Res<Moment>>, Option<Res<Animation>>),
    display: Res<DisplaySettings>,
    (mut had_environment, mut had_animation): (Local<bool>, Local<bool>),
    mut history: ResMut<History>,
) {
    let environment_changed = environment.as_ref().is_some_and(|environment| environment.is_changed())
        || std::mem::replace(&mut *had_environment, environment.is_some()) != environment.is_some();
    let moment_changed = moment.is_some_and(|moment| moment.is_changed());
    let animation_changed = animation.as_ref().is_some_and(|animation| animation.is_changed())
        || std::mem::replace(&mut *had_animation, animation.is_some()) != animation.is_some();
    history.touched |= changes.of_content() || environment_changed || moment_changed || animation_changed;
    history.camera_touched |= changes.of_cameras() || display.is_changed();
}

/// Reads what was touched, and stores a step if it has changed.
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
    let environment = world.get_resource::<SceneEnvironment>().cloned();
    let animation = if touched { AnimationKeys::of(world, &old.animation) } else { old.animation };
    let display = world.get_resource::<DisplaySettings>().copied().unwrap_or_default();
    let moment = world.get_resource::<Moment>().copied();
    let state = State { entities, environment, camera, display, moment, animation };
    let now = world.get_resource::<Clock>().map_or(Duration::ZERO, |clock| clock.0);
    world.resource_mut::<History>().record(state, now);
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
        let state = EntityState::of(world, entity);
        match old.get(&entity) {
            Some(known) if **known == state => (entity, known.clone()),
            _ => (entity, Arc::new(state)),
        }
    };
    Arc::new(entities.into_iter().map(read).collect())
}

/// Changes the world from state `now` to state `wanted`. Equal values are not touched.
fn restore(world: &mut World, now: &State, wanted: &State) {
    let nothing = Arc::new(EntityState::default());
    let both = now.entities.keys().chain(wanted.entities.keys());
    let entities: std::collections::BTreeSet<Entity> = both.copied().collect();
    for entity in entities {
        let target = wanted.entities.get(&entity).unwrap_or(&nothing);
        if now.entities.get(&entity).is_some_and(|state| Arc::ptr_eq(state, target)) {
            continue;
        }
        // Despawned entities are not restored: their number may be reused.
        if world.get_entity(entity).is_err() {
            continue;
        }
        target.put(world, entity);
    }
    if let Some(environment) = &wanted.environment
        && wanted.environment != now.environment
    {
        world.insert_resource(environment.clone());
    }
    if wanted.display != now.display {
        world.insert_resource(wanted.display);
    }
    if let Some(moment) = wanted.moment.filter(|_| wanted.moment != now.moment) {
        world.insert_resource(moment);
    }
    if wanted.animation != now.animation {
        match &wanted.animation.0 {
            Some(animation) => world.insert_resource(Animation::clone(animation)),
            None => drop(world.remove_resource::<Animation>()),
        }
    }
    if let Some((entity, rig)) = wanted.camera.filter(|_| wanted.camera != now.camera) {
        put(world, entity, Some(&rig.view));
        put(world, entity, Some(&rig.projection));
        put(world, entity, Some(&rig.lens));
    }
}

/// Selects entities that were added or shown, as after their first addition. If entities were only removed or hidden,
/// restores the selection `selected`.
fn select_what_came(world: &mut World, now: &State, wanted: &State, selected: &[Entity]) {
    let is_there = |state: &State, entity: &Entity| {
        state.entities.get(entity).is_some_and(|state| state.is_thing() && state.hidden.is_none())
    };
    let missing = |of: &State, other: &State| -> Vec<Entity> {
        of.entities.keys().copied().filter(|entity| is_there(of, entity) && !is_there(other, entity)).collect()
    };
    let came = missing(wanted, now);
    if !came.is_empty() {
        world.resource_mut::<Selection>().0 = came;
    } else if !selected.is_empty() && !missing(now, wanted).is_empty() {
        world.resource_mut::<Selection>().0 = selected.to_vec();
    }
}

/// Returns a label of the change, and the key by which it merges with following steps.
fn what_changed(old: &State, new: &State) -> (String, Option<String>) {
    if old.moment != new.moment {
        return ("time of the animation".to_owned(), Some("time of the animation".to_owned()));
    }
    if old.animation != new.animation {
        let tracks = |state: &State| state.animation.0.as_ref().map(|it| it.tracks.clone()).unwrap_or_default();
        let label = if tracks(old) == tracks(new) { "settings of the animation" } else { "keys of the animation" };
        return (label.to_owned(), None);
    }
    if !Arc::ptr_eq(&old.entities, &new.entities) && old.entities != new.entities {
        return what_changed_in_entities(&old.entities, &new.entities);
    }
    let without_lens = |state: &State| state.camera.map(|(entity, rig)| (entity, rig.view, rig.projection));
    let (label, goes_on) = match () {
        () if old.environment != new.environment => ("environment", false),
        () if old.display.0.tone_curve != new.display.0.tone_curve => ("tone curve", false),
        () if old.display != new.display => ("exposure", true),
        () if without_lens(old) == without_lens(new) => ("lens", true),
        () => ("camera", true),
    };
    (label.to_owned(), goes_on.then(|| label.to_owned()))
}

/// What was done to a placement.
fn verb(before: Option<Placement>, after: Option<Placement>) -> &'static str {
    let linear = |placement: Option<Placement>| placement.unwrap_or_default().linear;
    match (linear(before), linear(after)) {
        (before, after) if before == after => "move",
        (Linear::Turned { scale: before, .. }, Linear::Turned { scale: after, .. }) if before != after => "scale",
        (_, Linear::Matrix(_)) => "transform",
        _ => "turn",
    }
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
        let is_object = |state: &&Arc<EntityState>| state.is_thing();
        let (before, after) = (old.get(entity), new.get(entity));
        let what = match (before, after) {
            (Some(a), Some(b)) if a == b => continue,
            // A new object and its new material are one change.
            (None, Some(b)) if !is_object(&b) && !label.is_empty() => continue,
            (None, Some(b)) => format!("add {}", name(b)),
            (Some(a), None) => format!("delete {}", name(a)),
            (a, b) => {
                let (a, b) = (a.map_or(&nothing, |a| &**a), b.map_or(&nothing, |b| &**b));
                let label = name(b);
                if a.shape != b.shape && matches!(b.shape, Some(Shape::Mesh(_))) {
                    merge = Some(format!("mesh {entity}"));
                    format!("mesh of {label}")
                } else if a.hidden != b.hidden {
                    format!("{} {label}", if b.hidden.is_some() { "hide" } else { "show" })
                } else if a.placement != b.placement {
                    format!("{} {label}", verb(a.placement, b.placement))
                } else if a.material != b.material {
                    format!("material {label}")
                } else if a.slots != b.slots {
                    format!("material of {label}")
                } else if a.light() != b.light() {
                    format!("light {label}")
                } else if a.shape != b.shape {
                    format!("shape of {label}")
                } else {
                    format!("name of {label}")
                }
            }
        };
        n += 1;
        // The label of an object takes precedence over that of its material.
        if label.is_empty() || after.as_ref().is_some_and(is_object) && label.starts_with("add") && n == 2 {
            label = what;
        }
    }
    (label, merge.filter(|_| n == 1))
}
