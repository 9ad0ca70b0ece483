//! Russian roulette.

use crate::core::techniques::Techniques;
use crate::prepare::prepared::Prepared;

/// Number of segments before Russian roulette begins: the first bounces carry most of the light.
const ROULETTE_DEPTH: u32 = 4;

/// Paths with at least a quarter of their throughput survive: their remaining contribution is worth the cost.
pub(crate) const ROULETTE_GRACE: f32 = 4.0;

/// Depth from which on even lossless paths are subject to Russian roulette: between perfect mirrors they would never
/// end. Paths through nested glass are longer in proportion to the nesting.
pub(crate) fn endless_depth(scene: &Prepared) -> u32 {
    64 * scene.tables.bodies.deepest().clamp(1, 128)
}

/// Maximum survival probability of such paths per vertex. Light that escapes from a body at a smaller rate than 1 minus
/// this is rarely found, so it is close to 1.
pub(crate) const ENDLESS_SURVIVAL: f32 = 0.99;

/// Russian roulette at a depth.
#[derive(Clone, Copy)]
pub(crate) struct Survival {
    /// Maximum survival probability; `None` for no roulette.
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

/// Returns the radiance bound with the rounding of paths of `depth` segments, and with roulette from `endless` on.
pub(crate) fn at_depth(bound: f32, depth: u32, endless: u32) -> f32 {
    let rounding = 1.0 + 2e-6 * (depth as f32 + 8.0);
    let roulette = ENDLESS_SURVIVAL.powi(-(depth.saturating_sub(endless) as i32));
    bound * rounding * roulette
}
