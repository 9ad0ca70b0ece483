//! Sample dimensions of light paths, and their Russian roulette.

use crate::integrators::common::survival::{ENDLESS_SURVIVAL, endless_depth};
use crate::prepare::prepared::Prepared;
use crate::shading::dimensions::{DIM_DIRECTION, DIM_LOBE};

/// Number of dimensions per vertex.
pub(crate) const VERTEX_DIMENSIONS: u32 = 4;
pub(crate) const DIM_LENS: u32 = 0;
pub(crate) const DIM_ROULETTE: u32 = 2;
// Directions and lobes have the same dimensions as on camera paths: surfaces are sampled alike.
const _: () = assert!(DIM_DIRECTION == 1 && DIM_LOBE == 3);

/// Maximum survival probability at a scattering surface: most of the visible part of a caustic is its first light.
const SURVIVAL: f32 = 0.5;

/// Number of vertices before specular surfaces apply Russian roulette.
const ROULETTE_DEPTH: u32 = 4;

/// Returns the maximum survival probability behind vertex number `n_vertices`; `None` for no roulette.
pub(crate) fn most_kept(scene: &Prepared, n_vertices: u32, is_specular: bool) -> Option<f32> {
    match n_vertices {
        _ if n_vertices >= endless_depth(scene) => Some(ENDLESS_SURVIVAL),
        _ if !is_specular => Some(SURVIVAL),
        ROULETTE_DEPTH.. => Some(1.0),
        _ => None,
    }
}
