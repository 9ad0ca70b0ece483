//! XML text to a [`Graph`]: parameters, `default` and `$name`, `include`, `ref`, `alias`, `path`.
//!
//! Document type definitions are refused, so that no entity expands; nesting and includes are limited.
//! Files of version 0.x are read by the rules of their time: parameters in camel case.
//!
//! Source: <https://mitsuba.readthedocs.io/en/stable/src/key_topics/scene_format.html>

use crate::mitsuba::graph::{Child, Graph, Object, Parameter, Place, SourceFile, Spectrum, Target, Value};
use crate::mitsuba::lenient::{tags_of, text_of};
use crate::mitsuba::parameters::{Defines, Parameters};
use crate::mitsuba::spectrum;
use crate::mitsuba::transform;
use crate::mitsuba::words::{check_tags, hex, is_old, number, numbers, snake_case};
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_files::limits::Limits;
use firstlight_files::printable;
use firstlight_files::reference::References;
use firstlight_files::relative::text_to_path;
use firstlight_files::stamp::stamp;
use firstlight_files::warnings::Warnings;
use firstlight_format::error::SceneError;
use firstlight_format::scene_format::MAX_XML_ELEMENTS;
use glam::{DMat4, DVec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Depth of nested elements.
const MAX_DEPTH: u32 = 100;
/// Depth of included files, as in Mitsuba.
const MAX_INCLUDE_DEPTH: u32 = 15;
/// Number of files of a scene.
const MAX_FILES: usize = 1000;
/// Folders in which each file is looked for.
const MAX_FOLDERS: usize = 16;

/// Reads the scene at `path` and the files that it includes.
///
/// # Errors
/// If a file cannot be read, is not XML, or has an element or value that no scene may have.
pub(crate) fn read_graph(
    path: &Path,
    defines: &Defines,
    allow_outside: bool,
    warnings: &mut Warnings,
) -> Result<Graph, SceneError> {
    let mut reader = Reader {
        graph: Graph::default(),
        parameters: Parameters::of(defines),
        references: References::of(path, allow_outside),
        warnings,
        bytes_left: Limits::of_this_process().scene_bytes,
        n_elements: 0,
        spectra: HashMap::new(),
        include_depth: 0,
        unnamed_scene: false,
        old: true,
    };
    reader.file(path, None)?;
    for (name, _) in defines.iter().filter(|(name, _)| !reader.parameters.is_used(name)) {
        let name = printable::name(name);
        reader.warnings.push(format!("{}: has no parameter `${name}`: -D {name} has no effect", path.display()));
    }
    Ok(reader.graph)
}

struct Reader<'a> {
    graph: Graph,
    parameters: Parameters,
    references: References,
    warnings: &'a mut Warnings,
    /// Bytes of text that may still be read.
    bytes_left: u64,
    n_elements: usize,
    /// Spectra in files of their own, each read once.
    spectra: HashMap<PathBuf, Spectrum>,
    include_depth: u32,
    unnamed_scene: bool,
    /// Whether the current file has a version before 2.
    old: bool,
}

type Element<'a, 'input> = roxmltree::Node<'a, 'input>;

impl Reader<'_> {
    /// - `parent`: the object that includes it, and the name that it gives.
    fn file(&mut self, path: &Path, parent: Option<(usize, Option<String>)>) -> Result<(), SceneError> {
        let stamp = stamp(path);
        let read = InputFile::open_within(path, FileKind::Scene, self.bytes_left).and_then(InputFile::bytes);
        let bytes = read.map_err(|error| SceneError::in_file(path, error.to_string()))?;
        self.bytes_left = self.bytes_left.saturating_sub(bytes.len() as u64);
        let text = tags_of(&text_of(&bytes));
        let number = self.graph.files.len() as u32;
        self.graph.files.push(SourceFile { path: path.to_owned(), text: text.clone(), stamp });
        if number == 0 {
            self.graph.folders.push(path.parent().map(Path::to_path_buf).unwrap_or_default());
        }
        check_tags(&text).map_err(|why| SceneError::in_file(path, why))?;
        let document = roxmltree::Document::parse(&text).map_err(|error| {
            let at = error.pos();
            // The position stands in front of the message.
            let message = error.to_string().replacen(&format!(" at {at}"), "", 1);
            SceneError::at(path, (at.row as usize, at.col as usize), format!("not valid XML: {message}"))
        })?;
        let root = document.root_element();
        let before = self.old;
        // Mitsuba 3 refuses files without one; other renderers write names as in 0.x.
        self.old = root.attribute("version").map_or(self.old, is_old);
        let place = Place { file: number, offset: root.range().start };
        let read = match (parent, root.tag_name().name()) {
            (None, "scene") => {
                let object = self.add_object(root, place, "scene")?;
                self.elements(root, number, object, 1)
            }
            (None, other) => {
                let other = printable::name(other);
                Err(self.graph.error(place, format!("a Mitsuba scene has a root `<scene>`, not `<{other}>`")))
            }
            // The parts of an included scene become parts of this one.
            (Some((object, _)), "scene") => self.elements(root, number, object, 1),
            (Some((object, name)), _) => self.element(root, number, object, 1, name),
        };
        self.old = before;
        read
    }

    fn elements(&mut self, parent: Element, file: u32, object: usize, depth: u32) -> Result<(), SceneError> {
        for child in parent.children().filter(Element::is_element) {
            self.element(child, file, object, depth, None)?;
        }
        Ok(())
    }

    /// - `given`: name of an object that the file which includes it gives.
    fn element(
        &mut self,
        element: Element,
        file: u32,
        parent: usize,
        depth: u32,
        given: Option<String>,
    ) -> Result<(), SceneError> {
        let place = Place { file, offset: element.range().start };
        let tag = element.tag_name().name();
        let attribute = |reader: &mut Self, name: &str| match element.attribute(name) {
            Some(text) => reader.substitute(text, place).map(Some),
            None => Ok(None),
        };
        self.n_elements += 1;
        if self.n_elements > MAX_XML_ELEMENTS {
            return Err(self
                .graph
                .error(place, format!("a scene may have {MAX_XML_ELEMENTS} elements, with those included")));
        }
        if depth > MAX_DEPTH {
            return Err(self.graph.error(place, format!("elements are nested more than {MAX_DEPTH} deep")));
        }
        match tag {
            "scene" | "integrator" | "sensor" | "film" | "rfilter" | "sampler" | "bsdf" | "texture" | "shape"
            | "emitter" | "medium" | "phase" | "volume" | "subsurface" => {
                self.object(element, place, parent, depth, given)?;
            }
            "spectrum" if element.has_attribute("type") => self.object(element, place, parent, depth, given)?,
            "default" => {
                let name = self.required(element, place, "name")?;
                let value = self.required(element, place, "value")?;
                self.parameters.add_default(name, value).map_err(|why| self.graph.error(place, why))?;
            }
            "include" => self.include(element, place, parent)?,
            "path" => {
                let value = self.required(element, place, "value")?;
                let folder = self.graph.files[file as usize].path.parent().unwrap_or(Path::new("")).to_owned();
                match self.references.resolve(&folder, &value) {
                    // Looked in before those that came earlier.
                    Ok(found) => {
                        let folder = folder.join(found.path);
                        self.graph.folders.retain(|known| *known != folder);
                        if self.graph.folders.len() >= MAX_FOLDERS {
                            let most = format!("a scene may name {MAX_FOLDERS} folders in which files are looked for");
                            return Err(self.graph.error(place, most));
                        }
                        self.graph.folders.insert(0, folder);
                    }
                    Err(outside) => {
                        self.graph.tell(place, &outside.to_string(), self.warnings);
                    }
                }
            }
            "ref" => {
                let id = self.required(element, place, "id")?;
                let name = attribute(self, "name")?.or(given).map(|name| self.spelt(&name));
                self.graph.objects[parent].children.push(Child::new(name, Target::Id(id), place));
            }
            "alias" => {
                let (id, other) = (self.required(element, place, "id")?, self.required(element, place, "as")?);
                let Some(&index) = self.graph.ids.get(&id) else {
                    let id = printable::name(&id);
                    return Err(self.graph.error(place, format!("there is no object with the id `{id}` before here")));
                };
                self.define(other, index, place)?;
            }
            _ => {
                let Some(value) = self.parameter(element, tag, place)? else {
                    // As other renderers that read these files add.
                    let told = format!("`<{}>` is not known and has no effect", printable::name(tag));
                    self.graph.tell(place, &told, self.warnings);
                    return Ok(());
                };
                let name = match element.attribute("name") {
                    // All transforms but those of textures are of this name.
                    None if tag == "transform" => {
                        self.graph.tell(place, "a `<transform>` without a name: it is `to_world`", self.warnings);
                        "to_world".to_owned()
                    }
                    _ => self.required(element, place, "name")?,
                };
                let name = self.spelt(&name);
                self.graph.objects[parent].parameters.push(Parameter::new(name, value, place));
            }
        }
        Ok(())
    }

    fn object(
        &mut self,
        element: Element,
        place: Place,
        parent: usize,
        depth: u32,
        given: Option<String>,
    ) -> Result<(), SceneError> {
        let own = element.attribute("name").map(|text| self.substitute(text, place)).transpose()?;
        let name = own.or(given).map(|name| self.spelt(&name));
        let tag = if element.tag_name().name() == "spectrum" { "texture" } else { element.tag_name().name() };
        let index = self.add_object(element, place, tag)?;
        self.graph.objects[parent].children.push(Child::new(name, Target::Object(index), place));
        self.elements(element, place.file, index, depth + 1)?;
        if self.old {
            upgrade(&mut self.graph.objects[index]);
        }
        Ok(())
    }

    fn add_object(&mut self, element: Element, place: Place, tag: &str) -> Result<usize, SceneError> {
        let is_root = self.graph.objects.is_empty() && !std::mem::replace(&mut self.unnamed_scene, true);
        let plugin = match is_root {
            true => "scene".to_owned(),
            // Names in another case are told by nothing else.
            false => self.required(element, place, "type")?.to_ascii_lowercase(),
        };
        let id = element.attribute("id").map(|text| self.substitute(text, place)).transpose()?;
        let index = self.graph.objects.len();
        self.graph.objects.push(Object::new(tag, plugin, id.clone(), place, self.old));
        if let Some(id) = id {
            self.define(id, index, place)?;
        }
        Ok(index)
    }

    fn define(&mut self, id: String, index: usize, place: Place) -> Result<(), SceneError> {
        if self.graph.ids.contains_key(&id) {
            let id = printable::name(&id);
            return Err(self.graph.error(place, format!("the id `{id}` is used twice: rename one")));
        }
        self.graph.ids.insert(id, index);
        Ok(())
    }

    fn include(&mut self, element: Element, place: Place, parent: usize) -> Result<(), SceneError> {
        let file = self.required(element, place, "filename")?;
        let name = element.attribute("name").map(|text| self.substitute(text, place)).transpose()?;
        if self.include_depth >= MAX_INCLUDE_DEPTH {
            return Err(self
                .graph
                .error(place, format!("files include each other more than {MAX_INCLUDE_DEPTH} deep")));
        }
        if self.graph.files.len() >= MAX_FILES {
            return Err(self.graph.error(place, format!("a scene may consist of {MAX_FILES} files")));
        }
        let own = self.graph.files[place.file as usize].path.parent().unwrap_or(Path::new("")).to_owned();
        let folders: Vec<PathBuf> = std::iter::once(own).chain(self.graph.folders.iter().cloned()).collect();
        let path = find_file(&self.references, &folders, &file).map_err(|why| self.graph.error(place, why))?;
        self.include_depth += 1;
        let read = self.file(&path, Some((parent, name)));
        self.include_depth -= 1;
        read
    }

    /// The value of a parameter element; `None` for other elements.
    fn parameter(&mut self, element: Element, tag: &str, place: Place) -> Result<Option<Value>, SceneError> {
        if let "vector" | "point" = tag {
            let vector = self.vector(element, place, None)?;
            return Ok(Some(Value::Vector(vector)));
        }
        if tag == "transform" {
            return Ok(Some(Value::Transform(self.transform(element, place.file)?)));
        }
        // Of version 0.x.
        if tag == "animation" {
            let mut steps = element.children().filter(|step| step.has_tag_name("transform"));
            let Some(first) = steps.next() else {
                return Err(self.graph.error(place, "an `<animation>` consists of `<transform>`s"));
            };
            self.graph.tell(place, "an `<animation>` stands still where it begins", self.warnings);
            return Ok(Some(Value::Transform(self.transform(first, place.file)?)));
        }
        if tag == "spectrum" && !element.has_attribute("value") {
            let name = self.required(element, place, "filename")?;
            let own = self.graph.files[place.file as usize].path.parent().unwrap_or(Path::new("")).to_owned();
            let folders: Vec<PathBuf> = std::iter::once(own).chain(self.graph.folders.iter().cloned()).collect();
            let wrong = |why: String| self.graph.error(place, why);
            let path = find_file(&self.references, &folders, &name).map_err(wrong)?;
            if let Some(known) = self.spectra.get(&path) {
                return Ok(Some(Value::Spectrum(known.clone())));
            }
            let before = stamp(&path);
            let read = spectrum::read_file(&path)?;
            self.graph.other_files.push((path.clone(), before));
            self.spectra.insert(path, read.clone());
            return Ok(Some(Value::Spectrum(read)));
        }
        // Of version 0.x.
        if tag == "blackbody" {
            let text = self.required(element, place, "temperature")?;
            let scale = element.attribute("scale").map(|text| self.substitute(text, place)).transpose()?;
            let positive = |name: &str, text: &str| {
                let expected =
                    || self.graph.error(place, format!("`{name}` of a `<blackbody>` must be a number above 0"));
                number(text).filter(|number| *number > 0.0).ok_or_else(expected)
            };
            let kelvin = positive("temperature", text.trim().trim_end_matches(['K', 'k']))?;
            let scale = scale.map_or(Ok(1.0), |text| positive("scale", &text))?;
            return Ok(Some(Value::Spectrum(spectrum::blackbody(kelvin).scaled(scale))));
        }
        if !matches!(tag, "float" | "integer" | "boolean" | "string" | "rgb" | "color" | "srgb" | "spectrum") {
            return Ok(None);
        }
        let text = self.required(element, place, "value")?;
        let shown = printable::name(&text).into_owned();
        let expected = |what: &str| self.graph.error(place, format!("`{shown}` is not {what}"));
        Ok(Some(match tag {
            "float" => Value::Float(number(&text).ok_or_else(|| expected("a number"))?),
            "integer" => Value::Integer(text.trim().parse().map_err(|_| expected("a whole number"))?),
            "boolean" if text.eq_ignore_ascii_case("true") => Value::Boolean(true),
            "boolean" if text.eq_ignore_ascii_case("false") => Value::Boolean(false),
            "boolean" => return Err(expected("`true` or `false`")),
            "string" => Value::Text(text),
            "spectrum" => match numbers(&text).as_deref() {
                // Of version 0.x, whose spectra are linear RGB unless it is compiled otherwise.
                Some(&[r, g, b]) if self.old => Value::Rgb(DVec3::new(r, g, b)),
                _ => Value::Spectrum(spectrum::parse(&text).map_err(|why| expected(&why))?),
            },
            _ => match hex(&text) {
                Some(rgb) => Value::Rgb(rgb),
                None => match numbers(&text).as_deref() {
                    Some(&[grey]) => Value::Rgb(DVec3::splat(grey)),
                    Some(&[r, g, b]) => {
                        let rgb = DVec3::new(r, g, b);
                        Value::Rgb(if tag == "srgb" {
                            rgb.to_array().map(firstlight_render::decode_srgb).into()
                        } else {
                            rgb
                        })
                    }
                    _ => return Err(expected("a colour: one number or three")),
                },
            },
        }))
    }

    fn transform(&mut self, element: Element, file: u32) -> Result<DMat4, SceneError> {
        element
            .children()
            .filter(Element::is_element)
            .try_fold(DMat4::IDENTITY, |matrix, step| Ok(self.transform_step(step, file)? * matrix))
    }

    fn transform_step(&mut self, element: Element, file: u32) -> Result<DMat4, SceneError> {
        let place = Place { file, offset: element.range().start };
        let text = |reader: &mut Self, name: &str| {
            let text = reader.required(element, place, name)?;
            let wrong = |reader: &Self| {
                let text = printable::name(&text).into_owned();
                reader.graph.error(place, format!("`{name}` must be three numbers, not `{text}`"))
            };
            match numbers(&text).as_deref() {
                Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
                _ => Err(wrong(reader)),
            }
        };
        let tag = element.tag_name().name();
        let step = match tag {
            "translate" => Ok(DMat4::from_translation(self.vector(element, place, Some(0.0))?)),
            "scale" => Ok(DMat4::from_scale(self.vector(element, place, Some(1.0))?)),
            "rotate" => {
                let axis = self.vector(element, place, Some(0.0))?;
                let angle = self.required(element, place, "angle")?;
                let angle = number(&angle).ok_or_else(|| self.graph.error(place, "`angle` must be a number"))?;
                transform::rotation(axis, angle, self.old)
            }
            "lookat" | "lookAt" => {
                let (origin, target) = (text(self, "origin")?, text(self, "target")?);
                let up = if element.has_attribute("up") { text(self, "up")? } else { DVec3::ZERO };
                transform::look_at(origin, target, up)
            }
            "matrix" => {
                let value = self.required(element, place, "value")?;
                transform::matrix(&numbers(&value).unwrap_or_default())
            }
            other => {
                let told = format!("`<{}>` is no part of a transform and has no effect", printable::name(other));
                self.graph.tell(place, &told, self.warnings);
                Ok(DMat4::IDENTITY)
            }
        };
        step.map_err(|why| self.graph.error(place, why))
    }

    /// `x`, `y` and `z`, or `value` with one number or three.
    ///
    /// - `default`: of missing coordinates; `None`: all are required.
    fn vector(&mut self, element: Element, place: Place, default: Option<f64>) -> Result<DVec3, SceneError> {
        if element.has_attribute("value") {
            let text = self.required(element, place, "value")?;
            return match numbers(&text).as_deref() {
                Some(&[all]) => Ok(DVec3::splat(all)),
                Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
                _ => {
                    let text = printable::name(&text);
                    Err(self.graph.error(place, format!("`value` must be one number or three, not `{text}`")))
                }
            };
        }
        let mut vector = DVec3::ZERO;
        for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
            vector[i] = match (element.has_attribute(name), default) {
                (false, Some(default)) => default,
                _ => {
                    let text = self.required(element, place, name)?;
                    number(&text).ok_or_else(|| {
                        let text = printable::name(&text);
                        self.graph.error(place, format!("`{name}` must be a number, not `{text}`"))
                    })?
                }
            };
        }
        Ok(vector)
    }

    fn required(&mut self, element: Element, place: Place, name: &str) -> Result<String, SceneError> {
        match element.attribute(name) {
            Some(text) => self.substitute(text, place),
            None => {
                let tag = printable::name(element.tag_name().name()).into_owned();
                Err(self.graph.error(place, format!("`<{tag}>` lacks `{name}`")))
            }
        }
    }

    fn substitute(&mut self, text: &str, place: Place) -> Result<String, SceneError> {
        self.parameters.substitute(text).map_err(|why| self.graph.error(place, why))
    }

    /// The name of a parameter today.
    fn spelt(&self, name: &str) -> String {
        if self.old { snake_case(name) } else { name.to_owned() }
    }
}

/// The first file of this name in the folders.
pub(crate) fn find_file(references: &References, folders: &[PathBuf], name: &str) -> Result<PathBuf, String> {
    let mut refused = None;
    for folder in folders {
        match references.resolve(folder, name) {
            Ok(found) => {
                let path = folder.join(&found.path);
                if path.exists() {
                    return Ok(path);
                }
            }
            Err(outside) => refused = refused.or(Some(outside)),
        }
    }
    match refused {
        Some(outside) => Err(outside.to_string()),
        None => Err(format!(
            "`{}`: no such file",
            printable::name(&firstlight_files::relative::path_to_text(&text_to_path(name)))
        )),
    }
}

/// What other parameters were called before version 2.
fn upgrade(object: &mut Object) {
    if object.plugin == "diffuse" {
        let rename = |name: &mut String| {
            if name == "diffuse_reflectance" {
                "reflectance".clone_into(name);
            }
        };
        object.parameters.iter_mut().for_each(|it| rename(&mut it.name));
        object.children.iter_mut().filter_map(|it| it.name.as_mut()).for_each(rename);
    }
    let mut affine = [0.0, 0.0, 1.0, 1.0];
    let mut place = None;
    for (name, value) in ["uoffset", "voffset", "uscale", "vscale"].into_iter().zip(&mut affine) {
        if let Some(at) = object.parameters.iter().position(|it| it.name == name) {
            let removed = object.parameters.remove(at);
            if let Value::Float(number) = removed.value {
                *value = number;
            }
            place = Some(removed.place);
        }
    }
    if let Some(place) = place {
        let [u, v, su, sv] = affine;
        let scale = DMat4::from_scale(DVec3::new(su, sv, 1.0));
        let matrix = scale * DMat4::from_translation(DVec3::new(u, v, 0.0));
        object.parameters.push(Parameter::new("to_uv".to_owned(), Value::Transform(matrix), place));
    }
}
