//! The kinds of materials, and the types of their parameters.

use serde::{Deserialize, Serialize};

/// The kinds of [`Material`](super::material::Material).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum MaterialKind {
    /// Emits light: `Material::Emissive`.
    Emissive,
    /// Lambertian reflection: `Material::Diffuse`.
    Diffuse,
    /// Perfect mirror: `Material::Mirror`.
    Mirror,
    /// Smooth dielectric: `Material::Glass`.
    Glass,
    /// GGX microfacets that reflect and refract: `Material::RoughGlass`.
    RoughGlass,
    /// GGX microfacets: `Material::Metal`.
    Metal,
    /// The classic local model: `Material::Phong`.
    Phong,
    /// Layers of dielectric, metal, sheen and coat: `Material::Principled`.
    Principled,
    /// Weighted sum of two materials: `Material::Blend`.
    Blend,
}

impl MaterialKind {
    /// The kinds into which a material can be converted; a blend needs two others.
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

    /// Name in a scene file.
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

/// A parameter of a material, by the kind of its value.
#[derive(Clone, Copy, Debug)]
pub enum Param<Color, Scalar, Number, Flag, Cutoff, Rgb, Part> {
    /// Share of light per channel, 0..1.
    Reflectance(Color),
    /// Radiance, W·sr⁻¹·m⁻².
    Radiance(Color),
    /// A share, 0..1, possibly textured.
    Share(Scalar),
    /// A constant share, 0..1.
    ConstantShare(Number),
    /// A factor per channel, 0 or more.
    Factor(Color),
    /// Data in the channels of an image, 0..1.
    Map(Color),
    /// A finite number.
    Number(Number),
    /// A flag.
    Flag(Flag),
    /// An optional share, 0..1.
    Cutoff(Cutoff),
    /// Index of refraction, above 0.
    Ior(Number),
    /// An exponent, 0 or more.
    Exponent(Number),
    /// A thickness, 0 or more, nanometres.
    Thickness(Number),
    /// 20 divided by the Abbe number, 0 or more.
    Dispersion(Number),
    /// Absorption per metre.
    Absorption(Rgb),
    /// Another material, as a part of a blend.
    Part(Part),
}
