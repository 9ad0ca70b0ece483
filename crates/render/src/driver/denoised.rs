//! A film as the denoiser takes it: a copy of its means and half steps. Its guides are in [`crate::driver::guides`].

use crate::denoise::{DenoiseInput, Denoised, denoise, denoise_with};
use crate::driver::guides::SurfaceGuides;
use crate::film::halves::HalfSteps;
use crate::film::tiles::Film;
use glam::Vec3;

/// What the denoiser reads of a film: a copy, so that the film can get more samples meanwhile.
#[derive(Clone, Debug, PartialEq)]
pub struct DenoiseSource {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Mean radiance of each pixel, row by row from the top, W·m⁻²·sr⁻¹.
    pub color: Vec<Vec3>,
    /// See [`Film::half_steps`].
    pub half_steps: Option<HalfSteps>,
}

impl DenoiseSource {
    /// A copy of what `film` shows now.
    pub fn of(film: &Film) -> Self {
        Self { width: film.width(), height: film.height(), color: film.means(), half_steps: film.half_steps() }
    }

    fn input<'a>(&'a self, guides: &'a SurfaceGuides) -> DenoiseInput<'a> {
        let Self { width, height, color, half_steps } = self;
        assert_eq!((guides.width, guides.height), (*width, *height), "guides of another image");
        let (width, height) = (*width as usize, *height as usize);
        DenoiseInput { width, height, color, half_steps: half_steps.as_ref(), guides: guides.as_guides() }
    }
}

/// Denoises what a film showed when it was copied, on the current rayon pool; `None` if `stop`, which is called
/// often, returned true.
///
/// - `guides`: of the same scene, camera and size, from [`gather_guides`](crate::gather_guides).
///
/// The result is a function of the samples, independent of the number of threads and the instruction set.
///
/// # Panics
/// If source and guides differ in size.
pub fn denoise_source(
    source: &DenoiseSource,
    guides: &SurfaceGuides,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Denoised> {
    denoise(&source.input(guides), stop)
}

/// Like [`denoise_source`], with another filter in place of firstlight's own.
///
/// - `filter`: gets the radiance of each pixel, row by row from the top, and returns the filtered one; called twice.
///
/// # Panics
/// If source and guides differ in size.
pub fn denoise_source_with(
    source: &DenoiseSource,
    guides: &SurfaceGuides,
    filter: &mut dyn FnMut(&[Vec3]) -> Option<Vec<Vec3>>,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Denoised> {
    denoise_with(&source.input(guides), filter, stop)
}

/// Denoises a film, which stays as it is; see [`denoise_source`].
///
/// # Panics
/// If film and guides differ in size.
pub fn denoise_film(film: &Film, guides: &SurfaceGuides, stop: &(dyn Fn() -> bool + Sync)) -> Option<Denoised> {
    denoise_source(&DenoiseSource::of(film), guides, stop)
}
