//! Conversion of a film to the input of the denoiser.

use crate::core::settings::RenderSettings;
use crate::denoise::{DenoiseInput, Denoised, Guides, denoise};
use crate::driver::features::gather_features_and_ids;
use crate::film::features::{FeatureBuffers, IdShares};
use crate::film::tiles::Film;
use crate::prepare::prepared::Prepared;
use glam::UVec2;

/// Gathers the feature buffers that guide the denoiser, on the current rayon pool; `None` if `stop` returned true.
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
) -> Option<FeatureBuffers> {
    let settings = RenderSettings { seed: settings.seed ^ OTHER_SEED, ..*settings };
    gather_features_and_ids(snapshot, &settings, size, samples, stop)
}

/// Changes the seed, so that features and image have different samples.
const OTHER_SEED: u32 = 0x9e37_79b9;

/// Denoises the image of a film, which stays unchanged, on the current rayon pool; `None` if `stop`, which is called
/// often, returned true.
///
/// - `features`: of the same scene, camera and size, from [`gather_guides`].
///
/// The result is a function of the samples, independent of the number of threads and the instruction set.
///
/// # Panics
/// If film and features differ in size.
pub fn denoise_film(
    snapshot: &Prepared,
    film: &Film,
    features: &FeatureBuffers,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Denoised> {
    let size = (film.width(), film.height());
    assert_eq!((features.width, features.height), size, "features of another image");
    let emits = |shares: &IdShares| {
        shares.iter().any(|(material, _)| snapshot.tables.emission.get(material as usize).is_some_and(Option::is_some))
    };
    let n_pixels = features.albedo.len();
    let emitters: Vec<bool> =
        features.ids.as_ref().map_or_else(|| vec![false; n_pixels], |ids| ids.materials.iter().map(emits).collect());
    let guides =
        Guides { albedo: &features.albedo, normal: &features.normal, depth: &features.depth, emitters: &emitters };
    let half_steps = film.half_steps();
    let input = DenoiseInput {
        width: size.0 as usize,
        height: size.1 as usize,
        color: &film.means(),
        half_steps: half_steps.as_ref(),
        guides,
    };
    denoise(&input, stop)
}
