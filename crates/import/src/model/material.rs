//! Materials as model files have them: those of MTL, in which other formats are told too.

use crate::model::texture_map::TextureMap;
use glam::Vec3;
use std::path::PathBuf;

/// A material as in its file; missing values are `None`. It is interpreted elsewhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportedMaterial {
    /// Empty for faces without `usemtl`.
    pub name: String,
    /// `Ka`, ambient colour; Blender writes the share of metal.
    pub ambient: Option<Vec3>,
    /// `Kd`, diffuse colour; treated as linear.
    pub diffuse: Option<Vec3>,
    /// Whether vertex colours replace the diffuse colour, which is their mean.
    pub vertex_colors: bool,
    /// `Ks`, specular colour.
    pub specular: Option<Vec3>,
    /// `Ns`, exponent of the specular lobe, at least 0.
    pub shininess: Option<f32>,
    /// `Ke`, emitted radiance.
    pub emission: Option<Vec3>,
    /// `Tf`, transmission filter; Maya writes the opacity.
    pub transmission: Option<Vec3>,
    /// `Ni`, index of refraction.
    pub ior: Option<f32>,
    /// `d`, or 1 − `Tr`: 1 is opaque.
    pub opacity: Option<f32>,
    /// `illum`, the illumination model.
    pub illumination_model: Option<u8>,
    /// `map_Kd`.
    pub diffuse_texture: Option<TextureMap>,
    /// `map_Ke`.
    pub emission_texture: Option<TextureMap>,
    /// `map_d`.
    pub opacity_texture: Option<TextureMap>,
    /// `map_Ns`; Blender writes roughness.
    pub shininess_texture: Option<TextureMap>,
    /// `map_refl`; Blender writes the share of metal.
    pub reflection_texture: Option<TextureMap>,
    /// `norm`, a normal map.
    pub normal_texture: Option<TextureMap>,
    /// `map_Bump` or `bump`: heights, or a normal map ([`Self::normal_map`]).
    pub bump_texture: Option<TextureMap>,
    /// Parameters of the PBR extension; `None` if none of them is present.
    pub pbr: Option<PbrMaterial>,
    /// Images that are named and need not be read, which no output may replace either.
    pub beside: Vec<PathBuf>,
}

/// The PBR extension of MTL (Clara.io 2013): `Pr`, `Pm`, `Ps`, `Pc`, `Pcr`, `aniso`, `anisor` and their maps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PbrMaterial {
    /// `Pr`, 0..1.
    pub roughness: Option<f32>,
    /// `Pm`, 0..1.
    pub metallic: Option<f32>,
    /// `Ps`, 0..1.
    pub sheen: Option<f32>,
    /// `Pc`, strength of the coat, at least 0: some programs write four times the reflectance.
    pub clearcoat: Option<f32>,
    /// `Pcr`, 0..1.
    pub clearcoat_roughness: Option<f32>,
    /// `aniso`, 0..1.
    pub anisotropy: Option<f32>,
    /// `anisor`, turns.
    pub anisotropy_rotation: Option<f32>,
    /// `map_Pr`.
    pub roughness_texture: Option<TextureMap>,
    /// `map_Pm`.
    pub metallic_texture: Option<TextureMap>,
}

impl ImportedMaterial {
    /// Takes away an image that does not exist, if there is a colour beside it; black and white say nothing of an image
    /// that replaces them.
    pub(crate) fn take_lost_image(&mut self) -> Option<PathBuf> {
        let has_color = self.diffuse.is_some_and(|diffuse| diffuse != Vec3::ZERO && diffuse != Vec3::ONE);
        self.diffuse_texture.take_if(|map| has_color && !map.path.exists()).map(|map| map.path)
    }

    /// Whether the values are a set that Blender writes: all of them, greys, and the `illum` that follows from them.
    pub fn is_of_blender(&self) -> bool {
        let is_grey = |color: Vec3| color.x == color.y && color.y == color.z;
        let opaque = self.opacity.is_none_or(|opacity| opacity == 1.0);
        let is_complete = (self.shininess.is_some_and(|ns| ns <= 1000.0) || self.shininess_texture.is_some())
            && self.ambient.is_some_and(|ambient| is_grey(ambient) && ambient.x > 0.0)
            && self.specular.is_none_or(is_grey)
            && self.ior.is_some()
            && (self.opacity.is_some() || self.opacity_texture.is_some())
            && self.transmission.is_none();
        let is_consistent = match self.illumination_model {
            Some(1) => self.specular == Some(Vec3::ZERO),
            Some(2 | 3) => opaque,
            Some(6 | 9) => !opaque,
            _ => false,
        };
        is_complete && is_consistent
    }

    /// The normal map. `map_Bump` is one if the material is of Blender or has keywords of the PBR extension; otherwise
    /// it holds heights, which are not modelled.
    pub fn normal_map(&self) -> Option<&TextureMap> {
        let has_normals = self.pbr.is_some() || self.is_of_blender();
        self.normal_texture.as_ref().or(self.bump_texture.as_ref().filter(|_| has_normals))
    }
}
