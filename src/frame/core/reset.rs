//! The cost of a change: the smallest correct invalidation.
//!
//! | changed | level | kept |
//! |---|---|---|
//! | exposure, tone curve | [`Level::Redraw`] | all samples |
//! | target, threads, pause | [`Level::Reschedule`] | all samples |
//! | camera, lens, integrator, depth, seed | [`Level::Restart`] | trees, lights, textures |
//! | material, texture, environment, light power, delta light moved | [`Level::Shading`] | all trees |
//! | object or other light moved, given other materials, any added, removed | [`Level::TopTree`] | every mesh's own tree |
//! | a mesh or a group of spheres | [`Level::MeshTree`] | other trees |
//! | image size | [`Level::Resize`] | the scene side; samples of the size before, until another change |

use crate::render::{Display, RenderSettings};
use crate::scene::{
    CameraInput, Lens, LightInput, MaterialInput, ObjectInput, SceneEnvironment, SceneInputs, Shape, SnapshotPart,
    View, origin_for,
};
use bevy_ecs::prelude::Entity;
use std::collections::HashMap;
use std::fmt;

/// What a change invalidates. From `Restart` on, all samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// The film is developed again.
    Redraw,
    /// The next step of rendering is decided again.
    Reschedule,
    /// The samples are discarded.
    Restart,
    /// The tables of materials and lights are rebuilt, and the samples discarded.
    Shading,
    /// The top-level tree is rebuilt, and everything of [`Self::Shading`].
    TopTree,
    /// A mesh or a group of spheres needs a new tree, and everything of [`Self::TopTree`].
    MeshTree,
    /// The film is replaced by an empty one of another size.
    Resize,
}

/// One detected change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// What it invalidates.
    pub level: Level,
    /// Description for the log and the status line.
    pub cause: String,
    /// Whether it subsumes all other changes: after opening a scene everything is new.
    pub is_all: bool,
}

/// All that changed since the last frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Changes(pub Vec<Change>);

impl Changes {
    /// Adds a change.
    pub fn add(&mut self, level: Level, cause: impl Into<String>) {
        self.0.push(Change { level, cause: cause.into(), is_all: false });
    }

    /// Adds the change to another scene, or to another state of this scene's files.
    pub fn add_scene(&mut self, cause: impl Into<String>) {
        self.0.push(Change { level: Level::Restart, cause: cause.into(), is_all: true });
    }

    /// Whether there is a change of exactly this level.
    pub fn has(&self, level: Level) -> bool {
        self.0.iter().any(|change| change.level == level)
    }

    /// Whether the samples are invalid.
    pub fn restarts(&self) -> bool {
        self.0.iter().any(|change| change.level >= Level::Restart)
    }

    /// Whether samples would be invalid in an image of the same size.
    pub fn changes_view(&self) -> bool {
        self.0.iter().any(|change| change.level >= Level::Restart && change.level != Level::Resize)
    }

    /// The part of the snapshot that has to be rebuilt.
    pub fn part(&self) -> Option<SnapshotPart> {
        let part = |level| match level {
            Level::Redraw | Level::Reschedule | Level::Resize => None,
            Level::Restart => Some(SnapshotPart::Camera),
            Level::Shading => Some(SnapshotPart::Shading),
            Level::TopTree | Level::MeshTree => Some(SnapshotPart::Geometry),
        };
        self.0.iter().filter_map(|change| part(change.level)).max()
    }
}

/// The cause when a scene has been opened.
pub const SCENE_OPENED: &str = "scene opened";

impl fmt::Display for Changes {
    /// The causes of the restart, the most expensive first, at most three.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(all) = self.0.iter().find(|change| change.is_all) {
            return f.write_str(&all.cause);
        }
        let mut causes: Vec<&Change> = self.0.iter().filter(|change| change.level >= Level::Restart).collect();
        causes.sort_by_key(|change| std::cmp::Reverse(change.level));
        let shown: Vec<&str> = causes.iter().take(3).map(|change| change.cause.as_str()).collect();
        f.write_str(&shown.join(", "))?;
        if causes.len() > shown.len() {
            write!(f, " and {} more", causes.len() - shown.len())?;
        }
        Ok(())
    }
}

/// Compares two states of the scene by value.
pub fn compare(old: &SceneInputs, new: &SceneInputs) -> Changes {
    let mut changes = Changes::default();
    compare_cameras(old.camera.as_ref(), new.camera.as_ref(), &mut changes);
    compare_environments(&old.environment, &new.environment, &mut changes);
    compare_lists(&old.objects, &new.objects, "object", Level::TopTree, compare_objects, &mut changes);
    compare_lists(&old.lights, &new.lights, "light", Level::TopTree, compare_lights, &mut changes);
    compare_lists(&old.materials, &new.materials, "material", Level::Shading, compare_materials, &mut changes);
    changes
}

/// Compares two sets of settings.
pub fn compare_settings(old: &RenderSettings, new: &RenderSettings, changes: &mut Changes) {
    if old.integrator != new.integrator {
        changes.add(Level::Restart, "integrator");
    }
    if old.max_depth != new.max_depth {
        changes.add(Level::Restart, "maximum depth");
    }
    if old.filter != new.filter {
        changes.add(Level::Restart, "pixel filter");
    }
    if old.seed != new.seed {
        changes.add(Level::Restart, "seed");
    }
    if old.allocation != new.allocation {
        changes.add(Level::Restart, "sample allocation");
    }
}

pub fn compare_displays(old: &Display, new: &Display, changes: &mut Changes) {
    if old != new {
        changes.add(Level::Redraw, "display");
    }
}

fn compare_cameras(old: Option<&CameraInput>, new: Option<&CameraInput>, changes: &mut Changes) {
    let (Some(old), Some(new)) = (old, new) else {
        if old.is_some() != new.is_some() {
            changes.add(Level::Restart, if new.is_some() { "camera added" } else { "camera removed" });
        }
        return;
    };
    if !looks_the_same(&old.view, &new.view) {
        changes.add(Level::Restart, "camera moved");
    }
    if old.projection != new.projection {
        changes.add(Level::Restart, "field of view");
    }
    // The parameters of a disabled lens are not visible.
    let (old, new) = (old.lens, new.lens);
    let open = |radius: f64, enabled: bool| if enabled { radius } else { 0.0 };
    let (old_radius, new_radius) = (open(old.radius, old.enabled), open(new.radius, new.enabled));
    if old_radius != new_radius {
        changes.add(Level::Restart, "aperture");
    } else if new_radius > 0.0 {
        if old.focus_distance != new.focus_distance {
            changes.add(Level::Restart, "focus");
        }
        if (Lens { focus_distance: new.focus_distance, ..old }) != new {
            changes.add(Level::Restart, "shape of the aperture");
        }
    }
}

/// Whether two views give the same image. The pivot is not visible, unless it changes the origin about which
/// coordinates are rounded.
fn looks_the_same(old: &View, new: &View) -> bool {
    let pose = |view: &View| (view.eye, view.forward, view.up);
    pose(old) == pose(new) && origin_for(old) == origin_for(new)
}

fn compare_environments(old: &SceneEnvironment, new: &SceneEnvironment, changes: &mut Changes) {
    if old != new {
        changes.add(Level::Shading, "environment");
    }
}

fn compare_objects(old: &ObjectInput, new: &ObjectInput, label: &str, changes: &mut Changes) {
    if old.shape != new.shape {
        match (&old.shape, &new.shape) {
            (_, Shape::Mesh(_)) => changes.add(Level::MeshTree, format!("mesh of {label}")),
            (_, Shape::Spheres(_)) => changes.add(Level::MeshTree, format!("spheres of {label}")),
            _ => changes.add(Level::TopTree, format!("shape of {label}")),
        }
    }
    if old.placement != new.placement {
        changes.add(Level::TopTree, format!("{label} moved"));
    }
    if old.slots != new.slots {
        changes.add(Level::TopTree, format!("material of {label}"));
    }
}

fn compare_lights(old: &LightInput, new: &LightInput, label: &str, changes: &mut Changes) {
    // A sphere light is in the tree; all other lights are in the light table only.
    let is_sphere = |light: &LightInput| light.light.radius() > 0.0;
    let level = if is_sphere(old) || is_sphere(new) { Level::TopTree } else { Level::Shading };
    let place = |light: &LightInput| {
        let position = light.light.has_position().then_some(light.placement.translation);
        (position, light.light.direction(&light.placement), light.light.image_up(&light.placement))
    };
    if place(old) != place(new) {
        changes.add(level, format!("{label} moved"));
    }
    if old.light.radius() != new.light.radius() {
        changes.add(Level::TopTree, format!("size of {label}"));
    }
    if old.light.strength() != new.light.strength() {
        changes.add(Level::Shading, format!("power of {label}"));
    }
    if old.light.name() != new.light.name() {
        changes.add(level, format!("kind of {label}"));
    } else if (old.light.cone(), &old.texture) != (new.light.cone(), &new.texture) {
        changes.add(Level::Shading, format!("cone of {label}"));
    }
    // Invalid lights are reported when everything is rebuilt.
    let problem = |light: &LightInput| light.light.check(&light.placement).err();
    if problem(old) != problem(new) {
        changes.add(Level::TopTree, label.to_owned());
    }
}

fn compare_materials(old: &MaterialInput, new: &MaterialInput, label: &str, changes: &mut Changes) {
    if old.material != new.material {
        changes.add(Level::Shading, label.to_owned());
    }
}

/// An item with an identity of its own.
trait NamedEntity {
    fn entity(&self) -> Entity;
    fn name(&self) -> Option<&str>;
    /// Name of the item if the user gave none.
    fn kind(&self) -> &'static str;
}

macro_rules! named {
    ($($input:ty: $kind:expr),*) => {$(
        impl NamedEntity for $input {
            fn entity(&self) -> Entity {
                self.entity
            }

            fn name(&self) -> Option<&str> {
                self.name.as_deref()
            }

            fn kind(&self) -> &'static str {
                let kind: fn(&Self) -> &'static str = $kind;
                kind(self)
            }
        }
    )*};
}
named!(ObjectInput: |object| object.shape.kind(), LightInput: |light| light.light.name(), MaterialInput: |_| "material");

/// Finds added, removed and changed items; `structure` is the level of additions and removals.
fn compare_lists<T: NamedEntity + PartialEq>(
    old: &[T],
    new: &[T],
    kind: &str,
    structure: Level,
    differ: impl Fn(&T, &T, &str, &mut Changes),
    changes: &mut Changes,
) {
    // Labels as in the lists of the panel.
    let label = |(i, item): (usize, &T)| match item.name() {
        Some(name) => format!("{kind} `{name}`"),
        None => format!("{} {i}", item.kind()),
    };
    // The common case: the same entities in the same order.
    let same_entities = old.len() == new.len() && old.iter().zip(new).all(|(a, b)| a.entity() == b.entity());
    if same_entities {
        for (i, (old, new)) in old.iter().zip(new).enumerate().filter(|(_, (old, new))| old != new) {
            differ(old, new, &label((i, new)), changes);
        }
        return;
    }
    let mut gone: HashMap<Entity, (usize, &T)> = old.iter().enumerate().map(|it| (it.1.entity(), it)).collect();
    for (i, item) in new.iter().enumerate() {
        match gone.remove(&item.entity()) {
            Some((_, old)) if old != item => differ(old, item, &label((i, item)), changes),
            Some(_) => {}
            None => changes.add(structure, format!("{} added", label((i, item)))),
        }
    }
    let mut gone: Vec<(usize, &T)> = gone.into_values().collect();
    gone.sort_by_key(|(_, item)| item.entity());
    for &item in &gone {
        changes.add(structure, format!("{} removed", label(item)));
    }
    if gone.is_empty() && old.len() == new.len() {
        changes.add(structure, format!("order of {kind}s"));
    }
}
