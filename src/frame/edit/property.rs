//! What can be set one value at a time.

use serde::{Deserialize, Serialize};

/// What [`super::Edit::Set`] sets. A number is the first of the three values, and `x` is all that counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Property {
    /// Metres.
    Translation,
    /// Degrees about X, then Y, then Z.
    Rotation,
    /// Factors along the axes of the object, positive.
    Scale,
    /// Of a sphere or of a point light, which may have none, metres.
    Radius,
    /// Of a point light or a spot light, W·sr⁻¹.
    Intensity,
    /// Of a directional light, W·m⁻².
    Irradiance,
    /// Of a spot light or a directional light: where it shines before it is turned, any length but 0.
    Direction,
    /// Of a spot light, degrees from its axis; stays within the outer angle.
    InnerAngle,
    /// Of a spot light, degrees from its axis; takes the inner angle along.
    OuterAngle,
    /// The colour of a material: albedo, reflectance, the diffuse share of Phong, or the radiance of a light.
    Color,
    /// GGX width, the square of what users call roughness.
    Alpha,
    /// 0: the same reflectance at every angle; else Schlick's.
    Schlick,
    /// Index of refraction.
    Ior,
    /// Per metre.
    Absorption,
    /// Of Phong: share of the ambient light that comes back, 0..1.
    Ambient,
    /// Of Phong: share that is mirrored, 0..1.
    Specular,
    /// Of Phong: exponent of the highlights.
    Shininess,
    /// Of Phong: share that is glass, 0..1.
    Transparency,
    /// Of the second part of a blend.
    Weight,
    /// Of a principled material: share of the base that is metal, 0..1.
    Metallic,
    /// Of a principled material: root of the width of its microfacets, 0..1.
    Roughness,
    /// Of a principled material: share that lets light through, 0..1.
    Transmission,
    /// Of a principled material: whether light passes as through a pane; 0 is no.
    ThinWalled,
    /// Of a principled material: how much wider highlights are in one direction, 0..1.
    Anisotropy,
    /// Of a principled material: that direction, degrees from the tangent.
    AnisotropyRotation,
    /// Of a principled material: colour of the sheen.
    SheenColor,
    /// Of a principled material: root of the width of the sheen, 0..1.
    SheenRoughness,
    /// Of a principled material: share that has a coat, 0..1.
    Clearcoat,
    /// Of a principled material: root of the width of the coat's microfacets, 0..1.
    ClearcoatRoughness,
    /// Of a principled material: share that has a thin film, 0..1.
    Iridescence,
    /// Of a principled material: index of refraction of the film.
    FilmIor,
    /// Of a principled material: thickness of the film, nanometres.
    FilmThickness,
    /// Of a principled material: its thickness where the map of it is 0, nanometres.
    FilmThinnest,
    /// Of a principled material: factor of the reflectance of its dielectric, which may be above 1.
    SpecularColor,
    /// Of a principled material: radiance that it adds.
    Emission,
    /// Of a principled material: share of the surface that is there, 0..1.
    Opacity,
    /// Of a principled material: opacity below which the surface is not there at all; above 1 its opacity is a share.
    OpacityCutoff,
    /// Of a principled material: factor of the slope of its normal map.
    NormalScale,
    /// Of a principled material: whether its back is a surface; 0 is no.
    TwoSided,
    /// Radiance of an even sky.
    Sky,
    /// Radiance of a gradient from straight above.
    Zenith,
    /// Radiance of a gradient from just above the horizon.
    Horizon,
    /// Radiance of a gradient from below the horizon.
    Ground,
    /// The brightest channel of the sky's colours, or the factor of its picture: all others keep their proportion to it.
    SkyStrength,
    /// Of a picture of the sky, degrees about +Y.
    SkyRotation,
}

impl Property {
    /// What sets a parameter of a material, by the parameter's name in a scene file.
    pub fn of_param(name: &str) -> Option<Self> {
        Some(match name {
            "albedo" | "reflectance" | "diffuse" | "radiance" | "base_color" => Self::Color,
            "alpha" => Self::Alpha,
            "ior" => Self::Ior,
            "absorption" => Self::Absorption,
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

    /// Of the surroundings, which are no entity.
    pub(super) fn is_of_sky(self) -> bool {
        use Property::{Ground, Horizon, Sky, SkyRotation, SkyStrength, Zenith};
        matches!(self, Sky | Zenith | Horizon | Ground | SkyStrength | SkyRotation)
    }
}
