//! Models of other programs: OBJ, PLY, STL and glTF, as meshes and as parts of a scene file.
//!
//! A reader ([`obj`], [`ply`], [`stl`], [`gltf`]) returns an [`ImportedModel`] or an error with its location in the
//! file; `model` has what the readers share. Knows no world. Start reading at [`load_model`].

pub(crate) mod documents;
pub(crate) mod error;
pub(crate) mod framing;
pub mod gltf;
pub(crate) mod gltf_mesh;
pub(crate) mod gltf_motion;
pub(crate) mod gltf_parts;
pub(crate) mod gltf_scene;
mod ktx2;
mod load_model;
pub(crate) mod meshes;
pub(crate) mod model;
pub(crate) mod mtl_material;
pub mod obj;
pub(crate) mod orientation;
pub(crate) mod picture;
pub mod ply;
pub mod stl;
pub(crate) mod up_axis;

pub use crate::files::reference::Outside;
pub use crate::format::model_format::ModelFormat;
pub use error::{ModelError, ModelProblem, Place};
pub use load_model::load_model;
pub use model::imported::{ImportedModel, ModelNormals, ModelOptions};
