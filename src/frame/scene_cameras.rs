//! The cameras of the open scene, one after the other.

use crate::files::printable;
use crate::frame::core::rig::Rig;
use crate::scene::LoadedScene;

/// A camera of the scene, and its name; the one that a scene opens with may have none.
pub(super) struct SceneCamera {
    pub name: Option<String>,
    pub rig: Rig,
}

impl SceneCamera {
    /// Message on looking through it.
    pub fn announcement(&self) -> String {
        match &self.name {
            Some(name) => format!("camera `{}`", printable::name(name)),
            None => "the camera that the scene opens with".to_owned(),
        }
    }
}

/// Returns the cameras of a scene: the one that it opens with, unless it is one of the others, then the others in the
/// order of the file.
pub(super) fn cameras_of(scene: &LoadedScene) -> Vec<SceneCamera> {
    let rig = |part: &crate::format::CameraPart| {
        let (view, projection, lens) = part.components().ok()?;
        Some(Rig { view, projection, lens })
    };
    let others = scene.file.cameras.iter();
    let mut cameras: Vec<SceneCamera> =
        others.filter_map(|(name, part)| Some(SceneCamera { name: Some(name.to_owned()), rig: rig(part)? })).collect();
    if let Some(first) = rig(&scene.file.camera)
        && !cameras.iter().any(|camera| shows_the_same(&camera.rig, &first))
    {
        cameras.insert(0, SceneCamera { name: None, rig: first });
    }
    cameras
}

/// Returns the camera after or before the one that the view is through; if it is through none, the first one.
pub(super) fn beside(cameras: Vec<SceneCamera>, rig: &Rig, backwards: bool) -> Option<SceneCamera> {
    let n = cameras.len();
    let current = cameras.iter().position(|camera| shows_the_same(&camera.rig, rig));
    let next = current.map_or(0, |current| if backwards { (current + n - 1) % n } else { (current + 1) % n });
    cameras.into_iter().nth(next)
}

fn shows_the_same(a: &Rig, b: &Rig) -> bool {
    a.view.shows_the_same(&b.view) && a.projection.shows_the_same(&b.projection)
}
