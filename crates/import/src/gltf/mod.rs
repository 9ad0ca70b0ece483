//! Reading of glTF 2.0, text and binary: nodes, meshes, materials, lights, cameras, skins and animations, as plain
//! structs.
//!
//! The JSON text is parsed into our own structs (`json`), since extensions matter and untrusted files must not cause
//! panics. Indices, counts and offsets are checked where they are used. Only files that the model refers to are read,
//! and none outside of its folder unless that is allowed (`uri`).
//!
//! The conversion to a scene is in `import/gltf_scene`. Start reading at [`Document::read`].

pub(crate) mod accessor;
pub(crate) mod animation;
pub(crate) mod assembly;
pub(crate) mod baked;
pub(crate) mod cameras;
pub(crate) mod container;
pub(crate) mod document;
pub(crate) mod draco;
pub mod facts;
pub mod images;
pub(crate) mod instancing;
pub(crate) mod json;
pub(crate) mod lenient;
pub(crate) mod lights;
pub(crate) mod material;
pub(crate) mod mesh;
pub(crate) mod meshopt;
pub(crate) mod meshopt_filters;
pub(crate) mod nodes;
pub(crate) mod omissions;
pub(crate) mod primitives;
pub(crate) mod skin;
pub(crate) mod surfaces;
pub(crate) mod uri;
pub(crate) mod vertices;

pub use crate::error::gltf::{GltfError, GltfProblem};
pub use cameras::{GltfCamera, Lens};
pub use document::{Document, ReadOptions};
pub use facts::GltfFacts;
