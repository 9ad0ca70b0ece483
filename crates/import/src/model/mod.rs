//! What the readers of models and scenes share: triangulation, normals, the conversion of indexed vertices to a checked
//! mesh, and placements.

pub(crate) mod assemble;
pub(crate) mod cie;
pub(crate) mod foreign;
pub(crate) mod imported;
pub(crate) mod ior;
pub(crate) mod material;
pub(crate) mod mesh_budget;
pub(crate) mod named_files;
pub(crate) mod number;
pub mod placing;
pub(crate) mod polygon;
pub(crate) mod projection;
pub(crate) mod texture_map;
pub(crate) mod unused;
