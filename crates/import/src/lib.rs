//! Models and scenes of other programs: OBJ, PLY, STL, glTF, pbrt and Mitsuba, as meshes and as parts of a scene file.
//!
//! A reader ([`obj`], [`ply`], [`stl`], [`gltf`]) returns an [`ImportedModel`] or an error with its location in the
//! file; `model` has what the readers share. Knows no world. Start reading at [`load_model`] and, for
//! scenes of other renderers, at `read_scene`.

pub mod builtin_images;
pub mod documents;
pub mod environment_image;
pub(crate) mod error;
pub mod framing;
pub mod gltf;
pub(crate) mod gltf_mesh;
pub mod gltf_motion;
pub(crate) mod gltf_parts;
pub mod gltf_scene;
mod ktx2;
mod load_model;
pub mod meshes;
pub(crate) mod mitsuba;
pub mod model;
pub(crate) mod mtl_material;
pub mod obj;
pub mod orientation;
pub(crate) mod pbrt;
pub(crate) mod pfm;
pub mod picture;
pub mod ply;
pub(crate) mod read_scene;
pub mod sky;
pub mod stl;
pub(crate) mod tungsten;
pub mod up_axis;

pub use error::{ModelError, ModelProblem, Place};
pub use firstlight_files::reference::Outside;
pub use firstlight_format::model_format::ModelFormat;
pub use load_model::load_model;
pub use model::cie::color_of_temperature;
pub use model::imported::{ImportedModel, ModelNormals, ModelOptions};
