//! Pilot light paths, which fill the guiding cache.

use crate::core::techniques::Techniques;
use crate::integrators::caustics::trace::LightWave;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::prepare::guide::Guide;
use rayon::prelude::*;

/// Number of pilot light paths: more find hardly better directions, and a small image waits for them.
const PILOT_PATHS: u32 = 1 << 13;

/// Pilot light paths per batch of a worker.
const PILOT_BATCH: u32 = 1024;

/// Builds the guiding cache if it is used; returns false if `stop` returned true before it was complete.
///
/// The cache depends on the lights and surfaces of the scene only, so it stays valid for other cameras, seeds and
/// settings.
pub(crate) fn prepare_guide(pass: &CausticPass, stop: &(dyn Fn() -> bool + Sync)) -> bool {
    if !pass.plan.guided || pass.casters.guide.get().is_some() {
        return true;
    }
    let pilots =
        CausticPass { seed: 0, techniques: Techniques::ALL, max_depth: u32::MAX, camera_media: Vec::new(), ..*pass };
    let traces: Vec<Option<Vec<_>>> = (0..PILOT_PATHS / PILOT_BATCH)
        .into_par_iter()
        .map_init(LightWave::default, |wave, batch| {
            wave.trace_pilots(&pilots, u64::from(batch * PILOT_BATCH), PILOT_BATCH, stop)
        })
        .collect();
    let Some(traces) = traces.into_iter().collect::<Option<Vec<_>>>() else { return false };
    // Another thread may have set it first, to the same value.
    let _ = pass.casters.guide.set(Guide::build(traces.concat()));
    true
}
