//! The objects of a Mitsuba scene as its XML describes them: plugins with typed parameters and nested objects.
//!
//! A value that nothing has asked for is a part of the scene that is not modelled: [`Graph::unread`] lists them, so that
//! none is lost silently. Start reading at [`Node`].

use crate::model::foreign::cut;
use firstlight_files::stamp::Stamp;
use firstlight_files::warnings::Warnings;
use firstlight_format::error::SceneError;
use firstlight_format::locate::line_and_column;
use glam::{DMat4, DVec3};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A place in one of the files of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// Index of the file.
    pub file: u32,
    /// Bytes from its start.
    pub offset: usize,
}

/// A file of a scene.
#[derive(Debug)]
pub(crate) struct SourceFile {
    pub path: PathBuf,
    pub text: String,
    /// From before it was read.
    pub stamp: Stamp,
}

/// A spectrum as written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Spectrum {
    /// The same at all wavelengths.
    Uniform(f64),
    /// Wavelengths in nm, increasing, and values; linear in between, 0 outside.
    Sampled(Arc<[(f64, f64)]>),
}

/// A typed parameter.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Float(f64),
    Integer(i64),
    Boolean(bool),
    Text(String),
    /// A vector or a point.
    Vector(DVec3),
    Rgb(DVec3),
    Spectrum(Spectrum),
    Transform(DMat4),
}

/// A parameter of an object.
#[derive(Debug)]
pub(crate) struct Parameter {
    pub name: String,
    pub value: Value,
    pub place: Place,
    /// Whether the conversion has asked for it.
    read: Cell<bool>,
}

/// What a nested element is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Target {
    /// An object, by index.
    Object(usize),
    /// A reference, by id.
    Id(String),
}

/// An object inside of another.
#[derive(Debug)]
pub(crate) struct Child {
    pub name: Option<String>,
    pub target: Target,
    pub place: Place,
    read: Cell<bool>,
}

/// One plugin: `<bsdf type="diffuse">`.
#[derive(Debug)]
pub(crate) struct Object {
    /// The element: `bsdf`, `shape`, …; a spectrum with a type is a `texture`.
    pub tag: String,
    pub plugin: String,
    pub id: Option<String>,
    pub place: Place,
    pub parameters: Vec<Parameter>,
    pub children: Vec<Child>,
    /// Whether its file has a version before 2.
    pub is_old: bool,
    /// Whether the conversion has looked at it.
    visited: Cell<bool>,
    /// Whether it is left out as a whole, which was told.
    skipped: Cell<bool>,
}

impl Object {
    pub(crate) fn new(tag: &str, plugin: String, id: Option<String>, place: Place, is_old: bool) -> Self {
        let (parameters, children) = (Vec::new(), Vec::new());
        let (visited, skipped) = (Cell::new(false), Cell::new(false));
        Self { tag: tag.to_owned(), plugin, id, place, parameters, children, is_old, visited, skipped }
    }
}

/// All objects of a scene; the first is the scene itself.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    pub files: Vec<SourceFile>,
    /// Files of spectra, each with its stamp from before it was read.
    pub other_files: Vec<(PathBuf, Stamp)>,
    pub objects: Vec<Object>,
    /// In the order in which messages list them.
    pub ids: BTreeMap<String, usize>,
    /// Folders in which files are looked for, in order.
    pub folders: Vec<PathBuf>,
}

impl Parameter {
    pub(crate) fn new(name: String, value: Value, place: Place) -> Self {
        Self { name, value, place, read: Cell::new(false) }
    }
}

impl Child {
    pub(crate) fn new(name: Option<String>, target: Target, place: Place) -> Self {
        Self { name, target, place, read: Cell::new(false) }
    }
}

impl Graph {
    pub(crate) fn root(&self) -> Node<'_> {
        Node { graph: self, index: 0 }
    }

    /// An error at a place.
    pub(crate) fn error(&self, place: Place, message: impl Into<String>) -> SceneError {
        let file = &self.files[place.file as usize];
        SceneError::at(&file.path, line_and_column(&file.text, place.offset), message)
    }

    /// A sentence about a place: `scene.xml:3:5: …`.
    fn sentence(&self, place: Place, message: &str) -> String {
        let file = &self.files[place.file as usize];
        let (line, column) = line_and_column(&file.text, place.offset);
        format!("{}:{line}:{column}: {message}", file.path.display())
    }

    /// Adds a [`sentence`](Self::sentence): the lines before it are counted only where it is listed.
    pub(crate) fn tell(&self, place: Place, message: &str, warnings: &mut Warnings) {
        let alike = format!("{}:1:1: {message}", self.files[place.file as usize].path.display());
        warnings.push_like(&alike, || self.sentence(place, message));
    }

    /// Parameters and nested objects that nothing has asked for, of the objects that were asked: the object, the name,
    /// and the place.
    pub(crate) fn unread(&self) -> impl Iterator<Item = (&Object, &str, Place)> {
        let asked = self.objects.iter().filter(|object| object.visited.get() && !object.skipped.get());
        asked.flat_map(|object| {
            let parameters = object.parameters.iter().filter(|it| !it.read.get()).map(|it| (&*it.name, it.place));
            let children = object.children.iter().filter(|it| !it.read.get());
            let children = children.map(|it| (it.name.as_deref().unwrap_or("a nested object"), it.place));
            parameters.chain(children).map(move |(name, place)| (object, name, place))
        })
    }
}

/// An object of a graph.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node<'a> {
    pub graph: &'a Graph,
    pub index: usize,
}

impl<'a> Node<'a> {
    pub(crate) fn object(self) -> &'a Object {
        &self.graph.objects[self.index]
    }

    pub(crate) fn tag(self) -> &'a str {
        &self.object().tag
    }

    pub(crate) fn plugin(self) -> &'a str {
        &self.object().plugin
    }

    /// How a person refers to it: its id, or its plugin.
    pub(crate) fn called(self) -> &'a str {
        cut(self.object().id.as_deref().unwrap_or(self.plugin()))
    }

    pub(crate) fn error(self, message: impl Into<String>) -> SceneError {
        self.graph.error(self.object().place, message)
    }

    /// The parameter of this name, from now on read.
    pub(crate) fn value(self, name: &str) -> Option<&'a Value> {
        self.object().visited.set(true);
        let parameter = self.object().parameters.iter().rev().find(|it| it.name == name)?;
        // An earlier one of the same name is overridden.
        self.object().parameters.iter().filter(|it| it.name == name).for_each(|it| it.read.set(true));
        Some(&parameter.value)
    }

    /// Marks it as left out, which is told.
    pub(crate) fn skip(self) {
        self.object().skipped.set(true);
    }

    /// Marks parameters as read that have no effect on an image.
    pub(crate) fn ignore(self, names: &[&str]) {
        for name in names {
            self.value(name);
        }
    }

    pub(crate) fn has(self, name: &str) -> bool {
        let object = self.object();
        object.parameters.iter().any(|it| it.name == name)
            || object.children.iter().any(|it| it.name.as_deref() == Some(name))
    }

    fn wrong(self, name: &str, expected: &str) -> SceneError {
        let place = self.object().parameters.iter().rev().find(|it| it.name == name);
        let place = place.map_or(self.object().place, |it| it.place);
        self.graph.error(place, format!("`{name}` of a {} `{}` must be {expected}", self.tag(), self.plugin()))
    }

    /// Returns what `of` makes of a value, `None` if there is none.
    ///
    /// # Errors
    /// If it is there, and `of` makes nothing of it: it must be `expected`.
    fn read<T>(self, name: &str, expected: &str, of: impl Fn(&'a Value) -> Option<T>) -> Result<Option<T>, SceneError> {
        self.value(name).map(|value| of(value).ok_or_else(|| self.wrong(name, expected))).transpose()
    }

    pub(crate) fn float(self, name: &str) -> Result<Option<f64>, SceneError> {
        self.read(name, "a number", |value| match value {
            Value::Float(number) | Value::Spectrum(Spectrum::Uniform(number)) => Some(*number),
            Value::Integer(number) => Some(*number as f64),
            Value::Rgb(rgb) if rgb.x == rgb.y && rgb.y == rgb.z => Some(rgb.x),
            _ => None,
        })
    }

    pub(crate) fn float_or(self, name: &str, default: f64) -> Result<f64, SceneError> {
        Ok(self.float(name)?.unwrap_or(default))
    }

    pub(crate) fn integer(self, name: &str) -> Result<Option<i64>, SceneError> {
        self.read(name, "a whole number", |value| match value {
            Value::Integer(number) => Some(*number),
            Value::Float(number) if number.fract() == 0.0 => Some(*number as i64),
            _ => None,
        })
    }

    pub(crate) fn boolean_or(self, name: &str, default: bool) -> Result<bool, SceneError> {
        let read =
            self.read(name, "true or false", |value| if let Value::Boolean(it) = value { Some(*it) } else { None });
        Ok(read?.unwrap_or(default))
    }

    pub(crate) fn text(self, name: &str) -> Result<Option<&'a str>, SceneError> {
        self.read(name, "a string", |value| if let Value::Text(text) = value { Some(text.as_str()) } else { None })
    }

    pub(crate) fn vector(self, name: &str) -> Result<Option<DVec3>, SceneError> {
        self.read(name, "a vector", |value| match value {
            Value::Vector(vector) | Value::Rgb(vector) => Some(*vector),
            _ => None,
        })
    }

    /// The identity if there is none.
    pub(crate) fn transform(self, name: &str) -> Result<DMat4, SceneError> {
        let read =
            self.read(name, "a transform", |value| if let Value::Transform(it) = value { Some(*it) } else { None });
        Ok(read?.unwrap_or(DMat4::IDENTITY))
    }

    fn follow(self, child: &Child) -> Result<Node<'a>, SceneError> {
        let index = match &child.target {
            Target::Object(index) => *index,
            Target::Id(id) => *self.graph.ids.get(id).ok_or_else(|| {
                let hint = firstlight_format::error::suggestion(id, self.graph.ids.keys().map(String::as_str));
                let id = firstlight_files::printable::name(id);
                self.graph.error(child.place, format!("there is no object with the id `{id}`{hint}"))
            })?,
        };
        Ok(Node { index, ..self })
    }

    /// The nested object of this name, from now on read.
    pub(crate) fn child(self, name: &str) -> Result<Option<Node<'a>>, SceneError> {
        let Some(child) = self.object().children.iter().rev().find(|it| it.name.as_deref() == Some(name)) else {
            return Ok(None);
        };
        child.read.set(true);
        self.follow(child).map(Some)
    }

    /// The nested objects of one element, in order, from now on read.
    pub(crate) fn children(self, tag: &str) -> Result<Vec<Node<'a>>, SceneError> {
        self.object().visited.set(true);
        let mut all = Vec::new();
        for child in &self.object().children {
            let node = self.follow(child)?;
            if node.tag() == tag {
                child.read.set(true);
                all.push(node);
            }
        }
        Ok(all)
    }
}
