//! Conversion of the materials of a glTF file and their textures to those of a scene.
//!
//! Clear solid glass becomes `glass` or `rough_glass`, everything else `principled`. Factors become the tint of a
//! texture; texture transforms are converted to v pointing up. Specular and glossiness become the colour and the
//! roughness of a dielectric.

use crate::error::gltf::Located;
use crate::gltf::document::Document;
use crate::gltf::material::{AlphaMode, GltfMaterial, TextureUse};
use crate::gltf::uri::{Uri, is_data};
use firstlight_files::reference::Referred;
use firstlight_files::relative::path_to_text;
use firstlight_format::material_textures::without_lost_textures;
use firstlight_format::names::Names;
use firstlight_format::parts::MaterialPart;
use firstlight_format::sources::TextureSource;
use firstlight_format::value::{ColorValue, Rgb, ScalarValue};
use firstlight_render::{Channel, Encoding, Material};
use glam::{DVec2, Vec3};
use std::collections::{HashMap, HashSet};

/// The materials of a file, as in scene files.
#[derive(Debug, Default)]
pub(crate) struct Surfaces {
    /// One per material of the file, and the default material last; names are unique.
    pub materials: Vec<Surface>,
    /// By name; names are unique.
    pub textures: Vec<(String, TextureSource)>,
}

/// A material of a file.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    pub name: String,
    pub part: MaterialPart,
    /// Unsupported features.
    pub notes: Vec<String>,
    /// Whether it is a light; an unlit material shows its color alone.
    pub emits: bool,
    /// Whether it has an occlusion map, which path tracing does not need.
    pub has_occlusion: bool,
}

impl Surfaces {
    /// The index of a material here; `None`: the default one.
    pub(crate) fn index(&self, material: Option<u32>) -> usize {
        let default = self.materials.len().saturating_sub(1);
        material.map_or(default, |material| (material as usize).min(default))
    }
}

/// Converts textures on request, each once.
struct Textures<'a> {
    document: &'a Document,
    /// Path of the model in texture paths.
    file: &'a str,
    names: Names,
    list: Vec<(String, TextureSource)>,
    known: HashMap<String, String>,
}

/// Stands for a texture without an image. No texture has this name.
const LOST: &str = "";

/// How a texture is used.
struct TextureRole {
    what: &'static str,
    channel: Option<Channel>,
    encoding: Encoding,
    tint: Vec3,
    invert: bool,
    vertex_colors: bool,
}

impl TextureRole {
    fn new(what: &'static str, channel: Option<Channel>, encoding: Encoding, tint: Vec3) -> Self {
        Self { what, channel, encoding, tint, invert: false, vertex_colors: false }
    }
}

impl Textures<'_> {
    fn add(&mut self, name: &str, source: TextureSource) -> String {
        let key = format!("{source:?}");
        if let Some(name) = self.known.get(&key) {
            return name.clone();
        }
        let name = self.names.free(name);
        self.list.push((name.clone(), source));
        self.known.insert(key, name.clone());
        name
    }

    /// The name of a texture; one whose image must not be read is not listed.
    fn of(&mut self, used: &TextureUse, role: TextureRole) -> String {
        let part = crate::error::gltf::place("images", used.image);
        let found = self.document.image_file(used.image, self.file);
        let Some((image, file)) = self.document.omissions.kept(&part, found) else { return LOST.to_owned() };
        let mut source = TextureSource::image(file);
        /// Smallest scale: with 0, an image would be stretched to a single colour, and the transform would be singular.
        const LEAST: f64 = 1e-9;
        let (sin, cos) = used.rotation.sin_cos();
        let scaled = used.scale.y;
        if let TextureSource::Image {
            stretch,
            repeat,
            offset,
            rotate,
            wrap,
            wrap_v,
            smooth,
            encoding,
            channel,
            tint,
            invert,
            uv_set,
            vertex_colors,
            ..
        } = &mut source
        {
            // With v up, the rotation stays the same and the origin moves to the other end of v.
            let size = |scale: f64| if scale.abs() < LEAST { LEAST } else { scale };
            *stretch = DVec2::new(size(used.scale.x), size(used.scale.y));
            *rotate = used.rotation.to_degrees();
            *offset = DVec2::new(used.offset.x + sin * scaled, 1.0 - used.offset.y - cos * scaled);
            if used.rotation == 0.0 && used.scale == DVec2::ONE && used.offset == DVec2::ZERO {
                (*rotate, *offset) = (0.0, DVec2::ZERO);
            }
            // Without rotation both are equivalent.
            if used.rotation == 0.0 {
                std::mem::swap(stretch, repeat);
            }
            *wrap = used.wrap[0];
            *wrap_v = (used.wrap[1] != used.wrap[0]).then_some(used.wrap[1]);
            *smooth = used.smooth;
            *encoding = role.encoding;
            *channel = role.channel;
            *tint = Rgb(role.tint);
            *invert = role.invert;
            *uv_set = used.uv_set as u8;
            *vertex_colors = role.vertex_colors;
        }
        self.add(&format!("{image} {}", role.what), source)
    }

    /// A factor times a channel.
    fn scalar(
        &mut self,
        factor: f32,
        texture: Option<&TextureUse>,
        channel: Channel,
        what: &'static str,
    ) -> ScalarValue {
        match texture {
            Some(used) if factor != 0.0 => {
                let role = TextureRole::new(what, Some(channel), Encoding::Linear, Vec3::splat(factor));
                ScalarValue::Texture(self.of(used, role))
            }
            _ => ScalarValue::Number(factor),
        }
    }

    /// The roughness that belongs to a glossiness.
    fn roughness_of(&mut self, (glossiness, texture): &(f32, Option<TextureUse>)) -> ScalarValue {
        match texture {
            Some(used) if *glossiness != 0.0 => {
                let tint = Vec3::splat(*glossiness);
                let role = TextureRole::new("roughness", Some(Channel::A), Encoding::Linear, tint);
                ScalarValue::Texture(self.of(used, TextureRole { invert: true, ..role }))
            }
            _ => ScalarValue::Number(1.0 - glossiness),
        }
    }

    /// A factor times an sRGB image.
    fn color(&mut self, factor: Vec3, texture: Option<&TextureUse>, what: &'static str) -> ColorValue {
        match texture {
            Some(used) if factor != Vec3::ZERO => {
                ColorValue::Texture(self.of(used, TextureRole::new(what, None, Encoding::Auto, factor)))
            }
            _ => ColorValue::Rgb(factor),
        }
    }

    /// A map of vectors; `None` if there is none.
    fn map(&mut self, texture: Option<&TextureUse>, what: &'static str) -> Option<ColorValue> {
        let used = texture?;
        Some(ColorValue::Texture(self.of(used, TextureRole::new(what, None, Encoding::Linear, Vec3::ONE))))
    }

    /// Base colour and coverage (alpha).
    fn base(&mut self, material: &GltfMaterial, vertex_colors: bool) -> (ColorValue, ScalarValue) {
        let [r, g, b, alpha] = material.base_color;
        let (rgb, tint) = (Vec3::new(r, g, b), Rgb(Vec3::splat(alpha)));
        let is_cut = material.alpha != AlphaMode::Opaque;
        match &material.base_color_texture {
            Some(used) => {
                let role = |what, channel, tint| TextureRole {
                    vertex_colors,
                    ..TextureRole::new(what, channel, Encoding::Auto, tint)
                };
                let color = ColorValue::Texture(self.of(used, role("color", None, rgb)));
                let opacity = match is_cut {
                    true => ScalarValue::Texture(self.of(used, role("alpha", Some(Channel::A), tint.0))),
                    false => ScalarValue::Number(1.0),
                };
                (color, opacity)
            }
            None if vertex_colors => {
                let color = self.add("vertex colors", TextureSource::VertexColors { channel: None, tint: Rgb(rgb) });
                let opacity = match is_cut {
                    true => {
                        let source = TextureSource::VertexColors { channel: Some(Channel::A), tint };
                        ScalarValue::Texture(self.add("vertex alpha", source))
                    }
                    false => ScalarValue::Number(1.0),
                };
                (ColorValue::Texture(color), opacity)
            }
            None => (ColorValue::Rgb(rgb), ScalarValue::Number(if is_cut { alpha } else { 1.0 })),
        }
    }
}

impl Document {
    /// All materials.
    ///
    /// - `file`: path of the model in texture paths.
    ///
    /// A texture whose image must not be read has a stand-in.
    pub(crate) fn surfaces(&self, file: &str) -> Surfaces {
        let colored = self.materials_with_vertex_colors();
        let mut textures =
            Textures { document: self, file, names: Names::default(), list: Vec::new(), known: HashMap::new() };
        let mut names = Names::default();
        let mut materials = Vec::new();
        let numbers = (0..self.root.materials.len() as u32).map(Some).chain([None]);
        for number in numbers {
            let material = self.material(number);
            let wanted = material.name.clone().unwrap_or_else(|| match number {
                Some(number) => format!("material {number}"),
                None => "default material".to_owned(),
            });
            let mut notes = material.notes.clone();
            let part = surface(&mut textures, &material, colored.contains(&number), &mut notes);
            let part = without_lost_textures(&part, |texture| (texture == LOST).then_some(Vec3::ONE));
            materials.push(Surface {
                name: names.free(&wanted),
                part,
                notes,
                emits: material.emission != Vec3::ZERO && !material.unlit,
                has_occlusion: material.has_occlusion,
            });
        }
        Surfaces { materials, textures: textures.list }
    }

    fn materials_with_vertex_colors(&self) -> HashSet<Option<u32>> {
        let mut colored = HashSet::new();
        for primitive in self.root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
            if primitive.attributes.contains_key("COLOR_0") {
                colored.insert(primitive.material);
                colored.extend(crate::gltf::primitives::variants_of(primitive).into_values().map(Some));
            }
        }
        colored
    }

    /// Name of an image, and its path in a scene: `MODEL#INDEX` for images inside the model.
    pub(crate) fn image_file(&self, image: u32, file: &str) -> Result<(String, String), Located> {
        let json = &self.root.images[image as usize];
        let named = json.name.clone().filter(|name| !name.is_empty());
        if let Some(uri) = json.uri.as_deref().filter(|uri| !is_data(uri)) {
            let part = crate::error::gltf::place("images", image);
            let found = self.resolved(uri, &part).map_err(|problem| (part, problem))?;
            if let Uri::File(Referred { path, .. }) = found {
                let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
                // Paths are relative to the scene, which may be in another folder than the model.
                let folder = std::path::Path::new(file).parent().unwrap_or(std::path::Path::new(""));
                return Ok((named.or(stem).unwrap_or_default(), path_to_text(&folder.join(path))));
            }
        }
        Ok((
            named.unwrap_or_else(|| format!("image {image}")),
            format!("{file}#{}", self.first_equal_image[image as usize]),
        ))
    }
}

fn surface(
    textures: &mut Textures,
    material: &GltfMaterial,
    vertex_colors: bool,
    notes: &mut Vec<String>,
) -> MaterialPart {
    if let Some(glass) = clear_glass(material) {
        return glass;
    }
    let (base, alpha) = textures.base(material, vertex_colors);
    let cutoff = match material.alpha {
        AlphaMode::Mask(cutoff) => Some(cutoff.clamp(0.0, 1.0)),
        AlphaMode::Opaque | AlphaMode::Blend => None,
    };
    let mut part = Material::principled(base.clone());
    let Material::Principled {
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
        ..
    } = &mut part
    else {
        return part;
    };
    (*opacity, *opacity_cutoff) = (alpha, cutoff);
    *two_sided = material.double_sided;
    if material.unlit {
        // It only emits its colour.
        *base_color = ColorValue::grey(0.0);
        *specular = ScalarValue::Number(0.0);
        (*metallic, *roughness) = (ScalarValue::Number(0.0), ScalarValue::Number(1.0));
        *emission = base;
        notes.push("it is unlit: it emits its own color, and is a light as well".to_owned());
        return part;
    }
    let metal_map = material.metallic_roughness_texture.as_ref();
    *metallic = textures.scalar(material.metallic, metal_map, Channel::B, "metallic");
    *roughness = match &material.glossiness {
        Some(glossiness) => textures.roughness_of(glossiness),
        None => textures.scalar(material.roughness, metal_map, Channel::G, "roughness"),
    };
    *ior = material.ior;
    *specular = textures.scalar(material.specular, material.specular_texture.as_ref(), Channel::A, "specular");
    let specular_map = material.specular_color_texture.as_ref();
    *specular_color = textures.color(material.specular_color, specular_map, "specular color");
    let passes = material.transmission_texture.as_ref();
    *transmission = textures.scalar(material.transmission, passes, Channel::R, "transmission");
    *thin_walled = material.transmission > 0.0 && material.thickness == 0.0;
    if material.transmission > 0.0 && material.thickness > 0.0 {
        *absorption = Rgb(absorption_of(material));
        *dispersion = material.dispersion;
        // Light leaves a solid through the back of its surface.
        *two_sided = true;
    }
    *anisotropy = ScalarValue::Number(material.anisotropy);
    *anisotropy_rotation = material.anisotropy_rotation.to_degrees();
    if let Some(map) = textures.map(material.anisotropy_texture.as_ref(), "anisotropy") {
        *anisotropy_map = map;
    }
    *sheen_color = textures.color(material.sheen_color, material.sheen_color_texture.as_ref(), "sheen color");
    let sheen_map = material.sheen_roughness_texture.as_ref();
    *sheen_roughness = textures.scalar(material.sheen_roughness, sheen_map, Channel::A, "sheen roughness");
    *clearcoat = textures.scalar(material.clearcoat, material.clearcoat_texture.as_ref(), Channel::R, "coat");
    let coat_map = material.clearcoat_roughness_texture.as_ref();
    *clearcoat_roughness = textures.scalar(material.clearcoat_roughness, coat_map, Channel::G, "coat roughness");
    if let Some(map) = textures.map(material.clearcoat_normal_texture.as_ref(), "coat normals") {
        *clearcoat_normal_map = map;
    }
    *iridescence =
        textures.scalar(material.iridescence, material.iridescence_texture.as_ref(), Channel::R, "iridescence");
    *iridescence_ior = material.iridescence_ior;
    [*iridescence_min, *iridescence_max] = material.iridescence_thickness;
    let film_map = material.iridescence_thickness_texture.as_ref();
    *iridescence_map = textures.scalar(1.0, film_map, Channel::G, "film thickness");
    *emission = textures.color(material.emission, material.emissive_texture.as_ref(), "emission");
    if let Some(map) = textures.map(material.normal_texture.as_ref(), "normals") {
        *normal_map = map;
        *normal_scale = material.normal_scale;
    }
    part
}

/// Solids that only refract and reflect have exact materials of their own.
fn clear_glass(material: &GltfMaterial) -> Option<MaterialPart> {
    let is_plain = material.base_color[..3] == [1.0; 3]
        && material.base_color_texture.is_none()
        && material.transmission == 1.0
        && material.transmission_texture.is_none()
        && material.thickness > 0.0
        && material.metallic == 0.0
        && material.metallic_roughness_texture.is_none()
        && material.normal_texture.is_none()
        && material.alpha == AlphaMode::Opaque
        && material.specular == 1.0
        && material.specular_texture.is_none()
        && material.specular_color == Vec3::ONE
        && material.specular_color_texture.is_none()
        && material.clearcoat == 0.0
        && material.iridescence == 0.0
        && material.sheen_color == Vec3::ZERO
        && material.anisotropy == 0.0
        && material.emission == Vec3::ZERO
        && !material.unlit;
    let (ior, absorption, dispersion) = (material.ior, Rgb(absorption_of(material)), material.dispersion);
    is_plain.then(|| match material.roughness {
        0.0 => MaterialPart::Glass { ior, absorption, dispersion },
        roughness => {
            let alpha = ScalarValue::Number(roughness * roughness);
            MaterialPart::RoughGlass { alpha, ior, absorption, dispersion, compensate: true, beckmann: false }
        }
    })
}

/// The absorption coefficient that leaves `attenuationColor` after `attenuationDistance`, per metre.
fn absorption_of(material: &GltfMaterial) -> Vec3 {
    /// Black has an infinite coefficient; this is nearly black.
    const LEAST: f32 = 1e-6;
    let distance = material.attenuation_distance;
    if !(distance > 0.0 && distance.is_finite()) {
        return Vec3::ZERO;
    }
    material.attenuation_color.to_array().map(|c| (-c.clamp(LEAST, 1.0).ln() / distance).clamp(0.0, f32::MAX)).into()
}
