//! Film: sums of samples, error estimate, sample allocation, and development for the display.

pub(crate) mod allocation;
pub(crate) mod block;
pub(crate) mod develop;
pub(crate) mod error;
pub(crate) mod estimate;
pub(crate) mod exact_sum;
pub(crate) mod features;
pub(crate) mod halves;
pub(crate) mod light_layer;
pub(crate) mod noted;
pub(crate) mod record;
pub(crate) mod region;
pub(crate) mod room;
pub(crate) mod round;
pub(crate) mod shadow_roulette;
pub(crate) mod surfaces;
pub(crate) mod tile;
pub(crate) mod tiles;
