//! What can be set one value at a time.

use crate::scene::Material;
use serde::{Deserialize, Serialize};

/// What [`super::Edit::Set`] sets. A number is the first of the three values, and `x` is all that counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Property {
    /// Metres.
    Translation,
    /// Degrees about X, then Y, then Z.
    Rotation,
    Scale,
    /// Of a sphere or of a point light, metres.
    Radius,
    /// Of a point light, W·sr⁻¹.
    Intensity,
    /// The colour of a material: albedo, reflectance, the diffuse share of Phong, or the radiance of a light.
    Color,
    /// GGX width, the square of what users call roughness.
    Alpha,
    /// 0: the same reflectance at every angle; else Schlick's.
    Schlick,
    Ior,
    /// Per metre.
    Absorption,
    Ambient,
    Specular,
    Shininess,
    Transparency,
    /// Of the second part of a blend.
    Weight,
    /// Radiance of an even sky.
    Sky,
    Zenith,
    Horizon,
    Ground,
    /// The brightest channel of the sky's colours, or the factor of its picture: all others keep their proportion to it.
    SkyStrength,
    /// Of a picture of the sky, degrees about +Y.
    SkyRotation,
}

impl Property {
    /// Of the surroundings, which are no entity.
    pub(super) fn is_of_sky(self) -> bool {
        use Property::{Ground, Horizon, Sky, SkyRotation, SkyStrength, Zenith};
        matches!(self, Sky | Zenith | Horizon | Ground | SkyStrength | SkyRotation)
    }
}

/// The kinds of [`Material`] that one can be turned into.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum MaterialKind {
    Diffuse,
    Mirror,
    Metal,
    Glass,
    Phong,
    Emissive,
}

impl MaterialKind {
    pub const ALL: [Self; 6] = [Self::Diffuse, Self::Mirror, Self::Metal, Self::Glass, Self::Phong, Self::Emissive];

    /// `None` for a blend.
    pub fn of(material: &Material) -> Option<Self> {
        Some(match material {
            Material::Diffuse { .. } => Self::Diffuse,
            Material::Mirror { .. } => Self::Mirror,
            Material::Metal { .. } => Self::Metal,
            Material::Glass { .. } => Self::Glass,
            Material::Phong { .. } => Self::Phong,
            Material::Emissive { .. } => Self::Emissive,
            Material::Blend { .. } => return None,
        })
    }

    pub fn label(self) -> &'static str {
        match self {
            Self::Diffuse => "diffuse",
            Self::Mirror => "mirror",
            Self::Metal => "metal",
            Self::Glass => "glass",
            Self::Phong => "Phong",
            Self::Emissive => "light",
        }
    }
}
