//! What is wrong with the meshes of a scene together.

use firstlight_files::limits::Limits;

/// All meshes of the scene together take more than the limits allow; the text follows a path.
#[derive(Debug, thiserror::Error)]
#[error("is not read: the meshes of the scene take more than {} MiB together: {}", .0 >> 20, Limits::advice())]
pub struct MeshesTooLarge(pub(crate) u64);
