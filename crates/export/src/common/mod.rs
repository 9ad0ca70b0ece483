//! What both formats share: surfaces, images, meshes and the files beside the text.

pub(crate) mod albedo;
pub(crate) mod environment;
pub(crate) mod folder;
pub(crate) mod identifiers;
pub(crate) mod number;
pub(crate) mod objects;
pub(crate) mod picture;
pub(crate) mod ply;
pub(crate) mod projected;
pub mod scene;
pub(crate) mod surface;
