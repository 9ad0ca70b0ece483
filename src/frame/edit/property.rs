//! Properties that can be set one at a time.

use serde::{Deserialize, Serialize};

/// The property of [`super::Edit::Set`]. A scalar uses the `x` component of the value only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Property {
    /// Position, metres.
    Translation,
    /// Rotation, degrees about X, then Y, then Z.
    Rotation,
    /// Scale factors along the axes of the object, positive.
    Scale,
    /// Radius of a sphere or a point light in metres; 0 is allowed for a point light.
    Radius,
    /// Radiant intensity of a point light or a spot light, W·sr⁻¹.
    Intensity,
    /// Irradiance of a directional light, W·m⁻².
    Irradiance,
    /// Direction of a spot light or a directional light before its rotation, any length except 0.
    Direction,
    /// Inner angle of a spot light, degrees from its axis; limited to the outer angle.
    InnerAngle,
    /// Outer angle of a spot light, degrees from its axis; limits the inner angle.
    OuterAngle,
    /// The colour of a material: albedo, reflectance, the diffuse reflectance of Phong, or the radiance of a light.
    Color,
    /// GGX width alpha, the square of the user's roughness.
    Alpha,
    /// 0 for the same reflectance at every angle; otherwise Schlick's approximation.
    Schlick,
    /// Index of refraction.
    Ior,
    /// Absorption per metre.
    Absorption,
    /// Dispersion of glass: 20 divided by the Abbe number, 0 or more.
    Dispersion,
    /// Phong: reflected share of the ambient light, 0..1.
    Ambient,
    /// Phong: specular share, 0..1.
    Specular,
    /// Phong: exponent of the highlights.
    Shininess,
    /// Phong: transmitted share, 0..1.
    Transparency,
    /// Weight of the second part of a blend, 0..1.
    Weight,
    /// Principled: share of the base that is metal, 0..1.
    Metallic,
    /// Principled: roughness, the root of the GGX width, 0..1.
    Roughness,
    /// Principled: transmitted share, 0..1.
    Transmission,
    /// Principled: whether it transmits like a thin pane; 0 is no.
    ThinWalled,
    /// Principled: anisotropy of the highlights, 0..1.
    Anisotropy,
    /// Principled: direction of the anisotropy, degrees from the tangent.
    AnisotropyRotation,
    /// Principled: colour of the sheen.
    SheenColor,
    /// Principled: roughness of the sheen, 0..1.
    SheenRoughness,
    /// Principled: share with a clear coat, 0..1.
    Clearcoat,
    /// Principled: roughness of the clear coat, 0..1.
    ClearcoatRoughness,
    /// Principled: share with a thin film, 0..1.
    Iridescence,
    /// Principled: index of refraction of the thin film.
    FilmIor,
    /// Principled: thickness of the thin film, nanometres.
    FilmThickness,
    /// Principled: thickness of the thin film where its map is 0, nanometres.
    FilmThinnest,
    /// Principled: factor of the dielectric reflectance, may be above 1.
    SpecularColor,
    /// Principled: emitted radiance.
    Emission,
    /// Principled: opacity, 0..1.
    Opacity,
    /// Principled: opacity below which the surface is absent; above 1, opacity blends instead.
    OpacityCutoff,
    /// Principled: scale of the normal map.
    NormalScale,
    /// Principled: whether its back is visible; 0 is no.
    TwoSided,
    /// Radiance of a constant environment.
    Sky,
    /// Radiance of a gradient at the zenith.
    Zenith,
    /// Radiance of a gradient at the horizon.
    Horizon,
    /// Radiance of a gradient below the horizon.
    Ground,
    /// The brightest channel of the environment's colours, or the factor of its image; the proportions of all channels
    /// are kept.
    SkyStrength,
    /// Rotation of an environment image, degrees about +Y.
    SkyRotation,
    /// Exposure time of the animation as a fraction of the duration of a frame, 0..1; 0 for no motion blur.
    Shutter,
    /// Duration of the animation in seconds; 0: up to the last key.
    Duration,
    /// Frames per second of the animation.
    FramesPerSecond,
}

impl Property {
    /// Returns the property for a parameter of a material, by the parameter's name in a scene file.
    pub fn of_param(name: &str) -> Option<Self> {
        Some(match name {
            "albedo" | "reflectance" | "diffuse" | "radiance" | "base_color" => Self::Color,
            "alpha" => Self::Alpha,
            "ior" => Self::Ior,
            "absorption" => Self::Absorption,
            "dispersion" => Self::Dispersion,
            "ambient" => Self::Ambient,
            "specular" => Self::Specular,
            "shininess" => Self::Shininess,
            "transparency" => Self::Transparency,
            "weight" => Self::Weight,
            "metallic" => Self::Metallic,
            "roughness" => Self::Roughness,
            "transmission" => Self::Transmission,
            "thin_walled" => Self::ThinWalled,
            "anisotropy" => Self::Anisotropy,
            "anisotropy_rotation" => Self::AnisotropyRotation,
            "sheen_color" => Self::SheenColor,
            "sheen_roughness" => Self::SheenRoughness,
            "clearcoat" => Self::Clearcoat,
            "clearcoat_roughness" => Self::ClearcoatRoughness,
            "iridescence" => Self::Iridescence,
            "iridescence_ior" => Self::FilmIor,
            "iridescence_min" => Self::FilmThinnest,
            "iridescence_max" => Self::FilmThickness,
            "specular_color" => Self::SpecularColor,
            "opacity_cutoff" => Self::OpacityCutoff,
            "emission" => Self::Emission,
            "opacity" => Self::Opacity,
            "normal_scale" => Self::NormalScale,
            "two_sided" => Self::TwoSided,
            _ => return None,
        })
    }

    /// Whether it belongs to the environment, which is no entity.
    pub(super) fn is_of_sky(self) -> bool {
        use Property::{Ground, Horizon, Sky, SkyRotation, SkyStrength, Zenith};
        matches!(self, Sky | Zenith | Horizon | Ground | SkyStrength | SkyRotation)
    }

    /// Whether it belongs to the animation, which is no entity.
    pub(super) fn is_of_animation(self) -> bool {
        matches!(self, Self::Shutter | Self::Duration | Self::FramesPerSecond)
    }
}
