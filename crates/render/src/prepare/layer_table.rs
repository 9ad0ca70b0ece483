//! Inputs of layered and translucent materials, metals, plastics and Disney's, as a table for SIMD.

use crate::core::fresnel::reflectance_of;
use crate::core::material::{ColorInput, Material, MaterialId, MaterialKind, ScalarInput};
use crate::core::texture::{Texture, TextureId};
use firstlight_simd::padded;
use glam::Vec3;

/// Kinds of hits after those of [`crate::prepare::material_table::Kinds`]: layers without transmission and thin films,
/// a base alone, or with a coat, sheen or anisotropy.
pub(crate) const LAYERED: usize = MaterialKind::N + 1;
pub(crate) const LAYERED_RICHLY: usize = LAYERED + 1;

/// Places of inputs in a row; colours have three.
pub(crate) mod input {
    /// Albedo or reflectance of all materials.
    pub const COLOR: usize = 0;

    /// Width of metals and plastics, and that of metals along v.
    pub const ALPHA: usize = 3;
    pub const ALPHA_V: usize = 4;
    /// Of conductors.
    pub const ETA: usize = 6;
    pub const K: usize = 10;
    /// Of plastics, whose coat has a strength too.
    pub const IOR: usize = 9;

    /// Of translucent materials.
    pub const TRANSMITTANCE: usize = 3;

    /// Of layers and Disney's from here on.
    pub const METALLIC: usize = 3;
    pub const ROUGHNESS: usize = 4;
    pub const COAT: usize = 18;
    pub const ANISOTROPY: usize = 20;

    /// Of Disney's, which have an index of refraction too.
    pub const SPECULAR_TINT: usize = 5;
    pub const FLATNESS: usize = 6;
    pub const SHEEN: usize = 7;
    pub const SHEEN_TINT: usize = 8;
    pub const COAT_GLOSS: usize = 19;

    /// Of layers.
    pub const SPECULAR: usize = 5;
    pub const SPECULAR_COLOR: usize = 6;
    /// Factor of the specular colour: the reflectance at normal incidence.
    pub const FACING: usize = 9;
    pub const NORMAL: usize = 10;
    pub const NORMAL_SCALE: usize = 13;
    pub const SHEEN_COLOR: usize = 14;
    pub const SHEEN_ROUGHNESS: usize = 17;
    pub const COAT_ROUGHNESS: usize = 19;
    pub const ANISOTROPY_MAP: usize = 21;
    /// Cosine and sine of the angle of anisotropy.
    pub const TURN: usize = 24;
    /// Length of a row.
    pub const N: usize = 26;
}

/// The inputs of all materials.
#[derive(Debug, Default)]
pub(crate) struct LayerTable {
    /// A row per material: inputs without textures.
    pub constants: Vec<f32>,
    /// Per material.
    pub textured: Vec<Box<[TexturedInput]>>,
    /// Whether some material has tangents.
    pub has_tangents: bool,
    /// Whether some metal is a conductor.
    pub has_conductors: bool,
}

/// An input with a texture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexturedInput {
    pub texture: TextureId,
    /// Its first place, and how many it has.
    pub input: usize,
    pub n: usize,
    /// Whether it reads the texels that the one before has read.
    pub has_texels: bool,
}

impl LayerTable {
    /// Returns the kind of a material whose inputs are those of a row, a layered one's by the layers that it can have;
    /// `None` for all others.
    pub fn kind_of(material: &Material, textures: &[Texture]) -> Option<usize> {
        match material {
            Material::Metal { .. } | Material::Conductor { .. } => return Some(MaterialKind::Metal as usize),
            Material::Plastic { .. } | Material::Translucent { .. } => return Some(material.kind() as usize),
            Material::Disney { thin_walled: false, .. } if !material.scatters_through() => {
                return Some(material.kind() as usize);
            }
            _ => {}
        }
        let Material::Principled {
            transmission,
            iridescence,
            clearcoat,
            clearcoat_normal_map,
            normal_map,
            sheen_color,
            anisotropy,
            ..
        } = material
        else {
            return None;
        };
        let is_none = |input: &ScalarInput| matches!(input, ScalarInput::Constant(share) if *share <= 0.0);
        let is_relief = matches!(normal_map, ColorInput::Texture(id) if textures[*id as usize].relief.is_some());
        if !is_none(transmission) || !is_none(iridescence) || clearcoat_normal_map.is_normal_map() || is_relief {
            return None;
        }
        let is_base = is_none(clearcoat) && is_none(anisotropy) && *sheen_color == ColorInput::Constant(Vec3::ZERO);
        Some(if is_base { LAYERED } else { LAYERED_RICHLY })
    }

    pub fn build(materials: &[Material], textures: &[Texture]) -> Self {
        let mut table = Self::default();
        for material in materials.iter().map(|material| material.scattering(materials)) {
            let mut row = Row { values: [0.0; input::N], textured: Vec::new() };
            row.fill(material);
            table.has_tangents |= Self::kind_of(material, textures).is_some() && material.asks_for_tangents();
            table.has_conductors |= matches!(material, Material::Conductor { .. });
            table.constants.extend(row.values);
            table.textured.push(row.sorted(textures));
        }
        table.constants = padded(table.constants);
        table
    }

    pub fn textured(&self, material: MaterialId) -> &[TexturedInput] {
        &self.textured[material as usize]
    }
}

struct Row {
    values: [f32; input::N],
    textured: Vec<TexturedInput>,
}

impl Row {
    fn fill(&mut self, material: &Material) {
        match material {
            Material::Metal { alpha, reflectance, .. } => {
                self.color(input::COLOR, reflectance);
                self.scalar(input::ALPHA, alpha);
                self.values[input::K..][..3].fill(1.0);
            }
            Material::Conductor { alpha, alpha_v, eta, k, reflectance, .. } => {
                self.color(input::COLOR, reflectance);
                self.scalar(input::ALPHA, alpha);
                self.scalar(input::ALPHA_V, alpha_v);
                self.color(input::ETA, &ColorInput::Constant(*eta));
                self.color(input::K, &ColorInput::Constant(*k));
            }
            Material::Plastic { diffuse, alpha, ior, specular, .. } => {
                self.color(input::COLOR, diffuse);
                self.scalar(input::ALPHA, alpha);
                self.scalar(input::SPECULAR, specular);
                self.values[input::IOR] = *ior;
            }
            Material::Translucent { reflectance, transmittance } => {
                self.color(input::COLOR, reflectance);
                self.color(input::TRANSMITTANCE, transmittance);
            }
            Material::Disney {
                base_color,
                metallic,
                roughness,
                anisotropic,
                ior,
                specular_tint,
                flatness,
                sheen,
                sheen_tint,
                clearcoat,
                clearcoat_gloss,
                ..
            } => {
                self.color(input::COLOR, base_color);
                self.values[input::IOR] = *ior;
                for (place, value) in [
                    (input::METALLIC, metallic),
                    (input::ROUGHNESS, roughness),
                    (input::ANISOTROPY, anisotropic),
                    (input::SPECULAR_TINT, specular_tint),
                    (input::FLATNESS, flatness),
                    (input::SHEEN, sheen),
                    (input::SHEEN_TINT, sheen_tint),
                    (input::COAT, clearcoat),
                    (input::COAT_GLOSS, clearcoat_gloss),
                ] {
                    self.scalar(place, value);
                }
            }
            _ => self.fill_layers(material),
        }
    }

    fn fill_layers(&mut self, material: &Material) {
        let Material::Principled {
            base_color,
            metallic,
            roughness,
            ior,
            specular,
            specular_color,
            anisotropy,
            anisotropy_rotation,
            anisotropy_map,
            sheen_color,
            sheen_roughness,
            clearcoat,
            clearcoat_roughness,
            normal_map,
            normal_scale,
            ..
        } = material
        else {
            return;
        };
        self.color(input::COLOR, base_color);
        self.scalar(input::METALLIC, metallic);
        self.scalar(input::ROUGHNESS, roughness);
        self.scalar(input::SPECULAR, specular);
        self.color(input::SPECULAR_COLOR, specular_color);
        self.values[input::FACING] = reflectance_of(*ior);
        self.color(input::NORMAL, normal_map);
        self.values[input::NORMAL_SCALE] = *normal_scale;
        self.color(input::SHEEN_COLOR, sheen_color);
        self.scalar(input::SHEEN_ROUGHNESS, sheen_roughness);
        self.scalar(input::COAT, clearcoat);
        self.scalar(input::COAT_ROUGHNESS, clearcoat_roughness);
        self.scalar(input::ANISOTROPY, anisotropy);
        self.color(input::ANISOTROPY_MAP, anisotropy_map);
        let (sin, cos) = anisotropy_rotation.to_radians().sin_cos();
        self.values[input::TURN..][..2].copy_from_slice(&[cos, sin]);
    }

    fn color(&mut self, place: usize, value: &ColorInput) {
        match value {
            ColorInput::Constant(color) => self.values[place..][..3].copy_from_slice(&color.to_array()),
            ColorInput::Texture(texture) => self.texture(place, 3, *texture),
        }
    }

    fn scalar(&mut self, place: usize, value: &ScalarInput) {
        match value {
            ScalarInput::Constant(value) => self.values[place] = *value,
            ScalarInput::Texture(texture) => self.texture(place, 1, *texture),
        }
    }

    fn texture(&mut self, input: usize, n: usize, texture: TextureId) {
        self.textured.push(TexturedInput { texture, input, n, has_texels: false });
    }

    /// The textured inputs, those of the same texels in succession.
    fn sorted(self, textures: &[Texture]) -> Box<[TexturedInput]> {
        let mut sorted: Vec<TexturedInput> = Vec::new();
        for one in self.textured {
            let is_alike =
                |other: &TexturedInput| textures[other.texture as usize].has_texels_of(&textures[one.texture as usize]);
            match sorted.iter().rposition(is_alike) {
                Some(at) => sorted.insert(at + 1, TexturedInput { has_texels: true, ..one }),
                None => sorted.push(one),
            }
        }
        sorted.into()
    }
}
