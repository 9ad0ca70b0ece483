//! How caustics are looked for in a film, and what was found out about it.

use crate::core::caustic_plan::{CausticChoice, CausticPlan};
use crate::core::settings::RenderSettings;
use crate::film::tiles::Film;
use crate::integrators::caustics::plan::{choose, for_preview, known};
use crate::prepare::prepared::Prepared;
use glam::UVec2;

/// How caustics are looked for in a picture of `width` × `height` pixels, and why. Traces pilot paths if that is not known yet,
/// some per cent of what one sample of every pixel takes, on the current rayon pool.
///
/// The same for every seed, number of threads, and part of the picture.
pub fn caustic_choice(snapshot: &Prepared, settings: &RenderSettings, (width, height): (u32, u32)) -> CausticChoice {
    choose(snapshot, settings, UVec2::new(width, height), &|| false).expect("nobody stops it")
}

/// The same if it is known, as it is of every picture with samples; `None` otherwise. Takes no time.
pub fn known_caustic_choice(
    snapshot: &Prepared,
    settings: &RenderSettings,
    (width, height): (u32, u32),
) -> Option<CausticChoice> {
    known(snapshot, settings, UVec2::new(width, height))
}

/// How caustics are looked for in a film: as in its samples so far, else as is best. `None` when `stop` said so.
pub(crate) fn plan_of_film(
    snapshot: &Prepared,
    settings: &RenderSettings,
    film: &mut Film,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<CausticPlan> {
    if let Some(plan) = film.caustic_plan {
        return Some(plan);
    }
    let size = UVec2::new(film.width(), film.height());
    let plan =
        if film.is_preview { for_preview(snapshot, settings) } else { choose(snapshot, settings, size, stop)?.plan };
    film.caustic_plan = Some(plan);
    Some(plan)
}
