//! The graphics state: what directives set for the shapes and lights that follow.

use crate::pbrt::params::{Param, Params};
use glam::DAffine3;
use std::rc::Rc;

/// A material as it was described.
#[derive(Debug)]
pub(crate) struct Described {
    /// Tells it from all others.
    pub number: u64,
    /// Empty for one without a name.
    pub name: String,
    pub kind: String,
    pub params: Params,
}

/// The material of the shapes that follow.
#[derive(Clone, Debug)]
pub(crate) enum MaterialRef {
    /// Described where it is set.
    Own(Rc<Described>),
    /// By its name, which may be described later.
    Named(String),
}

#[derive(Clone, Debug)]
pub(crate) struct State {
    /// From object space to the world.
    pub ctm: DAffine3,
    /// Whether transforms count: not those of the end of a motion.
    pub sets_start: bool,
    pub is_reversed: bool,
    pub material: MaterialRef,
    /// Parameters of the light that the shapes emit.
    pub area_light: Option<Rc<Params>>,
    /// Name of the medium inside of the shapes; empty for none.
    pub inside: String,
    /// Parameters for what is described from here on, by `shape`, `light`, `material`, `medium` or `texture`.
    pub defaults: Rc<Vec<(String, Vec<Param>)>>,
}

impl Default for State {
    fn default() -> Self {
        let plain = Described { number: 0, name: String::new(), kind: "diffuse".to_owned(), params: Params::default() };
        Self {
            ctm: DAffine3::IDENTITY,
            sets_start: true,
            is_reversed: false,
            material: MaterialRef::Own(Rc::new(plain)),
            area_light: None,
            inside: String::new(),
            defaults: Rc::default(),
        }
    }
}

impl State {
    /// Multiplies the transform.
    pub(crate) fn apply(&mut self, transform: DAffine3) {
        if self.sets_start {
            self.ctm *= transform;
        }
    }

    /// Adds the parameters that `Attribute` gave for things of this kind.
    pub(crate) fn with_defaults(&self, kind: &str, mut params: Params) -> Params {
        // The latest counts.
        for (_, list) in self.defaults.iter().rev().filter(|(of, _)| of == kind) {
            params.add_missing(list);
        }
        params
    }
}
