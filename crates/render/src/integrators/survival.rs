//! When paths end by chance: Russian roulette.

use crate::core::techniques::Techniques;
use crate::prepare::prepared::Prepared;

/// Segments before Russian roulette begins: the first bounces carry most of the light.
const ROULETTE_DEPTH: u32 = 4;

/// Paths that keep a quarter of their light and more are not ended: what they would still find is worth their cost.
pub(crate) const ROULETTE_GRACE: f32 = 4.0;

/// From here on even paths that lose nothing are ended now and then: between perfect mirrors they would go on for
/// ever. The way through nested glass is as much longer as it is nested.
pub(crate) fn endless_depth(scene: &Prepared) -> u32 {
    64 * scene.tables.bodies.deepest().clamp(1, 128)
}

/// What is kept of such paths at each vertex, at most. Light that escapes from a body at a smaller rate than it is ended by this
/// comes too rarely to be seen, so it is close to 1.
pub(crate) const ENDLESS_SURVIVAL: f32 = 0.99;

/// Whether, and how, paths end by chance at a depth.
#[derive(Clone, Copy)]
pub(crate) struct Survival {
    /// The most that may be kept; `None` while all paths go on.
    pub share: Option<f32>,
}

impl Survival {
    pub fn at(depth: u32, scene: &Prepared, techniques: &Techniques) -> Self {
        let share = match depth {
            _ if depth >= endless_depth(scene) => Some(ENDLESS_SURVIVAL),
            ROULETTE_DEPTH.. if techniques.roulette => Some(1.0),
            _ => None,
        };
        Self { share }
    }
}

/// The bound with the rounding of paths of `depth` segments, and roulette from `endless` on.
pub(crate) fn at_depth(bound: f32, depth: u32, endless: u32) -> f32 {
    let rounding = 1.0 + 2e-6 * (depth as f32 + 8.0);
    let roulette = ENDLESS_SURVIVAL.powi(-(depth.saturating_sub(endless) as i32));
    bound * rounding * roulette
}
