//! Pilot light paths, which show camera paths the way.

use crate::core::techniques::Techniques;
use crate::integrators::caustics::pass::CausticPass;
use crate::integrators::caustics::trace::LightWave;
use crate::prepare::guide::Guide;
use rayon::prelude::*;

/// Light paths that show the others the way.
const PILOT_PATHS: u32 = 1 << 15;

/// Scouts that one worker sends at once.
const PILOT_BATCH: u32 = 2048;

/// Sees to it that hints are there, if they are to be used; false if `stop` said so before they were.
///
/// They belong to the lights and surfaces of the scene, so they outlive cameras, seeds and settings.
pub(crate) fn prepare_guide(pass: &CausticPass, stop: &(dyn Fn() -> bool + Sync)) -> bool {
    if !pass.plan.guided || pass.casters.guide.get().is_some() {
        return true;
    }
    let scouts =
        CausticPass { seed: 0, techniques: Techniques::ALL, max_depth: u32::MAX, camera_media: Vec::new(), ..*pass };
    let traces: Vec<Option<Vec<_>>> = (0..PILOT_PATHS / PILOT_BATCH)
        .into_par_iter()
        .map_init(LightWave::default, |wave, batch| {
            wave.trace_pilots(&scouts, u64::from(batch * PILOT_BATCH), PILOT_BATCH, stop)
        })
        .collect();
    let Some(traces) = traces.into_iter().collect::<Option<Vec<_>>>() else { return false };
    // Somebody else may have been faster, with the same.
    let _ = pass.casters.guide.set(Guide::build(traces.concat()));
    true
}
