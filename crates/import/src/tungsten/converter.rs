//! A scene while it is converted, and the order in which it is.

use crate::model::foreign::{ForeignOptions, ForeignScene};
use crate::model::mesh_budget::MeshBudget;
use crate::model::named_files::NamedFiles;
use crate::model::projection::LightImages;
use crate::tungsten::fields::{Fields, Source};
use crate::tungsten::meshes::MeshRequest;
use firstlight_files::relative::path_to_text;
use firstlight_files::stamp::{Stamp, stamp};
use firstlight_format::camera::CameraPart;
use firstlight_format::error::SceneError;
use firstlight_format::names::Names;
use firstlight_format::scene_file::SceneFile;
use firstlight_format::sources::EnvironmentSource;
use firstlight_format::value::ColorValue;
use firstlight_mesh::Mesh;
use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// What a texture is read as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Reads {
    /// A colour of at most 1.
    Color,
    /// Radiance.
    Light,
    /// The mean of the channels.
    Number,
    /// Alpha, if the image has it.
    Opacity,
}

/// The mesh of a primitive with its number in the scene.
#[derive(Clone)]
pub(crate) struct PrimitiveMesh {
    pub mesh: Arc<Mesh>,
    pub number: u32,
}

pub(crate) struct Converter<'a> {
    pub root: &'a Value,
    pub file: SceneFile,
    source: &'a Source<'a>,
    /// Of the scene: paths are relative to it.
    pub folder: &'a Path,
    named_files: NamedFiles<'a>,
    pub light_images: &'a LightImages,
    meshes: &'a MeshBudget,
    /// Of the scene in its folder.
    pub file_name: String,
    /// Names and values from the command line, which have no effect.
    pub defines: &'a [(String, String)],
    pub bsdfs: HashMap<&'a str, &'a Value>,
    /// Absorption of the media that do not scatter, per metre; `None` for others.
    pub media: HashMap<&'a str, Option<Vec3>>,
    /// Orientation of the skydomes.
    pub domes: HashMap<&'a str, DMat3>,
    /// Materials by their BSDF and what is inside.
    pub surfaces: HashMap<(*const Value, String), Option<String>>,
    pub textures: HashMap<(String, Reads), ColorValue>,
    /// Of the images that are read as numbers: whether they have alpha, and colours.
    pub channels: HashMap<String, [bool; 2]>,
    pub material_names: Names,
    pub texture_names: Names,
}

/// The elements of a list of the root with their names.
fn named<'a>(root: &'a Value, list: &str) -> impl Iterator<Item = (&'a str, &'a Value)> {
    let all = root.get(list).and_then(Value::as_array).into_iter().flatten();
    all.filter_map(|value| Some((value.get("name")?.as_str()?, value)))
}

impl<'a> Converter<'a> {
    pub(crate) fn new(root: &'a Value, source: &'a Source<'a>, options: &'a ForeignOptions) -> Self {
        let path = source.path;
        Self {
            root,
            file: SceneFile::new(CameraPart::looking_at(DVec3::ZERO, DVec3::NEG_Z)),
            source,
            folder: path.parent().unwrap_or(Path::new("")),
            named_files: NamedFiles::of(path, options.allow_outside),
            light_images: &options.light_images,
            meshes: &options.meshes,
            file_name: path.file_name().map(|name| path_to_text(name.as_ref())).unwrap_or_default(),
            defines: &options.defines,
            bsdfs: named(root, "bsdfs").collect(),
            media: HashMap::new(),
            domes: HashMap::new(),
            surfaces: HashMap::new(),
            textures: HashMap::new(),
            channels: HashMap::new(),
            material_names: Names::default(),
            texture_names: Names::default(),
        }
    }

    /// - `before`: the stamp of the scene from before it was read.
    ///
    /// # Errors
    /// If there is nothing that can be seen.
    pub(crate) fn convert(mut self, before: Stamp) -> Result<ForeignScene, SceneError> {
        let (root, source) = (self.root, self.source);
        self.view();
        self.describe_media();
        self.domes = named(root, "primitives")
            .filter(|(_, value)| kind_of(value) == "skydome")
            .map(|(name, value)| (name, Fields::of(Some(value), "primitive", source).transform("transform").matrix3))
            .collect();
        let primitives = root.get("primitives").and_then(Value::as_array).into_iter().flatten();
        let primitives: Vec<Fields> = primitives.map(|value| Fields::of(Some(value), kind_of(value), source)).collect();
        let wanted: Vec<Option<MeshRequest>> = primitives.iter().map(|primitive| self.mesh_of(primitive)).collect();
        let mut requests: HashMap<&MeshRequest, u32> = HashMap::new();
        // By the place of the first primitive that has it, whatever must not be read.
        for (place, request) in (0..).zip(&wanted) {
            if let Some(request) = request {
                requests.entry(request).or_insert(place);
            }
        }
        let budget = self.meshes;
        let made: HashMap<&MeshRequest, Result<PrimitiveMesh, String>> = (requests.par_iter())
            .map(|(request, number)| {
                let mesh = request.make(budget).map(|mesh| PrimitiveMesh { mesh: Arc::new(mesh), number: *number });
                (*request, mesh)
            })
            .collect();
        for (primitive, request) in primitives.iter().zip(&wanted) {
            let mesh = match request.as_ref().and_then(|request| made.get(request)) {
                Some(Err(why)) => {
                    primitive.tell(format!("{why}; it is left out"));
                    continue;
                }
                Some(Ok(mesh)) => Some(mesh.clone()),
                None => None,
            };
            self.primitive(primitive, mesh);
        }
        let parts = made.values().flatten().map(|made| (made.number, made.mesh.clone())).collect();
        let of_files = requests.iter().filter_map(|(request, number)| Some((*number, request.file()?)));
        let part_files = of_files.map(|(number, file)| (number, (file.to_owned(), stamp(file)))).collect();
        let warnings = source.told.take();
        if self.file.objects.is_empty() && self.file.environment == EnvironmentSource::Black {
            return Err(SceneError::in_file(source.path, "has no primitive that can be shown"));
        }
        let files = Arc::new([(source.path.to_owned(), before)]);
        Ok(ForeignScene { file: self.file, parts, part_files, warnings, files })
    }

    pub(crate) fn fields(&self, value: Option<&'a Value>, kind: &'a str) -> Fields<'a> {
        Fields::of(value, kind, self.source)
    }

    /// The path of a file in the scene file; `None` if it must not be read, which is told.
    pub(crate) fn file_of(&mut self, of: &Fields, name: &str) -> Option<String> {
        let (path, told) = self.named_files.find(name);
        told.into_iter().for_each(|it| of.tell(it));
        path
    }

    fn describe_media(&mut self) {
        for (name, value) in named(self.root, "media") {
            let of = self.fields(Some(value), "medium");
            let coefficient = |name: &str| of.vector(name).unwrap_or(DVec3::ZERO).clamp(DVec3::ZERO, DVec3::splat(1e9));
            let factor = of.number("density").unwrap_or(1.0).clamp(0.0, 1e9);
            let is_clear = of.kind() == "homogeneous" && coefficient("sigma_s") == DVec3::ZERO;
            self.media.insert(name, is_clear.then(|| (factor * coefficient("sigma_a")).as_vec3()));
        }
    }
}

fn kind_of(value: &Value) -> &str {
    value.get("type").and_then(Value::as_str).unwrap_or("primitive")
}
