//! What can change in time: the properties of camera, objects, lights and materials, by their names in a scene file.

use serde::{Deserialize, Serialize};

/// What the numbers of a key are, which decides how many there are and how they are mixed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Three coordinates, metres; smooth curves may swing beyond their keys.
    Position,
    /// Three coordinates of any length but 0, as [`Self::Position`].
    Direction,
    /// Degrees about X, then Y, then Z.
    Rotation,
    /// One factor or three; stays between its keys.
    Factors,
    /// One number or three, linear Rec. 709; stays between its keys.
    Color,
    /// Stays between its keys.
    Number,
}

impl Quantity {
    /// Whether smooth curves stay between their keys, which are within the limits of the value.
    pub(super) fn is_limited(self) -> bool {
        matches!(self, Self::Factors | Self::Color | Self::Number)
    }
}

/// An enum of properties with their names in scene files.
macro_rules! properties {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident = $word:literal: $quantity:ident,)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        pub enum $name {
            $($(#[$doc])* #[serde(rename = $word)] $variant,)*
        }

        impl $name {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// As in a scene file.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $word,)* }
            }

            /// What its keys hold.
            pub fn quantity(self) -> Quantity {
                match self { $(Self::$variant => Quantity::$quantity,)* }
            }
        }
    };
}

properties! {
    /// Of the camera, as in a scene file.
    CameraProperty {
        /// Centre of the lens, metres.
        Eye = "eye": Position,
        /// What is in the middle of the image, metres.
        LookAt = "look_at": Position,
        /// Direction of the view, in place of `look_at`.
        Forward = "forward": Direction,
        /// What is up in the image.
        Up = "up": Direction,
        /// Vertical field of view, degrees.
        Vfov = "vfov": Number,
        /// Height of what an orthographic camera sees, metres.
        OrthographicHeight = "orthographic_height": Number,
        /// Metres.
        LensRadius = "lens_radius": Number,
        /// Focal length over diameter of the aperture.
        FStop = "f_stop": Number,
        /// Metres along the view axis.
        FocusDistance = "focus_distance": Number,
        /// Degrees.
        BladeRotation = "blade_rotation": Number,
    }
}

properties! {
    /// Of an object, as in a transform.
    ObjectProperty {
        /// Where its own point is in the world (the centre of a sphere, the origin of a mesh), metres.
        Translate = "translate": Position,
        /// Degrees about X, then Y, then Z.
        Rotate = "rotate": Rotation,
        /// Factors along its own axes.
        Scale = "scale": Factors,
    }
}

properties! {
    /// Of a light that is no object, as in the light.
    LightProperty {
        /// Metres.
        Position = "position": Position,
        /// Where it shines before it is rotated.
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

properties! {
    /// A number or colour of a material, as in the material.
    MaterialProperty {
        /// Of a diffuse material.
        Albedo = "albedo": Color,
        /// Of a mirror or a metal.
        Reflectance = "reflectance": Color,
        /// Width of a GGX lobe.
        Alpha = "alpha": Number,
        /// Index of refraction.
        Ior = "ior": Number,
        /// Per metre.
        Absorption = "absorption": Color,
        /// Of a classic material.
        Diffuse = "diffuse": Color,
        /// Of a classic material.
        Ambient = "ambient": Number,
        /// Of a classic or a principled material.
        Specular = "specular": Number,
        /// Of a classic material.
        Shininess = "shininess": Number,
        /// Of a classic material.
        Transparency = "transparency": Number,
        /// Of a principled material.
        BaseColor = "base_color": Color,
        /// Of a principled material.
        Metallic = "metallic": Number,
        /// Of a principled material.
        Roughness = "roughness": Number,
        /// Of a principled material.
        SpecularColor = "specular_color": Color,
        /// Of a principled material.
        Transmission = "transmission": Number,
        /// Of a principled material.
        Anisotropy = "anisotropy": Number,
        /// Of a principled material, degrees.
        AnisotropyRotation = "anisotropy_rotation": Number,
        /// Of a principled material.
        SheenColor = "sheen_color": Color,
        /// Of a principled material.
        SheenRoughness = "sheen_roughness": Number,
        /// Of a principled material.
        Clearcoat = "clearcoat": Number,
        /// Of a principled material.
        ClearcoatRoughness = "clearcoat_roughness": Number,
        /// Of a principled material.
        Iridescence = "iridescence": Number,
        /// Of a principled material.
        IridescenceIor = "iridescence_ior": Number,
        /// Of a principled material, nanometres.
        IridescenceMin = "iridescence_min": Number,
        /// Of a principled material, nanometres.
        IridescenceMax = "iridescence_max": Number,
        /// Of a principled material.
        IridescenceMap = "iridescence_map": Number,
        /// Of a principled material, W·sr⁻¹·m⁻².
        Emission = "emission": Color,
        /// Of a principled material.
        Opacity = "opacity": Number,
        /// Of a principled material.
        OpacityCutoff = "opacity_cutoff": Number,
        /// Of a principled material.
        NormalScale = "normal_scale": Number,
        /// Of a blend.
        Weight = "weight": Number,
        /// Of an emissive material, W·sr⁻¹·m⁻².
        Radiance = "radiance": Color,
    }
}
