//! Materials as plain values: the core of glTF and its ratified extensions, with their textures.
//!
//! Source: Khronos, "glTF 2.0 Specification", §3.9, and the `KHR_materials_*` and `KHR_texture_transform` extensions.

use crate::error::gltf::{Located, item, place};
use crate::gltf::document::Document;
use crate::gltf::json::{Extensions, TextureRef};
use crate::gltf::omissions::omission;
use firstlight_format::bounds;
use firstlight_render::Wrap;
use glam::{DVec2, Vec3};
use serde::Deserialize;
use serde_json::Value;
use std::collections::HashSet;

/// A use of an image. Texture coordinates as in glTF, with v downwards.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TextureUse {
    pub image: u32,
    pub uv_set: u32,
    pub offset: DVec2,
    /// Radians.
    pub rotation: f64,
    pub scale: DVec2,
    pub wrap: [Wrap; 2],
    pub smooth: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum AlphaMode {
    #[default]
    Opaque,
    /// Visible where alpha is at least this.
    Mask(f32),
    Blend,
}

/// All parameters of a material, with the defaults of the format.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GltfMaterial {
    pub name: Option<String>,
    /// Linear RGBA.
    pub base_color: [f32; 4],
    pub base_color_texture: Option<TextureUse>,
    pub metallic: f32,
    pub roughness: f32,
    /// Green: roughness; blue: metallic.
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Instead of the roughness: `1 - roughness`, and a texture whose alpha is a factor of that.
    pub glossiness: Option<(f32, Option<TextureUse>)>,
    pub normal_texture: Option<TextureUse>,
    pub normal_scale: f32,
    pub has_occlusion: bool,
    /// `emissiveFactor` times `emissiveStrength`.
    pub emission: Vec3,
    pub emissive_texture: Option<TextureUse>,
    pub alpha: AlphaMode,
    pub double_sided: bool,
    pub unlit: bool,
    pub ior: f32,
    pub specular: f32,
    pub specular_texture: Option<TextureUse>,
    pub specular_color: Vec3,
    pub specular_color_texture: Option<TextureUse>,
    pub transmission: f32,
    pub transmission_texture: Option<TextureUse>,
    /// 0: a thin wall.
    pub thickness: f32,
    pub attenuation_color: Vec3,
    /// Metres.
    pub attenuation_distance: f32,
    pub clearcoat: f32,
    pub clearcoat_texture: Option<TextureUse>,
    pub clearcoat_roughness: f32,
    pub clearcoat_roughness_texture: Option<TextureUse>,
    pub clearcoat_normal_texture: Option<TextureUse>,
    pub iridescence: f32,
    pub iridescence_texture: Option<TextureUse>,
    pub iridescence_ior: f32,
    /// Thickness of the film, nanometres: where its texture is 0, and where it is 1 or there is no texture.
    pub iridescence_thickness: [f32; 2],
    pub iridescence_thickness_texture: Option<TextureUse>,
    pub sheen_color: Vec3,
    pub sheen_color_texture: Option<TextureUse>,
    pub sheen_roughness: f32,
    pub sheen_roughness_texture: Option<TextureUse>,
    pub anisotropy: f32,
    /// Radians.
    pub anisotropy_rotation: f32,
    pub anisotropy_texture: Option<TextureUse>,
    pub dispersion: f32,
    /// Unsupported features; the text follows the name of the material.
    pub notes: Vec<String>,
}

/// Reads values from an extension object; missing and invalid ones get the default.
struct Fields<'a>(Option<&'a Value>);

impl Fields<'_> {
    fn number(&self, name: &str, default: f32) -> f32 {
        let value = self.0.and_then(|object| object.get(name)).and_then(Value::as_f64).map(|value| value as f32);
        value.filter(|value| value.is_finite()).unwrap_or(default)
    }

    fn color(&self, name: &str, default: Vec3) -> Vec3 {
        let list = self.0.and_then(|object| object.get(name)).and_then(Value::as_array);
        let numbers: Option<Vec<f32>> =
            list.map(|list| list.iter().filter_map(Value::as_f64).map(|value| value as f32).collect());
        match numbers.as_deref() {
            Some(&[r, g, b]) if r.is_finite() && g.is_finite() && b.is_finite() => Vec3::new(r, g, b).max(Vec3::ZERO),
            _ => default,
        }
    }

    fn has(&self, name: &str) -> bool {
        self.0.is_some_and(|object| object.get(name).is_some())
    }

    fn four(&self, name: &str, default: [f32; 4]) -> [f32; 4] {
        let value = self.0.and_then(|object| object.get(name));
        let numbers = value.and_then(|value| <[f32; 4]>::deserialize(value).ok());
        numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite())).unwrap_or(default)
    }

    fn texture(&self, name: &str) -> Option<TextureRef> {
        self.0.and_then(|object| object.get(name)).and_then(|value| TextureRef::deserialize(value).ok())
    }
}

impl Document {
    /// The material of this index; `None`, and for one that does not exist: the default material of the format. Broken
    /// textures are left out.
    pub(crate) fn material(&self, index: Option<u32>) -> GltfMaterial {
        let default = crate::gltf::json::Material::default();
        let json = index.and_then(|index| self.root.materials.get(index as usize)).unwrap_or(&default);
        let mut notes = Vec::new();
        let mut texture = |reference: Option<&TextureRef>| {
            let reference = reference?;
            self.texture_use(reference, &mut notes).unwrap_or_else(|located| {
                notes.push(omission(&place("textures", reference.index), &located));
                None
            })
        };
        let extension = |name: &str| Fields(json.extensions.get(&format!("KHR_materials_{name}")));
        let unit = |value: f32| value.clamp(0.0, 1.0);
        let pbr = json.pbr_metallic_roughness.as_ref();
        let base_color = pbr.and_then(|pbr| pbr.base_color_factor).unwrap_or([1.0; 4]).map(|c| unit(c as f32));
        let emission = json.emissive_factor.unwrap_or([0.0; 3]).map(|c| (c as f32).max(0.0));
        let strength = extension("emissive_strength").number("emissiveStrength", 1.0).max(0.0);
        let (specular, transmission, volume) = (extension("specular"), extension("transmission"), extension("volume"));
        let (clearcoat, sheen, anisotropy) = (extension("clearcoat"), extension("sheen"), extension("anisotropy"));
        let iridescence = extension("iridescence");
        let mut material = GltfMaterial {
            name: json.name.clone().filter(|name| !name.is_empty()),
            base_color,
            base_color_texture: texture(pbr.and_then(|pbr| pbr.base_color_texture.as_ref())),
            metallic: unit(pbr.and_then(|pbr| pbr.metallic_factor).unwrap_or(1.0) as f32),
            roughness: unit(pbr.and_then(|pbr| pbr.roughness_factor).unwrap_or(1.0) as f32),
            metallic_roughness_texture: texture(pbr.and_then(|pbr| pbr.metallic_roughness_texture.as_ref())),
            glossiness: None,
            normal_texture: texture(json.normal_texture.as_ref()),
            normal_scale: (json.normal_texture.as_ref().and_then(|normal| normal.scale).map(|scale| scale as f32))
                .filter(|scale| scale.is_finite())
                .unwrap_or(1.0),
            has_occlusion: json.occlusion_texture.is_some(),
            emission: (Vec3::from(emission) * strength).min(Vec3::splat(f32::MAX)),
            emissive_texture: texture(json.emissive_texture.as_ref()),
            alpha: match json.alpha_mode.as_deref() {
                Some("MASK") => AlphaMode::Mask(json.alpha_cutoff.unwrap_or(0.5) as f32),
                Some("BLEND") => AlphaMode::Blend,
                _ => AlphaMode::Opaque,
            },
            double_sided: json.double_sided,
            unlit: json.extensions.contains_key("KHR_materials_unlit"),
            // 0 means a perfect reflector, which is not supported.
            ior: Some(extension("ior").number("ior", 1.5)).filter(|ior| *ior >= 1.0).unwrap_or(1.5),
            specular: unit(specular.number("specularFactor", 1.0)),
            specular_texture: texture(specular.texture("specularTexture").as_ref()),
            specular_color: specular.color("specularColorFactor", Vec3::ONE),
            specular_color_texture: texture(specular.texture("specularColorTexture").as_ref()),
            transmission: unit(transmission.number("transmissionFactor", 0.0)),
            transmission_texture: texture(transmission.texture("transmissionTexture").as_ref()),
            thickness: volume.number("thicknessFactor", 0.0).max(0.0),
            attenuation_color: volume.color("attenuationColor", Vec3::ONE).min(Vec3::ONE),
            attenuation_distance: volume.number("attenuationDistance", f32::INFINITY),
            clearcoat: unit(clearcoat.number("clearcoatFactor", 0.0)),
            clearcoat_texture: texture(clearcoat.texture("clearcoatTexture").as_ref()),
            clearcoat_roughness: unit(clearcoat.number("clearcoatRoughnessFactor", 0.0)),
            clearcoat_roughness_texture: texture(clearcoat.texture("clearcoatRoughnessTexture").as_ref()),
            clearcoat_normal_texture: texture(clearcoat.texture("clearcoatNormalTexture").as_ref()),
            iridescence: unit(iridescence.number("iridescenceFactor", 0.0)),
            iridescence_texture: texture(iridescence.texture("iridescenceTexture").as_ref()),
            iridescence_ior: iridescence.number("iridescenceIor", 1.3).max(1.0),
            iridescence_thickness: [
                iridescence.number("iridescenceThicknessMinimum", 100.0).max(0.0),
                iridescence.number("iridescenceThicknessMaximum", 400.0).max(0.0),
            ],
            iridescence_thickness_texture: texture(iridescence.texture("iridescenceThicknessTexture").as_ref()),
            sheen_color: sheen.color("sheenColorFactor", Vec3::ZERO).min(Vec3::ONE),
            sheen_color_texture: texture(sheen.texture("sheenColorTexture").as_ref()),
            sheen_roughness: unit(sheen.number("sheenRoughnessFactor", 0.0)),
            sheen_roughness_texture: texture(sheen.texture("sheenRoughnessTexture").as_ref()),
            anisotropy: unit(anisotropy.number("anisotropyStrength", 0.0)),
            anisotropy_rotation: anisotropy.number("anisotropyRotation", 0.0),
            anisotropy_texture: texture(anisotropy.texture("anisotropyTexture").as_ref()),
            dispersion: extension("dispersion").number("dispersion", 0.0).max(0.0),
            notes: Vec::new(),
        };
        let glossy = Fields(json.extensions.get("KHR_materials_pbrSpecularGlossiness"));
        if glossy.0.is_some() {
            /// What a dielectric with an index of 1.5 reflects of light that meets it at a right angle.
            const FACING: f32 = 0.04;
            let map = texture(glossy.texture("specularGlossinessTexture").as_ref());
            let [r, g, b, alpha] = glossy.four("diffuseFactor", [1.0; 4]);
            material.base_color = [unit(r), unit(g), unit(b), unit(alpha)];
            material.base_color_texture = texture(glossy.texture("diffuseTexture").as_ref());
            (material.metallic, material.metallic_roughness_texture, material.ior) = (0.0, None, 1.5);
            (material.specular, material.specular_texture) = (1.0, None);
            // By default all light is reflected and the diffuse colour does not show, which no file means that has one.
            let has_diffuse = glossy.has("diffuseFactor") || glossy.has("diffuseTexture");
            let usual = Vec3::splat(if has_diffuse && map.is_none() { FACING } else { 1.0 });
            material.specular_color = glossy.color("specularFactor", usual).min(Vec3::ONE) / FACING;
            material.specular_color_texture = map.clone();
            material.glossiness = Some((unit(glossy.number("glossinessFactor", 1.0)), map));
        }
        let with_volume = json.extensions.contains_key("KHR_materials_volume");
        if with_volume && volume.texture("thicknessTexture").is_some() {
            notes.push("its thickness texture is not used: light goes through the real thickness".to_owned());
        }
        let ior = extension("ior").number("ior", 1.5);
        if !(ior >= 1.0) {
            notes.push(format!("an index of refraction of {ior} is not modelled: 1.5 is used"));
        }
        if material.dispersion > 0.0 && !with_volume {
            notes.push("its dispersion is not used: it has no volume".to_owned());
        }
        if clearcoat.texture("clearcoatNormalTexture").and_then(|normal| normal.scale).is_some_and(|s| s != 1.0) {
            notes.push("the scale of its clear-coat normals is not used".to_owned());
        }
        notes.extend(unknown(&json.extensions));
        // A texture may be used in several places.
        let mut told = HashSet::new();
        notes.retain(|note| told.insert(note.clone()));
        material.notes = notes;
        material
    }

    /// `None` if the image format is not supported; a note is added then.
    fn texture_use(&self, reference: &TextureRef, notes: &mut Vec<String>) -> Result<Option<TextureUse>, Located> {
        let here = |problem| (String::new(), problem);
        let index = reference.index;
        let texture = item(&self.root.textures, "textures", index).map_err(here)?;
        let by_extension = |name: &str| {
            let source = texture.extensions.get(name).and_then(|extension| extension.get("source"));
            source.and_then(Value::as_u64).and_then(|image| u32::try_from(image).ok())
        };
        let sources = [texture.source, by_extension("EXT_texture_webp"), by_extension("KHR_texture_basisu")];
        let Some(image) = sources.into_iter().flatten().next() else {
            notes.push(format!("textures[{index}] has no image in a format that is read, and is left out"));
            return Ok(None);
        };
        item(&self.root.images, "images", image).map_err(here)?;
        let default = crate::gltf::json::Sampler::default();
        let sampler = match texture.sampler {
            None => &default,
            // Without its sampler a texture is repeated, which is most often right.
            Some(sampler) => self.root.samplers.get(sampler as usize).unwrap_or(&default),
        };
        let wrap = |number: Option<u32>| match number {
            Some(33071) => Wrap::Clamp,
            Some(33648) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        const NEAREST: u32 = 9728;
        let transform = Fields(reference.extensions.get("KHR_texture_transform"));
        let pair = |name: &str, default: f64| {
            let list = transform.0.and_then(|object| object.get(name)).and_then(Value::as_array);
            let number = |i: usize| {
                let value = list.and_then(|list| list.get(i)).and_then(Value::as_f64);
                value.filter(|value| value.abs() <= bounds::MAX_COORDINATE).unwrap_or(default)
            };
            DVec2::new(number(0), number(1))
        };
        // An angle that is hardly finite in degrees says nothing.
        let rotation = transform.0.and_then(|object| object.get("rotation")).and_then(Value::as_f64);
        let rotation = rotation.filter(|angle| angle.abs() <= bounds::MAX_COORDINATE).unwrap_or(0.0);
        let set = transform.0.and_then(|object| object.get("texCoord")).and_then(Value::as_u64);
        let uv_set = set.and_then(|set| u32::try_from(set).ok()).unwrap_or(reference.tex_coord);
        if uv_set > 1 {
            notes.push(format!("textures[{index}] uses texture coordinates {uv_set}; only 0 and 1 are read"));
            return Ok(None);
        }
        Ok(Some(TextureUse {
            image,
            uv_set,
            offset: pair("offset", 0.0),
            rotation,
            scale: pair("scale", 1.0),
            wrap: [wrap(sampler.wrap_s), wrap(sampler.wrap_t)],
            smooth: sampler.mag_filter != Some(NEAREST),
        }))
    }

    /// Whether the textures of a material use the first and the second texture coordinates.
    pub(crate) fn uv_sets(&self, index: Option<u32>) -> [bool; 2] {
        let known = index.and_then(|index| self.uv_sets.get(index as usize));
        known.map_or([false; 2], |known| *known.get_or_init(|| self.uv_sets_of(index)))
    }

    fn uv_sets_of(&self, index: Option<u32>) -> [bool; 2] {
        let material = self.material(index);
        let textures = [
            &material.base_color_texture,
            &material.metallic_roughness_texture,
            &material.normal_texture,
            &material.emissive_texture,
            &material.specular_texture,
            &material.specular_color_texture,
            &material.transmission_texture,
            &material.clearcoat_texture,
            &material.clearcoat_roughness_texture,
            &material.clearcoat_normal_texture,
            &material.iridescence_texture,
            &material.iridescence_thickness_texture,
            &material.sheen_color_texture,
            &material.sheen_roughness_texture,
            &material.anisotropy_texture,
        ];
        [0, 1].map(|set| textures.iter().any(|used| used.as_ref().is_some_and(|used| used.uv_set == set)))
    }

    /// Whether a material depends on tangents.
    pub(crate) fn needs_tangents(&self, index: Option<u32>) -> bool {
        let json = index.and_then(|index| self.root.materials.get(index as usize));
        json.is_some_and(|json| {
            let coat = json.extensions.get("KHR_materials_clearcoat");
            json.normal_texture.is_some()
                || json.extensions.contains_key("KHR_materials_anisotropy")
                || coat.is_some_and(|coat| coat.get("clearcoatNormalTexture").is_some())
        })
    }
}

/// Notes about the unsupported extensions of a material.
fn unknown(extensions: &Extensions) -> Vec<String> {
    let known = |name: &str| crate::gltf::document::SUPPORTED.contains(&name);
    let unknown = extensions.keys().filter(|name| !known(name));
    unknown.map(|name| format!("the extension `{}` is not modelled", firstlight_files::printable::name(name))).collect()
}
