//! A film as the denoiser takes it: a copy of its means and half steps, and guides from feature buffers.

use crate::core::settings::RenderSettings;
use crate::denoise::{DenoiseInput, Denoised, Guides, denoise, denoise_with};
use crate::driver::features::gather_features_and_materials_beyond;
use crate::film::features::{FeatureBuffers, IdShares};
use crate::film::halves::HalfSteps;
use crate::film::tiles::Film;
use crate::prepare::prepared::Prepared;
use glam::{UVec2, Vec3};

/// What guides the denoiser: the part of feature buffers that it reads, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceGuides {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Share of light that the surface reflects, 0..1 per channel.
    pub albedo: Vec<Vec3>,
    /// Shading normal, at most of length 1.
    pub normal: Vec<Vec3>,
    /// Metres along the view axis; infinite where nothing is hit.
    pub depth: Vec<f32>,
    /// Whether a pixel shows an emitter, in part at least, and be it in a mirror or through glass.
    pub emitters: Vec<bool>,
}

impl SurfaceGuides {
    /// - `features`: of the same scene, with the materials of what is seen in mirrors and through glass.
    fn of(snapshot: &Prepared, features: FeatureBuffers) -> Self {
        let FeatureBuffers { width, height, albedo, normal, depth, ids, .. } = features;
        let is_emitter = |material: u32| snapshot.tables.emission.get(material as usize).is_some_and(Option::is_some);
        let emits = |shares: &IdShares| shares.iter().any(|(material, _)| is_emitter(material));
        let emitters = ids.map_or_else(|| vec![false; albedo.len()], |ids| ids.materials.iter().map(emits).collect());
        Self { width, height, albedo, normal, depth, emitters }
    }

    /// The same as the denoiser takes them.
    pub fn as_guides(&self) -> Guides<'_> {
        let Self { albedo, normal, depth, emitters, .. } = self;
        Guides { albedo, normal, depth, emitters }
    }
}

/// Gathers the guides of the denoiser, on the current rayon pool; `None` if `stop` returned true.
///
/// - `size`: of the film, pixels; `samples`: per pixel, at least 1.
///
/// Uses other samples than the image: with the same ones, the noise of features at an edge would correlate with that of
/// the image, and the denoiser would keep it.
pub fn gather_guides(
    snapshot: &Prepared,
    settings: &RenderSettings,
    size: UVec2,
    samples: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<SurfaceGuides> {
    let settings = RenderSettings { seed: settings.seed ^ OTHER_SEED, ..*settings };
    gather_features_and_materials_beyond(snapshot, &settings, size, samples, stop)
        .map(|features| SurfaceGuides::of(snapshot, features))
}

/// Changes the seed, so that features and image have different samples.
const OTHER_SEED: u32 = 0x9e37_79b9;

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
/// - `guides`: of the same scene, camera and size, from [`gather_guides`].
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
