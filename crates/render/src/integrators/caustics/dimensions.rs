//! Which sample dimension decides what on a light path, and when such paths end by chance.

use crate::integrators::survival::{ENDLESS_SURVIVAL, endless_depth};
use crate::prepare::prepared::Prepared;
use crate::shading::dimensions::{DIM_DIRECTION, DIM_LOBE};

/// Sample dimensions of a vertex.
pub(crate) const VERTEX_DIMENSIONS: u32 = 4;
pub(crate) const DIM_LENS: u32 = 0;
pub(crate) const DIM_ROULETTE: u32 = 2;
// Those of directions and lobes are where camera paths have them: surfaces are sampled alike.
const _: () = assert!(DIM_DIRECTION == 1 && DIM_LOBE == 3);

/// What a surface that scatters keeps of a path, at most: most of what can be seen of a caustic is its first light.
const SURVIVAL: f32 = 0.5;

/// Vertices before specular surfaces end paths that they dim.
const ROULETTE_DEPTH: u32 = 4;

/// The most that roulette keeps of a path behind its vertex number `n_vertices`; `None` while all go on.
pub(crate) fn most_kept(scene: &Prepared, n_vertices: u32, is_specular: bool) -> Option<f32> {
    match n_vertices {
        _ if n_vertices >= endless_depth(scene) => Some(ENDLESS_SURVIVAL),
        _ if !is_specular => Some(SURVIVAL),
        ROULETTE_DEPTH.. => Some(1.0),
        _ => None,
    }
}
