//! Trees and meshes against what is simple and slow.

#[path = "../common/random.rs"]
mod random;

mod kdtree;
mod mesh_simplify;
