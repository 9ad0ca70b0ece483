//! The JSON of a glTF file as typed structs: the core of glTF 2.0; extensions are kept as JSON values.
//!
//! Only the types are checked ([`crate::gltf::lenient`]): indices may be out of range and are checked when they are used
//! ([`crate::gltf::document::Document`]). Unknown members are skipped, as the specification requires.
//!
//! Source: Khronos, "glTF 2.0 Specification", chapter 5 (properties reference).

use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value};
use std::collections::{BTreeMap, HashMap};
use std::ops::{Deref, DerefMut};

/// Characters of a name that are kept: many objects may copy it.
const MOST_OF_A_NAME: usize = 1024;

/// Reads a name, cut at [`MOST_OF_A_NAME`] characters.
fn short_name<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    let name: Option<String> = Deserialize::deserialize(deserializer)?;
    Ok(name.map(|name| shortened(&name).to_owned()))
}

/// The first [`MOST_OF_A_NAME`] characters of a name.
pub(crate) fn shortened(name: &str) -> &str {
    name.char_indices().nth(MOST_OF_A_NAME).map_or(name, |(end, _)| &name[..end])
}

/// Extensions of an object, by name. Whole numbers in them are integers, also where the file has `4.0`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Extensions(Map<String, Value>);

impl<'de> Deserialize<'de> for Extensions {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut extensions = Map::deserialize(deserializer)?;
        extensions.values_mut().for_each(make_whole);
        Ok(Self(extensions))
    }
}

impl Deref for Extensions {
    type Target = Map<String, Value>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for Extensions {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// Replaces numbers such as `4.0` by integers.
pub(crate) fn make_whole(value: &mut Value) {
    /// Above, not every integer has a number of its own.
    const MOST: f64 = 9_007_199_254_740_992.0;
    match value {
        Value::Number(number) if number.is_f64() => {
            if let Some(float) = number.as_f64().filter(|&x| x.fract() == 0.0 && (0.0..MOST).contains(&x)) {
                *value = Value::from(float as u64);
            }
        }
        Value::Array(list) => list.iter_mut().for_each(make_whole),
        Value::Object(object) => object.values_mut().for_each(make_whole),
        _ => {}
    }
}

/// The root object.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Root {
    pub asset: Asset,
    pub scene: Option<u32>,
    pub scenes: Vec<Scene>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<BufferView>,
    pub buffers: Vec<Buffer>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub images: Vec<Image>,
    pub samplers: Vec<Sampler>,
    pub cameras: Vec<Camera>,
    pub skins: Vec<Skin>,
    pub animations: Vec<Animation>,
    pub extensions_used: Vec<String>,
    pub extensions_required: Vec<String>,
    pub extensions: Extensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Asset {
    pub version: String,
    pub min_version: Option<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Scene {
    pub nodes: Vec<u32>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Node {
    #[serde(default, deserialize_with = "short_name")]
    pub name: Option<String>,
    pub children: Vec<u32>,
    /// Column-major.
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    /// x, y, z, w.
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub mesh: Option<u32>,
    pub skin: Option<u32>,
    pub camera: Option<u32>,
    pub weights: Option<Vec<f64>>,
    pub extensions: Extensions,
}

impl Node {
    /// Whether the node and all below it are hidden (`KHR_node_visibility`).
    pub(crate) fn is_hidden(&self) -> bool {
        let visibility = self.extensions.get("KHR_node_visibility");
        visibility.and_then(|extension| extension.get("visible")?.as_bool()) == Some(false)
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Mesh {
    #[serde(default, deserialize_with = "short_name")]
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
    pub weights: Vec<f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Primitive {
    pub attributes: BTreeMap<String, u32>,
    pub indices: Option<u32>,
    pub material: Option<u32>,
    /// 0 points, 1 to 3 lines, 4 triangles, 5 strip, 6 fan; default: triangles.
    pub mode: Option<u32>,
    pub targets: Vec<BTreeMap<String, u32>>,
    pub extensions: Extensions,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Accessor {
    pub buffer_view: Option<u32>,
    pub byte_offset: u64,
    pub component_type: u32,
    pub normalized: bool,
    pub count: u64,
    #[serde(rename = "type")]
    pub kind: String,
    pub sparse: Option<Sparse>,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Sparse {
    pub count: u64,
    pub indices: SparsePart,
    pub values: SparsePart,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct SparsePart {
    pub buffer_view: u32,
    pub byte_offset: u64,
    pub component_type: u32,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct BufferView {
    pub buffer: u32,
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<u64>,
    pub extensions: Extensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: u64,
    pub extensions: Extensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Material {
    #[serde(default, deserialize_with = "short_name")]
    pub name: Option<String>,
    pub pbr_metallic_roughness: Option<Pbr>,
    pub normal_texture: Option<TextureRef>,
    pub occlusion_texture: Option<TextureRef>,
    pub emissive_texture: Option<TextureRef>,
    pub emissive_factor: Option<[f64; 3]>,
    pub alpha_mode: Option<String>,
    pub alpha_cutoff: Option<f64>,
    pub double_sided: bool,
    pub extensions: Extensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Pbr {
    pub base_color_factor: Option<[f64; 4]>,
    pub base_color_texture: Option<TextureRef>,
    pub metallic_factor: Option<f64>,
    pub roughness_factor: Option<f64>,
    pub metallic_roughness_texture: Option<TextureRef>,
}

/// A reference to a texture; `scale` is for normal maps.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct TextureRef {
    pub index: u32,
    pub tex_coord: u32,
    pub scale: Option<f64>,
    pub extensions: Extensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Texture {
    pub sampler: Option<u32>,
    pub source: Option<u32>,
    pub extensions: Extensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Image {
    #[serde(default, deserialize_with = "short_name")]
    pub name: Option<String>,
    pub uri: Option<String>,
    pub mime_type: Option<String>,
    pub buffer_view: Option<u32>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Sampler {
    pub mag_filter: Option<u32>,
    pub wrap_s: Option<u32>,
    pub wrap_t: Option<u32>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Camera {
    #[serde(default, deserialize_with = "short_name")]
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: String,
    pub perspective: Option<Perspective>,
    pub orthographic: Option<Orthographic>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Perspective {
    /// Vertical field of view, radians.
    pub yfov: f64,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Orthographic {
    /// Half the height of the visible region, metres.
    pub ymag: f64,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Skin {
    pub inverse_bind_matrices: Option<u32>,
    pub joints: Vec<u32>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Animation {
    #[serde(default, deserialize_with = "short_name")]
    pub name: Option<String>,
    pub channels: Vec<Channel>,
    pub samplers: Vec<AnimationSampler>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Channel {
    pub sampler: u32,
    pub target: ChannelTarget,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct ChannelTarget {
    pub node: Option<u32>,
    pub path: String,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct AnimationSampler {
    pub input: u32,
    pub interpolation: Option<String>,
    pub output: u32,
}

/// For each image the first one with the same bytes: in the same view, in one of the same range, or in the same URI.
pub(crate) fn first_equal_images(root: &Root) -> Vec<u32> {
    #[derive(PartialEq, Eq, Hash)]
    enum Source<'a> {
        Range(u32, u64, u64),
        View(u32),
        Uri(&'a str),
    }
    let mut known = HashMap::new();
    let images = (0..).zip(&root.images);
    images
        .map(|(number, image)| {
            let view = image.buffer_view.map(|index| match root.buffer_views.get(index as usize) {
                Some(view) if view.extensions.is_empty() => {
                    Source::Range(view.buffer, view.byte_offset, view.byte_length)
                }
                _ => Source::View(index),
            });
            match view.or(image.uri.as_deref().map(Source::Uri)) {
                Some(source) => *known.entry(source).or_insert(number),
                None => number,
            }
        })
        .collect()
}
