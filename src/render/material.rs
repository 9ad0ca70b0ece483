//! What a surface does to light.

use super::TextureId;
use glam::Vec3;

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
    /// f = (1 − weight) f_a + weight f_b; `a` and `b` are not emissive.
    Blend { weight: ScalarInput, a: MaterialId, b: MaterialId },
    /// A black body: emits on its front (a sphere outwards, a face along its normal), reflects nothing.
    Emissive { radiance: ColorInput },
}
