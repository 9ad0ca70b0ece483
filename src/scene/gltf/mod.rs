//! Reading glTF 2.0, text and binary: nodes, meshes, materials, lights, cameras, skins and animations, as plain
//! structs.
//!
//! The JSON text is parsed into structs of its own (`json`), for it is the extensions that matter, and a file of
//! unknown origin must not make anything panic. Whatever an index, a count or an offset says is checked where it is
//! followed. No file is read that the model does not name, and none outside of its folder unless that is allowed
//! (`uri`).
//!
//! What becomes of it in a scene is in `scene/gltf_scene`. Start reading at [`Document::read`].

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
mod lights;
mod material;
mod mesh;
mod meshopt;
mod names;
mod nodes;
mod primitives;
mod skin;
mod surfaces;
mod uri;

pub use cameras::{GltfCamera, Lens};
pub use document::{Document, ReadOptions};
pub use error::{GltfError, GltfProblem};
pub use facts::GltfFacts;

pub(in crate::scene) use assembly::{MeshKey, PlacedLight, Posed};
pub(in crate::scene) use error::Located;
pub(in crate::scene) use lights::LightKind;
pub(in crate::scene) use mesh::BuiltMesh;
pub(in crate::scene) use surfaces::Surfaces;
