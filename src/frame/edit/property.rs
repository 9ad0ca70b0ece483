//! Properties that can be set one at a time.

use crate::format::property::SkyProperty;
use crate::scene::MaterialProperty;
use crate::scene::animation::{LightProperty, ObjectProperty};
use serde::{Deserialize, Serialize};

/// The property of [`crate::frame::edit::Edit::Set`]. A number uses the `x` component of the value only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Property {
    /// Placement of an object; scale factors are positive.
    Object(ObjectProperty),
    /// A number, a colour or the placement of a light that is no object; limited to the values that it may have.
    Light(LightProperty),
    /// Radius of a sphere, metres.
    SphereRadius,
    /// A number, colour or choice of a material; limited to the values that it may have.
    Material(MaterialProperty),
    /// Radiance of a constant environment, which any other environment becomes by it.
    Sky,
    /// Radiance of a gradient at the zenith, which any other environment becomes by it.
    Zenith,
    /// Radiance of a gradient at the horizon.
    Horizon,
    /// Radiance of a gradient below the horizon; of a clear sky, the albedo of the ground.
    Ground,
    /// The brightest channel of the environment's colours, or the factor of its image; the proportions of all channels
    /// are kept.
    SkyStrength,
    /// Rotation of an environment image, degrees about +Y.
    SkyRotation,
    /// A number of a clear sky, which any other environment becomes by it.
    ClearSky(SkyProperty),
    /// Exposure time of the animation as a fraction of the duration of a frame, 0..1; 0 for no motion blur.
    Shutter,
    /// Duration of the animation in seconds; 0: up to the last key.
    Duration,
    /// Frames per second of the animation.
    FramesPerSecond,
}

impl Property {
    /// Whether it belongs to the environment, which is no entity.
    pub(super) fn is_of_sky(self) -> bool {
        use Property::{ClearSky, Ground, Horizon, Sky, SkyRotation, SkyStrength, Zenith};
        matches!(self, Sky | Zenith | Horizon | Ground | SkyStrength | SkyRotation | ClearSky(_))
    }

    /// Whether it belongs to the animation, which is no entity.
    pub(super) fn is_of_animation(self) -> bool {
        matches!(self, Self::Shutter | Self::Duration | Self::FramesPerSecond)
    }
}
