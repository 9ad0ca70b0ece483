//! What a surface does to light.

use crate::core::texture::TextureId;
use glam::Vec3;

/// Below it a GGX surface is a mirror: its highlight is narrower than directions in `f32` can tell apart.
pub(crate) const SMALLEST_ALPHA: f32 = 1e-4;

/// Index into the materials of a snapshot.
pub type MaterialId = u32;

/// A colour, linear Rec. 709, the same everywhere or looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorInput {
    Constant(Vec3),
    Texture(TextureId),
}

/// A number without unit, the same everywhere or the red channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScalarInput {
    Constant(f32),
    Texture(TextureId),
}

/// How the reflectance of a metal grows towards grazing angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fresnel {
    Constant,
    Schlick,
}

/// A closed set of surfaces; all are two-sided but for emission.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// Lambert: f = albedo / π.
    Diffuse { albedo: ColorInput },
    /// Perfect mirror, the same reflectance at every angle.
    Mirror { reflectance: ColorInput },
    /// Isotropic GGX microfacets; `alpha` is the square of what users call roughness.
    Metal {
        alpha: ScalarInput,
        reflectance: ColorInput,
        fresnel: Fresnel,
        /// Give back the energy that single scattering loses (Turquin 2019).
        compensate: bool,
    },
    /// Smooth dielectric with exact Fresnel; `absorption` per metre inside (Beer–Lambert).
    Glass { ior: f32, absorption: Vec3 },
    /// f = (1 − weight) f_a + weight f_b, and the same for emission. At most one part is emissive, and then `weight`
    /// is constant: see [`Emission::of`].
    Blend { weight: ScalarInput, a: MaterialId, b: MaterialId },
    /// The classic local model. For paths it is matte, mirror and glass in shares that sum to 1: `transparency`, of
    /// the rest `specular`, of the rest `diffuse`.
    Phong {
        diffuse: ColorInput,
        /// Of the ambient light, the share of `diffuse` that comes back.
        ambient: f32,
        /// Share that is mirrored; lights appear in it as highlights.
        specular: ScalarInput,
        /// Exponent of the highlights.
        shininess: f32,
        transparency: f32,
        /// Of the transparent part, as for glass.
        ior: f32,
        absorption: Vec3,
    },
    /// A black body: emits on its front (a sphere outwards, a face along its normal), reflects nothing.
    Emissive { radiance: ColorInput },
}

impl Material {
    /// Whether light can pass through the surface.
    pub(crate) fn is_clear(&self) -> bool {
        match self {
            Self::Glass { .. } => true,
            Self::Phong { transparency, .. } => *transparency > 0.0,
            _ => false,
        }
    }

    /// Whether it, or a part of it, lets light pass.
    pub(crate) fn has_clear_part(&self, materials: &[Self]) -> bool {
        match self {
            Self::Blend { a, b, .. } => [a, b].into_iter().any(|&id| materials[id as usize].has_clear_part(materials)),
            _ => self.is_clear(),
        }
    }

    /// Whether the inside of it takes light away.
    pub(crate) fn absorbs(&self) -> bool {
        match self {
            Self::Glass { absorption, .. } | Self::Phong { absorption, .. } => {
                self.is_clear() && *absorption != Vec3::ZERO
            }
            _ => false,
        }
    }

    /// Whether it, or a part of it, is specular everywhere: a mirror or glass.
    pub(crate) fn is_specular(&self, materials: &[Self]) -> bool {
        match self {
            Self::Mirror { .. } | Self::Glass { .. } => true,
            Self::Metal { alpha, .. } => matches!(alpha, ScalarInput::Constant(alpha) if *alpha < SMALLEST_ALPHA),
            Self::Phong { specular, transparency, .. } => {
                *transparency > 0.0 || !matches!(specular, ScalarInput::Constant(share) if *share <= 0.0)
            }
            Self::Blend { a, b, .. } => [a, b].into_iter().any(|&id| materials[id as usize].is_specular(materials)),
            Self::Diffuse { .. } | Self::Emissive { .. } => false,
        }
    }

    /// Whether it, or a part of it, looks up a texture.
    pub(crate) fn is_textured(&self, materials: &[Self]) -> bool {
        let color = |input: &ColorInput| matches!(input, ColorInput::Texture(_));
        let scalar = |input: &ScalarInput| matches!(input, ScalarInput::Texture(_));
        match self {
            Self::Diffuse { albedo } => color(albedo),
            Self::Mirror { reflectance } => color(reflectance),
            Self::Metal { alpha, reflectance, .. } => scalar(alpha) || color(reflectance),
            Self::Glass { .. } => false,
            Self::Phong { diffuse, specular, .. } => color(diffuse) || scalar(specular),
            Self::Blend { weight, a, b } => {
                let part = |id: MaterialId| materials[id as usize].is_textured(materials);
                scalar(weight) || part(*a) || part(*b)
            }
            Self::Emissive { radiance } => color(radiance),
        }
    }

    pub(crate) const KINDS: usize = 7;

    /// A number below [`Self::KINDS`] for each kind, to sort by.
    #[inline]
    pub(crate) fn kind(&self) -> usize {
        match self {
            Self::Emissive { .. } => 0,
            Self::Diffuse { .. } => 1,
            Self::Mirror { .. } => 2,
            Self::Glass { .. } => 3,
            Self::Metal { .. } => 4,
            Self::Phong { .. } => 5,
            Self::Blend { .. } => 6,
        }
    }
}

/// The light that a material adds itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    pub radiance: ColorInput,
    /// Share of an emissive part in a blend.
    pub scale: f32,
}

impl Emission {
    /// The emission of a material, looked for in blends; `None` for one that does not shine.
    pub fn of(materials: &[Material], id: MaterialId) -> Option<Self> {
        match &materials[id as usize] {
            Material::Emissive { radiance: ColorInput::Constant(Vec3::ZERO) } => None,
            Material::Emissive { radiance } => Some(Self { radiance: *radiance, scale: 1.0 }),
            Material::Blend { weight: ScalarInput::Constant(weight), a, b } => {
                let part = |id, share: f32| {
                    let emission = Self::of(materials, id)?;
                    (share > 0.0).then_some(Self { scale: share * emission.scale, ..emission })
                };
                part(*a, 1.0 - weight).or_else(|| part(*b, *weight))
            }
            _ => None,
        }
    }
}
