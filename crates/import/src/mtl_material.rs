//! What a material of an MTL file means: from its numbers and maps to a material of a scene.
//!
//! The format is of 1992: colours and exponents of a Phong model, and `illum`, a number from 0 to 10 that says what a
//! renderer of that time should compute. Programs of today store layered materials in it, each in its own way, so the
//! meaning depends on who wrote it. docs/models.md has the table; start reading at [`MtlMaterials::part`].

use crate::model::material::{ImportedMaterial, PbrMaterial};
use crate::model::texture_map::TextureMap;
use crate::picture::{Alpha, ImageBudget, alpha_of};
use firstlight_format::parts::MaterialPart;
use firstlight_format::sources::TextureSource;
use firstlight_format::value::{ColorValue, Rgb, ScalarValue};
use firstlight_render::{Channel, Encoding, Wrap};
use glam::{DVec2, Vec3};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Exponents from here on belong to mirrors: textbooks write 900 to 1024, and for Blender it is a roughness below 0.05.
const MIRROR_EXPONENT: f32 = 900.0;

/// Converts materials and collects their textures.
#[derive(Debug, Default)]
pub(crate) struct MtlMaterials {
    /// Name, description and image of each texture.
    pub textures: Vec<(String, TextureSource, PathBuf)>,
    names: HashSet<String>,
    /// Alpha of the images that were looked at, by their real paths, and the pixels that may be decoded for it.
    alphas: HashMap<PathBuf, Alpha>,
    pixels: ImageBudget,
}

impl MtlMaterials {
    /// The material of the scene.
    pub fn part(&mut self, material: &ImportedMaterial) -> MaterialPart {
        let meaning = Meaning::of(material);
        match meaning.kind {
            SurfaceKind::Light { radiance } => MaterialPart::Emissive { radiance: self.emission(material, radiance) },
            SurfaceKind::Mirror { reflectance } => MaterialPart::Mirror { reflectance: share(reflectance) },
            SurfaceKind::Glass => {
                MaterialPart::Glass { ior: ior(material), absorption: Rgb::default(), dispersion: 0.0 }
            }
            SurfaceKind::Diffuse => MaterialPart::Diffuse { albedo: self.base_color(material, meaning.base) },
            SurfaceKind::Layered => self.layered(material, &meaning),
        }
    }

    fn layered(&mut self, material: &ImportedMaterial, meaning: &Meaning) -> MaterialPart {
        let mut layers = MaterialPart::principled(self.base_color(material, meaning.base));
        let MaterialPart::Principled {
            metallic,
            roughness,
            ior: index,
            specular,
            specular_color,
            transmission,
            anisotropy,
            anisotropy_rotation,
            sheen_color,
            clearcoat,
            clearcoat_roughness,
            emission,
            opacity,
            normal_map,
            normal_scale,
            ..
        } = &mut layers
        else {
            unreachable!("a principled material is one")
        };
        let pbr = material.pbr.clone().unwrap_or_default();
        let number = |number: Option<f32>| ScalarValue::Number(number.unwrap_or(0.0));
        *metallic = self.data_or(meaning.metallic_map, meaning.metallic);
        *roughness = self.data_or(meaning.roughness_map, meaning.roughness);
        *index = ior(material);
        let strength = meaning.specular.max_element();
        *specular = ScalarValue::Number((2.0 * strength).min(1.0));
        if strength > 0.0 {
            *specular_color = ColorValue::Rgb(meaning.specular / strength);
        }
        *transmission = ScalarValue::Number(if meaning.transmits { 1.0 } else { 0.0 });
        *opacity = self.opacity(material, meaning.opacity);
        *anisotropy = number(pbr.anisotropy);
        *anisotropy_rotation = 360.0 * pbr.anisotropy_rotation.unwrap_or(0.0);
        *sheen_color = ColorValue::grey(pbr.sheen.unwrap_or(0.0));
        *clearcoat = number(pbr.clearcoat.map(|strength| strength.min(1.0)));
        *clearcoat_roughness = number(pbr.clearcoat_roughness);
        *emission = self.emission(material, material.emission.unwrap_or(Vec3::ZERO));
        if let Some(map) = material.normal_map() {
            (*normal_map, *normal_scale) = (ColorValue::Texture(self.data(map, None)), map.bump_scale.unwrap_or(1.0));
        }
        layers
    }

    fn base_color(&mut self, material: &ImportedMaterial, plain: Vec3) -> ColorValue {
        if material.vertex_colors {
            let source = TextureSource::VertexColors { channel: None, tint: Rgb(Vec3::ONE) };
            return ColorValue::Texture(self.add("vertex colors".to_owned(), source, PathBuf::new()));
        }
        self.color(material.diffuse_texture.as_ref(), Vec3::ONE).unwrap_or(share(plain))
    }

    /// A map counts with the factor `Ke`, which some programs leave at 0.
    fn emission(&mut self, material: &ImportedMaterial, radiance: Vec3) -> ColorValue {
        let tint = if radiance == Vec3::ZERO { Vec3::ONE } else { radiance };
        self.color(material.emission_texture.as_ref(), tint).unwrap_or(ColorValue::Rgb(radiance))
    }

    /// A map counts with the factor `d`, which some programs leave at 0.
    ///
    /// Its channel is that of `-imfchan`; otherwise alpha if it says anything, as Blender writes it, else red, which is
    /// the luminance of a grey image.
    fn opacity(&mut self, material: &ImportedMaterial, opacity: f32) -> ScalarValue {
        let Some(map) = &material.opacity_texture else { return ScalarValue::Number(opacity) };
        let is_of_color = material.diffuse_texture.as_ref().is_some_and(|color| color.path == map.path);
        let channel = match map.channel {
            Some(channel) => Some(channel),
            None => match self.alpha(&map.path) {
                Alpha::Varies => Some(Channel::A),
                Alpha::Uniform if is_of_color => return ScalarValue::Number(opacity),
                Alpha::Uniform | Alpha::Missing => None,
            },
        };
        let factor = if opacity > 0.0 { opacity } else { 1.0 };
        ScalarValue::Texture(self.data(&TextureMap { gain: factor * map.gain, ..map.clone() }, channel))
    }

    /// That an image cannot be read is told when its texture is.
    fn alpha(&mut self, path: &Path) -> Alpha {
        let real = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let pixels = &self.pixels;
        *self.alphas.entry(real).or_insert_with(|| alpha_of(path, pixels).unwrap_or(Alpha::Missing))
    }

    fn data_or(&mut self, map: Option<&TextureMap>, plain: f32) -> ScalarValue {
        map.map_or(ScalarValue::Number(plain), |map| ScalarValue::Texture(self.data(map, map.channel)))
    }

    /// Adds a texture that holds data instead of colours, and returns its name.
    fn data(&mut self, map: &TextureMap, channel: Option<Channel>) -> String {
        self.image(map, Encoding::Linear, channel, Vec3::ONE)
    }

    fn color(&mut self, map: Option<&TextureMap>, tint: Vec3) -> Option<ColorValue> {
        let map = map?;
        let encoding = if map.is_linear { Encoding::Linear } else { Encoding::Auto };
        Some(ColorValue::Texture(self.image(map, encoding, map.channel, tint)))
    }

    /// The name has all that differs, since other meshes of a scene may use the same image in another way.
    fn image(&mut self, map: &TextureMap, encoding: Encoding, channel: Option<Channel>, tint: Vec3) -> String {
        let tint = map.gain * tint;
        let mut source = TextureSource::image(map.path.display().to_string());
        if let TextureSource::Image { repeat, offset, wrap, encoding: own, channel: of, tint: factor, .. } = &mut source
        {
            (*repeat, *offset, *own, *of, *factor) = (map.repeat, map.offset, encoding, channel, Rgb(tint));
            *wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
        }
        let differences = [
            (encoding == Encoding::Linear).then(|| "data".to_owned()),
            channel.map(|channel| format!("channel {channel:?}")),
            (map.repeat != DVec2::ONE).then(|| format!("repeat {}", map.repeat)),
            (map.offset != DVec2::ZERO).then(|| format!("offset {}", map.offset)),
            map.clamp.then(|| "clamp".to_owned()),
            (tint != Vec3::ONE).then(|| format!("tint {tint}")),
        ];
        let differences: Vec<String> = differences.into_iter().flatten().collect();
        let file = map.path.display();
        let name =
            if differences.is_empty() { file.to_string() } else { format!("{file} ({})", differences.join(", ")) };
        self.add(name, source, map.path.clone())
    }

    fn add(&mut self, name: String, source: TextureSource, path: PathBuf) -> String {
        if self.names.insert(name.clone()) {
            self.textures.push((name.clone(), source, path));
        }
        name
    }
}

fn share(color: Vec3) -> ColorValue {
    ColorValue::Rgb(color.clamp(Vec3::ZERO, Vec3::ONE))
}

/// An index of 1, which many programs write for everything, would reflect nothing.
fn ior(material: &ImportedMaterial) -> f32 {
    material.ior.filter(|_| refracts(material)).unwrap_or(1.5)
}

fn refracts(material: &ImportedMaterial) -> bool {
    material.ior.is_none_or(|ior| (ior - 1.0).abs() > 0.01)
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum SurfaceKind {
    /// A light whose surface is not seen beside what it emits.
    Light {
        radiance: Vec3,
    },
    Mirror {
        reflectance: Vec3,
    },
    Glass,
    Diffuse,
    Layered,
}

/// What the numbers of a material mean, whoever wrote them.
#[derive(Debug)]
struct Meaning<'a> {
    kind: SurfaceKind,
    /// Base colour without texture.
    base: Vec3,
    metallic: f32,
    metallic_map: Option<&'a TextureMap>,
    roughness: f32,
    roughness_map: Option<&'a TextureMap>,
    /// `Ks` of the highlight of the dielectric: 0.5 and above are 4 %, as in Blender.
    specular: Vec3,
    opacity: f32,
    /// Layered glass.
    transmits: bool,
}

impl<'a> Meaning<'a> {
    fn of(material: &'a ImportedMaterial) -> Self {
        let illum = material.illumination_model;
        let is_glass = matches!(illum, Some(4 | 6 | 7 | 9)) && refracts(material) && !material.is_of_blender();
        let has_image = material.diffuse_texture.is_some() || material.opacity_texture.is_some();
        let mut meaning = match &material.pbr {
            Some(pbr) => Self::of_pbr(material, pbr),
            None if material.is_of_blender() => Self::of_blender(material),
            None => Self::of_phong(material),
        };
        // A colour texture of the PBR extension tints glass; elsewhere it says that there is a surface.
        let has_surface = if material.pbr.is_some() { material.opacity_texture.is_some() } else { has_image };
        // `illum` alone says too little: some programs write 7 for everything that reflects.
        let is_black = material.diffuse.is_none_or(|color| color == Vec3::ZERO);
        let is_seen_through = material.ior.is_some() || meaning.opacity < 1.0 || is_black;
        if is_glass && is_seen_through && !has_surface {
            (meaning.transmits, meaning.opacity) = (true, 1.0);
        }
        let glow = material.emission.unwrap_or(Vec3::ZERO);
        let glows = glows(material);
        let is_plain = material.pbr.is_none() && !has_image && meaning.opacity == 1.0;
        let is_black = !material.vertex_colors && meaning.base == Vec3::ZERO && meaning.specular == Vec3::ZERO;
        let outshines = glow.max_element() > 1.0 && !material.is_of_blender();
        let has_maps = meaning.metallic_map.is_some() || meaning.roughness_map.is_some();
        let is_sharp = material.shininess.is_none_or(|exponent| exponent >= MIRROR_EXPONENT);
        let is_mirror = meaning.metallic == 1.0 && is_sharp && !has_maps && !material.vertex_colors;
        let has_layers = meaning.metallic > 0.0 || has_maps || meaning.specular != Vec3::ZERO;
        meaning.kind = if is_plain && glows && (is_black || outshines) {
            SurfaceKind::Light { radiance: glow }
        } else if is_plain && !glows && meaning.transmits {
            SurfaceKind::Glass
        } else if is_plain && !glows && is_mirror && material.normal_map().is_none() {
            SurfaceKind::Mirror { reflectance: meaning.base }
        } else if is_plain_surface(material, meaning.opacity) && !glows && !has_layers {
            SurfaceKind::Diffuse
        } else {
            SurfaceKind::Layered
        };
        meaning
    }

    /// `Ns` = 1000 (1 − roughness)², `Ka` = metallic, `Ks` = half the specular level, alpha in `d`.
    fn of_blender(material: &'a ImportedMaterial) -> Self {
        let is_metal = matches!(material.illumination_model, Some(3 | 6));
        let exponent = material.shininess.unwrap_or(250.0);
        let ambient = material.ambient.map_or(1.0, |ambient| ambient.x.min(1.0));
        Self {
            metallic: if is_metal { ambient } else { 0.0 },
            metallic_map: material.reflection_texture.as_ref(),
            roughness: 1.0 - (exponent / 1000.0).min(1.0).sqrt(),
            roughness_map: material.shininess_texture.as_ref(),
            specular: material.specular.unwrap_or(Vec3::splat(0.5)),
            ..Self::diffuse(material, 0.6)
        }
    }

    /// Phong: the highlight becomes one of the same width; `illum` 3 and 5 reflect the share `Ks`.
    fn of_phong(material: &'a ImportedMaterial) -> Self {
        let mut meaning = Self::diffuse(material, 0.6);
        let specular = material.specular.unwrap_or(Vec3::ZERO).clamp(Vec3::ZERO, Vec3::ONE);
        let exponent = material.shininess.unwrap_or(0.0);
        // A GGX lobe of the width α has that of the Phong exponent 2 / α² − 2.
        meaning.roughness = (2.0 / (exponent + 2.0)).sqrt().sqrt();
        if matches!(material.illumination_model, Some(3 | 5)) {
            let has_color = material.diffuse_texture.is_some() || material.vertex_colors;
            let is_dark = material.diffuse.is_none_or(|diffuse| diffuse.max_element() < 0.02);
            let is_sharp = material.shininess.is_none_or(|exponent| exponent >= MIRROR_EXPONENT);
            if !has_color && (is_dark || is_sharp) {
                (meaning.base, meaning.metallic) = (material.specular.unwrap_or(Vec3::splat(0.9)), 1.0);
            } else {
                meaning.metallic = specular.max_element();
            }
        }
        // Below an exponent of 1 there is no highlight to be seen; `illum` 0 and 1 have none.
        if exponent >= 1.0 && !matches!(material.illumination_model, Some(0 | 1)) {
            meaning.specular = specular;
        }
        meaning
    }

    /// Keywords of the PBR extension say what they mean.
    fn of_pbr(material: &'a ImportedMaterial, pbr: &'a PbrMaterial) -> Self {
        Self {
            metallic: pbr.metallic.unwrap_or(0.0),
            metallic_map: pbr.metallic_texture.as_ref(),
            roughness: pbr.roughness.unwrap_or(0.5),
            roughness_map: pbr.roughness_texture.as_ref(),
            specular: Vec3::splat(0.5),
            ..Self::diffuse(material, 0.8)
        }
    }

    fn diffuse(material: &ImportedMaterial, grey: f32) -> Self {
        Self {
            kind: SurfaceKind::Diffuse,
            base: material.diffuse.unwrap_or(if glows(material) { Vec3::ZERO } else { Vec3::splat(grey) }),
            metallic: 0.0,
            metallic_map: None,
            roughness: 1.0,
            roughness_map: None,
            specular: Vec3::ZERO,
            opacity: opacity(material),
            transmits: false,
        }
    }
}

fn glows(material: &ImportedMaterial) -> bool {
    material.emission.is_some_and(|emission| emission != Vec3::ZERO) || material.emission_texture.is_some()
}

/// Whether it has neither holes nor a normal map.
fn is_plain_surface(material: &ImportedMaterial, opacity: f32) -> bool {
    let has_map = material.opacity_texture.is_some() || material.normal_map().is_some();
    material.pbr.is_none() && opacity == 1.0 && !has_map
}

/// Maya writes `illum 4` for every material, and its opacity as `Tf`.
fn opacity(material: &ImportedMaterial) -> f32 {
    let of_maya = material.transmission.filter(|_| material.illumination_model == Some(4) && !refracts(material));
    material.opacity.or(of_maya.map(|filter| filter.element_sum() / 3.0)).unwrap_or(1.0).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obj::load_obj;

    fn material(lines: &str) -> ImportedMaterial {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.mtl"), format!("newmtl a\n{lines}\n")).unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n").unwrap();
        load_obj(&path).unwrap().materials.remove(0)
    }

    fn part(lines: &str) -> MaterialPart {
        MtlMaterials::default().part(&material(lines))
    }

    /// Roughness, metallic, specular, opacity.
    fn layers(lines: &str) -> [f32; 4] {
        let MaterialPart::Principled { roughness, metallic, specular, opacity, .. } = part(lines) else {
            panic!("{lines}: {:?}", part(lines))
        };
        [roughness, metallic, specular, opacity].map(|value| match value {
            ScalarValue::Number(number) => (1000.0 * number).round() / 1000.0,
            ScalarValue::Texture(_) => -1.0,
        })
    }

    fn grey(value: f32) -> ColorValue {
        ColorValue::grey(value)
    }

    #[test]
    fn mirrors_and_glass_of_textbooks_stay() {
        for lines in
            ["Kd 0 0 0\nKs .9 .9 .9\nNs 1000\nillum 3", "Ka 0 0 0\nKd .2 .2 .2\nKs .9\nNs 1024\nillum 5", "illum 3"]
        {
            assert_eq!(part(lines), MaterialPart::Mirror { reflectance: grey(0.9) }, "{lines}");
        }
        let glass = MaterialPart::Glass { ior: 1.5, absorption: Rgb::default(), dispersion: 0.0 };
        for lines in [
            "illum 4",
            "Ka 0 0 0\nKd 0 0 0\nKs 1 1 1\nNs 200\nNi 1.5\nillum 7",
            "Ka .04 .04 .04\nKd .1 .1 .1\nKs .2 .2 .2\nTf .98 .98 .98\nNs 32\nNi 1.5\nillum 6",
            "Ni 1.5\nd 0.1\nillum 9",
        ] {
            assert_eq!(part(lines), glass, "{lines}");
        }
    }

    #[test]
    fn highlights_become_rough_ones_of_their_width() {
        // MeshLab and OpenGL: an exponent of 0 is no highlight.
        for lines in
            ["Kd .8\nKs 1 1 1\nNs 0\nillum 2", "Kd .8\nKs 0 0 0\nNs 90", "Kd .8\nKs 1\nNs 90\nillum 1", "Kd .8"]
        {
            assert_eq!(part(lines), MaterialPart::Diffuse { albedo: grey(0.8) }, "{lines}");
        }
        assert_eq!(layers("Kd .8\nKs .9\nNs 10\nillum 2"), [0.639, 0.0, 1.0, 1.0]);
        assert_eq!(layers("Kd .8\nKs .1\nNs 1000"), [0.211, 0.0, 0.2, 1.0]);
        let MaterialPart::Principled { specular_color, .. } = part("Kd .7 .6 .2\nKs .6 .3 .15\nNs 50") else {
            panic!()
        };
        assert_eq!(specular_color, ColorValue::rgb(1.0, 0.5, 0.25));
        // Reflection of a glossy floor.
        assert_eq!(layers("Kd .8\nKs .25\nNs 200\nillum 3"), [0.315, 0.25, 0.5, 1.0]);
    }

    #[test]
    fn blender_stores_its_layers() {
        let set = "Ka 1 1 1\nKs .5 .5 .5\nKe 0 0 0\nNi 1.45\nKd .8 .6 .2\n";
        assert_eq!(layers(&format!("{set}Ns 250\nd 1\nillum 2")), [0.5, 0.0, 1.0, 1.0]);
        assert_eq!(layers(&format!("{set}Ns 250\nd 1\nillum 3")), [0.5, 1.0, 1.0, 1.0]);
        assert_eq!(layers(&format!("{set}Ns 250\nd .5\nillum 9")), [0.5, 0.0, 1.0, 0.5]);
        assert_eq!(layers(&format!("{set}Ns 40\nd .25\nillum 6")), [0.8, 1.0, 1.0, 0.25]);
        let partly = set.replace("Ka 1 1 1", "Ka .3 .3 .3");
        assert_eq!(layers(&format!("{partly}Ns 250\nd 1\nillum 3")), [0.5, 0.3, 1.0, 1.0]);
        let mirror = MaterialPart::Mirror { reflectance: ColorValue::rgb(0.8, 0.6, 0.2) };
        assert_eq!(part(&format!("{set}Ns 1000\nd 1\nillum 3")), mirror);
        assert_eq!(layers(&format!("{set}map_Ns r.png\nmap_refl m.png\nd 1\nillum 3")), [-1.0, -1.0, 1.0, 1.0]);
        let MaterialPart::Principled { normal_map, normal_scale, .. } =
            part(&format!("{set}Ns 250\nd 1\nillum 2\nmap_Bump -bm 0.5 n.png"))
        else {
            panic!()
        };
        assert!(matches!(normal_map, ColorValue::Texture(_)) && normal_scale == 0.5);
    }

    #[test]
    fn maya_writes_illum_4_for_every_material() {
        let maya = "illum 4\nKd .5 .5 .5\nKa 0 0 0\n";
        assert_eq!(part(&format!("{maya}Tf 1 1 1\nNi 1.00")), MaterialPart::Diffuse { albedo: grey(0.5) });
        assert_eq!(layers(&format!("{maya}Tf .25 .25 .25\nNi 1.00"))[3], 0.25);
        // As 3ds Max does: `Tf` beside `d` and `Tr`.
        let max = "Ns 10\nNi 1.5\nd .4\nTr .6\nTf 1 1 1\nillum 2\nKa .6 .6 .6\nKd .6 .6 .6\nKs 0 0 0\nKe 0 0 0";
        assert_eq!(layers(max), [0.639, 0.0, 0.0, 0.4]);
    }

    #[test]
    fn emission_is_added_and_bright_lights_are_lights() {
        let light = |radiance| MaterialPart::Emissive { radiance: ColorValue::grey(radiance) };
        assert_eq!(part("Kd .8\nKe 15 15 15"), light(15.0));
        assert_eq!([part("Kd 0 0 0\nKe .5"), part("Ke .5")], [light(0.5), light(0.5)]);
        for lines in ["Kd .8\nKe .5", "Kd 1 1 1\nKe 15\nmap_Kd a.png"] {
            let MaterialPart::Principled { emission, base_color, .. } = part(lines) else { panic!("{lines}") };
            assert!(emission != grey(0.0) && base_color != grey(0.0));
        }
        let mut materials = MtlMaterials::default();
        let MaterialPart::Emissive { radiance } = materials.part(&material("Ke 2 0 1\nmap_Ke a.png")) else { panic!() };
        assert!(matches!(radiance, ColorValue::Texture(_)));
        let TextureSource::Image { tint, .. } = &materials.textures[0].1 else { panic!() };
        assert_eq!(tint.0, Vec3::new(2.0, 0.0, 1.0));
    }

    #[test]
    fn opacity_of_every_kind_of_material() {
        for lines in
            ["d .3", "Tr .7", "Ks .5\nNs 9\nd .3", "map_Kd a.png\nillum 4\nNi 1.5\nd .3", "Pr .5\nd .3", "Ke .1\nd .3"]
        {
            assert_eq!(layers(lines)[3], 0.3, "{lines}");
        }
        for lines in ["map_d a.png", "map_d a.png\nillum 4", "map_d a.png\nPr .5\nillum 7\nd 0"] {
            assert_eq!(layers(lines)[3], -1.0, "{lines}");
        }
    }

    /// Without `-imfchan`, alpha counts if it says anything.
    #[test]
    fn masks_use_the_channel_that_has_the_mask() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let save =
            |name: &str, pixels| image::GrayAlphaImage::from_raw(2, 1, pixels).unwrap().save(path(name)).unwrap();
        save("alpha.png", vec![9, 0, 9, 255]);
        save("plain.png", vec![0, 255, 9, 255]);
        let channel = |color: &str, mask: &str| {
            let material = ImportedMaterial {
                diffuse_texture: Some(TextureMap::of(path(color))),
                opacity_texture: Some(TextureMap::of(path(mask))),
                opacity: Some(0.5),
                ..ImportedMaterial::default()
            };
            let mut materials = MtlMaterials::default();
            materials.part(&material);
            materials.textures.into_iter().find(|(name, ..)| name.contains("(data")).map(
                |(_, source, _)| match source {
                    TextureSource::Image { channel, tint, encoding: Encoding::Linear, .. } => (channel, tint.0.x),
                    other => panic!("{other:?}"),
                },
            )
        };
        assert_eq!(channel("c.png", "alpha.png"), Some((Some(Channel::A), 0.5)));
        assert_eq!(channel("c.png", "plain.png"), Some((None, 0.5)));
        assert_eq!(channel("alpha.png", "alpha.png"), Some((Some(Channel::A), 0.5)));
        assert_eq!(channel("plain.png", "plain.png"), None);
        assert_eq!(channel("c.png", "missing.png"), Some((None, 0.5)));
    }

    #[test]
    fn one_image_with_other_options_is_another_texture() {
        let map = |repeat| TextureMap { repeat: DVec2::splat(repeat), ..TextureMap::of("a.png".into()) };
        let mut materials = MtlMaterials::default();
        for repeat in [1.0, 2.0, 1.0] {
            materials.part(&ImportedMaterial { diffuse_texture: Some(map(repeat)), ..ImportedMaterial::default() });
        }
        assert_eq!(
            materials.textures.iter().map(|(name, ..)| &**name).collect::<Vec<_>>(),
            ["a.png", "a.png (repeat [2, 2])"]
        );
    }
}
