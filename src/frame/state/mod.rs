//! The resources of a session: what is rendered, selected and remembered, and work in the background.

pub(crate) mod background;
pub(crate) mod explain;
pub(crate) mod history;
pub(crate) mod remake;
pub(crate) mod resources;
pub(crate) mod seen_lights;
pub(crate) mod selection;
