//! Reading of glTF 2.0, text and binary: nodes, meshes, materials, lights, cameras, skins and animations, as plain
//! structs.
//!
//! The JSON text is parsed into our own structs (`json`), since extensions matter and untrusted files must not cause
//! panics. Indices, counts and offsets are checked where they are used. Only files that the model refers to are read,
//! and none outside of its folder unless that is allowed (`uri`).
//!
//! The conversion to a scene is in `scene/gltf_scene`. Start reading at [`Document::read`].

mod accessor;
mod animation;
mod assembly;
pub(in crate::scene) mod baked;
mod cameras;
mod container;
mod document;
mod draco;
pub(in crate::scene) mod error;
mod facts;
pub(in crate::scene) mod images;
mod instancing;
mod json;
mod lenient;
mod lights;
mod material;
mod mesh;
mod meshopt;
mod meshopt_filters;
mod nodes;
mod omissions;
mod primitives;
mod skin;
mod surfaces;
mod uri;
mod vertices;

pub use cameras::{GltfCamera, Lens};
pub use document::{Document, ReadOptions};
pub use error::{GltfError, GltfProblem};
pub use facts::GltfFacts;

pub(in crate::scene) use assembly::{MeshKey, PlacedLight, Posed};
pub(in crate::scene) use error::Located;
pub(in crate::scene) use lights::LightKind;
pub(in crate::scene) use mesh::BuiltMesh;
pub(in crate::scene) use surfaces::Surfaces;
