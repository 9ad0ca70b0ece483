//! The components of a scene, what the image depends on, and lists of what is there.

pub(crate) mod components;
pub(crate) mod entity_state;
pub(crate) mod extent;
pub(crate) mod inputs;
pub(crate) mod inventory;
pub(crate) mod lights;
pub(crate) mod material_value;
pub(crate) mod trees;
