//! Assignment of sample dimensions on a camera path.

/// Number of dimensions of the camera; those of the vertices follow.
pub(crate) const CAMERA_DIMENSIONS: u32 = 2;
/// Number of dimensions per vertex.
const VERTEX_DIMENSIONS: u32 = 5;
pub(crate) const DIM_LIGHT_POINT: u32 = 0;
pub(crate) const DIM_DIRECTION: u32 = 1;
pub(crate) const DIM_LIGHT: u32 = 2;
pub(crate) const DIM_LOBE: u32 = 3;
pub(crate) const DIM_ROULETTE: u32 = 4;

/// Dimension of the channel to which dispersion limits a path, beyond those of all vertices.
pub(crate) const DIM_CHANNEL: u32 = u32::MAX - 1;

/// Dimensions of the choice among light samples and of the roulette of shadow rays, one each per vertex, beyond those of
/// all vertices.
const FIRST_OF_RESAMPLING: u32 = 1 << 30;
const FIRST_OF_SHADOW_ROULETTE: u32 = FIRST_OF_RESAMPLING + (1 << 29);

/// Returns the dimension that chooses among light samples at the end of segment `depth`.
pub(crate) fn resampling_dimension(depth: u32) -> u32 {
    FIRST_OF_RESAMPLING + depth
}

/// Returns the dimension of the roulette of the shadow ray from the end of segment `depth`.
pub(crate) fn shadow_roulette_dimension(depth: u32) -> u32 {
    FIRST_OF_SHADOW_ROULETTE + depth
}

/// Returns the first dimension of the vertex at the end of segment `depth`.
pub(crate) fn first_dimension(depth: u32) -> u32 {
    CAMERA_DIMENSIONS + (depth - 1) * VERTEX_DIMENSIONS
}
