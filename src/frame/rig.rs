//! All that a person steers.

use crate::scene::{BadValue, Lens, Projection, View};
use serde::{Deserialize, Serialize};

/// All that a person steers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rig {
    /// Where the camera stands and looks.
    pub view: View,
    /// Its field of view.
    pub projection: Projection,
    /// Its aperture and focus.
    pub lens: Lens,
}

impl Rig {
    /// # Errors
    /// When no picture can be taken with it.
    pub fn check(&self) -> Result<(), BadValue> {
        self.view.check()?;
        self.projection.check()?;
        self.lens.check()
    }
}

/// What turning keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Turning {
    /// Yaw is about the vertical and the horizon keeps its lean.
    #[default]
    Turntable,
    /// Yaw and pitch are about the picture's own axes, without limits.
    Free,
}
