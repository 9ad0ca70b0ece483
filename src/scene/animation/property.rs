//! The properties that can be animated: of camera, objects and lights, by their names in scene files. Those of
//! materials are in their table, see [`MaterialProperty`](crate::scene::MaterialProperty).

use serde::{Deserialize, Serialize};

/// Type of a key's value: determines the number of components and the interpolation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Three coordinates, metres; smooth curves may overshoot their keys.
    Position,
    /// Three coordinates, not all 0; like [`Self::Position`].
    Direction,
    /// Degrees about X, then Y, then Z.
    Rotation,
    /// One factor or three; stays within the range of the keys.
    Factors,
    /// One number or three, linear Rec. 709; stays within the range of the keys.
    Color,
    /// One number; stays within the range of the keys.
    Number,
}

impl Quantity {
    /// Whether smooth curves stay within the range of their keys, and so within the limits of the value.
    pub(super) fn is_limited(self) -> bool {
        matches!(self, Self::Factors | Self::Color | Self::Number)
    }
}

/// Defines an enum of properties with their names in scene files.
macro_rules! properties {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $word:literal: $quantity:ident,)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        pub enum $name {
            $($(#[$doc])* #[serde(rename = $word)] $variant,)*
        }

        impl $name {
            /// All properties.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Name in scene files.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $word,)* }
            }

            /// The type of its values.
            pub fn quantity(self) -> Quantity {
                match self { $(Self::$variant => Quantity::$quantity,)* }
            }
        }
    };
}

properties! {
    /// Property of the camera, as in scene files.
    CameraProperty {
        /// Centre of the lens, metres.
        Eye = "eye": Position,
        /// Point in the centre of the image, metres.
        LookAt = "look_at": Position,
        /// View direction, instead of `look_at`.
        Forward = "forward": Direction,
        /// Up direction of the image.
        Up = "up": Direction,
        /// Vertical field of view, degrees.
        Vfov = "vfov": Number,
        /// Height of the image of an orthographic camera, metres.
        OrthographicHeight = "orthographic_height": Number,
        /// Radius of the aperture, metres.
        LensRadius = "lens_radius": Number,
        /// Focal length over diameter of the aperture.
        FStop = "f_stop": Number,
        /// Metres along the view axis.
        FocusDistance = "focus_distance": Number,
        /// Rotation of the aperture, degrees.
        BladeRotation = "blade_rotation": Number,
    }
}

properties! {
    /// Property of an object, as in transforms.
    ObjectProperty {
        /// World-space position of its origin (the centre of a sphere, the origin of a mesh), metres.
        Translate = "translate": Position,
        /// Degrees about X, then Y, then Z.
        Rotate = "rotate": Rotation,
        /// Factors along the axes of object space.
        Scale = "scale": Factors,
    }
}

properties! {
    /// Property of a light that is not an object.
    LightProperty {
        /// Metres.
        Position = "position": Position,
        /// Direction of emission before rotation.
        Direction = "direction": Direction,
        /// Degrees about X, then Y, then Z.
        Rotate = "rotate": Rotation,
        /// W·sr⁻¹.
        Intensity = "intensity": Color,
        /// W·m⁻².
        Irradiance = "irradiance": Color,
        /// Of a point light, metres.
        Radius = "radius": Number,
        /// Of a spot light, degrees from its axis.
        InnerAngle = "inner_angle": Number,
        /// Of a spot light, degrees from its axis.
        OuterAngle = "outer_angle": Number,
    }
}
