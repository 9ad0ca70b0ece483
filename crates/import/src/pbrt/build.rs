//! Collects what directives describe: objects with their materials, lights, and meshes inside of the text.

use crate::model::foreign::{ForeignOptions, MAX_OBJECTS, cut};
use crate::model::mesh_budget::MeshBudget;
use crate::model::named_files::NamedFiles;
use crate::model::placing::{is_placement, transform};
use crate::model::projection::LightImages;
use crate::pbrt::curves::Strands;
use crate::pbrt::lights::{Light, light};
use crate::pbrt::params::{Param, Params};
use crate::pbrt::state::{Described, MaterialRef, State};
use crate::pbrt::textures::{Texture, Textures};
use firstlight_files::limits::Limits;
use firstlight_files::printable;
use firstlight_files::relative::path_to_text;
use firstlight_files::stamp::Stamp;
use firstlight_files::warnings::Warnings;
use firstlight_format::names::Names;
use firstlight_format::parts::{LightPart, MaterialPart, ObjectPart, TransformPart};
use firstlight_format::sources::{EnvironmentSource, MeshShading, MeshSource, TextureCoordinates, TextureSource};
use firstlight_format::value::{Rgb, ScalarValue};
use firstlight_mesh::Mesh;
use glam::{DAffine3, DMat3, Vec3};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

/// Shapes, with the pieces of hair, and those that are left out.
const MAX_SHAPES: u32 = 1 << 23;
/// Meshes that formulas make may have this fraction of the bytes of a scene: reading them and building their trees takes
/// as long as for a text of such a size.
const SCENE_BYTES_PER_BYTE_MADE: u64 = 4;

/// What a shape is made of.
#[derive(Clone, Debug)]
pub(super) enum Geometry {
    /// A whole sphere about the origin; its number, for a mesh of it where it is stretched or has a texture.
    Sphere {
        radius: f64,
        shape: u32,
    },
    Mesh {
        source: MeshSource,
        shading: MeshShading,
    },
}

/// A shape with its material, in the space of a world or of an object definition.
#[derive(Clone, Debug)]
pub(super) struct Item {
    pub name: String,
    pub geometry: Geometry,
    pub material: String,
    pub local: DAffine3,
}

/// Why a scene cannot be read on.
pub(crate) struct TooMany;

/// Of several things of one name.
pub(super) const FIRST_COUNTS: &str = "the first counts";

/// Everything with a name that a scene describes.
pub(crate) struct Known {
    named: HashMap<String, Rc<Described>>,
    media: HashMap<String, Option<Vec3>>,
    textures: Textures,
    n_described: u64,
}

pub(crate) struct Builder<'a> {
    pub(super) path: &'a Path,
    pub(super) folder: &'a Path,
    pub(super) named_files: NamedFiles<'a>,
    pub(super) allow_outside: bool,
    light_images: &'a LightImages,
    pub(super) meshes: &'a MeshBudget,
    /// From the world of the file to ours.
    pub world: DMat3,
    pub warnings: Warnings,
    pub textures: Textures,
    pub objects: Vec<ObjectPart>,
    pub lights: Vec<LightPart>,
    pub environment: EnvironmentSource,
    pub materials: Vec<(String, MaterialPart)>,
    pub used_textures: Vec<(String, TextureSource)>,
    pub parts: HashMap<u32, Arc<Mesh>>,
    /// Meshes in files of their own that became parts.
    pub files: Vec<(PathBuf, Stamp)>,
    pub(super) named: HashMap<String, Rc<Described>>,
    /// Whether `named` is from an earlier reading: then it stays.
    pub(super) is_known: bool,
    /// Names of materials, textures and media that were used and not there.
    pub(super) missing: HashSet<String>,
    /// What this reading has defined: its kind and its name.
    pub(super) defined: HashSet<(&'static str, String)>,
    /// Names of materials that it has defined more than once.
    pub(super) redefined: HashSet<String>,
    /// Absorption of the media without scattering, per metre.
    pub(super) media: HashMap<String, Option<Vec3>>,
    pub(super) definitions: HashMap<String, Vec<Item>>,
    /// Instances before the definition of their object.
    pub(super) early: Vec<(String, DAffine3)>,
    /// The object definition that is being read.
    pub(super) open: Option<(String, Vec<Item>)>,
    pub(super) material_names: Names,
    pub(super) texture_names: Names,
    /// Names of textures by what they are.
    pub(super) texture_of: HashMap<String, String>,
    /// Names of materials by what they were made of; `None`: nothing can be seen.
    pub(super) material_of: HashMap<String, Option<String>>,
    /// Places in `materials` by name.
    pub(super) place_of: HashMap<String, usize>,
    pub(super) lobes: HashMap<String, usize>,
    pub(super) with_textures: HashSet<String>,
    /// Whether a PLY file has normals, by its path.
    pub(super) with_normals: HashMap<PathBuf, Option<bool>>,
    /// By path and whether it is turned round.
    pub(super) ply: HashMap<(PathBuf, bool), Result<Arc<Mesh>, String>>,
    /// Bytes of meshes that may still be made of formulas: a few letters can ask for many triangles.
    pub(super) bytes_left: u64,
    pub(super) strands: Strands,
    pub(super) n_shapes: u32,
    /// Shapes that were placed, also those that cannot be shown.
    n_placed: usize,
    pub(super) n_described: u64,
    pub(super) depth: u32,
}

impl<'a> Builder<'a> {
    pub(crate) fn new(path: &'a Path, options: &'a ForeignOptions) -> Self {
        let allow_outside = options.allow_outside;
        let folder = path.parent().unwrap_or(Path::new(""));
        Self {
            path,
            folder,
            named_files: NamedFiles::of(path, allow_outside),
            allow_outside,
            light_images: &options.light_images,
            meshes: &options.meshes,
            world: DMat3::IDENTITY,
            warnings: Warnings::default(),
            textures: Textures::default(),
            objects: Vec::new(),
            lights: Vec::new(),
            environment: EnvironmentSource::Black,
            materials: Vec::new(),
            used_textures: Vec::new(),
            parts: HashMap::new(),
            files: Vec::new(),
            named: HashMap::new(),
            is_known: false,
            missing: HashSet::new(),
            defined: HashSet::new(),
            redefined: HashSet::new(),
            media: HashMap::new(),
            definitions: HashMap::new(),
            early: Vec::new(),
            open: None,
            material_names: Names::default(),
            texture_names: Names::default(),
            texture_of: HashMap::new(),
            material_of: HashMap::new(),
            place_of: HashMap::new(),
            lobes: HashMap::new(),
            with_textures: HashSet::new(),
            with_normals: HashMap::new(),
            ply: HashMap::new(),
            bytes_left: Limits::of_this_process().scene_bytes / SCENE_BYTES_PER_BYTE_MADE,
            strands: Strands::default(),
            n_shapes: 0,
            n_placed: 0,
            n_described: 0,
            depth: 0,
        }
    }

    /// What the scene describes, if it has used some of it before.
    pub(crate) fn described_later(&mut self) -> Option<Known> {
        let Self { named, media, textures, .. } = self;
        let is_texture = |name: &str| [true, false].iter().any(|&is_number| textures.get(is_number, name).is_some());
        let is_there = |name: &String| named.contains_key(name) || media.contains_key(name) || is_texture(name);
        if !self.missing.iter().any(is_there) {
            return None;
        }
        let (mut named, media, textures) = (std::mem::take(named), std::mem::take(media), std::mem::take(textures));
        // Which of them counts depends on where it is used.
        named.retain(|name, _| !self.redefined.contains(name));
        Some(Known { named, media, textures, n_described: self.n_described })
    }

    /// Takes what an earlier reading has found.
    pub(crate) fn know(&mut self, known: Known) {
        (self.named, self.media, self.textures) = (known.named, known.media, known.textures);
        (self.n_described, self.is_known) = (known.n_described, true);
    }

    /// Remarks that something is not shown.
    pub(crate) fn tell(&mut self, what: impl AsRef<str>) {
        self.warnings.push(format!("{}: {}", self.path.display(), what.as_ref()));
    }

    /// The path of a file in the scene file; `None` if it must not be read, which is told.
    pub(crate) fn file(&mut self, name: &str) -> Option<String> {
        let (path, told) = self.named_files.find(name);
        told.into_iter().for_each(|it| self.tell(it));
        path
    }

    /// Like [`Self::file`], for a file that was named before.
    pub(super) fn named_file(&self, name: &str) -> Option<String> {
        self.named_files.known(name)
    }

    /// A shape.
    pub(crate) fn shape(&mut self, kind: &str, params: &Params, state: &State) -> Result<(), TooMany> {
        let number = self.n_shapes;
        if number == MAX_SHAPES {
            return Err(TooMany);
        }
        self.n_shapes += 1;
        if kind == "curve" {
            return self.curve(params, state, number);
        }
        let file_name = params.string("filename").filter(|_| kind == "plymesh");
        let stem = file_name.and_then(|name| Path::new(name).file_stem()).map(|stem| path_to_text(stem.as_ref()));
        let name = cut(&stem.unwrap_or_else(|| format!("{kind} {}", u64::from(number) + 1))).to_owned();
        let area_light = match self.open {
            None => state.area_light.clone(),
            Some(_) => {
                if state.area_light.is_some() {
                    self.tell(format!(
                        "`{}` does not emit light: pbrt has no lights in objects",
                        printable::name(&name)
                    ));
                }
                None
            }
        };
        let geometry = match self.geometry(kind, params, state, area_light.is_some(), number, file_name) {
            Ok(geometry) => geometry,
            Err(why) => {
                self.tell(format!("`{}` is left out: {why}", printable::name(&name)));
                return Ok(());
            }
        };
        if params.has("displacement") || params.has("displacement.edgelength") {
            self.tell(format!("`{}` is shown without its displacement", printable::name(&name)));
        }
        let mut opacity = self.opacity(params, &name);
        let light = area_light.map(|light| self.radiance(&light, &geometry, state, params, kind, &name));
        let mut bare = None;
        if opacity == Some(ScalarValue::Number(0.0)) {
            let shown = printable::name(&name);
            if light.is_none() {
                self.tell(format!("`{shown}` is left out: it is transparent everywhere"));
                return Ok(());
            }
            // In pbrt no ray hits it, and still it lights.
            self.tell(format!("`{shown}` is an invisible light, which is not modelled: it is seen"));
            opacity = None;
            let material = MaterialRef::Own(self.described("", "interface".to_owned(), Params::default()));
            bare = Some(State { material, inside: String::new(), ..state.clone() });
        }
        let Some(material) = self.surface(bare.as_ref().unwrap_or(state), opacity, light, &name) else {
            return Ok(());
        };
        self.add_item(Item { name, geometry, material, local: state.ctm })
    }

    /// Adds an item to the scene, or to the object definition that is open.
    pub(super) fn add_item(&mut self, item: Item) -> Result<(), TooMany> {
        match &mut self.open {
            Some((_, items)) => {
                if items.len() >= MAX_OBJECTS {
                    return Err(TooMany);
                }
                items.push(item);
                Ok(())
            }
            None => self.place(&item, &item.local),
        }
    }

    /// Coverage of a shape; `None` if it is opaque.
    pub(super) fn opacity(&mut self, params: &Params, name: &str) -> Option<ScalarValue> {
        let alpha = self.textures.parameter(true, params, "alpha");
        if alpha.is_none() && params.has("alpha") {
            self.missing.extend(params.texture("alpha").map(str::to_owned));
            self.tell(format!("`{}` is opaque: its `alpha` is not known", printable::name(name)));
        }
        match alpha? {
            Texture::Constant(alpha) if alpha.x >= 1.0 => None,
            Texture::Constant(alpha) => Some(ScalarValue::Number(alpha.x.max(0.0))),
            Texture::Varying(source) => Some(ScalarValue::Texture(self.texture_name("alpha", source))),
        }
    }

    /// Adds an item to the scene.
    pub(super) fn place(&mut self, item: &Item, ctm: &DAffine3) -> Result<(), TooMany> {
        self.n_placed += 1;
        if self.n_placed > MAX_OBJECTS {
            return Err(TooMany);
        }
        let world = DAffine3::from_mat3(self.world) * *ctm;
        if !is_placement(&world) {
            self.tell(format!("`{}` is flattened or too far away, and is left out", printable::name(&item.name)));
            return Ok(());
        }
        let (name, material) = (Some(item.name.clone()), item.material.clone());
        let mesh = |source, shading| ObjectPart::Mesh {
            name: name.clone(),
            hidden: false,
            source,
            shading,
            texture_coordinates: TextureCoordinates::File,
            simplify: None,
            material: Some(material.clone()),
            materials: None,
            transform: transform(&world),
        };
        let object = match &item.geometry {
            Geometry::Mesh { source, shading } => mesh(source.clone(), *shading),
            Geometry::Sphere { radius, shape } => match even_scale(&world.matrix3) {
                Some(scale) if !self.with_textures.contains(&item.material) => ObjectPart::Sphere {
                    name,
                    hidden: false,
                    center: world.translation,
                    radius: radius * scale,
                    material,
                    transform: TransformPart::default(),
                },
                _ => {
                    // The same mesh, whenever the shape is read.
                    if !self.parts.contains_key(shape) {
                        let numbers = vec![Param::number("radius", *radius)];
                        match self.made("sphere", &Params::new(numbers), false) {
                            Ok(made) => drop(self.parts.insert(*shape, made)),
                            Err(why) => {
                                self.tell(format!("`{}` is left out: {why}", printable::name(&item.name)));
                                return Ok(());
                            }
                        }
                    }
                    mesh(self.shape_source(*shape), MeshShading::Auto)
                }
            },
        };
        self.objects.push(object);
        Ok(())
    }

    /// A light that is no shape.
    pub(crate) fn light(&mut self, kind: &str, params: &Params, ctm: &DAffine3) {
        for image in ["filename", "mapname"].into_iter().filter_map(|name| params.string(name)) {
            // Tells what is wrong with it.
            self.file(image);
        }
        let world = DAffine3::from_mat3(self.world) * *ctm;
        let name = format!("{} {}", cut(kind), self.lights.len() + 1);
        let mut told = Vec::new();
        let file = |name: &str| self.named_file(name);
        let image = |source: &TextureSource| self.light_images.of(self.folder, source);
        let made = light(kind, params, &world, name, image, file, &mut |what| told.push(what));
        told.extend(params.complaints());
        told.into_iter().for_each(|what| self.tell(what));
        match made {
            Light::Nothing => {}
            Light::Part(part) => self.lights.push(part),
            Light::Projector(mut part, source) => {
                if let LightPart::Spot { texture, .. } = &mut part {
                    *texture = Some(self.texture_name("slide", source));
                }
                self.lights.push(part);
            }
            Light::Environment(environment) => {
                self.environment = match (&self.environment, environment) {
                    (EnvironmentSource::Black, new) => new,
                    (EnvironmentSource::Constant(Rgb(a)), EnvironmentSource::Constant(Rgb(b))) => {
                        EnvironmentSource::Constant(Rgb(*a + b))
                    }
                    (old, new) => {
                        let is_image = matches!(new, EnvironmentSource::Image { .. });
                        let kept = if is_image { new } else { old.clone() };
                        self.tell("several environments of which one is an image are not modelled: one is shown");
                        kept
                    }
                };
            }
        }
    }

    /// Leaves out the materials that no object has.
    pub(crate) fn keep_used_materials(&mut self) {
        let mut used: HashSet<String> = HashSet::new();
        let mut open: Vec<String> =
            self.objects.iter().filter_map(|object| object.material()).map(str::to_owned).collect();
        while let Some(name) = open.pop() {
            if !used.insert(name.clone()) {
                continue;
            }
            if let Some(MaterialPart::Blend { a, b, .. }) = self.part(&name) {
                open.extend([a, b]);
            }
        }
        self.materials.retain(|(name, _)| used.contains(name));
    }
}

/// The scale of a matrix, if it is the same in all directions as far as seven digits in a file can say.
fn even_scale(matrix: &DMat3) -> Option<f64> {
    let scale = matrix.determinant().abs().cbrt();
    let unit = *matrix * scale.recip();
    let deviation = unit.transpose() * unit - DMat3::IDENTITY;
    deviation.to_cols_array().iter().all(|entry| entry.abs() < 1e-5).then_some(scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::projection::LightImages;

    #[test]
    fn shapes_that_are_left_out_are_counted() {
        let light_images = LightImages::new(|_| None);
        let options =
            ForeignOptions { allow_outside: false, defines: Vec::new(), light_images, meshes: Arc::default() };
        let mut builder = Builder::new(Path::new("a.pbrt"), &options);
        builder.n_shapes = MAX_SHAPES - 1;
        let mut shape = || builder.shape("x", &Params::default(), &State::default()).is_ok();
        assert_eq!([shape(), shape()], [true, false]);
    }
}
