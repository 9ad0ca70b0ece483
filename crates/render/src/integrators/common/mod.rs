//! What all integrators share: rays through holes and panes, survival, resampling, work of a pass, and the passes of
//! light tracing.

pub(crate) mod batches;
pub(crate) mod caustics_pass;
pub(crate) mod caustics_weight;
pub(crate) mod emission;
mod passing;
pub(crate) mod record;
pub(crate) mod resampling;
pub(crate) mod seen;
pub(crate) mod survival;
pub(crate) mod work;
