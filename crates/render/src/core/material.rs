//! Materials: one enum for the scene file, the world and the snapshot.
//!
//! [`Material`] is the same in all three except for its references ([`Params`]): a texture and another material are
//! names in a file, entities in the world and indices in a snapshot. [`Material::map`] converts between them. To add a
//! kind of material, start here: its variant, its [`kind`](Material::kind), its rows in `map`, `params_of` and
//! [`of_kind`](Material::of_kind).

use super::material_defaults::{
    along_tangent, black, dull, film_ior, flat, glass_ior, half, is_along_tangent, is_black, is_default, is_film_ior,
    is_flat, is_half, is_one, is_one_number, is_thick, is_thin, is_white, is_yes, is_zero, light_grey, one, one_scalar,
    thick, thin, white, yes, zero,
};
use super::material_kind::{MaterialKind, Param};
use crate::core::texture::TextureId;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

/// Width below which a GGX surface is a mirror: its lobe is narrower than directions in `f32` can resolve.
pub(crate) const SMALLEST_ALPHA: f32 = 1e-4;

/// Maximum number of lobes of a blend, including nested ones; see [`Material::n_lobes`].
pub const MAX_LOBES: usize = 8;

/// Index into the materials of a snapshot.
pub type MaterialId = u32;

/// Types of a material's parameters and references.
pub trait Params {
    /// A colour, linear Rec. 709, constant or textured.
    type Color: Clone + Debug + PartialEq + From<Vec3>;
    /// A dimensionless number, constant or textured.
    type Scalar: Clone + Debug + PartialEq + From<f32>;
    /// A constant colour.
    type Rgb: Copy + Debug + Default + PartialEq + From<Vec3> + Into<Vec3>;
    /// Another material.
    type Material: Clone + Debug + PartialEq;
}

/// Parameters of a snapshot: references by index into its tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InSnapshot;

impl Params for InSnapshot {
    type Color = ColorInput;
    type Scalar = ScalarInput;
    type Rgb = Vec3;
    type Material = MaterialId;
}

/// A colour, linear Rec. 709, constant or textured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorInput {
    /// A constant colour.
    Constant(Vec3),
    /// The colour of a texture at the surface point.
    Texture(TextureId),
}

/// A dimensionless number, constant or the red channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScalarInput {
    /// A constant number.
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

/// Angular dependence of a metal's reflectance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fresnel {
    /// The reflectance is the same at every angle.
    #[default]
    Constant,
    /// The reflectance rises to 1 at grazing angles by Schlick's approximation (Schlick 1994).
    Schlick,
}

/// A closed set of materials; all are two-sided except for emission.
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
        /// Reflected share of light, per channel, 0..1.
        albedo: P::Color,
    },
    /// Perfect mirror with the same reflectance at every angle.
    Mirror {
        /// Reflected share of light, per channel, 0..1.
        #[serde(default = "white")]
        reflectance: P::Color,
    },
    /// Isotropic GGX microfacets.
    Metal {
        /// GGX width, 0..1: the square of what other programs call roughness.
        alpha: P::Scalar,
        /// Reflectance at normal incidence, per channel, 0..1.
        reflectance: P::Color,
        /// Angular dependence of the reflectance.
        #[serde(default, skip_serializing_if = "is_default")]
        fresnel: Fresnel,
        /// Compensate the energy that single scattering loses, see `shading::metal`.
        #[serde(default, skip_serializing_if = "is_default")]
        compensate: bool,
    },
    /// Smooth dielectric with exact Fresnel.
    Glass {
        /// Index of refraction.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// Absorption inside, per metre (Beer–Lambert).
        #[serde(default, skip_serializing_if = "is_default")]
        absorption: P::Rgb,
        /// Dispersion: 20 divided by the Abbe number, 0 for none; see [`Material::iors`].
        #[serde(default, skip_serializing_if = "is_default")]
        dispersion: f32,
    },
    /// Dielectric with GGX microfacets that reflect and refract, each with exact Fresnel (Walter et al. 2007).
    RoughGlass {
        /// GGX width, 0..1: the square of what other programs call roughness.
        alpha: P::Scalar,
        /// Index of refraction.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// Absorption inside, per metre (Beer–Lambert).
        #[serde(default, skip_serializing_if = "is_default")]
        absorption: P::Rgb,
        /// Dispersion, as for glass.
        #[serde(default, skip_serializing_if = "is_default")]
        dispersion: f32,
        /// Compensate the energy that single scattering loses, after Kulla and Conty 2017.
        #[serde(default, skip_serializing_if = "is_default")]
        compensate: bool,
    },
    /// The classic local model. In path tracing it is diffuse, mirror and glass in shares that sum to 1:
    /// `transparency`, of the rest `specular`, of the rest `diffuse`.
    Phong {
        /// Diffusely reflected share of the light that is neither transmitted nor mirrored; per channel, 0..1.
        diffuse: P::Color,
        /// Reflected share of the ambient light, relative to `diffuse`.
        #[serde(default = "one")]
        ambient: f32,
        /// Mirrored share, 0..1; lights appear in it as highlights.
        #[serde(default = "zero", skip_serializing_if = "is_zero")]
        specular: P::Scalar,
        /// Exponent of the highlights.
        #[serde(default = "dull")]
        shininess: f32,
        /// Transmitted share, 0..1.
        #[serde(default, skip_serializing_if = "is_default")]
        transparency: f32,
        /// Index of refraction of the transparent part, as for glass.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// Absorption of the transparent part, as for glass.
        #[serde(default, skip_serializing_if = "is_default")]
        absorption: P::Rgb,
    },
    /// Layers with the parameters of glTF 2.0 and of most programs: a clear coat, on a sheen, on a base that is metal,
    /// or a dielectric over a diffuse or transmissive layer; see `shading/principled`.
    Principled {
        /// Reflected share of light of the base, per channel, 0..1.
        #[serde(default = "light_grey")]
        base_color: P::Color,
        /// Share of the base that is metal, 0..1.
        #[serde(default = "zero", skip_serializing_if = "is_zero")]
        metallic: P::Scalar,
        /// Root of the GGX width α of the base, 0..1.
        #[serde(default = "half")]
        roughness: P::Scalar,
        /// Index of refraction of the dielectric.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// Strength of the reflection of the dielectric, 0..1.
        #[serde(default = "one_scalar", skip_serializing_if = "is_one")]
        specular: P::Scalar,
        /// Colour of the reflection of the dielectric at normal incidence, a factor per channel, 0 or more.
        #[serde(default = "white", skip_serializing_if = "is_white")]
        specular_color: P::Color,
        /// Share of the dielectric that transmits light instead of scattering it, 0..1.
        #[serde(default = "zero", skip_serializing_if = "is_zero")]
        transmission: P::Scalar,
        /// Light is transmitted as by a pane without thickness: not refracted, and not absorbed.
        #[serde(default, skip_serializing_if = "is_default")]
        thin_walled: bool,
        /// Absorption inside, per metre (Beer–Lambert).
        #[serde(default, skip_serializing_if = "is_default")]
        absorption: P::Rgb,
        /// Dispersion of what is transmitted by a solid, as for glass.
        #[serde(default, skip_serializing_if = "is_default")]
        dispersion: f32,
        /// Anisotropy, 0..1: the ratio of the widths along the tangent and across grows from 1 to 1/α; see
        /// `KHR_materials_anisotropy`.
        #[serde(default = "zero", skip_serializing_if = "is_zero")]
        anisotropy: P::Scalar,
        /// Direction of anisotropy, degrees from the tangent, counter-clockwise.
        #[serde(default, skip_serializing_if = "is_default")]
        anisotropy_rotation: f32,
        /// Red and green: direction of anisotropy relative to the tangent, 0.5 is 0; blue: factor of its strength.
        #[serde(default = "along_tangent", skip_serializing_if = "is_along_tangent")]
        anisotropy_map: P::Color,
        /// Strength of the sheen at grazing angles, per channel, 0..1.
        #[serde(default = "black", skip_serializing_if = "is_black")]
        sheen_color: P::Color,
        /// Root of the width of the sheen, 0..1.
        #[serde(default = "half", skip_serializing_if = "is_half")]
        sheen_roughness: P::Scalar,
        /// Share of the surface with a clear coat of index 1.5, 0..1.
        #[serde(default = "zero", skip_serializing_if = "is_zero")]
        clearcoat: P::Scalar,
        /// Root of the GGX width α of the coat, 0..1.
        #[serde(default = "zero", skip_serializing_if = "is_zero")]
        clearcoat_roughness: P::Scalar,
        /// Normal map of the coat, relative to the interpolated normal, as in `normal_map`.
        #[serde(default = "flat", skip_serializing_if = "is_flat")]
        clearcoat_normal_map: P::Color,
        /// Share of the surface with a thin film, whose reflection is coloured by interference, 0..1.
        #[serde(default = "zero", skip_serializing_if = "is_zero")]
        iridescence: P::Scalar,
        /// Index of refraction of the thin film.
        #[serde(default = "film_ior", skip_serializing_if = "is_film_ior")]
        iridescence_ior: f32,
        /// Thickness of the film in nanometres where `iridescence_map` is 0; `iridescence_max` applies where it is 1.
        #[serde(default = "thin", skip_serializing_if = "is_thin")]
        iridescence_min: f32,
        /// See `iridescence_min`.
        #[serde(default = "thick", skip_serializing_if = "is_thick")]
        iridescence_max: f32,
        /// Position between the two, 0..1.
        #[serde(default = "one_scalar", skip_serializing_if = "is_one")]
        iridescence_map: P::Scalar,
        /// Radiance emitted by the front, in addition to reflection, W·sr⁻¹·m⁻².
        #[serde(default = "black", skip_serializing_if = "is_black")]
        emission: P::Color,
        /// Opacity, 0..1: rays pass the rest without refraction.
        #[serde(default = "one_scalar", skip_serializing_if = "is_one")]
        opacity: P::Scalar,
        /// If given, the surface is present where its opacity is at least this, and absent elsewhere, 0..1.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        opacity_cutoff: Option<f32>,
        /// Normals in the frame of tangent, bitangent and normal; 0..1 encodes −1..1.
        #[serde(default = "flat", skip_serializing_if = "is_flat")]
        normal_map: P::Color,
        /// Factor of the first two components of `normal_map`.
        #[serde(default = "one", skip_serializing_if = "is_one_number")]
        normal_scale: f32,
        /// Whether the back is visible, and emits like the front; otherwise rays pass it.
        #[serde(default = "yes", skip_serializing_if = "is_yes")]
        two_sided: bool,
    },
    /// f = (1 − weight) f_a + weight f_b, and the same for emission. At most one part is emissive, and then `weight`
    /// is constant: see `Emission::of`.
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
        /// Emitted radiance, W·sr⁻¹·m⁻².
        radiance: P::Color,
    },
}

/// A parameter by reference.
pub type ParamRef<'a, P> = Param<
    &'a <P as Params>::Color,
    &'a <P as Params>::Scalar,
    &'a f32,
    &'a bool,
    &'a Option<f32>,
    &'a <P as Params>::Rgb,
    &'a <P as Params>::Material,
>;

/// A parameter by mutable reference.
pub type ParamMut<'a, P> = Param<
    &'a mut <P as Params>::Color,
    &'a mut <P as Params>::Scalar,
    &'a mut f32,
    &'a mut bool,
    &'a mut Option<f32>,
    &'a mut <P as Params>::Rgb,
    &'a mut <P as Params>::Material,
>;

/// The parameters with their names in a scene file, for a reference to a material or a mutable one.
macro_rules! params_of {
    ($material:expr) => {
        match $material {
            Material::Diffuse { albedo } => vec![("albedo", Param::Reflectance(albedo))],
            Material::Mirror { reflectance } => vec![("reflectance", Param::Reflectance(reflectance))],
            Material::Metal { alpha, reflectance, fresnel: _, compensate: _ } => {
                vec![("alpha", Param::Share(alpha)), ("reflectance", Param::Reflectance(reflectance))]
            }
            Material::Glass { ior, absorption, dispersion } => vec![
                ("ior", Param::Ior(ior)),
                ("absorption", Param::Absorption(absorption)),
                ("dispersion", Param::Dispersion(dispersion)),
            ],
            Material::RoughGlass { alpha, ior, absorption, dispersion, compensate: _ } => vec![
                ("alpha", Param::Share(alpha)),
                ("ior", Param::Ior(ior)),
                ("absorption", Param::Absorption(absorption)),
                ("dispersion", Param::Dispersion(dispersion)),
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
            Material::Principled {
                base_color,
                metallic,
                roughness,
                ior,
                specular,
                specular_color,
                transmission,
                thin_walled,
                absorption,
                dispersion,
                anisotropy,
                anisotropy_rotation,
                anisotropy_map,
                sheen_color,
                sheen_roughness,
                clearcoat,
                clearcoat_roughness,
                clearcoat_normal_map,
                iridescence,
                iridescence_ior,
                iridescence_min,
                iridescence_max,
                iridescence_map,
                emission,
                opacity,
                opacity_cutoff,
                normal_map,
                normal_scale,
                two_sided,
            } => vec![
                ("base_color", Param::Reflectance(base_color)),
                ("metallic", Param::Share(metallic)),
                ("roughness", Param::Share(roughness)),
                ("ior", Param::Ior(ior)),
                ("specular", Param::Share(specular)),
                ("specular_color", Param::Factor(specular_color)),
                ("transmission", Param::Share(transmission)),
                ("thin_walled", Param::Flag(thin_walled)),
                ("absorption", Param::Absorption(absorption)),
                ("dispersion", Param::Dispersion(dispersion)),
                ("anisotropy", Param::Share(anisotropy)),
                ("anisotropy_rotation", Param::Number(anisotropy_rotation)),
                ("anisotropy_map", Param::Map(anisotropy_map)),
                ("sheen_color", Param::Reflectance(sheen_color)),
                ("sheen_roughness", Param::Share(sheen_roughness)),
                ("clearcoat", Param::Share(clearcoat)),
                ("clearcoat_roughness", Param::Share(clearcoat_roughness)),
                ("clearcoat_normal_map", Param::Map(clearcoat_normal_map)),
                ("iridescence", Param::Share(iridescence)),
                ("iridescence_ior", Param::Ior(iridescence_ior)),
                ("iridescence_min", Param::Thickness(iridescence_min)),
                ("iridescence_max", Param::Thickness(iridescence_max)),
                ("iridescence_map", Param::Share(iridescence_map)),
                ("emission", Param::Radiance(emission)),
                ("opacity", Param::Share(opacity)),
                ("opacity_cutoff", Param::Cutoff(opacity_cutoff)),
                ("normal_map", Param::Map(normal_map)),
                ("normal_scale", Param::Number(normal_scale)),
                ("two_sided", Param::Flag(two_sided)),
            ],
            Material::Blend { weight, a, b } => {
                vec![("weight", Param::Share(weight)), ("a", Param::Part(a)), ("b", Param::Part(b))]
            }
            Material::Emissive { radiance } => vec![("radiance", Param::Radiance(radiance))],
        }
    };
}

/// The main colour, for a reference to a material or a mutable one.
macro_rules! color_of {
    ($material:expr) => {
        match $material {
            Material::Diffuse { albedo: color }
            | Material::Mirror { reflectance: color }
            | Material::Metal { reflectance: color, .. }
            | Material::Phong { diffuse: color, .. }
            | Material::Principled { base_color: color, .. }
            | Material::Emissive { radiance: color } => Some(color),
            Material::Glass { .. } | Material::RoughGlass { .. } | Material::Blend { .. } => None,
        }
    };
}

/// Conversion of a material's references; see [`Material::map`].
pub trait MapParams<From: Params, To: Params> {
    /// Converts a colour.
    fn color(&mut self, color: &From::Color) -> To::Color;
    /// Converts a number.
    fn scalar(&mut self, scalar: &From::Scalar) -> To::Scalar;
    /// Converts a reference to another material.
    fn material(&mut self, material: &From::Material) -> To::Material;
}

impl<P: Params> Material<P> {
    /// Returns the same material with converted references.
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
            Self::Glass { ior, absorption, dispersion } => {
                Material::Glass { ior: *ior, absorption: rgb(absorption), dispersion: *dispersion }
            }
            Self::RoughGlass { alpha, ior, absorption, dispersion, compensate } => Material::RoughGlass {
                alpha: to.scalar(alpha),
                ior: *ior,
                absorption: rgb(absorption),
                dispersion: *dispersion,
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
            Self::Principled {
                base_color,
                metallic,
                roughness,
                ior,
                specular,
                specular_color,
                transmission,
                thin_walled,
                absorption,
                dispersion,
                anisotropy,
                anisotropy_rotation,
                anisotropy_map,
                sheen_color,
                sheen_roughness,
                clearcoat,
                clearcoat_roughness,
                clearcoat_normal_map,
                iridescence,
                iridescence_ior,
                iridescence_min,
                iridescence_max,
                iridescence_map,
                emission,
                opacity,
                opacity_cutoff,
                normal_map,
                normal_scale,
                two_sided,
            } => Material::Principled {
                base_color: to.color(base_color),
                metallic: to.scalar(metallic),
                roughness: to.scalar(roughness),
                ior: *ior,
                specular: to.scalar(specular),
                specular_color: to.color(specular_color),
                transmission: to.scalar(transmission),
                thin_walled: *thin_walled,
                absorption: rgb(absorption),
                dispersion: *dispersion,
                anisotropy: to.scalar(anisotropy),
                anisotropy_rotation: *anisotropy_rotation,
                anisotropy_map: to.color(anisotropy_map),
                sheen_color: to.color(sheen_color),
                sheen_roughness: to.scalar(sheen_roughness),
                clearcoat: to.scalar(clearcoat),
                clearcoat_roughness: to.scalar(clearcoat_roughness),
                clearcoat_normal_map: to.color(clearcoat_normal_map),
                iridescence: to.scalar(iridescence),
                iridescence_ior: *iridescence_ior,
                iridescence_min: *iridescence_min,
                iridescence_max: *iridescence_max,
                iridescence_map: to.scalar(iridescence_map),
                emission: to.color(emission),
                opacity: to.scalar(opacity),
                opacity_cutoff: *opacity_cutoff,
                normal_map: to.color(normal_map),
                normal_scale: *normal_scale,
                two_sided: *two_sided,
            },
            Self::Blend { weight, a, b } => {
                Material::Blend { weight: to.scalar(weight), a: to.material(a), b: to.material(b) }
            }
            Self::Emissive { radiance } => Material::Emissive { radiance: to.color(radiance) },
        }
    }

    /// Its parameters with their names in a scene file, without those that are no quantity.
    pub fn params(&self) -> Vec<(&'static str, ParamRef<'_, P>)> {
        params_of!(self)
    }

    /// Its parameters for modification, otherwise as in [`Self::params`].
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
            Self::Principled { .. } => MaterialKind::Principled,
            Self::Blend { .. } => MaterialKind::Blend,
        }
    }

    /// Contribution to [`MAX_LOBES`] as a part of a blend; a blend itself counts by its parts.
    pub fn n_lobes(&self) -> usize {
        match self {
            Self::Phong { .. } => 3,
            Self::Principled { .. } => 2,
            _ => 1,
        }
    }

    /// Returns a plain material of a kind, with common parameters; `None` for a blend.
    ///
    /// - `color`: the main colour, see [`Self::color`].
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
            MaterialKind::Glass => Self::Glass { ior: glass_ior(), absorption: P::Rgb::default(), dispersion: 0.0 },
            MaterialKind::RoughGlass => Self::RoughGlass {
                alpha: P::Scalar::from(0.04),
                ior: glass_ior(),
                absorption: P::Rgb::default(),
                dispersion: 0.0,
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
            MaterialKind::Principled => Self::principled(color),
            MaterialKind::Emissive => Self::Emissive { radiance: color },
            MaterialKind::Blend => return None,
        })
    }

    /// Returns a principled material of this colour, with the defaults of a scene file for all other parameters.
    pub fn principled(base_color: P::Color) -> Self {
        Self::Principled {
            base_color,
            metallic: zero(),
            roughness: half(),
            ior: glass_ior(),
            specular: one_scalar(),
            specular_color: white(),
            transmission: zero(),
            thin_walled: false,
            absorption: P::Rgb::default(),
            dispersion: 0.0,
            anisotropy: zero(),
            anisotropy_rotation: 0.0,
            anisotropy_map: along_tangent(),
            sheen_color: black(),
            sheen_roughness: half(),
            clearcoat: zero(),
            clearcoat_roughness: zero(),
            clearcoat_normal_map: flat(),
            iridescence: zero(),
            iridescence_ior: film_ior(),
            iridescence_min: thin(),
            iridescence_max: thick(),
            iridescence_map: one_scalar(),
            emission: black(),
            opacity: one_scalar(),
            opacity_cutoff: None,
            normal_map: flat(),
            normal_scale: 1.0,
            two_sided: true,
        }
    }

    /// The main colour: albedo, reflectance, diffuse colour or radiance; `None` if there is none.
    #[inline]
    pub fn color(&self) -> Option<&P::Color> {
        color_of!(self)
    }

    /// See [`Self::color`].
    pub fn color_mut(&mut self) -> Option<&mut P::Color> {
        color_of!(self)
    }
}
