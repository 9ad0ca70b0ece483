//! Hot reload: when the open scene's file changes on disk, or a mesh, a material library or an image that it refers to,
//! it is loaded again in the background; only changed parts are read and rebuilt. The camera stays, unless the file has
//! moved it. A file that cannot be read gives a message, and the current scene stays. Another time of a model's
//! animations is loaded in the same way.

use crate::format::bounds::MOST_SECONDS;
use crate::frame::Waker;
use crate::frame::adopt::{adopt_again, set_moment};
use crate::frame::core::status::{MessageKind, Status};
use crate::frame::input::ModelUp;
use crate::frame::saving::SavedAs;
use crate::frame::state::background::BackgroundTasks;
use crate::frame::state::history::History;
use crate::frame::state::resources::{
    Clock, CurrentScene, PictureSize, PlayRange, RenderState, Renderer, WantedMoment,
};
use crate::frame::watch::Watch;
use crate::scene::{
    Animation, Description, LoadOptions, LoadedScene, ModelChoice, Moment, SceneContent, SceneError, SceneSource, load,
};
use bevy_ecs::prelude::{Resource, World};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// No scene if it has not changed.
type ReadAgain = Result<Option<LoadedScene>, SceneError>;

/// Watches the files of the open scene.
#[derive(Resource, Default)]
pub struct HotReload {
    watch: Option<Watch>,
    /// Changed files.
    changed: Arc<Mutex<Vec<PathBuf>>>,
    /// Result of the last reload.
    loaded: Arc<Mutex<Option<ReadAgain>>>,
    waker: Option<Waker>,
    /// The scene whose files are watched, and the file to which it was saved.
    watched: Option<(Arc<LoadedScene>, Option<PathBuf>)>,
    /// The files that caused the current reload.
    reading: Vec<PathBuf>,
    /// Whether a reload is running.
    busy: Arc<Mutex<bool>>,
    /// The error messages of the last reload; empty if it succeeded.
    failed: Vec<String>,
}

impl HotReload {
    /// - `waker`: called when a file has changed.
    pub fn new(waker: Option<Waker>) -> Self {
        Self { waker, ..Self::default() }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Loads changed files again, and replaces the scene by the result.
///
/// Reads [`CurrentScene`]; writes the world, [`Status`].
pub fn reload(world: &mut World) {
    let Some(current) = world.get_resource::<CurrentScene>().map(|current| current.0.clone()) else { return };
    let saved_as = world.resource::<SavedAs>().path.clone();
    look_after(world, &current, saved_as.clone());
    let now = world.resource::<Clock>().0;
    show_moment(world, &current, now);
    let reload = world.resource::<HotReload>();
    let finished = lock(&reload.loaded).take();
    if let Some(result) = finished {
        *lock(&world.resource::<HotReload>().busy) = false;
        take(world, &current, result, now);
        return;
    }
    if *lock(&reload.busy) {
        return;
    }
    let changed = std::mem::take(&mut *lock(&reload.changed));
    if changed.is_empty() {
        return;
    }
    if has_unsaved_changes(world, &current) {
        let names: Vec<String> = changed.iter().map(|path| path.display().to_string()).collect();
        let message = "changed on disk, but the scene has unsaved changes: save it, or open it again";
        return world.resource_mut::<Status>().say(
            now,
            MessageKind::Warning,
            format!("{} {message}", names.join(", ")),
        );
    }
    world.resource_mut::<HotReload>().reading = changed;
    let reload = world.resource::<HotReload>();
    *lock(&reload.busy) = true;
    let (loaded, waker) = (reload.loaded.clone(), reload.waker.clone());
    let pool = world.resource::<Renderer>().0.pool();
    let saved = world.resource::<SavedAs>().content;
    let source = saved_as.map_or_else(|| current.source.clone(), SceneSource::Scene);
    let options = world.resource::<ModelUp>().0;
    let work = move || {
        let (up, environment) = (current.up.or(options), current.environment.as_deref());
        let options = LoadOptions {
            up,
            environment,
            known: Some(&current),
            choice: Some(&current.choice),
            ..LoadOptions::default()
        };
        let read = || pool.install(|| load(&source, &options));
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(read));
        let result = result.unwrap_or_else(|_| {
            Err(SceneError::in_file(source.title(), "cannot be reloaded: this is a bug in firstlight"))
        });
        // The file was only touched, or saved by this session.
        let is_same = |scene: &LoadedScene| match saved {
            Some(saved) => scene.content_fingerprint() == saved,
            None => scene.file == current.file && scene.content_fingerprint() == current.content_fingerprint(),
        };
        *lock(&loaded) = Some(result.map(|scene| Some(scene).filter(|scene| !is_same(scene))));
        if let Some(waker) = waker {
            waker();
        }
    };
    if let Err(error) = std::thread::Builder::new().name("firstlight reload".to_owned()).spawn(work) {
        *lock(&world.resource::<HotReload>().busy) = false;
        world.resource_mut::<Status>().say(now, MessageKind::Error, format!("cannot start a thread: {error}"));
    }
}

/// Frames by which a time may be short of a frame that it is at.
const FRAME_ROUNDING: f64 = 1e-6;

/// Shows the requested moment, unless a scene or the trees of the last one are awaited; loads a model at that time if it is
/// in its stored pose.
fn show_moment(world: &mut World, current: &Arc<LoadedScene>, now: Duration) {
    if world.resource::<BackgroundTasks>().is_loading() || world.resource::<RenderState>().builds_missing {
        return;
    }
    let WantedMoment { at, advance } = std::mem::take(&mut *world.resource_mut::<WantedMoment>());
    let animation = world.get_resource::<Animation>();
    let is_model = current.model_length().is_some();
    // A scene has time before it has an animation, so that keys can be set.
    if !is_model || animation.is_some_and(Animation::moves) {
        let (length, fps) = animation.map_or((0.0, 1.0), |animation| (animation.length(), animation.fps));
        let shown = world.get_resource::<Moment>().copied().unwrap_or_default().0;
        match at {
            Some(None) => {}
            None if advance == 0.0 || length == 0.0 => return,
            _ => {
                let at = at.flatten().unwrap_or(shown);
                if advance == 0.0 {
                    return set_moment(world, at.clamp(0.0, MOST_SECONDS));
                }
                let wanted = world.resource::<PlayRange>().wrap(at + advance, length);
                // What plays are the frames that would be rendered; there is time for each until the next.
                let frame = (wanted * fps + FRAME_ROUNDING).floor() / fps;
                world.resource_mut::<WantedMoment>().advance = wanted - frame;
                return set_moment(world, frame);
            }
        }
    }
    let Some(at) = at else { return };
    if at == current.choice.at {
        return;
    }
    let mut problem = None;
    if !is_model {
        problem = Some("has no animations");
    } else if has_unsaved_changes(world, current) {
        problem = Some("has unsaved changes, which another moment would lose: save it as a scene, or undo them");
    }
    if let Some(problem) = problem {
        let text = format!("{} {problem}", current.source.title());
        return world.resource_mut::<Status>().say(now, MessageKind::Warning, text);
    }
    let choice = ModelChoice { at, ..current.choice.clone() };
    let how = (current.up.or(world.resource::<ModelUp>().0), current.environment.clone());
    let aspect = world.resource::<PictureSize>().aspect();
    let pool = world.resource::<Renderer>().0.pool();
    let known = Some(current.clone());
    world.resource::<BackgroundTasks>().load(current.source.clone(), how, choice, aspect, pool, known);
}

/// Watches the files of the open scene, if it has changed.
fn look_after(world: &mut World, current: &Arc<LoadedScene>, saved_as: Option<PathBuf>) {
    let mut reload = world.resource_mut::<HotReload>();
    let same = |(scene, path): &(Arc<LoadedScene>, Option<PathBuf>)| Arc::ptr_eq(scene, current) && *path == saved_as;
    if reload.watched.as_ref().is_some_and(same) {
        return;
    }
    let mut files = current.files();
    if let Some(path) = &saved_as {
        files.push(path.clone());
    }
    if reload.watch.is_none() {
        let (changed, waker) = (reload.changed.clone(), reload.waker.clone());
        let started = Watch::start(move |paths| {
            lock(&changed).extend(paths);
            if let Some(waker) = &waker {
                waker();
            }
        });
        match started {
            Ok(watch) => reload.watch = Some(watch),
            // Everything else works without it.
            Err(error) => tracing::warn!("files are not watched for changes: {error}"),
        }
    }
    if let Some(watch) = &reload.watch {
        watch.set(files.clone());
    }
    // A file may have changed again while it was read.
    lock(&reload.changed).retain(|path| files.contains(path));
    reload.watched = Some((current.clone(), saved_as));
}

/// Whether the world differs from the opened and the saved scene; the view does not count.
fn has_unsaved_changes(world: &mut World, current: &LoadedScene) -> bool {
    // At another time everything that moves differs from what was opened.
    if world.get_resource::<Animation>().is_some_and(Animation::moves) {
        History::content(world);
        return world.resource::<History>().is_unsaved();
    }
    let description = Description::of(world, Some(current));
    let now = SceneContent::of(world, &description).fingerprint();
    let clean = world.resource::<SavedAs>().content;
    now != clean.unwrap_or_else(|| current.content_fingerprint())
}

fn take(world: &mut World, old: &LoadedScene, result: ReadAgain, now: Duration) {
    let had_failed = std::mem::take(&mut world.resource_mut::<HotReload>().failed);
    let was_mended = !had_failed.is_empty();
    // Old errors of the file no longer apply.
    world.resource_mut::<Status>().withdraw(had_failed);
    let scene = match result {
        Ok(Some(scene)) => scene,
        Ok(None) => {
            if was_mended {
                let text = format!("{} can be read again; the image is up to date", old.source.title());
                world.resource_mut::<Status>().say(now, MessageKind::Note, text);
            }
            return;
        }
        Err(error) => {
            let texts: Vec<String> =
                error.problems.iter().map(|problem| format!("{problem} (the scene is unchanged)")).collect();
            let mut status = world.resource_mut::<Status>();
            // Errors that occur again are displayed again.
            status.withdrawn.retain(|text| !texts.contains(text));
            for text in &texts {
                status.say(now, MessageKind::Error, text.as_str());
            }
            world.resource_mut::<HotReload>().failed = texts;
            return;
        }
    };
    let names = names_of(&world.resource::<HotReload>().reading);
    let shown = world.get_resource::<Moment>().map(|shown| shown.0);
    let moment = shown.filter(|_| scene.file.animation.at == old.file.animation.at);
    adopt_again(world, old, scene, moment, format!("{names} reloaded"), now);
    world.resource_mut::<Status>().say(now, MessageKind::Note, format!("reloaded {names} (changed on disk)"));
}

/// File names without folders, at most two.
fn names_of(paths: &[PathBuf]) -> String {
    let name = |path: &PathBuf| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let mut names: Vec<String> = paths.iter().map(name).collect();
    names.sort_unstable();
    names.dedup();
    match &names[..] {
        [] => "scene".to_owned(),
        [one] => one.clone(),
        [one, other] => format!("{one}, {other}"),
        [first, rest @ ..] => format!("{first} and {} more", rest.len()),
    }
}
