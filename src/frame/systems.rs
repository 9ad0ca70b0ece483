//! The systems of a frame in the order of execution. Each states what it reads and writes.

use crate::frame::adopt::{adopt, adopt_moment};
use crate::frame::core::reset::{Changes, Level, compare, compare_displays, compare_settings};
use crate::frame::core::status::{MessageKind, Picture, Status};
use crate::frame::navigation;
use crate::frame::scene_bounds::{SceneBounds, ground_below};
use crate::frame::state::background::{BackgroundTasks, Finished};
use crate::frame::state::resources::{
    Clock, FrameChanges, Paused, PictureSize, RenderRegion, RenderState, Renderer, ShownMoment, StopAt, Threads,
    ViewMode, WindowHidden,
};
use crate::frame::state::selection::Selection;
use crate::frame::walls::floor_below;
use crate::frame::worker::{Job, Orders};
use crate::kdtree::HitSpace;
use crate::render::RenderSettings;
use crate::scene::hit_spaces::{StaticJob, hit_spaces};
use crate::scene::world::entity_state::SceneChanges;
use crate::scene::{
    Animation, CameraInput, DisplaySettings, Extraction, Moment, Rendering, SceneInputs, SceneQueries, Shape,
    SnapshotPart, Trees, origin_of,
};
use bevy_ecs::prelude::{DetectChanges, Entity, Res, ResMut, World};
use glam::DVec3;
use std::time::Duration;

/// Applies finished background work to the world, for example replaces the scene by one that was loaded.
///
/// Reads [`BackgroundTasks`]; writes entities, the resources of the scene, [`CurrentScene`], [`Status`].
pub fn edit(world: &mut World) {
    let now = world.resource::<Clock>().0;
    for finished in world.resource::<BackgroundTasks>().take() {
        match finished {
            Finished::Mesh(remade) => crate::frame::edit::remesh::take(world, *remade),
            Finished::Picture { purpose, result } => crate::frame::edit::take_picture(world, purpose, result),
            Finished::Trees(trees) => {
                let mut shown = world.resource_mut::<RenderState>();
                let preview = shown.trees.preview().len();
                shown.trees.extend(trees);
                shown.better_trees |= shown.trees.preview().len() < preview;
                shown.waiting = true;
            }
            Finished::Statics(built) => {
                let mut shown = world.resource_mut::<RenderState>();
                shown.trees.take_statics(built);
                shown.builds_statics = false;
                shown.better_trees = true;
                shown.waiting = true;
            }
            Finished::Scene { again: true, result: Ok(scene), .. } => adopt_moment(world, *scene, now),
            Finished::Scene { result: Ok(scene), .. } => adopt(world, *scene, now),
            Finished::Scene { source, result: Err(error), .. } => {
                let mut status = world.resource_mut::<Status>();
                for problem in &error.problems {
                    status.say(now, MessageKind::Error, problem.to_string());
                }
                tracing::debug!("{} cannot be opened", source.title());
            }
        }
    }
}

/// Detects changes and rebuilds the affected part of the snapshot only.
///
/// Reads everything that the image depends on; writes [`RenderState`], [`FrameChanges`], [`SceneBounds`], [`Status`].
#[allow(clippy::too_many_arguments)] // A system says what it reads and writes.
pub fn rebuild(
    mut scene_changes: SceneChanges,
    queries: SceneQueries,
    rendering: Option<Res<Rendering>>,
    time: (Option<Res<Animation>>, Option<Res<Moment>>),
    beside: Res<BackgroundTasks>,
    renderer: Res<Renderer>,
    selection: Option<Res<Selection>>,
    clock: Res<Clock>,
    mut shown: ResMut<RenderState>,
    mut found: ResMut<FrameChanges>,
    mut around: ResMut<SceneBounds>,
    mut status: ResMut<Status>,
) {
    let mut changes = Changes::default();
    let settings = match rendering {
        None => RenderSettings::default(),
        Some(rendering) => match rendering.0.check() {
            Ok(()) => rendering.0,
            // Keeps the previous settings if the new ones are invalid.
            Err(bad) => {
                if rendering.is_changed() {
                    status.say(clock.0, MessageKind::Error, bad.to_string());
                }
                shown.settings
            }
        },
    };
    compare_settings(&shown.settings, &settings, &mut changes);
    shown.settings = settings;
    if let Some(cause) = shown.restart.take() {
        changes.add(Level::Restart, cause);
    }
    if let Some(cause) = shown.adopted.take() {
        changes.add_scene(cause);
    }
    let has_new_keys = time.0.as_ref().is_some_and(|animation| animation.is_changed());
    let (animation, seconds) = (time.0.as_deref(), time.1.map_or(0.0, |moment| moment.0));
    if shown.moment.seconds != seconds {
        let per_frame = animation.map_or(0.0, |animation| animation.fps.recip());
        shown.moment = ShownMoment { seconds, changed_at: Some(clock.0), per_frame, ..shown.moment };
    }
    let exposure = animation.and_then(|animation| animation.open_shutter(seconds));
    let other_exposure = shown.exposure != exposure || has_new_keys && exposure.is_some();
    // Touched values are often equal to the previous ones; only differences count.
    let environment_changed = queries.environment() != shown.inputs.environment;
    if (scene_changes.of_content() | scene_changes.of_cameras())
        || environment_changed
        || std::mem::take(&mut shown.waiting)
        || shown.extraction.is_none()
    {
        let mut inputs = queries.collect();
        if let Some(bad) = inputs.camera.and_then(|camera| camera.check().err()) {
            status.say(clock.0, MessageKind::Error, format!("the camera was not changed: {bad}"));
            inputs.camera = shown.inputs.camera;
        }
        let origin = origin_of(&inputs);
        let same_objects = inputs.objects == shown.inputs.objects
            && shown.extraction.as_ref().is_some_and(|extraction| extraction.origin == origin);
        let waits = !same_objects && builds_missing_trees(&inputs, &mut shown, origin, (&beside, &renderer));
        shown.builds_missing = waits;
        if waits {
            // The old image stays until the trees are built; the camera keeps moving, unless it moves with what they are of.
            let is_animated = shown.moment.of_inputs != seconds && animation.is_some_and(Animation::moves_camera);
            let camera = if is_animated { shown.inputs.camera } else { inputs.camera };
            inputs = SceneInputs { camera, ..shown.inputs.clone() };
        } else {
            shown.moment.of_inputs = seconds;
        }
        let differences = compare(&shown.inputs, &inputs);
        let part = differences.part();
        let structure = differences.0.iter().any(|change| change.level >= Level::TopTree);
        changes.0.extend(differences.0);
        if is_another_list(&shown.inputs, &inputs) {
            shown.revision += 1;
        }
        around.ground = ground_below(&inputs, around.home.view.eye);
        shown.inputs = inputs;
        let RenderState { inputs, extraction, trees, extents, unsettled_since, .. } = &mut *shown;
        let is_elsewhere = extraction.as_ref().is_some_and(|extraction| extraction.origin != origin);
        let rebuilt = match (extraction.as_mut(), part.or(is_elsewhere.then_some(SnapshotPart::Camera))) {
            (Some(extraction), Some(_)) if waits => {
                extraction.follow_camera(inputs);
                structure
            }
            (None, _) => {
                *extraction = Some(Extraction::new(inputs, trees));
                true
            }
            (Some(extraction), Some(part)) => {
                if extraction.update(part, inputs, trees) {
                    changes.add(Level::TopTree, "origin followed the camera");
                }
                structure
            }
            (Some(_), None) => false,
        };
        if let Some(extraction) = extraction {
            extraction.expose(animation, seconds, inputs, trees);
        }
        if rebuilt {
            trees.keep_used(inputs);
            *unsettled_since = waits_for_rest(inputs, trees, origin).then_some(clock.0);
            around.extent = extents.extent(inputs);
            around.corners = extents.corners(inputs);
            around.floor = extraction.as_ref().and_then(|scene| floor_below(scene, &around.home.view));
            for problem in extraction.iter().flat_map(|extraction| &extraction.problems) {
                status.say(clock.0, MessageKind::Warning, problem.clone());
            }
        }
    }
    if other_exposure {
        shown.exposure = exposure;
        if !changes.restarts() {
            changes.add(Level::Restart, "shutter");
        }
    }
    if other_exposure && let RenderState { inputs, extraction: Some(extraction), trees, .. } = &mut *shown {
        extraction.expose(animation, seconds, inputs, trees);
    }
    if std::mem::take(&mut shown.better_trees)
        && let RenderState { inputs, extraction: Some(extraction), trees, generation, unsettled_since, .. } =
            &mut *shown
    {
        // The same hits, found faster: no sample is lost, and no restart is reported, unless a large mesh has come to rest.
        // After a restart it comes with the job.
        if !extraction.take_trees(inputs, trees) {
            changes.add(Level::Restart, "meshes came to rest");
            // Where one has got a tree of its own meanwhile, it is still to be shared.
            *unsettled_since = waits_for_rest(inputs, trees, extraction.origin).then_some(clock.0);
        }
        extraction.expose(animation, seconds, inputs, trees);
        if !changes.restarts() {
            renderer.0.set_prepared(*generation, extraction.prepared.clone());
        }
    }
    let selected = selection.as_ref().map_or(&[][..], |selection| &selection.0);
    prepare_moves(&mut shown, selected, &beside, &renderer);
    improve_trees(&mut shown, &beside, &renderer, clock.0);
    share_trees(&mut shown, &beside, &renderer, clock.0);
    found.0 = changes;
}

/// Whether lists of the scene have changed, which is false if only the camera has moved. Touched values that look equal
/// here may be a material that nothing uses.
fn is_another_list(old: &SceneInputs, new: &SceneInputs) -> bool {
    let as_before = old.objects == new.objects && old.materials == new.materials && old.lights == new.lights;
    !as_before || old.camera == new.camera
}

/// Starts building the final trees of those that have preview trees so far, unless an animation is about to replace them.
fn improve_trees(shown: &mut RenderState, beside: &BackgroundTasks, renderer: &Renderer, now: Duration) {
    if shown.next_improving().is_some_and(|then| now < then) {
        return;
    }
    shown.moment.changed_at = None;
    let preview = shown.trees.preview();
    shown.improving.retain(|shape| preview.contains(shape));
    let new: Vec<Shape> = preview.into_iter().filter(|shape| !shown.improving.contains(shape)).collect();
    if !new.is_empty() {
        shown.improving.extend(new.iter().cloned());
        beside.build(new, shown.trees.clone(), false, renderer.0.pool());
    }
}

/// Starts building the own trees of selected meshes, which they need once they are moved.
fn prepare_moves(shown: &mut RenderState, selected: &[Entity], beside: &BackgroundTasks, renderer: &Renderer) {
    let RenderState { inputs, trees, prepared_moves, .. } = shown;
    prepared_moves.retain(|shape| !trees.is_built(shape));
    let chosen = inputs.objects.iter().filter(|object| selected.contains(&object.entity)).map(|object| &object.shape);
    let is_new = |shape: &&Shape| trees.has(shape) && !trees.is_built(shape) && !prepared_moves.contains(shape);
    let new: Vec<Shape> = chosen.filter(is_new).cloned().collect();
    if !new.is_empty() {
        prepared_moves.extend(new.iter().cloned());
        beside.build(new, trees.clone(), true, renderer.0.pool());
    }
}

/// After so much time without a change, meshes share trees.
const REST: Duration = Duration::from_millis(250);

impl RenderState {
    /// When trees are to be improved, if no other moment is shown until then.
    pub(crate) fn next_improving(&self) -> Option<Duration> {
        self.moment.changed_at.map(|since| since + REST)
    }

    /// When meshes are to share trees, if they are not about to be moved on.
    pub(crate) fn next_sharing(&self) -> Option<Duration> {
        self.unsettled_since.filter(|_| !self.builds_statics).map(|since| since + REST)
    }
}

/// Whether meshes are going to share trees once nothing has moved for a while.
fn waits_for_rest(inputs: &SceneInputs, trees: &Trees, origin: DVec3) -> bool {
    StaticJob::next(inputs, trees, origin).is_some()
}

/// Starts building trees that meshes share, once nothing has moved for a while.
fn share_trees(shown: &mut RenderState, beside: &BackgroundTasks, renderer: &Renderer, now: Duration) {
    let rests = shown.trees.has_preview_statics || shown.next_sharing().is_some_and(|then| now >= then);
    if shown.builds_statics || !rests {
        return;
    }
    let RenderState { inputs, extraction: Some(extraction), trees, .. } = &*shown else { return };
    let job = StaticJob::next(inputs, trees, extraction.origin);
    shown.unsettled_since = None;
    if let Some(job) = job {
        shown.builds_statics = true;
        beside.build_statics(job, false, renderer.0.pool());
    }
}

/// Starts building the trees without which a scene cannot be shown; false if there are none.
fn builds_missing_trees(
    inputs: &SceneInputs,
    shown: &mut RenderState,
    origin: DVec3,
    (beside, renderer): (&BackgroundTasks, &Renderer),
) -> bool {
    let missing = missing_trees(inputs, &mut shown.trees, origin);
    if !missing.is_empty() {
        beside.build(missing, shown.trees.clone(), true, renderer.0.pool());
        return true;
    }
    let Some(job) = StaticJob::missing(inputs, &shown.trees, origin) else { return false };
    if !shown.builds_statics {
        shown.builds_statics = true;
        // What moves on has a tree of its own by then.
        let moved = shown.inputs.objects.iter().map(|object| object.shape.clone());
        let moved: Vec<Shape> = moved.filter(|shape| job.has(shape, &shown.trees)).collect();
        if !moved.is_empty() {
            beside.build(moved, shown.trees.clone(), true, renderer.0.pool());
        }
        beside.build_statics(job, true, renderer.0.pool());
    }
    true
}

/// Returns shapes whose trees have yet to be built. Small trees are built immediately, within the frame.
fn missing_trees(inputs: &SceneInputs, trees: &mut Trees, origin: DVec3) -> Vec<Shape> {
    const AT_ONCE: usize = 2_000;
    let mut missing: Vec<Shape> = Vec::new();
    for object in &inputs.objects {
        let size = match &object.shape {
            Shape::Mesh(mesh) => mesh.triangles.len(),
            Shape::Spheres(balls) => balls.centers.len(),
            _ => continue,
        };
        if trees.has(&object.shape) || missing.contains(&object.shape) {
            continue;
        }
        if size > AT_ONCE {
            missing.push(object.shape.clone());
        } else {
            trees.add_or_mark(&object.shape);
        }
    }
    // Meshes that share no tree need one of their own.
    for (object, space) in inputs.objects.iter().zip(hit_spaces(inputs, trees, origin, None)) {
        let is_new = space == HitSpace::Object && !missing.contains(&object.shape);
        if is_new && trees.has(&object.shape) && !trees.is_built(&object.shape) {
            missing.push(object.shape.clone());
        }
    }
    missing
}

/// Discards the samples if they are invalid, and states the reason.
///
/// Reads [`FrameChanges`], [`PictureSize`]; writes [`RenderState`], [`Status`].
pub fn reset(
    size: Res<PictureSize>,
    mut found: ResMut<FrameChanges>,
    mut shown: ResMut<RenderState>,
    mut status: ResMut<Status>,
) {
    if !size.is_empty() && shown.size != Some(*size) {
        found.0.add(Level::Resize, if shown.size.is_some() { "size" } else { "start" });
        shown.size = Some(*size);
    }
    if found.0.restarts() {
        shown.generation += 1;
        shown.view += u64::from(found.0.changes_view());
        status.restarts += 1;
        status.restart_cause = found.0.to_string();
        tracing::debug!("restart {}: {}", shown.generation, status.restart_cause);
    }
}

/// Passes the job, the target, the region and the number of threads to the workers.
///
/// Reads [`RenderState`], [`StopAt`], [`Threads`], [`Paused`], [`BackgroundTasks`]; writes [`FrameChanges`] and to the [`Renderer`].
#[allow(clippy::too_many_arguments)] // A system says what it reads and writes.
pub fn accumulate(
    stop_at: Res<StopAt>,
    threads: Res<Threads>,
    paused: Res<Paused>,
    hidden: Res<WindowHidden>,
    size: Res<PictureSize>,
    brush: Res<RenderRegion>,
    (renderer, beside): (Res<Renderer>, Res<BackgroundTasks>),
    mut shown: ResMut<RenderState>,
    mut found: ResMut<FrameChanges>,
) {
    let mut orders = Orders::default();
    // The first frame sees the values with which the worker was started.
    if let Some(before) = shown.threads.replace(threads.0).filter(|before| *before != threads.0) {
        orders.threads = Some(threads.0);
        found.0.add(Level::Reschedule, format!("threads: {before} → {}", threads.0));
    }
    if shown.target.replace(stop_at.0).is_some_and(|before| before != stop_at.0) {
        orders.target = Some(stop_at.0);
        found.0.add(Level::Reschedule, "target");
    }
    if shown.region != brush.0 {
        orders.region = Some(brush.0);
        shown.region = brush.0;
        found.0.add(Level::Reschedule, "region");
    }
    // An empty scene has nothing to show, and the one that opens needs the processor.
    let opens_first = shown.inputs.objects.is_empty() && beside.progress().0.is_some();
    let paused = paused.0 || hidden.0 || size.is_empty() || opens_first;
    if shown.paused != paused {
        orders.paused = Some(paused);
        shown.paused = paused;
        found.0.add(Level::Reschedule, "pause");
    }
    shown.is_unordered |= found.0.restarts();
    if shown.is_unordered
        && !opens_first
        && let (Some(extraction), Some(PictureSize { width, height })) = (&shown.extraction, shown.size)
    {
        orders.job = Some(Job {
            generation: shown.generation,
            view: shown.view,
            prepared: extraction.prepared.clone(),
            settings: shown.settings,
            width,
            height,
            pace: shown.moment.changed_at.map(|_| shown.moment.per_frame),
        });
        shown.is_unordered = false;
    }
    renderer.0.order(orders);
}

/// Passes the display settings to the workers; no sample is lost.
///
/// Reads [`DisplaySettings`]; writes [`RenderState`], [`FrameChanges`], and to the [`Renderer`].
pub fn develop(
    display_settings: Option<Res<DisplaySettings>>,
    view_mode: Res<ViewMode>,
    renderer: Res<Renderer>,
    mut shown: ResMut<RenderState>,
    mut found: ResMut<FrameChanges>,
) {
    if shown.look != view_mode.0 {
        found.0.add(Level::Redraw, "view");
        renderer.0.set_look(view_mode.0);
        shown.look = view_mode.0;
    }
    let display = display_settings.map(|display_settings| display_settings.0).unwrap_or_default();
    if shown.display != display {
        compare_displays(&shown.display, &display, &mut found.0);
        renderer.0.set_display(display);
        shown.display = display;
    }
}

/// Fetches the results of the workers.
///
/// Reads the [`Renderer`] and [`BackgroundTasks`]; writes [`Picture`] and [`Status`].
pub fn present(
    renderer: Res<Renderer>,
    beside: Res<BackgroundTasks>,
    clock: Res<Clock>,
    paused: Res<Paused>,
    mut picture: ResMut<Picture>,
    shown: ResMut<RenderState>,
    mut status: ResMut<Status>,
) {
    if renderer.0.has_picture() {
        renderer.0.take(&mut picture);
    }
    let stats = renderer.0.stats();
    let per_second =
        |rays: u64| if stats.recent_seconds > 0.0 { rays as f64 / stats.recent_seconds * 1e-6 } else { 0.0 };
    if let Some(failure) = &stats.failure
        && status.messages.back().is_none_or(|last| last.text != *failure)
    {
        status.say(clock.0, MessageKind::Error, failure.clone());
    }
    status.camera_mrays = per_second(stats.recent_rays.camera);
    status.bounce_mrays = per_second(stats.recent_rays.bounce);
    status.shadow_mrays = per_second(stats.recent_rays.shadow);
    status.progress = stats.progress;
    if let Some(CameraInput { view, projection, lens, .. }) = shown.inputs.camera {
        status.rig = navigation::Rig { view, projection, lens };
    }
    (status.display, status.integrator) = (shown.display, shown.settings.integrator);
    status.done = stats.done && stats.generation == shown.generation;
    status.paused = paused.0;
    (status.opening, status.loading) = beside.progress();
}
