//! A coarse film, smoothed for the moment that it is shown.

use crate::core::settings::RenderSettings;
use crate::denoise::{MovingInput, smooth_moving};
use crate::film::surfaces::PixelSurface;
use crate::film::tiles::Film;
use crate::prepare::prepared::Prepared;
use firstlight_simd::InstructionSet;
use glam::Vec3;
use rayon::prelude::*;

/// Radiance of each pixel of a film without most of its noise, on the current rayon pool; the film stays as it is. `None`
/// where the film has no noted surfaces ([`Film::note_surfaces`]), or if `stop` returned true.
///
/// - `snapshot`: what the film shows.
pub fn smooth_film(
    snapshot: &Prepared,
    settings: &RenderSettings,
    film: &Film,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<Vec3>> {
    if !film.has_surfaces() {
        return None;
    }
    let (width, height) = (film.width() as usize, film.height() as usize);
    let nothing = PixelSurface { albedo: Vec3::ZERO, normal: Vec3::ZERO, position: Vec3::ZERO, is_bright: true };
    let (mut color, mut surfaces) = (vec![Vec3::ZERO; width * height], vec![nothing; width * height]);
    let rows = color.par_chunks_exact_mut(width).zip(surfaces.par_chunks_exact_mut(width));
    rows.enumerate().for_each(|(y, (color, surfaces))| {
        film.for_each_in_row(y as u32, |x, radiance| color[x] = radiance);
        film.for_each_surface_in_row(y as u32, |x, surface| surfaces[x] = surface);
    });
    let eye = snapshot.camera.eye;
    let input = MovingInput { width, height, color: &color, surfaces: &surfaces, eye };
    smooth_moving(&input, settings.simd.unwrap_or(InstructionSet::Portable), stop)
}
