//! How caustics are rendered in a film, and the measurements behind that choice.

use crate::core::caustic_plan::{CausticChoice, CausticPlan};
use crate::core::settings::RenderSettings;
use crate::film::tiles::Film;
use crate::integrators::caustics::plan::{choose, for_preview, known};
use crate::prepare::prepared::Prepared;
use glam::UVec2;

/// Returns how caustics are rendered in an image of `width` × `height` pixels, and why. If that is not known yet,
/// traces pilot paths on the current rayon pool, which costs some per cent of one sample per pixel.
///
/// The result is independent of seed, number of threads, and part of the image.
pub fn caustic_choice(snapshot: &Prepared, settings: &RenderSettings, (width, height): (u32, u32)) -> CausticChoice {
    choose(snapshot, settings, UVec2::new(width, height), &|| false).expect("the stop flag is constant false")
}

/// Like [`caustic_choice`] if the choice is already known, as it is for every image with samples; `None` otherwise.
/// Traces nothing.
pub fn known_caustic_choice(
    snapshot: &Prepared,
    settings: &RenderSettings,
    (width, height): (u32, u32),
) -> Option<CausticChoice> {
    known(snapshot, settings, UVec2::new(width, height))
}

/// Returns how caustics are rendered in a film: as in its samples so far, otherwise the best choice. `None` if `stop`
/// returned true.
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
