//! Materials: one table for the scene file, the world and the snapshot.
//!
//! [`Material`] is the same in all three except for its references ([`Params`]): a texture and another material are
//! names in a file, entities in the world and indices in a snapshot. [`Material::map`] converts between them. To add a
//! kind of material or a parameter, start at the table here: files, checks, edits, animation, the window and the
//! reference pages read it.

pub use crate::core::fresnel::Fresnel;
use crate::core::material_params::has_value;
pub use crate::core::material_params::{
    ColorInput, InSnapshot, MapParams, MaterialId, Param, ParamMut, ParamRef, Params, ScalarInput,
};
use crate::core::material_table::{initial, mapped, materials, value_of};
use crate::core::property::{Domain, Property, Value, ValueType};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Width below which a GGX surface is a mirror: its lobe is narrower than directions in `f32` can resolve.
pub(crate) const SMALLEST_ALPHA: f32 = 1e-4;

/// Maximum number of lobes of a blend, including nested ones; see [`Material::n_lobes`].
pub const MAX_LOBES: usize = 8;

materials! {
    /// Lambert: f = albedo / π.
    Diffuse "diffuse" (albedo) {
        /// reflected share of light; f = albedo / π
        albedo: P::Color, Color(Reflectance), "colour";
    }

    /// A diffuse base under a smooth or rough dielectric: the `plastic` and `roughplastic` of Mitsuba 3, and the
    /// `coateddiffuse` of pbrt-v4 in closed form; see `shading/plastic`.
    Plastic "plastic" (diffuse) {
        /// albedo of the base
        diffuse: P::Color, Color(Reflectance), "colour";
        /// width of the coat's microfacets: the square of what other programs call roughness
        alpha: P::Scalar, Scalar(Width) = 0.0, "roughness";
        /// index of refraction of the coat
        ior: f32, Number(Ior) = 1.5, "IOR";
        /// strength of the reflection of the coat
        specular: P::Scalar, Scalar(Share) = 1.0, "specular";
        /// the base colours light at every bounce below the coat
        nonlinear: bool, Flag(Choice) = true, "nonlinear";
        /// microfacets of Beckmann, without long tails, instead of GGX
        beckmann: bool, Flag(Choice) = false, "Beckmann";
    }

    /// Lambert on both sides: light is reflected and transmitted in all directions, as by paper or a leaf.
    Translucent "translucent" (reflectance) {
        /// share of light that is scattered back
        reflectance: P::Color, Color(Reflectance), "reflected";
        /// share that is scattered to the far side; both together return at most all light
        transmittance: P::Color, Color(Reflectance), "transmitted";
    }

    /// Layers with the parameters of glTF 2.0 and of most programs: a clear coat, on a sheen, on a base that is metal,
    /// or a dielectric over a diffuse or transmissive layer; see `shading/principled`.
    Principled "principled" (base_color) {
        /// albedo, reflectance of metal, tint of transmitted light
        base_color: P::Color, Color(Reflectance) = Vec3::splat(0.8), "colour";
        /// fraction of metal: 0 is a dielectric, 1 metal
        metallic: P::Scalar, Scalar(Share) = 0.0, "metallic";
        /// square root of the GGX width α: 0 is a mirror, 1 rough
        roughness: P::Scalar, Scalar(Share) = 0.5, "roughness";
        /// index of refraction of the dielectric
        ior: f32, Number(Ior) = 1.5, "IOR";
        /// strength of the reflection of the dielectric
        specular: P::Scalar, Scalar(Share) = 1.0, "specular";
        /// colour of that reflection at normal incidence
        specular_color: P::Color, Color(Factor) = Vec3::ONE, "specular colour";
        /// fraction of the dielectric that transmits: 0 is opaque, 1 glass
        transmission: P::Scalar, Scalar(Share) = 0.0, "transmission";
        /// transmit as a pane without thickness, unbent
        thin_walled: bool, Flag(Choice) = false, "thin walled";
        /// absorption coefficient inside, 1/m (Beer–Lambert)
        absorption: P::Rgb, Rgb(Absorption) = Vec3::ZERO, "absorption";
        /// 20 / Abbe number, of solids: 0.3 to 0.8 for glass, 0.36 for diamond
        dispersion: f32, Number(Dispersion) = 0.0, "dispersion";
        /// elongation of highlights; α along it is α + (1 − α) · anisotropy²
        anisotropy: P::Scalar, Scalar(Share) = 0.0, "anisotropy";
        /// direction of elongation, from the direction of u, counter-clockwise
        anisotropy_rotation: f32, Number(Degrees) = 0.0, "anisotropy angle";
        /// red, green: direction, 0.5 is 0; blue: factor of `anisotropy`
        anisotropy_map: P::Color, Color(Map) = Vec3::new(1.0, 0.5, 1.0), "anisotropy map";
        /// reflection of fibres at grazing angles
        sheen_color: P::Color, Color(Reflectance) = Vec3::ZERO, "sheen colour";
        /// square root of the width of the sheen: 0 is sharp at the rim, 1 wide
        sheen_roughness: P::Scalar, Scalar(Share) = 0.5, "sheen roughness";
        /// strength of a coat with an index of 1.5
        clearcoat: P::Scalar, Scalar(Share) = 0.0, "clearcoat";
        /// square root of its GGX width: 0 is a mirror, 1 rough
        clearcoat_roughness: P::Scalar, Scalar(Share) = 0.0, "coat roughness";
        /// normal map of the coat alone
        clearcoat_normal_map: P::Color, Color(Map) = Vec3::new(0.5, 0.5, 1.0), "coat normals";
        /// fraction that has a thin film, coloured by interference (Belcour and Barla 2017)
        iridescence: P::Scalar, Scalar(Share) = 0.0, "iridescence";
        /// index of refraction of the film
        iridescence_ior: f32, Number(Ior) = 1.3, "film IOR";
        /// thickness of the film where its map is 0, nm
        iridescence_min: f32, Number(Nanometres) = 100.0, "film at least";
        /// thickness of the film where its map is 1, nm
        iridescence_max: f32, Number(Nanometres) = 400.0, "film at most";
        /// interpolates between the two
        iridescence_map: P::Scalar, Scalar(Share) = 1.0, "film map";
        /// radiance emitted by the front, W·m⁻²·sr⁻¹
        emission: P::Color, Color(Radiance) = Vec3::ZERO, "emission";
        /// coverage: 1 is opaque, 0 is a hole
        opacity: P::Scalar, Scalar(Share) = 1.0, "opacity";
        /// opaque where `opacity` is at least this, a hole elsewhere
        opacity_cutoff: Option<f32>, Cutoff(Share) = None, "cutoff";
        /// tangent-space normals: 0…1 for −1…1
        normal_map: P::Color, Color(Map) = Vec3::new(0.5, 0.5, 1.0), "normals";
        /// factor of their slope
        normal_scale: f32, Number(Scale) = 1.0, "normal scale";
        /// the back is visible and emits; `false`: rays pass through it
        two_sided: bool, Flag(Choice) = true, "two-sided";
    }

    /// The BSDF of Disney as Mitsuba 3 evaluates it in `principled` and `principledthin`; see `shading/disney`.
    Disney "disney" (base_color) {
        /// albedo, reflectance of metal, tint of transmitted light
        base_color: P::Color, Color(Reflectance) = Vec3::splat(0.5), "colour";
        /// fraction of metal: 0 is a dielectric, 1 metal
        metallic: P::Scalar, Scalar(Share) = 0.0, "metallic";
        /// square root of the GGX width α, which is at least 0.001
        roughness: P::Scalar, Scalar(Share) = 0.5, "roughness";
        /// length of highlights along u: α / √(1 − 0.9 anisotropic), and times it across
        anisotropic: P::Scalar, Scalar(Share) = 0.0, "anisotropy";
        /// index of refraction of the dielectric
        ior: f32, Number(Ior) = 1.5, "IOR";
        /// share of the dielectric's reflection that has the hue of `base_color`
        specular_tint: P::Scalar, Scalar(Share) = 0.0, "specular tint";
        /// fraction of the dielectric that transmits: 0 is opaque, 1 glass
        transmission: P::Scalar, Scalar(Share) = 0.0, "transmission";
        /// a sheet without thickness: `principledthin`, without metal and coat
        thin_walled: bool, Flag(Choice) = false, "thin walled";
        /// twice the fraction of a sheet's diffuse light that goes to the far side
        diffuse_transmission: P::Scalar, Scalar(Factor) = 0.0, "diffuse transmission";
        /// share of the base that is a thin subsurface layer
        flatness: P::Scalar, Scalar(Share) = 0.0, "flatness";
        /// strength of the light that is added at grazing angles
        sheen: P::Scalar, Scalar(Share) = 0.0, "sheen";
        /// share of the sheen that has the hue of `base_color`
        sheen_tint: P::Scalar, Scalar(Share) = 0.0, "sheen tint";
        /// strength of a coat, of which a quarter is added
        clearcoat: P::Scalar, Scalar(Share) = 0.0, "clearcoat";
        /// its width: 0 is 0.1, 1 is 0.001
        clearcoat_gloss: P::Scalar, Scalar(Share) = 0.0, "coat gloss";
    }

    /// Perfect mirror with the same reflectance at every angle.
    Mirror "mirror" (reflectance) {
        /// reflected share, the same at every angle
        reflectance: P::Color, Color(Reflectance) = Vec3::ONE, "colour";
    }

    /// Isotropic GGX microfacets.
    Metal "metal" (reflectance) {
        /// GGX width: the square of what other programs call roughness
        alpha: P::Scalar, Scalar(Width), "roughness";
        /// reflected share at normal incidence
        reflectance: P::Color, Color(Reflectance), "colour";
        /// `constant`, or `schlick`: rises to 1 at grazing angles
        fresnel: Fresnel, Fresnel(Choice) = Fresnel::Constant, "Fresnel";
        /// return the energy that single scattering loses
        compensate: bool, Flag(Choice) = false, "compensate";
    }

    /// Microfacets of a metal with the exact Fresnel term of unpolarised light.
    Conductor "conductor" {
        /// width of the microfacets: the square of what other programs call roughness
        alpha: P::Scalar, Scalar(Width) = 0.0, "roughness";
        /// the same along the direction of v, where `alpha` is that of u; 0: `alpha`
        alpha_v: P::Scalar, Scalar(Width) = 0.0, "roughness along v";
        /// microfacets of Beckmann, without long tails, instead of GGX
        beckmann: bool, Flag(Choice) = false, "Beckmann";
        /// index of refraction, per channel
        eta: P::Rgb, Rgb(Factor) = Vec3::new(0.143, 0.375, 1.442), "eta";
        /// extinction coefficient, per channel
        k: P::Rgb, Rgb(Factor) = Vec3::new(3.983, 2.386, 1.603), "k";
        /// factor of the reflection
        reflectance: P::Color, Color(Reflectance) = Vec3::ONE, "colour";
        /// return the energy that single scattering of GGX loses
        compensate: bool, Flag(Choice) = false, "compensate";
    }

    /// Smooth dielectric with exact Fresnel.
    Glass "glass" {
        /// index of refraction: water 1.33, glass 1.5, diamond 2.4
        ior: f32, Number(Ior) = 1.5, "IOR";
        /// absorption coefficient inside, 1/m (Beer–Lambert)
        absorption: P::Rgb, Rgb(Absorption) = Vec3::ZERO, "absorption";
        /// 20 / Abbe number: 0.3 to 0.8 for glass, 0.36 for diamond
        dispersion: f32, Number(Dispersion) = 0.0, "dispersion";
    }

    /// A pane of smooth glass without thickness, with all reflections between its two sides.
    ThinGlass "thin_glass" {
        /// index of refraction: water 1.33, glass 1.5, diamond 2.4
        ior: f32, Number(Ior) = 1.5, "IOR";
        /// factor of reflected light
        reflectance: P::Color, Color(Reflectance) = Vec3::ONE, "reflected";
        /// factor of transmitted light
        transmittance: P::Color, Color(Reflectance) = Vec3::ONE, "transmitted";
    }

    /// Dielectric with microfacets that reflect and refract, each with exact Fresnel (Walter et al. 2007).
    RoughGlass "rough_glass" {
        /// width of the microfacets: the square of what other programs call roughness
        alpha: P::Scalar, Scalar(Width), "roughness";
        /// index of refraction: water 1.33, glass 1.5, diamond 2.4
        ior: f32, Number(Ior) = 1.5, "IOR";
        /// absorption coefficient inside, 1/m (Beer–Lambert)
        absorption: P::Rgb, Rgb(Absorption) = Vec3::ZERO, "absorption";
        /// 20 / Abbe number: 0.3 to 0.8 for glass, 0.36 for diamond
        dispersion: f32, Number(Dispersion) = 0.0, "dispersion";
        /// return what single scattering of GGX loses (Kulla and Conty 2017)
        compensate: bool, Flag(Choice) = false, "compensate";
        /// microfacets of Beckmann, without long tails, instead of GGX
        beckmann: bool, Flag(Choice) = false, "Beckmann";
    }

    /// The classic local model. In path tracing it is diffuse, mirror and glass in shares that sum to 1:
    /// `transparency`, of the rest `specular`, of the rest `diffuse`.
    Phong "phong" (diffuse) {
        /// albedo of what is neither glass nor mirror
        diffuse: P::Color, Color(Reflectance), "colour";
        /// share of ambient light that `diffuse` reflects
        ambient: f32, Number(Share) = 1.0, "ambient";
        /// mirrored share of what is not glass; lights appear in it as highlights
        specular: P::Scalar, Scalar(Share) = 0.0, "specular";
        /// exponent of highlights: 20 is broad, 200 is sharp
        shininess: f32, Number(Exponent) = 20.0, "shininess";
        /// share that is glass
        transparency: f32, Number(Share) = 0.0, "transparency";
        /// index of refraction of that share
        ior: f32, Number(Ior) = 1.5, "IOR";
        /// its absorption coefficient inside, 1/m (Beer–Lambert)
        absorption: P::Rgb, Rgb(Absorption) = Vec3::ZERO, "absorption";
    }

    /// A black body: emits on its front (a sphere outwards, a face along its normal), reflects nothing.
    Emissive "emissive" (radiance) {
        /// emitted radiance, W·m⁻²·sr⁻¹
        radiance: P::Color, Color(Radiance), "radiance";
    }

    /// f = (1 − weight) f_a + weight f_b, and the same for emission. At most one part is emissive, and then `weight`
    /// is constant: see `Emission::of`. Holes and normals are those of the whole: parts have none of their own.
    Blend "blend" {
        /// share of `b`: 0 is only `a`, 1 only `b`
        weight: P::Scalar, Scalar(Share), "weight";
        /// the material at weight 0, also another blend
        a: P::Material, Part(Reference), "first";
        /// the material at weight 1, also another blend
        b: P::Material, Part(Reference), "second";
        /// whatever the weight, `a` is the front and `b` the back
        by_side: bool, Flag(Choice) = false, "by side";
        /// coverage: 1 is opaque, 0 is a hole
        opacity: P::Scalar, Scalar(Share) = 1.0, "opacity";
        /// opaque where `opacity` is at least this, a hole elsewhere
        opacity_cutoff: Option<f32>, Cutoff(Share) = None, "cutoff";
        /// tangent-space normals: 0…1 for −1…1
        normal_map: P::Color, Color(Map) = Vec3::new(0.5, 0.5, 1.0), "normals";
        /// factor of their slope
        normal_scale: f32, Number(Scale) = 1.0, "normal scale";
        /// mapped normals as in Mitsuba 3, which dims light that grazes them
        normal_shadowing: bool, Flag(Choice) = false, "normal shadowing";
    }
}

impl MaterialKind {
    pub(crate) const N: usize = Self::ALL.len();

    /// The kinds into which a material can be converted; a blend needs two others.
    pub fn plain() -> impl Iterator<Item = Self> {
        Self::ALL.iter().copied().filter(|kind| *kind != Self::Blend)
    }
}

impl<P: Params> Material<P> {
    /// Returns a diffuse material.
    pub fn diffuse(albedo: impl Into<P::Color>) -> Self {
        Self::Diffuse { albedo: albedo.into() }
    }

    /// Returns a mirror.
    pub fn mirror(reflectance: impl Into<P::Color>) -> Self {
        Self::Mirror { reflectance: reflectance.into() }
    }

    /// Returns clear, smooth glass.
    pub fn glass(ior: f32) -> Self {
        Self::Glass { ior, absorption: Vec3::ZERO.into(), dispersion: 0.0 }
    }

    /// Returns a material that emits light, W·m⁻²·sr⁻¹, and reflects none.
    pub fn emissive(radiance: impl Into<P::Color>) -> Self {
        Self::Emissive { radiance: radiance.into() }
    }

    /// Returns a principled material of this colour, with the defaults of a scene file for all other parameters.
    pub fn principled(base_color: P::Color) -> Self {
        Self::of_kind(MaterialKind::Principled, base_color).expect("it is no blend")
    }

    /// Returns a blend of two materials, without holes and normal map.
    pub fn blend(weight: P::Scalar, a: P::Material, b: P::Material) -> Self {
        let mut blend = Self::initial(MaterialKind::Blend, &Vec3::ZERO.into(), || a.clone());
        if let Self::Blend { weight: of_second, b: second, .. } = &mut blend {
            (*of_second, *second) = (weight, b);
        }
        blend
    }

    /// Returns a plain material of a kind, with common parameters; `None` for a blend.
    ///
    /// - `color`: the main colour, see [`Self::color`].
    pub fn of_kind(kind: MaterialKind, color: P::Color) -> Option<Self> {
        if kind == MaterialKind::Blend {
            return None;
        }
        let mut material = Self::initial(kind, &color, || unreachable!("only blends have parts"));
        match &mut material {
            Self::Metal { alpha, fresnel, compensate, .. } => {
                (*alpha, *fresnel, *compensate) = (0.04.into(), Fresnel::Schlick, true);
            }
            Self::RoughGlass { alpha, compensate, .. } => (*alpha, *compensate) = (0.04.into(), true),
            Self::Conductor { alpha, compensate, .. } => (*alpha, *compensate) = (0.04.into(), true),
            Self::Plastic { alpha, .. } => *alpha = 0.04.into(),
            Self::Phong { specular, shininess, .. } => (*specular, *shininess) = (0.2.into(), 50.0),
            _ => {}
        }
        if let Some(main) = material.color_mut() {
            *main = color;
        }
        Some(material)
    }

    /// Whether its highlights have a direction, which the texture coordinates of its surface tell.
    pub fn is_anisotropic(&self) -> bool {
        match self {
            Self::Conductor { alpha_v: share, .. }
            | Self::Disney { anisotropic: share, .. }
            | Self::Principled { anisotropy: share, .. } => *share != 0.0.into(),
            _ => false,
        }
    }

    /// The parameters that do not have their default, as in [`Self::params`].
    pub fn given(&self) -> Vec<(&'static Property, ParamRef<'_, P>)> {
        let mut params = self.params();
        params.retain(|(property, param)| !property.default.is_some_and(|default| has_value::<P>(param, default)));
        params
    }

    /// Contribution to [`MAX_LOBES`] as a part of a blend; a blend itself counts by its parts.
    pub fn n_lobes(&self) -> usize {
        match self {
            Self::Phong { .. } => 3,
            Self::Principled { .. } => 2,
            _ => 1,
        }
    }
}
