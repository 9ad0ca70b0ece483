//! The directives of a scene and of the files that it includes.

use crate::model::foreign::{ForeignOptions, cut};
use crate::pbrt::build::{Builder, TooMany};
use crate::pbrt::cursor::{Cursor, SourceText};
use crate::pbrt::state::{AreaLight, MaterialRef, State};
use crate::pbrt::transforms::{look_at, rotation};
use crate::pbrt::view::{ViewOptions, ViewParts};
use firstlight_files::gzip::decompressed;
use firstlight_files::input_file::{BYTE_ORDER_MARK, FileKind, InputFile};
use firstlight_files::limits::Limits;
use firstlight_files::printable;
use firstlight_files::stamp::{Stamp, stamp};
use firstlight_format::error::{SceneError, suggestion};
use glam::DAffine3;
use std::cell::OnceCell;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Files inside of one another.
const MAX_INCLUDES_DEEP: usize = 32;
/// Files that are included, all together.
const MAX_INCLUDES: usize = 10_000;
/// Parameters of the `Attribute`s that count at a time, and their bytes: each shape looks for its own in all of them.
const MAX_ATTRIBUTES: usize = 256;
const MAX_ATTRIBUTE_BYTES: usize = 1 << 14;
/// States that are saved at a time.
const MAX_STATES: usize = 1024;

/// All directives, for suggestions.
const DIRECTIVES: &[&str] = &[
    "Accelerator",
    "ActiveTransform",
    "AreaLightSource",
    "Attribute",
    "AttributeBegin",
    "AttributeEnd",
    "Camera",
    "ColorSpace",
    "ConcatTransform",
    "CoordSysTransform",
    "CoordinateSystem",
    "Film",
    "Identity",
    "Import",
    "Include",
    "Integrator",
    "LightSource",
    "LookAt",
    "MakeNamedMaterial",
    "MakeNamedMedium",
    "Material",
    "MediumInterface",
    "NamedMaterial",
    "ObjectBegin",
    "ObjectEnd",
    "ObjectInstance",
    "Option",
    "PixelFilter",
    "ReverseOrientation",
    "Rotate",
    "Sampler",
    "Scale",
    "Shape",
    "Texture",
    "Transform",
    "TransformBegin",
    "TransformEnd",
    "TransformTimes",
    "Translate",
    "WorldBegin",
];

const MORE_THAN_SHOWN: &str = "the scene has more objects than can be shown: use fewer shapes or instances";

/// Textures may consist of later ones to this depth.
const MOST_READINGS: u32 = 4;

/// Reads directives, one after the other.
pub(crate) struct Reader<'a> {
    path: &'a Path,
    folder: &'a Path,
    state: State,
    stack: Vec<State>,
    systems: HashMap<String, DAffine3>,
    before_world: ViewOptions,
    /// Known from `WorldBegin` on.
    view: Option<ViewParts>,
    builder: Builder<'a>,
    files: Vec<(PathBuf, Stamp)>,
    known_files: HashSet<PathBuf>,
    n_includes: usize,
    /// Bytes of text that may still be read.
    bytes_left: u64,
    /// After `WorldEnd` of version 3.
    has_ended: bool,
}

impl<'a> Reader<'a> {
    fn new(path: &'a Path, options: &'a ForeignOptions) -> Self {
        Self {
            path,
            folder: path.parent().unwrap_or(Path::new("")),
            state: State::default(),
            stack: Vec::new(),
            systems: HashMap::new(),
            before_world: ViewOptions::default(),
            view: None,
            builder: Builder::new(path, options),
            files: Vec::new(),
            known_files: HashSet::new(),
            n_includes: 0,
            bytes_left: Limits::of_this_process().scene_bytes,
            has_ended: false,
        }
    }

    /// Reads a scene; once more if it uses names before it describes them, which pbrt allows, and again while textures
    /// consist of later ones.
    pub(crate) fn read(path: &'a Path, options: &'a ForeignOptions) -> Result<Self, SceneError> {
        let mut reader = Self::new(path, options);
        reader.read_all()?;
        for _ in 1..MOST_READINGS {
            let Some(known) = reader.builder.described_later() else { break };
            reader = Self::new(path, options);
            reader.builder.know(known);
            reader.read_all()?;
        }
        Ok(reader)
    }

    fn read_all(&mut self) -> Result<(), SceneError> {
        let source = self.text(self.path)?;
        self.run(&source, 0)?;
        self.builder.finish_instances().map_err(|TooMany| SceneError::in_file(self.path, MORE_THAN_SHOWN))?;
        if self.builder.is_in_object() {
            self.builder.tell("`ObjectBegin` is not ended: what follows it is not shown; is the file cut off?");
        } else if !self.stack.is_empty() {
            self.builder.tell("`AttributeBegin` is not ended: is the file cut off?");
        }
        Ok(())
    }

    /// What was read: camera and film, everything else, and the files.
    pub(crate) fn finish(self) -> Result<(ViewParts, Builder<'a>, Vec<(PathBuf, Stamp)>), SceneError> {
        let none =
            || SceneError::in_file(self.path, "has no `WorldBegin`: it is only a part of a scene, to be included");
        Ok((self.view.ok_or_else(none)?, self.builder, self.files))
    }

    /// The text of a file, within what may still be read.
    fn text(&mut self, path: &Path) -> Result<SourceText, SceneError> {
        let failed = |error: String| SceneError::in_file(path, error);
        // Taken before reading, so that a change in the meantime is noticed.
        let before = stamp(path);
        let bytes = InputFile::open_within(path, FileKind::Scene, self.bytes_left).and_then(InputFile::bytes);
        let bytes = bytes.map_err(|error| failed(error.to_string()))?;
        let packed = bytes.len() as u64;
        let bytes = decompressed(bytes, FileKind::Scene, self.bytes_left);
        // What cannot be read took as long.
        let length = bytes.as_ref().map_or(Limits::most_unpacked(packed), |bytes| bytes.len() as u64);
        self.bytes_left = self.bytes_left.saturating_sub(length);
        let bytes = bytes.map_err(|error| failed(error.to_string()))?;
        // Names in other encodings are no reason to refuse a scene.
        let text =
            String::from_utf8(bytes).unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned());
        let text = text.strip_prefix(BYTE_ORDER_MARK).map(str::to_owned).unwrap_or(text);
        if self.known_files.insert(path.to_owned()) {
            self.files.push((path.to_owned(), before));
        }
        Ok(SourceText { path: path.to_owned(), text })
    }

    fn run(&mut self, source: &SourceText, depth: usize) -> Result<(), SceneError> {
        let mut cursor = Cursor::new(source);
        while let Some((name, at)) = cursor.directive()?.filter(|_| !self.has_ended) {
            self.directive(&mut cursor, name, at, depth)?;
        }
        Ok(())
    }

    fn directive(&mut self, cursor: &mut Cursor, name: &str, at: usize, depth: usize) -> Result<(), SceneError> {
        let is_in_world = self.view.is_some();
        // Names of versions 2 and 3.
        let name = match name {
            "SurfaceIntegrator" => "Integrator",
            "AreaLight" => "AreaLightSource",
            name => name,
        };
        let needs_world = ["AttributeBegin", "AreaLightSource", "LightSource", "Material", "MakeNamedMaterial"];
        let needs_world =
            needs_world.contains(&name) || name.starts_with("Object") || matches!(name, "Shape" | "Texture");
        if needs_world && !is_in_world {
            return Err(cursor.wrong(at, format!("`{name}` stands before `WorldBegin`, but belongs after it")));
        }
        let needs_options = matches!(name, "Camera" | "Film" | "PixelFilter" | "Integrator" | "WorldBegin");
        if needs_options && is_in_world {
            return Err(cursor.wrong(at, format!("`{name}` stands after `WorldBegin`, but belongs before it")));
        }
        match name {
            "Identity" => {
                if self.state.sets_start {
                    self.state.ctm = DAffine3::IDENTITY;
                }
            }
            "Translate" => {
                let by = cursor.vector()?;
                self.state.apply(DAffine3::from_translation(by));
            }
            "Scale" => {
                let by = cursor.vector()?;
                self.state.apply(DAffine3::from_scale(by));
            }
            "Rotate" => {
                let (degrees, axis) = cursor.rotation()?;
                self.state.apply(rotation(degrees, axis));
            }
            "LookAt" => {
                let points = cursor.look_at()?;
                match look_at(points) {
                    Some(transform) => {
                        self.state.apply(transform);
                        if !is_in_world {
                            self.before_world.up = points[2].try_normalize();
                        }
                    }
                    None => {
                        let place = cursor.place(at);
                        self.builder.warnings.push(format!("{place}: `LookAt` without a direction is ignored"));
                    }
                }
            }
            "Transform" | "ConcatTransform" => {
                let (matrix, is_affine) = cursor.matrix()?;
                if !is_affine {
                    let place = cursor.place(at);
                    self.builder.warnings.push(format!("{place}: the perspective part of a matrix is ignored"));
                }
                if self.state.sets_start {
                    let before = if name == "Transform" { DAffine3::IDENTITY } else { self.state.ctm };
                    self.state.ctm = before * matrix;
                }
            }
            "CoordinateSystem" => {
                let system = cursor.string()?;
                self.systems.insert(system, self.state.ctm);
            }
            "CoordSysTransform" => {
                let system = cursor.string()?;
                match self.systems.get(&system) {
                    Some(transform) => self.state.ctm = *transform,
                    None => {
                        let system = printable::name(&system);
                        self.builder.tell(format!("there is no coordinate system `{system}`: the transform stays"));
                    }
                }
            }
            "ActiveTransform" => {
                let which = cursor.word()?;
                self.state.sets_start = which != "EndTime";
                if which == "EndTime" {
                    self.builder.tell("motion is not shown: everything is where it begins");
                }
            }
            "TransformTimes" => {
                cursor.pair()?;
            }
            "ReverseOrientation" => self.state.is_reversed = !self.state.is_reversed,
            // The latter names are those of version 3, and mean the same in version 4.
            "AttributeBegin" | "TransformBegin" => self.save(cursor, at)?,
            "AttributeEnd" | "TransformEnd" => self.restore(cursor, at),
            "ObjectBegin" => {
                let object = cursor.string()?;
                self.save(cursor, at)?;
                self.builder.begin_object(&object).map_err(|message| cursor.wrong(at, message))?;
            }
            "ObjectEnd" => {
                self.builder.end_object().map_err(|message| cursor.wrong(at, message))?;
                self.restore(cursor, at);
            }
            "ObjectInstance" => {
                let object = cursor.string()?;
                let ctm = self.state.ctm;
                self.builder.instance(&object, &ctm).map_err(|error| too_many(cursor, at, error))?;
            }
            "Attribute" => {
                let of = cursor.string()?;
                let params = cursor.params()?;
                let attributes = self.state.attributes.and(cut(&of), params.into_list());
                if attributes.n_params() > MAX_ATTRIBUTES || attributes.n_bytes() > MAX_ATTRIBUTE_BYTES {
                    let most = format!("{MAX_ATTRIBUTES} parameters, or than {MAX_ATTRIBUTE_BYTES} bytes of them");
                    return Err(cursor.wrong(at, format!("the `Attribute`s that count here have more than {most}")));
                }
                self.state.attributes = attributes;
            }
            "Include" | "Import" => {
                let file = cursor.string()?;
                self.include(cursor, at, &file, name == "Import", depth)?;
            }
            "ColorSpace" => {
                let space = cursor.string()?;
                if space != "srgb" {
                    let space = printable::name(&space).into_owned();
                    self.builder
                        .tell(format!("the colour space `{space}` is not modelled: colours are taken for sRGB"));
                }
            }
            "Option" => cursor.option()?,
            "Sampler" | "Accelerator" | "PixelSampler" | "Renderer" | "VolumeIntegrator" => {
                cursor.string()?;
                cursor.params()?;
            }
            "Camera" => {
                let camera = (cursor.string()?, cursor.params()?);
                self.before_world.camera = Some(camera);
                self.before_world.camera_from_world = self.state.ctm;
                self.systems.insert("camera".to_owned(), self.state.ctm.inverse());
            }
            "Film" => self.before_world.film = Some((cursor.string()?, cursor.params()?)),
            "PixelFilter" => self.before_world.filter = Some((cursor.string()?, cursor.params()?)),
            "Integrator" => self.before_world.integrator = Some((cursor.string()?, cursor.params()?)),
            "WorldBegin" => {
                let builder = &mut self.builder;
                let view = self.before_world.parts(|what| builder.tell(what));
                let parts = [&self.before_world.camera, &self.before_world.film, &self.before_world.filter];
                for (_, params) in parts.into_iter().chain([&self.before_world.integrator]).flatten() {
                    params.complaints().into_iter().for_each(|what| builder.tell(what));
                }
                builder.world = view.world;
                self.view = Some(view);
                self.state = State { ctm: DAffine3::IDENTITY, sets_start: true, ..self.state.clone() };
                self.systems.insert("world".to_owned(), DAffine3::IDENTITY);
            }
            "Texture" => {
                let (texture, of, class) = (cursor.string()?, cursor.string()?, cursor.string()?);
                let params = cursor.params()?.with_attributes("texture", &self.state.attributes);
                self.builder.define_texture(&texture, of == "float", &class, &params);
            }
            "Material" => {
                let kind = cursor.string()?;
                let params = cursor.params()?.with_attributes("material", &self.state.attributes);
                self.state.material = MaterialRef::Own(self.builder.described("", kind, params));
            }
            "MakeNamedMaterial" => {
                let material = cursor.string()?;
                let params = cursor.params()?.with_attributes("material", &self.state.attributes);
                self.builder.describe_material(&material, params);
            }
            "NamedMaterial" => {
                let name = cut(&cursor.string()?).to_owned();
                let known = self.builder.named.get(&name).cloned();
                self.state.material = known.map_or(MaterialRef::Named(name), MaterialRef::Own);
            }
            "MakeNamedMedium" => {
                let medium = cursor.string()?;
                let params = cursor.params()?.with_attributes("medium", &self.state.attributes);
                self.builder.describe_medium(&medium, &params);
            }
            "MediumInterface" => {
                self.state.inside = cut(&cursor.string()?).to_owned();
                let outside = cursor.optional_string()?;
                if let Some(outside) = outside.filter(|outside| !outside.is_empty()) {
                    let outside = printable::name(&outside).into_owned();
                    self.builder.tell(format!("medium `{outside}` is not shown outside of shapes"));
                }
            }
            "AreaLightSource" => {
                let kind = cursor.string()?;
                let params = cursor.params()?.with_attributes("light", &self.state.attributes);
                if kind != "diffuse" && kind != "area" {
                    let kind = printable::name(&kind).into_owned();
                    self.builder.tell(format!("area lights of the kind `{kind}` are taken for diffuse ones"));
                }
                self.state.area_light = Some(Rc::new(AreaLight { params, radiance: OnceCell::new() }));
            }
            "LightSource" => {
                let kind = cursor.string()?;
                let params = cursor.params()?.with_attributes("light", &self.state.attributes);
                let ctm = self.state.ctm;
                self.builder.light(&kind, &params, &ctm);
            }
            "Shape" => {
                let kind = cursor.string()?;
                let params = cursor.params()?.with_attributes("shape", &self.state.attributes);
                let made = self.builder.shape(&kind, &params, &self.state);
                made.map_err(|error| too_many(cursor, at, error))?;
                let place = cursor.place(at);
                for complaint in params.complaints() {
                    self.builder.warnings.push(format!("{place}: {complaint}"));
                }
            }
            "Volume" => {
                cursor.string()?;
                cursor.params()?;
                self.builder.tell("volumes are not modelled");
            }
            "WorldEnd" => self.has_ended = true,
            other => {
                let hint = suggestion(other, DIRECTIVES.iter().copied());
                return Err(cursor.wrong(at, format!("there is no directive `{}`{hint}", printable::name(other))));
            }
        }
        Ok(())
    }

    fn save(&mut self, cursor: &Cursor, at: usize) -> Result<(), SceneError> {
        if self.stack.len() >= MAX_STATES {
            return Err(cursor.wrong(at, format!("more than {MAX_STATES} attributes are open: end some of them")));
        }
        self.stack.push(self.state.clone());
        Ok(())
    }

    /// Ends what was begun last: in version 3, objects and attributes may end in any order.
    fn restore(&mut self, cursor: &Cursor, at: usize) {
        match self.stack.pop() {
            Some(state) => self.state = state,
            None => {
                let place = cursor.place(at);
                self.builder.warnings.push(format!("{place}: nothing was begun that this could end: it is ignored"));
            }
        }
    }

    fn include(
        &mut self,
        cursor: &mut Cursor,
        at: usize,
        file: &str,
        is_import: bool,
        depth: usize,
    ) -> Result<(), SceneError> {
        if depth >= MAX_INCLUDES_DEEP {
            let message = format!("files include one another more than {MAX_INCLUDES_DEEP} deep: is it a circle?");
            return Err(cursor.wrong(at, message));
        }
        self.n_includes += 1;
        if self.n_includes > MAX_INCLUDES {
            return Err(cursor.wrong(at, format!("more than {MAX_INCLUDES} files are included")));
        }
        let found = self.builder.named_files.references.resolve(self.folder, file);
        let folder = self.folder;
        let source = found.map_err(|outside| outside.to_string()).and_then(|found| {
            let path = folder.join(&found.path);
            // A file of that name beside the scene is another scene, or this one.
            let is_this = path == self.path && found.path != Path::new(file);
            if leaves_out_folders(file, &found.path) || is_this {
                return Err(format!("there is no `{}`", printable::name(file)));
            }
            self.text(&path).map_err(|error| error.to_string())
        });
        let source = match source {
            Ok(source) => source,
            // A part that is missing costs only itself, with the parameters that go on with its last directive.
            Err(error) => {
                let place = cursor.place(at);
                self.builder.warnings.push(format!("{place}: {error}; the included file is left out"));
                return cursor.params().map(drop);
            }
        };
        if !is_import {
            return self.run(&source, depth + 1);
        }
        // What an imported file sets does not count outside of it.
        let state = self.state.clone();
        let n_open = self.stack.len();
        self.run(&source, depth + 1)?;
        self.stack.truncate(n_open);
        self.state = state;
        Ok(())
    }
}

/// Whether a file was found by the last part of a relative name alone.
fn leaves_out_folders(name: &str, found: &Path) -> bool {
    let name = name.replace('\\', "/");
    let is_within = |folders: &str| !folders.is_empty() && !folders.contains([':', '.']);
    name.rsplit_once('/').is_some_and(|(folders, file)| found == Path::new(file) && is_within(folders))
        && !name.starts_with('/')
}

fn too_many(cursor: &Cursor, at: usize, TooMany: TooMany) -> SceneError {
    cursor.wrong(at, MORE_THAN_SHOWN)
}
