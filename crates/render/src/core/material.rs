//! What a surface does to light: one enum for the scene file, the world and the snapshot.
//!
//! [`Material`] is the same in all three but for what it refers to ([`Params`]): a texture and another material are names
//! in a file, entities in the world and indices in a snapshot. [`Material::map`] goes from one to the next. A new kind of
//! material begins here: its variant, its [`kind`](Material::kind), its rows in `map`, `params_of` and
//! [`of_kind`](Material::of_kind).

use crate::core::texture::{Texture, TextureId};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

/// Below it a GGX surface is a mirror: its highlight is narrower than directions in `f32` can tell apart.
pub(crate) const SMALLEST_ALPHA: f32 = 1e-4;

/// Lobes that a blend may come to, however it is nested; see [`Material::n_lobes`].
pub const MAX_LOBES: usize = 8;

/// Index into the materials of a snapshot.
pub type MaterialId = u32;

/// How a material refers to what it uses.
pub trait Params {
    /// A colour, linear Rec. 709, the same everywhere or looked up.
    type Color: Clone + Debug + PartialEq + From<Vec3>;
    /// A number without unit, the same everywhere or looked up.
    type Scalar: Clone + Debug + PartialEq + From<f32>;
    /// A colour that cannot be looked up.
    type Rgb: Copy + Debug + Default + PartialEq + From<Vec3> + Into<Vec3>;
    /// Another material.
    type Material: Clone + Debug + PartialEq;
}

/// By index into the tables of a snapshot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InSnapshot;

impl Params for InSnapshot {
    type Color = ColorInput;
    type Scalar = ScalarInput;
    type Rgb = Vec3;
    type Material = MaterialId;
}

/// A colour, linear Rec. 709, the same everywhere or looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorInput {
    /// The same colour everywhere.
    Constant(Vec3),
    /// The colour of a texture at the surface point.
    Texture(TextureId),
}

/// A number without unit, the same everywhere or the red channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScalarInput {
    /// The same number everywhere.
    Constant(f32),
    /// The red channel of a texture at the surface point.
    Texture(TextureId),
}

impl From<Vec3> for ColorInput {
    fn from(rgb: Vec3) -> Self {
        Self::Constant(rgb)
    }
}

impl From<f32> for ScalarInput {
    fn from(value: f32) -> Self {
        Self::Constant(value)
    }
}

/// How the reflectance of a metal grows towards grazing angles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fresnel {
    /// The reflectance is the same at every angle.
    #[default]
    Constant,
    /// The reflectance rises to 1 at grazing angles by Schlick's approximation (Schlick 1994).
    Schlick,
}

/// A closed set of surfaces; all are two-sided but for emission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[serde(bound(
    serialize = "P::Color: Serialize, P::Scalar: Serialize, P::Rgb: Serialize, P::Material: Serialize",
    deserialize = "P::Color: Deserialize<'de>, P::Scalar: Deserialize<'de>, P::Rgb: Deserialize<'de>, \
                   P::Material: Deserialize<'de>"
))]
pub enum Material<P: Params = InSnapshot> {
    /// Lambert: f = albedo / π.
    Diffuse {
        /// Share of light that is reflected, per channel, 0..1.
        albedo: P::Color,
    },
    /// Perfect mirror, the same reflectance at every angle.
    Mirror {
        /// Share of light that is reflected, per channel, 0..1.
        #[serde(default = "white")]
        reflectance: P::Color,
    },
    /// Isotropic GGX microfacets.
    Metal {
        /// Width of the lobe, 0..1: the square of what other programs call roughness.
        alpha: P::Scalar,
        /// Share of light that is reflected at normal incidence, per channel, 0..1.
        reflectance: P::Color,
        /// How the reflectance depends on the angle.
        #[serde(default, skip_serializing_if = "is_default")]
        fresnel: Fresnel,
        /// Give back the energy that single scattering loses (Turquin 2019).
        #[serde(default, skip_serializing_if = "is_default")]
        compensate: bool,
    },
    /// Smooth dielectric with exact Fresnel.
    Glass {
        /// Index of refraction.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// Per metre inside (Beer–Lambert).
        #[serde(default, skip_serializing_if = "is_default")]
        absorption: P::Rgb,
    },
    /// Dielectric with GGX microfacets that reflect and refract, each with exact Fresnel (Walter et al. 2007).
    RoughGlass {
        /// Width of the distribution of normals, 0..1: the square of what other programs call roughness.
        alpha: P::Scalar,
        /// Index of refraction.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// Per metre inside (Beer–Lambert).
        #[serde(default, skip_serializing_if = "is_default")]
        absorption: P::Rgb,
        /// Give back the energy that single scattering loses, after Kulla and Conty 2017.
        #[serde(default, skip_serializing_if = "is_default")]
        compensate: bool,
    },
    /// The classic local model. For paths it is diffuse, mirror and glass in shares that sum to 1: `transparency`, of
    /// the rest `specular`, of the rest `diffuse`.
    Phong {
        /// Share of light that is reflected diffusely, of what is neither transparent nor specular; per channel, 0..1.
        diffuse: P::Color,
        /// Of the ambient light, the share of `diffuse` that comes back.
        #[serde(default = "one")]
        ambient: f32,
        /// Share that is mirrored; lights appear in it as highlights.
        #[serde(default = "zero", skip_serializing_if = "is_zero")]
        specular: P::Scalar,
        /// Exponent of the highlights.
        #[serde(default = "dull")]
        shininess: f32,
        /// Share that is glass.
        #[serde(default, skip_serializing_if = "is_default")]
        transparency: f32,
        /// Of the transparent part, as for glass.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// Of the transparent part, as for glass.
        #[serde(default, skip_serializing_if = "is_default")]
        absorption: P::Rgb,
    },
    /// f = (1 − weight) f_a + weight f_b, and the same for emission. At most one part is emissive, and then `weight`
    /// is constant: see [`Emission::of`].
    Blend {
        /// Share of `b`, 0..1.
        weight: P::Scalar,
        /// The material at weight 0.
        a: P::Material,
        /// The material at weight 1.
        b: P::Material,
    },
    /// A black body: emits on its front (a sphere outwards, a face along its normal), reflects nothing.
    Emissive {
        /// W·sr⁻¹·m⁻².
        radiance: P::Color,
    },
}

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
    /// Weighted sum of two materials: [`Material::Blend`].
    Blend,
}

impl MaterialKind {
    /// The kinds that a material can be turned into; a blend needs two others.
    pub const PLAIN: [Self; 7] =
        [Self::Diffuse, Self::Mirror, Self::Metal, Self::Glass, Self::RoughGlass, Self::Phong, Self::Emissive];

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
            Self::Blend => "blend",
        }
    }
}

/// A parameter of a material, by what may stand in it.
#[derive(Clone, Copy, Debug)]
pub enum Param<Color, Scalar, Number, Rgb, Part> {
    /// Share of light per channel, 0..1.
    Reflectance(Color),
    /// W·sr⁻¹·m⁻².
    Radiance(Color),
    /// 0..1.
    Share(Scalar),
    /// 0..1, the same everywhere.
    ConstantShare(Number),
    /// Index of refraction, above 0.
    Ior(Number),
    /// 0 or more.
    Exponent(Number),
    /// Per metre.
    Absorption(Rgb),
    /// Another material, of which a blend consists.
    Part(Part),
}

/// To be read.
pub type ParamRef<'a, P> = Param<
    &'a <P as Params>::Color,
    &'a <P as Params>::Scalar,
    &'a f32,
    &'a <P as Params>::Rgb,
    &'a <P as Params>::Material,
>;

/// To be changed.
pub type ParamMut<'a, P> = Param<
    &'a mut <P as Params>::Color,
    &'a mut <P as Params>::Scalar,
    &'a mut f32,
    &'a mut <P as Params>::Rgb,
    &'a mut <P as Params>::Material,
>;

/// Names as in a scene file; of a reference to a material, or of a mutable one.
macro_rules! params_of {
    ($material:expr) => {
        match $material {
            Material::Diffuse { albedo } => vec![("albedo", Param::Reflectance(albedo))],
            Material::Mirror { reflectance } => vec![("reflectance", Param::Reflectance(reflectance))],
            Material::Metal { alpha, reflectance, fresnel: _, compensate: _ } => {
                vec![("alpha", Param::Share(alpha)), ("reflectance", Param::Reflectance(reflectance))]
            }
            Material::Glass { ior, absorption } => {
                vec![("ior", Param::Ior(ior)), ("absorption", Param::Absorption(absorption))]
            }
            Material::RoughGlass { alpha, ior, absorption, compensate: _ } => vec![
                ("alpha", Param::Share(alpha)),
                ("ior", Param::Ior(ior)),
                ("absorption", Param::Absorption(absorption)),
            ],
            Material::Phong { diffuse, ambient, specular, shininess, transparency, ior, absorption } => vec![
                ("specular", Param::Share(specular)),
                ("diffuse", Param::Reflectance(diffuse)),
                ("ambient", Param::ConstantShare(ambient)),
                ("shininess", Param::Exponent(shininess)),
                ("transparency", Param::ConstantShare(transparency)),
                ("ior", Param::Ior(ior)),
                ("absorption", Param::Absorption(absorption)),
            ],
            Material::Blend { weight, a, b } => {
                vec![("weight", Param::Share(weight)), ("a", Param::Part(a)), ("b", Param::Part(b))]
            }
            Material::Emissive { radiance } => vec![("radiance", Param::Radiance(radiance))],
        }
    };
}

/// Of a reference to a material, or of a mutable one.
macro_rules! color_of {
    ($material:expr) => {
        match $material {
            Material::Diffuse { albedo: color }
            | Material::Mirror { reflectance: color }
            | Material::Metal { reflectance: color, .. }
            | Material::Phong { diffuse: color, .. }
            | Material::Emissive { radiance: color } => Some(color),
            Material::Glass { .. } | Material::RoughGlass { .. } | Material::Blend { .. } => None,
        }
    };
}

/// What a material refers to, looked up for another place; see [`Material::map`].
pub trait MapParams<From: Params, To: Params> {
    /// Looks up a colour.
    fn color(&mut self, color: &From::Color) -> To::Color;
    /// Looks up a number.
    fn scalar(&mut self, scalar: &From::Scalar) -> To::Scalar;
    /// Looks up another material.
    fn material(&mut self, material: &From::Material) -> To::Material;
}

impl<P: Params> Material<P> {
    /// The same material with other references.
    pub fn map<Q: Params>(&self, to: &mut impl MapParams<P, Q>) -> Material<Q> {
        let rgb = |rgb: &P::Rgb| Q::Rgb::from((*rgb).into());
        match self {
            Self::Diffuse { albedo } => Material::Diffuse { albedo: to.color(albedo) },
            Self::Mirror { reflectance } => Material::Mirror { reflectance: to.color(reflectance) },
            Self::Metal { alpha, reflectance, fresnel, compensate } => Material::Metal {
                alpha: to.scalar(alpha),
                reflectance: to.color(reflectance),
                fresnel: *fresnel,
                compensate: *compensate,
            },
            Self::Glass { ior, absorption } => Material::Glass { ior: *ior, absorption: rgb(absorption) },
            Self::RoughGlass { alpha, ior, absorption, compensate } => Material::RoughGlass {
                alpha: to.scalar(alpha),
                ior: *ior,
                absorption: rgb(absorption),
                compensate: *compensate,
            },
            Self::Phong { diffuse, ambient, specular, shininess, transparency, ior, absorption } => Material::Phong {
                diffuse: to.color(diffuse),
                ambient: *ambient,
                specular: to.scalar(specular),
                shininess: *shininess,
                transparency: *transparency,
                ior: *ior,
                absorption: rgb(absorption),
            },
            Self::Blend { weight, a, b } => {
                Material::Blend { weight: to.scalar(weight), a: to.material(a), b: to.material(b) }
            }
            Self::Emissive { radiance } => Material::Emissive { radiance: to.color(radiance) },
        }
    }

    /// Its parameters with their names in a scene file; those that are no quantity are left out.
    pub fn params(&self) -> Vec<(&'static str, ParamRef<'_, P>)> {
        params_of!(self)
    }

    /// Its parameters to be changed, otherwise as in [`Self::params`].
    pub fn params_mut(&mut self) -> Vec<(&'static str, ParamMut<'_, P>)> {
        params_of!(self)
    }

    /// Its kind.
    #[inline]
    pub fn kind(&self) -> MaterialKind {
        match self {
            Self::Emissive { .. } => MaterialKind::Emissive,
            Self::Diffuse { .. } => MaterialKind::Diffuse,
            Self::Mirror { .. } => MaterialKind::Mirror,
            Self::Glass { .. } => MaterialKind::Glass,
            Self::RoughGlass { .. } => MaterialKind::RoughGlass,
            Self::Metal { .. } => MaterialKind::Metal,
            Self::Phong { .. } => MaterialKind::Phong,
            Self::Blend { .. } => MaterialKind::Blend,
        }
    }

    /// For how many of [`MAX_LOBES`] a material counts in a blend; a blend itself counts by its parts.
    pub fn n_lobes(&self) -> usize {
        match self {
            Self::Phong { .. } => 3,
            _ => 1,
        }
    }

    /// A plain material of a kind, with usual parameters; `None` for a blend.
    ///
    /// - `color`: what the material is known by, see [`Self::color`].
    pub fn of_kind(kind: MaterialKind, color: P::Color) -> Option<Self> {
        Some(match kind {
            MaterialKind::Diffuse => Self::Diffuse { albedo: color },
            MaterialKind::Mirror => Self::Mirror { reflectance: color },
            MaterialKind::Metal => Self::Metal {
                alpha: P::Scalar::from(0.04),
                reflectance: color,
                fresnel: Fresnel::Schlick,
                compensate: true,
            },
            MaterialKind::Glass => Self::Glass { ior: glass_ior(), absorption: P::Rgb::default() },
            MaterialKind::RoughGlass => Self::RoughGlass {
                alpha: P::Scalar::from(0.04),
                ior: glass_ior(),
                absorption: P::Rgb::default(),
                compensate: true,
            },
            MaterialKind::Phong => Self::Phong {
                diffuse: color,
                ambient: 1.0,
                specular: P::Scalar::from(0.2),
                shininess: 50.0,
                transparency: 0.0,
                ior: glass_ior(),
                absorption: P::Rgb::default(),
            },
            MaterialKind::Emissive => Self::Emissive { radiance: color },
            MaterialKind::Blend => return None,
        })
    }

    /// What the material is known by: albedo, reflectance, diffuse colour or radiance; `None` where it has no colour.
    #[inline]
    pub fn color(&self) -> Option<&P::Color> {
        color_of!(self)
    }

    /// See [`Self::color`].
    pub fn color_mut(&mut self) -> Option<&mut P::Color> {
        color_of!(self)
    }
}

fn white<C: From<Vec3>>() -> C {
    Vec3::ONE.into()
}

fn zero<S: From<f32>>() -> S {
    0.0.into()
}

fn is_zero<S: From<f32> + PartialEq>(scalar: &S) -> bool {
    *scalar == zero()
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

fn one() -> f32 {
    1.0
}

fn glass_ior() -> f32 {
    1.5
}

fn dull() -> f32 {
    20.0
}

impl Material {
    /// Whether light can pass through the surface.
    pub(crate) fn is_clear(&self) -> bool {
        match self {
            Self::Glass { .. } | Self::RoughGlass { .. } => true,
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
            Self::Glass { absorption, .. } | Self::RoughGlass { absorption, .. } | Self::Phong { absorption, .. } => {
                self.is_clear() && *absorption != Vec3::ZERO
            }
            _ => false,
        }
    }

    /// Whether it, or a part of it, is specular everywhere: a mirror or glass.
    pub(crate) fn is_specular(&self, materials: &[Self]) -> bool {
        match self {
            Self::Mirror { .. } | Self::Glass { .. } => true,
            Self::Metal { alpha, .. } | Self::RoughGlass { alpha, .. } => {
                matches!(alpha, ScalarInput::Constant(alpha) if *alpha < SMALLEST_ALPHA)
            }
            Self::Phong { specular, transparency, .. } => {
                *transparency > 0.0 || !matches!(specular, ScalarInput::Constant(share) if *share <= 0.0)
            }
            Self::Blend { a, b, .. } => [a, b].into_iter().any(|&id| materials[id as usize].is_specular(materials)),
            Self::Diffuse { .. } | Self::Emissive { .. } => false,
        }
    }

    /// Whether it, or a part of it, looks up a texture.
    pub(crate) fn is_textured(&self, materials: &[Self]) -> bool {
        self.any_texture(materials, &mut |_| true)
    }

    /// Whether a texture of it, or of a part of it, asks for more than the first surface coordinates.
    pub(crate) fn asks_for_more_than_uv(&self, materials: &[Self], textures: &[Texture]) -> bool {
        self.any_texture(materials, &mut |id| textures[id as usize].asks_for_more_than_uv())
    }

    fn any_texture(&self, materials: &[Self], is_so: &mut impl FnMut(TextureId) -> bool) -> bool {
        self.params().into_iter().any(|(_, param)| match param {
            Param::Reflectance(ColorInput::Texture(id))
            | Param::Radiance(ColorInput::Texture(id))
            | Param::Share(ScalarInput::Texture(id)) => is_so(*id),
            Param::Part(part) => materials[*part as usize].any_texture(materials, is_so),
            _ => false,
        })
    }
}

/// The light that a material adds itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance of the emissive material, W·m⁻²·sr⁻¹, before `scale`.
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
