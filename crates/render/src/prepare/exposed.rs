//! Input of a film: a scene that stands still, or one that moves while the shutter is open.
//!
//! All pixels of a sample see the same moment, so each moment is an ordinary [`Prepared`] and the kernels know nothing of
//! time: motion blur is the mean over moments (Haeberli and Akeley 1990, "The Accumulation Buffer"). Every sample number
//! has its own moment, so the number of samples need not be known in advance, and the mean converges to the integral
//! over time.

use crate::core::settings::RenderSettings;
use crate::prepare::prepared::{Moments, Prepared};
use crate::sampling::{Sampler, hash_u32};

/// A scene as the film sees it. A reference to a [`Prepared`] converts to it.
#[derive(Clone, Copy)]
pub struct Exposed<'a> {
    middle: &'a Prepared,
    moments: Option<&'a dyn Moments>,
}

impl<'a> Exposed<'a> {
    /// A scene in which nothing moves.
    pub fn still(scene: &'a Prepared) -> Self {
        Self { middle: scene, moments: None }
    }

    /// A scene that moves.
    ///
    /// - `middle`: the scene in the middle of the shutter interval. The plan for caustics and the guiding cache are made
    ///   from it, once for all moments; they change the noise, not the mean.
    pub fn moving(middle: &'a Prepared, moments: &'a dyn Moments) -> Self {
        Self { middle, moments: Some(moments) }
    }

    /// The scene in the middle of the shutter interval.
    pub fn middle(&self) -> &'a Prepared {
        self.middle
    }

    /// Whether the scene differs from moment to moment.
    pub fn is_moving(&self) -> bool {
        self.moments.is_some()
    }

    /// Returns the scene that all pixels see in the sample with this number.
    pub fn of_sample(&self, settings: &RenderSettings, sample: u32) -> Prepared {
        match self.moments {
            None => self.middle.clone(),
            Some(moments) => moments.at(moment_of_sample(settings, sample)),
        }
    }
}

impl<'a> From<&'a Prepared> for Exposed<'a> {
    /// It moves if [`Prepared::with_moments`] says so.
    fn from(scene: &'a Prepared) -> Self {
        Self { middle: scene, moments: scene.moments() }
    }
}

/// Returns the moment of a sample as a fraction of the shutter interval, in `[0, 1)`: a scrambled radical inverse in base
/// 2. Each aligned run of 2ᵏ samples has one moment in each of 2ᵏ equal intervals; moments are independent of all other
/// random numbers of the sample.
pub fn moment_of_sample(settings: &RenderSettings, sample: u32) -> f64 {
    /// Coordinates that no pixel has.
    const SHUTTER: u32 = 0x7368_7574;
    let new = if settings.techniques.even_samples { Sampler::new } else { Sampler::independent };
    f64::from(new(hash_u32(settings.seed ^ SHUTTER), SHUTTER, SHUTTER, sample).single(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_power_of_two_of_samples_has_a_moment_in_each_interval() {
        for seed in 0..16 {
            let settings = RenderSettings { seed, ..RenderSettings::default() };
            for n in [1, 2, 4, 16, 256, 4096] {
                for first in [0, n, 6 * n] {
                    let mut places: Vec<u32> = (first..first + n)
                        .map(|sample| (moment_of_sample(&settings, sample) * f64::from(n)) as u32)
                        .collect();
                    places.sort_unstable();
                    assert!(places.into_iter().eq(0..n), "seed {seed}, samples from {first} on");
                }
            }
        }
    }

    /// Moments that were correlated with the position in the pixel would distort moving edges.
    #[test]
    fn moments_know_nothing_of_the_other_numbers_of_a_sample() {
        const N: u32 = 1 << 14;
        const CELLS: usize = 16;
        let settings = RenderSettings { seed: 5, ..RenderSettings::default() };
        for dimension in [0, 1, 9] {
            for (x, y) in [(0, 0), (17, 200)] {
                let mut counts = [0.0; 2 * CELLS * CELLS];
                for sample in 0..N {
                    let moment = moment_of_sample(&settings, sample);
                    let pair = Sampler::of_pixel(settings.seed, x, y, sample).pair(dimension);
                    for (k, u) in [pair.x, pair.y].into_iter().enumerate() {
                        let cell = (moment * CELLS as f64) as usize * CELLS + (u * CELLS as f32) as usize;
                        counts[k * CELLS * CELLS + cell] += 1.0;
                    }
                }
                for counts in counts.chunks(CELLS * CELLS) {
                    let expected = f64::from(N) / (CELLS * CELLS) as f64;
                    // 6 standard deviations of a count; even numbers have less.
                    let most = counts.iter().map(|n: &f64| (n - expected).abs()).fold(0.0, f64::max);
                    assert!(most < 6.0 * expected.sqrt(), "dimension {dimension}: {most} of {expected}");
                }
            }
        }
    }
}
