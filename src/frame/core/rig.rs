//! The camera as controlled by the user.

use crate::scene::{BadValue, Lens, Projection, View};
use serde::{Deserialize, Serialize};

/// View, projection and lens of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rig {
    /// Pose.
    pub view: View,
    /// Field of view.
    pub projection: Projection,
    /// Aperture and focus.
    pub lens: Lens,
}

impl Rig {
    /// Checks the values.
    ///
    /// # Errors
    /// If no image can be rendered with them.
    pub fn check(&self) -> Result<(), BadValue> {
        self.view.check()?;
        self.projection.check()?;
        self.lens.check()
    }
}

/// A side of the scene: Y is up, and its front faces +Z, as that of glTF models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Side {
    /// From +Z.
    Front,
    /// From -Z.
    Back,
    /// From +X.
    Right,
    /// From -X.
    Left,
    /// From +Y, with the front below.
    Top,
    /// From -Y, with the front above.
    Bottom,
}

/// The mode of turning the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Turning {
    /// Yaw is about the vertical, and the roll is preserved.
    #[default]
    Turntable,
    /// Yaw and pitch are about the image axes, without limits.
    Free,
}
