//! What the readers of models share: triangulation, normals, and the conversion of indexed vertices to a checked mesh.

pub(crate) mod assemble;
pub(crate) mod imported;
pub(crate) mod material;
pub(crate) mod number;
pub(crate) mod polygon;
pub(crate) mod texture_map;
