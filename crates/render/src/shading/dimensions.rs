//! Which sample dimension decides what on a path from the camera.

/// Sample dimensions of the camera, and then of each vertex.
pub(crate) const CAMERA_DIMENSIONS: u32 = 2;
/// Of each vertex.
const VERTEX_DIMENSIONS: u32 = 5;
pub(crate) const DIM_LIGHT_POINT: u32 = 0;
pub(crate) const DIM_DIRECTION: u32 = 1;
pub(crate) const DIM_LIGHT: u32 = 2;
pub(crate) const DIM_LOBE: u32 = 3;
pub(crate) const DIM_ROULETTE: u32 = 4;

/// The first of the vertex that the segment `depth` ends at.
pub(crate) fn first_dimension(depth: u32) -> u32 {
    CAMERA_DIMENSIONS + (depth - 1) * VERTEX_DIMENSIONS
}
