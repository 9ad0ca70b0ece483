//! What a change costs: the smallest thing that is right.
//!
//! | changed | level | kept |
//! |---|---|---|
//! | exposure, tone curve | [`Level::Redraw`] | all samples |
//! | target, threads, pause | [`Level::Reschedule`] | all samples |
//! | camera, lens, light model, depth, seed | [`Level::Restart`] | trees, lights, textures |
//! | material, texture, environment, light power, a light without size moved | [`Level::Shading`] | all trees |
//! | object or other light moved, given other materials, any added, removed | [`Level::TopTree`] | every mesh's own tree |
//! | a mesh or a cloud of spheres | [`Level::MeshTree`] | other trees |
//! | picture size | [`Level::Resize`] | the scene side |

use crate::render::{Display, RenderSettings};
use crate::scene::{
    CameraInput, LightInput, LightKind, MaterialInput, ObjectInput, SceneEnvironment, SceneInputs, Shape, SnapshotPart,
    View, origin_for,
};
use bevy_ecs::prelude::Entity;
use std::collections::HashMap;
use std::fmt;

/// How much a change makes worthless. From `Restart` on, all samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// The film is developed again.
    Redraw,
    /// What is rendered next is decided again.
    Reschedule,
    /// The samples are dropped.
    Restart,
    /// The tables of materials and lights are built again, and the samples dropped.
    Shading,
    /// The tree over the objects is built again, with all of [`Self::Shading`].
    TopTree,
    /// A mesh or a group of spheres needs a tree of its own, with all of [`Self::TopTree`].
    MeshTree,
    /// The film gets another size and begins empty.
    Resize,
}

/// One thing that is not as it was.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// What it makes worthless.
    pub level: Level,
    /// For the log and the status line.
    pub cause: String,
    /// It says it all: of a new scene everything is new.
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

    /// Another scene, or another state of the files of this one.
    pub fn add_scene(&mut self, cause: impl Into<String>) {
        self.0.push(Change { level: Level::Restart, cause: cause.into(), is_all: true });
    }

    /// Whether some change has exactly this level.
    pub fn has(&self, level: Level) -> bool {
        self.0.iter().any(|change| change.level == level)
    }

    /// Whether the samples are worthless now.
    pub fn restarts(&self) -> bool {
        self.0.iter().any(|change| change.level >= Level::Restart)
    }

    /// What of the snapshot has to be made anew.
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
    /// The causes of the restart, the weightiest first, no more than three.
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

/// What differs between two readings of the world. Values decide, not who touched them.
pub fn compare(old: &SceneInputs, new: &SceneInputs) -> Changes {
    let mut changes = Changes::default();
    compare_cameras(old.camera.as_ref(), new.camera.as_ref(), &mut changes);
    compare_environments(&old.environment, &new.environment, &mut changes);
    compare_lists(&old.objects, &new.objects, "object", Level::TopTree, compare_objects, &mut changes);
    compare_lists(&old.lights, &new.lights, "light", Level::TopTree, compare_lights, &mut changes);
    compare_lists(&old.materials, &new.materials, "material", Level::Shading, compare_materials, &mut changes);
    changes
}

/// What differs between two sets of settings.
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
    // A lens that is off shows nothing of its numbers.
    let (old, new) = (old.lens, new.lens);
    let open = |radius: f64, enabled: bool| if enabled { radius } else { 0.0 };
    let (old_radius, new_radius) = (open(old.radius, old.enabled), open(new.radius, new.enabled));
    if old_radius != new_radius {
        changes.add(Level::Restart, "aperture");
    } else if new_radius > 0.0 {
        if old.focus_distance != new.focus_distance {
            changes.add(Level::Restart, "focus");
        }
        if (old.blades, old.blade_rotation_deg) != (new.blades, new.blade_rotation_deg) {
            changes.add(Level::Restart, "aperture blades");
        }
    }
}

/// The pivot is not in the picture, unless it moves the origin that the picture is rounded about.
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
    // A sphere is in the tree; all other lights are in the table of lights alone.
    let is_sphere = |light: &LightInput| light.light.radius() > 0.0;
    let level = if is_sphere(old) || is_sphere(new) { Level::TopTree } else { Level::Shading };
    let place = |light: &LightInput| {
        let shines_everywhere = matches!(light.light, LightKind::Directional(_));
        let position = (!shines_everywhere).then_some(light.placement.translation);
        (position, light.light.direction(&light.placement))
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
    match (old.light, new.light) {
        (LightKind::Point(_), LightKind::Point(_)) | (LightKind::Directional(_), LightKind::Directional(_)) => {}
        (LightKind::Spot(old), LightKind::Spot(new)) => {
            if (old.inner_angle_deg, old.outer_angle_deg) != (new.inner_angle_deg, new.outer_angle_deg) {
                changes.add(Level::Shading, format!("cone of {label}"));
            }
        }
        _ => changes.add(level, format!("kind of {label}")),
    }
    // What is wrong with a light is told when everything is made anew.
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

/// What has an identity of its own.
trait Named {
    fn entity(&self) -> Entity;
    fn name(&self) -> Option<&str>;
    /// What it is called without a name.
    fn kind(&self) -> &'static str;
}

macro_rules! named {
    ($($input:ty: $kind:expr),*) => {$(
        impl Named for $input {
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

/// Finds what came, what went, and what changed; `structure` is the level of coming and going.
fn compare_lists<T: Named + PartialEq>(
    old: &[T],
    new: &[T],
    kind: &str,
    structure: Level,
    differ: impl Fn(&T, &T, &str, &mut Changes),
    changes: &mut Changes,
) {
    // As the lists of the panel call it.
    let label = |(i, item): (usize, &T)| match item.name() {
        Some(name) => format!("{kind} `{name}`"),
        None => format!("{} {i}", item.kind()),
    };
    // The usual case, in which everything stands where it stood.
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
