//! Reconstruction filters by importance sampling of film positions (Ernst, Stamminger and Greiner 2006, "Filter
//! Importance Sampling"): every sample belongs to one pixel and, for a filter without negative lobes, has weight 1, so
//! that pixels are independent and a uniform image stays exactly uniform.
//!
//! All filters are separable products of one function of x and y; widths are in pixels from the pixel's centre.

use firstlight_simd::{Float, Real, Simd, select};
use glam::Vec2;
use serde::{Deserialize, Serialize};

/// Reconstruction filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PixelFilter {
    /// The pixel's square, uniform.
    #[default]
    Box,
    /// Falls linearly to zero at 1.
    Tent,
    /// Gaussian with a standard deviation of 1/2, offset to reach zero at 1.5.
    Gaussian,
    /// The four-term window of Harris 1978, zero from 1.65 on: almost no ringing.
    BlackmanHarris,
    /// Mitchell and Netravali 1988, B = C = 1/3, zero from 2 on: sharpens. Its negative lobes give samples negative
    /// weights, so that images with few samples look speckled; the expectation is correct.
    Mitchell,
}

impl PixelFilter {
    /// Radius of the filter, pixels along each axis.
    pub fn radius(self) -> f32 {
        match self {
            Self::Box => 0.5,
            Self::Tent => 1.0,
            Self::Gaussian => 1.5,
            Self::BlackmanHarris => 1.65,
            Self::Mitchell => 2.0,
        }
    }

    /// Weight along one axis, not normalised; zero from the radius on.
    pub fn weight(self, x: f64) -> f64 {
        let x = x.abs();
        let radius = f64::from(self.radius());
        if x >= radius {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::Tent => 1.0 - x,
            Self::Gaussian => {
                let bell = |x: f64| (-2.0 * x * x).exp();
                bell(x) - bell(radius)
            }
            Self::BlackmanHarris => {
                let phase = std::f64::consts::PI * (1.0 + x / radius);
                0.35875 - 0.48829 * phase.cos() + 0.14128 * (2.0 * phase).cos() - 0.01168 * (3.0 * phase).cos()
            }
            Self::Mitchell if x < 1.0 => (7.0 * x.powi(3) - 12.0 * x * x + 16.0 / 3.0) / 6.0,
            Self::Mitchell => (-7.0 / 3.0 * x.powi(3) + 12.0 * x * x - 20.0 * x + 32.0 / 3.0) / 6.0,
        }
    }
}

impl PixelFilter {
    /// Integral of [`Self::weight`] along one axis.
    pub(crate) fn integral(self) -> f64 {
        const STEPS: u32 = 1 << 12;
        let step = 2.0 * f64::from(self.radius()) / f64::from(STEPS);
        let at = |i: u32| (f64::from(i) + 0.5) * step - f64::from(self.radius());
        (0..STEPS).map(|i| self.weight(at(i))).sum::<f64>() * step
    }
}

/// Importance sampling of a filter, prepared once per pass.
#[derive(Clone, Debug)]
pub(crate) struct FilterSampler {
    filter: PixelFilter,
    /// Quantiles: the position beyond which the share ½ (i / [`STEPS`])⁴ of |weight| lies, on one side; empty if there
    /// is a formula. The power resolves the thin tails by many steps.
    quantiles: Vec<f32>,
    /// Absolute weight of every sample: ∫|f| over ∫f, both axes together.
    scale: f32,
}

const STEPS: usize = 512;

impl FilterSampler {
    /// Absolute weight of every sample.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    pub fn new(filter: PixelFilter) -> Self {
        if matches!(filter, PixelFilter::Box | PixelFilter::Tent) {
            return Self { filter, quantiles: Vec::new(), scale: 1.0 };
        }
        // Fine steps of |f| from the rim inwards, accumulated and inverted.
        const FINE: usize = 1 << 16;
        let radius = f64::from(filter.radius());
        let place = |i: f64| radius * (1.0 - i / FINE as f64);
        let (mut signed, mut sizes) = (0.0, vec![0.0; FINE + 1]);
        for i in 0..FINE {
            let weight = filter.weight(place(i as f64 + 0.5));
            signed += weight;
            sizes[i + 1] = sizes[i] + weight.abs();
        }
        let total = sizes[FINE];
        let mut at = 0;
        let quantiles = (0..=STEPS)
            .map(|k| {
                let share = total * (k as f64 / STEPS as f64).powi(4);
                while at + 1 < FINE && sizes[at + 1] <= share {
                    at += 1;
                }
                let within = (share - sizes[at]) / (sizes[at + 1] - sizes[at]);
                place(at as f64 + within.clamp(0.0, 1.0)) as f32
            })
            .collect();
        Self { filter, quantiles, scale: ((total / signed) as f32).powi(2) }
    }

    /// Samples a position relative to the upper left corner of the pixel; returns it with the weight of its radiance.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        match self.filter {
            PixelFilter::Box => (u, 1.0),
            PixelFilter::Tent => (Vec2::new(tent(u.x), tent(u.y)) + 0.5, 1.0),
            _ => {
                let offset = Vec2::new(self.quantile(u.x), self.quantile(u.y));
                let weight = match self.filter {
                    PixelFilter::Mitchell => {
                        let sign = |x: f32| if self.filter.weight(f64::from(x)) < 0.0 { -1.0 } else { 1.0 };
                        sign(offset.x) * sign(offset.y) * self.scale
                    }
                    _ => 1.0,
                };
                (offset + 0.5, weight)
            }
        }
    }

    /// Whether [`Self::sample_lanes`] supports the filter; all samples have the same weight then.
    pub fn is_plain(&self) -> bool {
        matches!(self.filter, PixelFilter::Box | PixelFilter::Tent)
    }

    /// Like [`Self::sample`] for sixteen positions, for plain filters.
    #[inline(always)]
    pub fn sample_lanes<S: Simd>(&self, [x, y]: [Float<S>; 2]) -> [Float<S>; 2] {
        match self.filter {
            PixelFilter::Tent => [tent(x) + 0.5, tent(y) + 0.5],
            _ => [x, y],
        }
    }

    fn quantile(&self, u: f32) -> f32 {
        let (beyond, side) = if u < 0.5 { (2.0 * u, -1.0) } else { (2.0 - 2.0 * u, 1.0) };
        let place = beyond.sqrt().sqrt() * STEPS as f32;
        let i = (place as usize).min(STEPS - 1);
        let (a, b) = (self.quantiles[i], self.quantiles[i + 1]);
        side * (a + (place - i as f32) * (b - a))
    }
}

/// Maps a uniform number to the triangular distribution on −1..1.
#[inline(always)]
fn tent<R: Real>(u: R) -> R {
    let one = u.all(1.0);
    let (rising, falling) = ((u * 2.0).sqrt() - one, one - (u.all(2.0) - u * 2.0).at_least(0.0).sqrt());
    select(u.lt(u.all(0.5)), rising, falling)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    const ALL: [PixelFilter; 5] = [
        PixelFilter::Box,
        PixelFilter::Tent,
        PixelFilter::Gaussian,
        PixelFilter::BlackmanHarris,
        PixelFilter::Mitchell,
    ];

    /// ∫ f g over ∫ f, by fine steps.
    fn by_weight(filter: PixelFilter, g: impl Fn(f64) -> f64) -> f64 {
        let n = 100_000;
        let place = |i: i32| f64::from(filter.radius()) * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0);
        let whole: f64 = (0..n).map(|i| filter.weight(place(i))).sum();
        (0..n).map(|i| filter.weight(place(i)) * g(place(i))).sum::<f64>() / whole
    }

    #[test]
    fn samples_weigh_light_as_the_filter_does() {
        for filter in ALL {
            let sampler = FilterSampler::new(filter);
            let n = 1 << 16;
            // Moments measure the width; the last one, a step between pixels, the spatial distribution.
            type Moment = fn(f64) -> f64;
            let tests: [(&str, Moment); 4] =
                [("whole", |_| 1.0), ("x²", |x| x * x), ("x⁴", |x| x.powi(4)), ("neighbour", |x| f64::from(x > 0.5))];
            for (name, g) in tests {
                let sum: f64 = (0..n)
                    .map(|i| {
                        let (place, weight) = sampler.sample(Sampler::new(8, 0, 0, i).pair(0));
                        f64::from(weight) * g(f64::from(place.x) - 0.5)
                    })
                    .sum();
                let (found, expected) = (sum / f64::from(n), by_weight(filter, g));
                assert!((found - expected).abs() < 2e-3, "{filter:?} {name}: {found} for {expected}");
            }
        }
    }

    #[test]
    fn filters_that_are_nowhere_negative_count_every_sample_in_full() {
        for filter in ALL.into_iter().filter(|filter| *filter != PixelFilter::Mitchell) {
            let sampler = FilterSampler::new(filter);
            for i in 0..4096 {
                let (place, weight) = sampler.sample(Sampler::new(8, 0, 0, i).pair(0));
                assert_eq!(weight, 1.0);
                assert!((place - 0.5).abs().max_element() <= filter.radius());
            }
        }
    }
}
