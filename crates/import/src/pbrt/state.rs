//! The graphics state: what directives set for the shapes and lights that follow.

use crate::pbrt::params::{Attributes, Params};
use glam::{DAffine3, DVec3};
use std::cell::OnceCell;
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

/// The light that shapes emit.
#[derive(Debug)]
pub(crate) struct AreaLight {
    pub params: Params,
    /// Its radiance, once it is known: shapes share it.
    pub radiance: OnceCell<DVec3>,
}

#[derive(Clone, Debug)]
pub(crate) struct State {
    /// From object space to the world.
    pub ctm: DAffine3,
    /// Whether transforms count: not those of the end of a motion.
    pub sets_start: bool,
    pub is_reversed: bool,
    pub material: MaterialRef,
    /// The light that the shapes emit.
    pub area_light: Option<Rc<AreaLight>>,
    /// Name of the medium inside of the shapes; empty for none.
    pub inside: String,
    /// Parameters for what is described from here on.
    pub attributes: Attributes,
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
            attributes: Attributes::default(),
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
}
