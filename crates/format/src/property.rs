//! The properties that can be animated: of camera, objects and lights, by their names in scene files, and how each is
//! read and set; and the numbers of a clear sky. Those of materials are in their table, see
//! [`MaterialProperty`](crate::material_property::MaterialProperty).

use crate::camera::CameraPart;
use crate::light::LightKind;
use crate::numbers::short_color;
use crate::placement::{Linear, Placement};
use crate::quantity::Quantity;
use crate::sources::EnvironmentSource;
use crate::view::{Lens, Projection, View};
use glam::DVec3;
use serde::{Deserialize, Serialize};

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
    /// The unit of a number or of a colour, as it is written behind it.
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
        Intensity = "intensity": Color, "intensity", [0.0, f64::INFINITY], " W/sr";
        /// irradiance of a surface that faces the light, W·m⁻²
        Irradiance = "irradiance": Color, "irradiance", [0.0, f64::INFINITY], " W/m²";
        /// of the sphere that emits; 0: a point, which no camera sees
        Radius = "radius": Number, "radius", [0.0, 1e9], " m";
        /// from the axis of the cone, from which on the intensity falls off; at most the outer angle
        InnerAngle = "inner_angle": Number, "inner angle", [0.0, 90.0], "°";
        /// from the axis of the cone, beyond which there is no light
        OuterAngle = "outer_angle": Number, "outer angle", [0.1, 90.0], "°";
        /// angle that the image fills horizontally; 0: by its height, or the cone
        ImageWidth = "image_width": Number, "image width", [0.0, 179.0], "°";
        /// angle that the image fills vertically; 0: by its width, or the cone
        ImageHeight = "image_height": Number, "image height", [0.0, 179.0], "°";
    }
}

properties! {
    /// Number of a clear sky; it cannot be animated.
    SkyProperty {
        /// height of the sun above the horizon
        Elevation = "elevation": Number, "sun elevation", [0.0, 90.0], "°";
        /// direction of the sun, from −Z clockwise as seen from above
        Azimuth = "azimuth": Number, "sun azimuth", [-360.0, 360.0], "°";
        /// haze: 1 is pure air, 10 is hazy
        Turbidity = "turbidity": Number, "turbidity", [1.0, 10.0], "";
        /// factor of the light of the sun
        Sun = "sun": Number, "sun", [0.0, 1e6], "";
        /// factor of the light of the clear sky without the sun
        Sky = "sky": Number, "sky", [0.0, 1e6], "";
        /// angle that the sun fills; it gives the same light
        SunSize = "sun_size": Number, "sun size", [0.1, 20.0], "°";
    }
}

impl SkyProperty {
    /// The value of an environment; `None` if it is no clear sky.
    pub fn get(self, sky: &EnvironmentSource) -> Option<f64> {
        self.place(&mut sky.clone()).copied()
    }

    /// The value of an environment, to be changed; `None` if it is no clear sky.
    pub fn place(self, sky: &mut EnvironmentSource) -> Option<&mut f64> {
        let EnvironmentSource::Sky { elevation, azimuth, turbidity, sun, sky, sun_size, .. } = sky else { return None };
        Some(match self {
            Self::Elevation => elevation,
            Self::Azimuth => azimuth,
            Self::Turbidity => turbidity,
            Self::Sun => sun,
            Self::Sky => sky,
            Self::SunSize => sun_size,
        })
    }
}

impl CameraProperty {
    /// The value for a camera with these components; `None` if it has none.
    pub fn get(self, view: &View, projection: &Projection, lens: &Lens) -> Option<DVec3> {
        Some(match self {
            Self::Eye => view.eye,
            Self::LookAt => view.pivot(),
            Self::Forward => view.forward,
            Self::Up => view.up,
            Self::Vfov => DVec3::splat(projection.vfov_deg),
            Self::OrthographicHeight => DVec3::splat(projection.orthographic_height?),
            Self::LensRadius => DVec3::splat(lens.radius),
            Self::FStop => return None,
            Self::FocusDistance => DVec3::splat(lens.focus_distance),
            Self::BladeRotation => DVec3::splat(lens.blade_rotation_deg),
        })
    }

    /// Sets this field.
    pub fn set(self, camera: &mut CameraPart, value: DVec3) {
        match self {
            Self::Eye => camera.eye = value,
            Self::LookAt => camera.look_at = Some(value),
            Self::Forward => camera.forward = Some(value),
            Self::Up => camera.up = value,
            Self::Vfov => camera.vfov = value.x,
            Self::OrthographicHeight => camera.orthographic_height = Some(value.x),
            Self::LensRadius => camera.lens_radius = Some(value.x),
            Self::FStop => camera.f_stop = Some(value.x),
            Self::FocusDistance => camera.focus_distance = Some(value.x),
            Self::BladeRotation => camera.blade_rotation = value.x,
        }
    }
}

impl ObjectProperty {
    /// The value of a placement; `None` for the rotation and the scale of a matrix with shear.
    pub fn get(self, placement: &Placement) -> Option<DVec3> {
        match self {
            Self::Translate => Some(placement.translation),
            Self::Rotate => placement.linear.rotation_and_scale().map(|(rotation_deg, _)| rotation_deg),
            Self::Scale => placement.linear.rotation_and_scale().map(|(_, scale)| scale),
        }
    }

    /// The placement with this value changed. A matrix with shear keeps its rotation and scale.
    #[must_use]
    pub fn set(self, placement: Placement, value: DVec3) -> Placement {
        let Placement { linear, .. } = placement;
        let parts = linear.rotation_and_scale();
        match (self, parts) {
            (Self::Translate, _) => Placement { translation: value, ..placement },
            (Self::Rotate, Some((_, scale))) => {
                Placement { linear: Linear::Turned { rotation_deg: value, scale }, ..placement }
            }
            (Self::Scale, Some((rotation_deg, _))) => {
                Placement { linear: Linear::Turned { rotation_deg, scale: value }, ..placement }
            }
            (Self::Rotate | Self::Scale, None) => placement,
        }
    }
}

impl LightProperty {
    /// The value of a light; `None` if lights of this kind do not have the property.
    pub fn get(self, light: &LightKind, placement: &Placement) -> Option<DVec3> {
        Some(match (self, light) {
            (Self::Position, LightKind::Point(_) | LightKind::Spot(_)) => placement.translation,
            (Self::Rotate, LightKind::Spot(_) | LightKind::Directional(_)) => ObjectProperty::Rotate.get(placement)?,
            (Self::Direction, LightKind::Spot(light)) => light.direction,
            (Self::Direction, LightKind::Directional(light)) => light.direction,
            (Self::Intensity, LightKind::Point(light)) => short_color(light.intensity),
            (Self::Intensity, LightKind::Spot(light)) => short_color(light.intensity),
            (Self::Irradiance, LightKind::Directional(light)) => short_color(light.irradiance),
            (Self::Radius, LightKind::Point(light)) => DVec3::splat(light.radius),
            (Self::InnerAngle, LightKind::Spot(light)) => DVec3::splat(light.inner_angle_deg),
            (Self::OuterAngle, LightKind::Spot(light)) => DVec3::splat(light.outer_angle_deg),
            (Self::ImageWidth, LightKind::Spot(light)) => DVec3::splat(light.image.width_deg),
            (Self::ImageHeight, LightKind::Spot(light)) => DVec3::splat(light.image.height_deg),
            _ => return None,
        })
    }

    /// Sets the value; `None` if lights of this kind do not have the property.
    pub fn set(self, light: &mut LightKind, placement: &mut Placement, value: DVec3) -> Option<()> {
        match (self, light) {
            (Self::Position, LightKind::Point(_) | LightKind::Spot(_)) => placement.translation = value,
            (Self::Rotate, LightKind::Spot(_) | LightKind::Directional(_)) => {
                *placement = ObjectProperty::Rotate.set(*placement, value);
            }
            (Self::Direction, LightKind::Spot(light)) => light.direction = value,
            (Self::Direction, LightKind::Directional(light)) => light.direction = value,
            (Self::Intensity, LightKind::Point(light)) => light.intensity = value.as_vec3(),
            (Self::Intensity, LightKind::Spot(light)) => light.intensity = value.as_vec3(),
            (Self::Irradiance, LightKind::Directional(light)) => light.irradiance = value.as_vec3(),
            (Self::Radius, LightKind::Point(light)) => light.radius = value.x,
            (Self::InnerAngle, LightKind::Spot(light)) => light.inner_angle_deg = value.x,
            (Self::OuterAngle, LightKind::Spot(light)) => light.outer_angle_deg = value.x,
            (Self::ImageWidth, LightKind::Spot(light)) => light.image.width_deg = value.x,
            (Self::ImageHeight, LightKind::Spot(light)) => light.image.height_deg = value.x,
            _ => return None,
        }
        Some(())
    }

    /// The property that is [`LightKind::strength`].
    pub fn strength_of(light: &LightKind) -> Self {
        if light.has_position() { Self::Intensity } else { Self::Irradiance }
    }

    /// The properties of lights of this kind.
    pub fn of(light: &LightKind) -> impl Iterator<Item = Self> {
        let mut light = *light;
        let has = move |property: &Self| property.set(&mut light, &mut Placement::default(), DVec3::ONE).is_some();
        Self::ALL.iter().copied().filter(has)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{DirectionalLight, ImageFrame, PointLight, SpotLight};
    use firstlight_render::Falloff;
    use glam::Vec3;

    #[test]
    fn what_is_set_is_read_again() {
        let value = DVec3::new(0.3, 0.4, 0.7);
        let lights = [
            LightKind::Point(PointLight { intensity: Vec3::ONE, radius: 0.0 }),
            LightKind::Spot(SpotLight {
                direction: DVec3::X,
                intensity: Vec3::ONE,
                inner_angle_deg: 10.0,
                outer_angle_deg: 20.0,
                falloff: Falloff::Quadratic,
                image: ImageFrame::default(),
            }),
            LightKind::Directional(DirectionalLight { direction: DVec3::X, irradiance: Vec3::ONE }),
        ];
        for mut light in lights {
            let mut placement = Placement::default();
            for property in LightProperty::of(&light.clone()) {
                property.set(&mut light, &mut placement, value).unwrap();
                let wanted = if property.quantity() == Quantity::Number { DVec3::splat(0.3) } else { value };
                assert_eq!(property.get(&light, &placement), Some(wanted), "{property:?}");
            }
        }
        for &property in ObjectProperty::ALL {
            assert_eq!(property.get(&property.set(Placement::default(), value)), Some(value));
        }
    }
}
