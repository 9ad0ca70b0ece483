//! Values by name.

use crate::model::foreign::cut;
use firstlight_files::printable;
use firstlight_files::warnings::Warnings;
use glam::DVec3;
use serde_json::{Map, Value};
use std::cell::RefCell;
use std::path::Path;

/// Where the fields of a scene come from, and what is told of them.
pub(crate) struct Source<'a> {
    pub path: &'a Path,
    pub told: RefCell<Warnings>,
}

/// An object of the scene.
#[derive(Clone, Copy)]
pub(crate) struct Fields<'a> {
    pub map: Option<&'a Map<String, Value>>,
    pub source: &'a Source<'a>,
    /// What it is called in messages.
    place: &'a str,
}

impl<'a> Fields<'a> {
    /// - `kind`: what it is, for messages, if it has no name.
    pub(crate) fn of(value: Option<&'a Value>, kind: &'a str, source: &'a Source<'a>) -> Self {
        let map = value.and_then(Value::as_object);
        let name = map.and_then(|map| map.get("name")).and_then(Value::as_str).filter(|name| !name.is_empty());
        Self { map, source, place: name.map_or(if kind.is_empty() { "primitive" } else { kind }, cut) }
    }

    /// Its name, or what it is.
    pub(crate) fn name(&self) -> &'a str {
        self.place
    }

    /// Remarks that something is not shown.
    pub(crate) fn tell(&self, what: impl AsRef<str>) {
        let (path, place) = (self.source.path.display(), printable::name(self.place));
        self.source.told.borrow_mut().push(format!("{path}: `{place}`: {}", what.as_ref()));
    }

    pub(crate) fn get(&self, name: &str) -> Option<&'a Value> {
        self.map?.get(name)
    }

    /// `None`, which is told, for a value of another kind.
    fn read<T>(&self, name: &str, expected: &str, read: impl Fn(&'a Value) -> Option<T>) -> Option<T> {
        let value = self.get(name)?;
        let found = read(value);
        if found.is_none() {
            self.tell(format!("`{name}` is not {expected}, and has no effect"));
        }
        found
    }

    pub(crate) fn text(&self, name: &str) -> Option<&'a str> {
        self.read(name, "text", Value::as_str)
    }

    pub(crate) fn flag(&self, name: &str) -> Option<bool> {
        self.read(name, "true or false", Value::as_bool)
    }

    pub(crate) fn number(&self, name: &str) -> Option<f64> {
        self.read(name, "a number", Value::as_f64)
    }

    pub(crate) fn vector(&self, name: &str) -> Option<DVec3> {
        self.read(name, "a number or three", vector)
    }

    /// The kind of thing that it is.
    pub(crate) fn kind(&self) -> &'a str {
        self.text("type").unwrap_or_default()
    }
}

/// Three numbers, or one for all of them.
pub(crate) fn vector(value: &Value) -> Option<DVec3> {
    if let Some(number) = value.as_f64() {
        return Some(DVec3::splat(number));
    }
    let [x, y, z] = value.as_array()?.as_slice() else { return None };
    Some(DVec3::new(x.as_f64()?, y.as_f64()?, z.as_f64()?))
}
