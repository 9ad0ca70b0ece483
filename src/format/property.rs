//! The properties that can be animated: of camera, objects and lights, by their names in scene files. Those of
//! materials are in their table, see [`MaterialProperty`](crate::format::material_property::MaterialProperty).

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
    pub(crate) fn is_limited(self) -> bool {
        matches!(self, Self::Factors | Self::Color | Self::Number)
    }
}

/// What an editor shows of a property.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PropertyInfo {
    /// Name in scene files.
    pub name: &'static str,
    /// The type of its values.
    pub quantity: Quantity,
    /// Name in the window.
    pub label: &'static str,
    /// What it means, a phrase.
    pub help: &'static str,
    /// The range in which a number can be set, in its unit.
    pub range: [f64; 2],
    /// The unit of a number, as it is written behind it.
    pub unit: &'static str,
}

/// Defines an enum of properties by rows of `Variant = "name in files": Quantity, "label", range, "unit";`.
macro_rules! properties {
    ($(#[$about:meta])* $name:ident { $(
        $(#[doc = $help:literal])*
        $variant:ident = $word:literal: $quantity:ident, $label:literal, $range:expr, $unit:literal;
    )* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        pub enum $name {
            $($(#[doc = $help])* #[serde(rename = $word)] $variant,)*
        }

        impl $name {
            /// All properties.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Its description.
            pub fn info(self) -> &'static PropertyInfo {
                const ALL: &[PropertyInfo] = &[$(PropertyInfo {
                    name: $word,
                    quantity: Quantity::$quantity,
                    label: $label,
                    help: concat!($($help),*).trim_ascii_start(),
                    range: $range,
                    unit: $unit,
                },)*];
                &ALL[self as usize]
            }

            /// Name in scene files.
            pub fn name(self) -> &'static str {
                self.info().name
            }

            /// The type of its values.
            pub fn quantity(self) -> Quantity {
                self.info().quantity
            }
        }
    };
}

/// Any number.
const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// From a nanometre on.
const LENGTH: [f64; 2] = [1e-9, 1e9];

properties! {
    /// Property of the camera, as in scene files.
    CameraProperty {
        /// centre of the lens
        Eye = "eye": Position, "position", ANY, " m";
        /// point in the centre of the image, about which the view orbits
        LookAt = "look_at": Position, "look at", ANY, " m";
        /// view direction, instead of `look_at`
        Forward = "forward": Direction, "direction", ANY, "";
        /// up direction of the image
        Up = "up": Direction, "up", ANY, "";
        /// vertical field of view
        Vfov = "vfov": Number, "field of view", [5.0, 120.0], "°";
        /// height of what the image of an orthographic camera shows, at any distance
        OrthographicHeight = "orthographic_height": Number, "height", LENGTH, " m";
        /// radius of the aperture
        LensRadius = "lens_radius": Number, "lens radius", [0.0, 1e6], " m";
        /// focal length over diameter of the aperture, for a film 24 mm high
        FStop = "f_stop": Number, "f-number", [1e-4, 1e6], "";
        /// distance of the focal plane along the view axis
        FocusDistance = "focus_distance": Number, "focus distance", LENGTH, " m";
        /// rotation of the aperture, counter-clockwise seen from behind the camera
        BladeRotation = "blade_rotation": Number, "blade rotation", [-360.0, 360.0], "°";
    }
}

properties! {
    /// Property of an object, as in transforms.
    ObjectProperty {
        /// where its origin is (the centre of a sphere, the origin of a mesh), metres
        Translate = "translate": Position, "position", ANY, " m";
        /// degrees about X, then Y, then Z
        Rotate = "rotate": Rotation, "rotation °", ANY, "°";
        /// factors along the axes of object space
        Scale = "scale": Factors, "scale", [1e-6, 1e6], "";
    }
}

properties! {
    /// Property of a light that is not an object.
    LightProperty {
        /// centre of the light, metres
        Position = "position": Position, "position", ANY, " m";
        /// direction of emission before rotation, any length except 0
        Direction = "direction": Direction, "direction", ANY, "";
        /// degrees about X, then Y, then Z
        Rotate = "rotate": Rotation, "rotation °", ANY, "°";
        /// radiant intensity, W·sr⁻¹
        Intensity = "intensity": Color, "intensity", [0.0, f64::INFINITY], "";
        /// irradiance of a surface that faces the light, W·m⁻²
        Irradiance = "irradiance": Color, "irradiance", [0.0, f64::INFINITY], "";
        /// of the sphere that emits; 0: a point, which no camera sees
        Radius = "radius": Number, "radius", [0.0, 1e9], " m";
        /// from the axis of the cone, from which on the intensity falls off; at most the outer angle
        InnerAngle = "inner_angle": Number, "inner angle", [0.0, 90.0], "°";
        /// from the axis of the cone, beyond which there is no light
        OuterAngle = "outer_angle": Number, "outer angle", [0.1, 90.0], "°";
    }
}
