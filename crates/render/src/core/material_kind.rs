//! The kinds of materials, and what their parameters may be.

use serde::{Deserialize, Serialize};

/// The kinds of [`Material`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum MaterialKind {
    /// Emits light: [`Material::Emissive`].
    Emissive,
    /// Lambertian reflection: [`Material::Diffuse`].
    Diffuse,
    /// Perfect mirror: [`Material::Mirror`].
    Mirror,
    /// Smooth dielectric: [`Material::Glass`].
    Glass,
    /// GGX microfacets that reflect and refract: [`Material::RoughGlass`].
    RoughGlass,
    /// GGX microfacets: [`Material::Metal`].
    Metal,
    /// The classic local model: [`Material::Phong`].
    Phong,
    /// Layers of dielectric, metal, sheen and coat: [`Material::Principled`].
    Principled,
    /// Weighted sum of two materials: [`Material::Blend`].
    Blend,
}

impl MaterialKind {
    /// The kinds that a material can be turned into; a blend needs two others.
    pub const PLAIN: [Self; 8] = [
        Self::Diffuse,
        Self::Principled,
        Self::Mirror,
        Self::Metal,
        Self::Glass,
        Self::RoughGlass,
        Self::Phong,
        Self::Emissive,
    ];

    pub(crate) const N: usize = Self::Blend as usize + 1;

    /// As in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Emissive => "emissive",
            Self::Diffuse => "diffuse",
            Self::Mirror => "mirror",
            Self::Glass => "glass",
            Self::RoughGlass => "rough_glass",
            Self::Metal => "metal",
            Self::Phong => "phong",
            Self::Principled => "principled",
            Self::Blend => "blend",
        }
    }
}

/// A parameter of a material, by what may stand in it.
#[derive(Clone, Copy, Debug)]
pub enum Param<Color, Scalar, Number, Flag, Cutoff, Rgb, Part> {
    /// Share of light per channel, 0..1.
    Reflectance(Color),
    /// W·sr⁻¹·m⁻².
    Radiance(Color),
    /// 0..1.
    Share(Scalar),
    /// 0..1, the same everywhere.
    ConstantShare(Number),
    /// A factor per channel, 0 or more.
    Factor(Color),
    /// Data in the channels of a picture, 0..1.
    Map(Color),
    /// Finite.
    Number(Number),
    /// Yes or no.
    Flag(Flag),
    /// 0..1 where there is one.
    Cutoff(Cutoff),
    /// Index of refraction, above 0.
    Ior(Number),
    /// 0 or more.
    Exponent(Number),
    /// 0 or more, nanometres.
    Thickness(Number),
    /// Per metre.
    Absorption(Rgb),
    /// Another material, of which a blend consists.
    Part(Part),
}
