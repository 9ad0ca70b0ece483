//! Explains the value of a pixel: traces some of its samples again and records every contribution.
//!
//! The same waves are traced as for the image, with the same random numbers ([`crate::integrators::common::record::Record`]
//! only observes), so the recorded values are those in the film, bit for bit: per light and per bounce, in parts that
//! sum to the whole. Start reading at [`explain`].

use crate::core::settings::{Integrator, RenderSettings};
use crate::driver::single::trace_recorded;
use crate::driver::wave::Pass;
use crate::film::exact_sum::ExactSum;
use crate::film::light_layer::LightLayer;
use crate::integrators::caustics::pilot::prepare_guide;
use crate::integrators::caustics::plan::choose;
use crate::integrators::common::record::{FoundBy, LightSource, Place, TracedPath};
use crate::prepare::exposed::Exposed;
use glam::{DVec3, UVec2};
use std::collections::BTreeMap;
use std::ops::Range;

/// A part of a pixel's radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// Where the light comes from.
    pub source: LightSource,
    /// Number of surfaces between the light and the camera; 0 for the light itself.
    pub bounces: u32,
    /// Whether the contribution comes from BSDF sampling or from light sampling.
    pub found_by: FoundBy,
    /// Share of the mean, W·m⁻²·sr⁻¹.
    pub radiance: DVec3,
}

/// See [`explain`].
#[derive(Clone, Debug)]
pub struct Explanation {
    /// The pixel, x and y from the upper left corner.
    pub pixel: UVec2,
    /// Width and height of the film in pixels.
    pub film_size: UVec2,
    /// Numbers of the traced samples.
    pub samples: Range<u32>,
    /// One path per sample, in order.
    pub paths: Vec<TracedPath>,
}

/// Traces samples of a pixel as in the image. `None` for the classic model, which has no paths, and for an empty range.
///
/// Contributions of light paths ([`light_traced`]) are not included: those paths belong to no pixel.
pub fn explain<'a>(
    scene: impl Into<Exposed<'a>>,
    settings: &RenderSettings,
    film_size: UVec2,
    pixel: UVec2,
    samples: Range<u32>,
) -> Option<Explanation> {
    debug_assert!(pixel.cmplt(film_size).all(), "{pixel} of {film_size}");
    if settings.integrator != Integrator::Path || samples.is_empty() {
        return None;
    }
    let paths = trace_recorded(scene.into(), settings, film_size, pixel, samples.clone());
    Some(Explanation { pixel, film_size, samples, paths })
}

impl Explanation {
    /// Number of samples that are not finite; the film rejects them.
    pub fn n_bad(&self) -> usize {
        self.paths.iter().filter(|path| !path.radiance.is_finite()).count()
    }

    fn good(&self) -> impl Iterator<Item = &TracedPath> {
        self.paths.iter().filter(|path| path.radiance.is_finite())
    }

    /// Mean of these samples in a film, without light paths; W·m⁻²·sr⁻¹.
    pub fn mean(&self) -> DVec3 {
        let mut sum = ExactSum::default();
        self.good().for_each(|path| sum.add(path.radiance));
        sum.sum / self.good().count().max(1) as f64
    }

    /// Standard deviation of [`Self::mean`] per channel, if samples were independent; stratified samples have less.
    pub fn deviation(&self) -> DVec3 {
        let (n, mean) = (self.good().count() as f64, self.mean());
        let squares: DVec3 = self.good().map(|path| (path.radiance.as_dvec3() - mean).powf(2.0)).sum();
        if n > 1.0 { (squares / (n * (n - 1.0))).map(f64::sqrt) } else { DVec3::INFINITY }
    }

    /// The parts of [`Self::mean`], by source, number of bounces and sampling technique; parts without radiance are
    /// left out.
    pub fn contributions(&self) -> Vec<Contribution> {
        let mut sums: BTreeMap<(LightSource, u32, FoundBy), DVec3> = BTreeMap::new();
        for path in self.good() {
            for (vertex, bounces) in path.vertices.iter().zip(0..) {
                let source = match vertex.place {
                    Place::Surface { object, .. } => LightSource::Object(object),
                    Place::Light { light, .. } => LightSource::Delta(light),
                    Place::Sky { .. } => LightSource::Sky,
                };
                *sums.entry((source, bounces, FoundBy::Itself)).or_default() += vertex.radiance;
                for asked in vertex.asked.iter().chain(&vertex.chain) {
                    *sums.entry((asked.source, bounces + 1 + asked.between, FoundBy::Asking)).or_default() +=
                        asked.radiance;
                }
            }
        }
        let n = self.good().count().max(1) as f64;
        sums.into_iter()
            .filter(|(_, sum)| *sum != DVec3::ZERO)
            .map(|((source, bounces, found_by), sum)| Contribution { source, bounces, found_by, radiance: sum / n })
            .collect()
    }
}

/// Returns the contribution of light paths to a pixel, mean over these samples of the whole image; W·m⁻²·sr⁻¹.
///
/// A light path may contribute to any pixel, so all of them are traced. `None` if `stop` returned true.
pub fn light_traced<'a>(
    scene: impl Into<Exposed<'a>>,
    settings: &RenderSettings,
    film_size: UVec2,
    pixel: UVec2,
    samples: Range<u32>,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<DVec3> {
    let scene = scene.into();
    let plan = choose(scene.middle(), settings, film_size, stop)?.plan;
    if !plan.has_light_paths() {
        return Some(DVec3::ZERO);
    }
    let pass = Pass::new(scene.middle(), settings, film_size, plan);
    let Some(caustics) = &pass.caustics else {
        return Some(DVec3::ZERO);
    };
    let mut layer = LightLayer::new(film_size, samples.start, plan.light_path_stride);
    if !prepare_guide(caustics, stop) {
        return None;
    }
    let completed = if scene.is_moving() {
        (0..samples.len() as u32).all(|i| {
            let moment = scene.of_sample(settings, samples.start + i);
            let pass = pass.of_moment(&moment);
            layer.advance_with(i + 1, stop, &|_| pass.caustics.as_ref()).completed
        })
    } else {
        layer.advance(caustics, samples.len() as u32, stop).completed
    };
    completed.then(|| layer.mean((pixel.y * film_size.x + pixel.x) as usize))
}
