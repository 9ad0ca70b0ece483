//! A film that is smoothed for the moment that it is shown.

use crate::core::settings::RenderSettings;
use crate::denoise::{MovingFilter, MovingInput};
use crate::film::surfaces::PixelSurface;
use crate::film::tiles::Film;
use crate::prepare::prepared::Prepared;
use firstlight_simd::InstructionSet;
use glam::Vec3;

/// Radiance of each pixel of a film without most of its noise, on the current rayon pool; the film stays as it is. `None`
/// where the film has no noted surfaces ([`Film::note_surfaces`]), or if `stop` returned true.
///
/// - `filter`: keeps memory from image to image; its result lies in it.
/// - `snapshot`: what the film shows.
pub fn smooth_film<'a>(
    filter: &'a mut MovingFilter,
    snapshot: &Prepared,
    settings: &RenderSettings,
    film: &Film,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<&'a [Vec3]> {
    if !film.has_surfaces() {
        return None;
    }
    let read = |y: usize, colors: &mut [Vec3], surfaces: &mut [PixelSurface]| {
        film.for_each_in_row(y as u32, |x, radiance| colors[x] = radiance);
        film.for_each_surface_in_row(y as u32, |x, surface| surfaces[x] = surface);
    };
    let (width, height) = (film.width() as usize, film.height() as usize);
    let input = MovingInput { width, height, read: &read, eye: snapshot.camera.eye };
    filter.smooth(&input, set_of(settings), stop)
}

pub(super) fn set_of(settings: &RenderSettings) -> InstructionSet {
    settings.simd.unwrap_or(InstructionSet::Portable)
}
