//! Owen-scrambled Sobol' points, padded two dimensions at a time.
//!
//! Each pair of dimensions is the two-dimensional Sobol' sequence, its points scrambled and its order shuffled by
//! hashes of (seed, pixel, pair). Any power-of-two run of samples of one pair is a scrambled (0, 2)-net, and the
//! pairs are independent of each other: Burley 2020, "Practical Hash-based Owen Scrambling", with the better mixing
//! constants of Vegdahl 2021. The second Sobol' coordinate is computed without a table (Ahmed 2024).
//! The first point is kept: without it the sequence is no net (Owen 2020, "On dropping the first Sobol' point").
//!
//! The first dimensions of pixels are spread over the screen as well: there all pixels share one scrambled sequence, each
//! with a digital shift of its own, and the shifts are a scrambled sequence along a Z-order curve. So each pixel has the
//! same points as ever, a scrambled net, but any sample of an aligned block of 2ᵏ × 2ᵏ pixels (up to 64 × 64) is a net too, and what is
//! left of noise is fine-grained (the idea is that of Ahmed and Wonka 2020, "Screen-Space Blue-Noise Diffusion", made
//! progressive: the number of samples need not be known).

use super::hash::{hash_combine, hash_u32};
use glam::Vec2;
use std::sync::LazyLock;

/// The random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sampler {
    /// Hash of seed and pixel.
    stream: u32,
    /// Bits of the sample number, lowest first.
    reversed_index: u32,
    /// See [`screen_place`]; 0 for what is not a pixel.
    screen: u32,
}

/// How many dimensions of a pixel's samples are spread over the screen: the camera's and those of the first vertex of a
/// path, whose noise is what the eye sees first.
pub(super) const SCREEN_DIMENSIONS: u32 = 7;

impl Sampler {
    /// Of one of a family of sequences that know nothing of each other.
    #[inline]
    pub fn new(seed: u32, x: u32, y: u32, sample: u32) -> Self {
        let stream = hash_combine(hash_combine(hash_u32(seed), x), y);
        Self { stream, reversed_index: sample.reverse_bits(), screen: 0 }
    }

    /// Of a pixel: its samples are spread evenly together with those of the pixels around.
    #[inline]
    pub fn of_pixel(seed: u32, x: u32, y: u32, sample: u32) -> Self {
        Self { screen: screen_place(seed, x, y), ..Self::new(seed, x, y, sample) }
    }

    /// Numbers that owe nothing to the other samples of the pixel: plain random sampling, to compare with.
    pub fn independent(seed: u32, x: u32, y: u32, sample: u32) -> Self {
        let Self { stream, .. } = Self::new(seed, x, y, 0);
        Self { stream: hash_combine(stream, sample), reversed_index: 0, screen: 0 }
    }

    /// What it consists of, see [`Self::from_parts`].
    #[inline]
    pub(crate) fn parts(&self) -> [u32; 3] {
        [self.stream, self.reversed_index, self.screen]
    }

    /// The sampler that [`Self::parts`] were taken from.
    #[inline]
    pub(crate) fn from_parts([stream, reversed_index, screen]: [u32; 3]) -> Self {
        Self { stream, reversed_index, screen }
    }

    /// Two numbers in `[0, 1)`, well spread together over the samples of a pixel.
    #[inline]
    pub fn pair(&self, dimension: u32) -> Vec2 {
        let [x, y] = match self.screen_seed(dimension) {
            None => sobol_pair(self.reversed_index, hash_combine(self.stream, dimension)),
            Some(seed) => {
                let shared = sobol_pair(self.reversed_index, seed);
                let at = self.shift_at(dimension);
                [shared[0] ^ SHIFTS[0][at], shared[1] ^ SHIFTS[1][at]]
            }
        };
        Vec2::new(to_unit(x.reverse_bits()), to_unit(y.reverse_bits()))
    }

    /// One number in `[0, 1)`, well spread over the samples of a pixel.
    #[inline]
    pub fn single(&self, dimension: u32) -> f32 {
        let x = match self.screen_seed(dimension) {
            None => van_der_corput(self.reversed_index, hash_combine(self.stream, dimension)),
            Some(seed) => van_der_corput(self.reversed_index, seed) ^ SHIFTS[0][self.shift_at(dimension)],
        };
        to_unit(x.reverse_bits())
    }

    /// What the pixels of a block share, in the dimensions where they share something.
    #[inline]
    fn screen_seed(&self, dimension: u32) -> Option<u32> {
        (self.screen != 0 && dimension < SCREEN_DIMENSIONS)
            .then(|| hash_combine(self.screen >> (2 * LOG_BLOCK), dimension))
    }

    /// Index into both of [`SHIFTS`].
    #[inline]
    fn shift_at(&self, dimension: u32) -> usize {
        (self.screen & (BLOCK_PIXELS - 1) | dimension << (2 * LOG_BLOCK)) as usize
    }
}

/// Place of a pixel along a Z-order curve through its block in the lowest bits, above them a hash of seed and block that is
/// not 0.
#[inline]
fn screen_place(seed: u32, x: u32, y: u32) -> u32 {
    let block = hash_combine(hash_combine(hash_u32(seed), x >> LOG_BLOCK), y >> LOG_BLOCK) | BLOCK_PIXELS;
    block & !(BLOCK_PIXELS - 1) | spread_bits(x & LOW) | spread_bits(y & LOW) << 1
}

/// Pixels in a row of a block, as a power of two: small enough for [`SHIFTS`] to stay in a cache.
pub(super) const LOG_BLOCK: u32 = 6;
pub(super) const BLOCK_PIXELS: u32 = 1 << (2 * LOG_BLOCK);
/// What of a coordinate tells where in its block a pixel is.
pub(super) const LOW: u32 = (1 << LOG_BLOCK) - 1;

/// The first and second coordinates of the shifts of all pixels of a block, dimension by dimension, along the curve; their
/// bits are in reverse.
pub(super) static SHIFTS: LazyLock<[Vec<u32>; 2]> = LazyLock::new(|| {
    let places = (0..SCREEN_DIMENSIONS).flat_map(|dimension| (0..BLOCK_PIXELS).map(move |z| (dimension, z)));
    let (x, y) = places.map(|(dimension, z)| sobol_pair(z.reverse_bits(), hash_u32(dimension)).into()).unzip();
    [x, y]
});

/// The lower eight bits, a zero above each.
#[inline]
fn spread_bits(x: u32) -> u32 {
    let x = (x | x << 4) & 0x0f0f;
    let x = (x | x << 2) & 0x3333;
    (x | x << 1) & 0x5555
}

/// A point of the scrambled sequence, the bits of its coordinates lowest first.
#[inline]
fn sobol_pair(reversed_index: u32, seed: u32) -> [u32; 2] {
    let index = scramble(reversed_index, seed).reverse_bits();
    let x = scramble(index, hash_u32(seed ^ 0x68bc_21eb));
    [x, scramble(sobol_second_reversed(index), hash_u32(seed ^ 0x02e5_be93))]
}

/// The same for one dimension. Shuffling the order of a scrambled van der Corput sequence is what keeps it independent
/// of other dimensions.
#[inline]
fn van_der_corput(reversed_index: u32, seed: u32) -> u32 {
    let index = scramble(reversed_index, seed).reverse_bits();
    scramble(index, hash_u32(seed ^ 0x68bc_21eb))
}

/// The second Sobol' coordinate of point `index`, lowest bit first: bit i is the xor of the bits j of the index with
/// i ⊆ j, because the generator matrix is Pascal's triangle modulo 2.
#[inline]
fn sobol_second_reversed(index: u32) -> u32 {
    let mut v = index;
    v ^= v >> 16;
    v ^= (v & 0xff00_ff00) >> 8;
    v ^= (v & 0xf0f0_f0f0) >> 4;
    v ^= (v & 0xcccc_cccc) >> 2;
    v ^ ((v & 0xaaaa_aaaa) >> 1)
}

/// Owen scrambling of a number whose bits come lowest first: each bit is flipped by a hash of the bits below it.
#[inline]
fn scramble(mut reversed: u32, seed: u32) -> u32 {
    reversed ^= reversed.wrapping_mul(0x3d20_adea);
    reversed = reversed.wrapping_add(seed);
    reversed = reversed.wrapping_mul((seed >> 16) | 1);
    reversed ^= reversed.wrapping_mul(0x0552_6c56);
    reversed ^ reversed.wrapping_mul(0x53a2_2864)
}

/// The upper 24 bits as a number in `[0, 1)`, exactly.
#[inline]
fn to_unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_statistics::ChiSquared;

    /// The definition by direction numbers (primitive polynomial x + 1), which the bit trick must reproduce.
    fn sobol_second_by_directions(index: u32) -> u32 {
        let mut direction = 1u32 << 31;
        let mut y = 0;
        for bit in 0..32 {
            if index >> bit & 1 == 1 {
                y ^= direction;
            }
            direction ^= direction >> 1;
        }
        y
    }

    #[test]
    fn bit_trick_is_the_second_sobol_coordinate() {
        for i in (0..4096).chain((0..4096).map(hash_u32)) {
            assert_eq!(sobol_second_reversed(i).reverse_bits(), sobol_second_by_directions(i), "index {i}");
        }
    }

    #[test]
    fn every_power_of_two_run_is_a_net() {
        for (pixel, dimension) in [(0, 0), (3, 7), (901, 2)] {
            for log_n in 0..=10u32 {
                let n = 1u32 << log_n;
                // The second run of n points, too: any aligned run must be a net.
                for first in [0, n] {
                    let points: Vec<_> =
                        (first..first + n).map(|s| Sampler::new(1, pixel, 5, s).pair(dimension)).collect();
                    for log_x in 0..=log_n {
                        let (nx, ny) = (1u32 << log_x, 1u32 << (log_n - log_x));
                        let mut seen = vec![false; n as usize];
                        for p in &points {
                            let cell = (p.x * nx as f32) as u32 + nx * (p.y * ny as f32) as u32;
                            assert!(!seen[cell as usize], "two of {n} points in one cell of {nx} × {ny}");
                            seen[cell as usize] = true;
                        }
                    }
                }
            }
        }
    }

    fn is_net(points: &[Vec2]) -> bool {
        let log_n = points.len().ilog2();
        (0..=log_n).all(|log_x| {
            let (nx, ny) = (1u32 << log_x, 1u32 << (log_n - log_x));
            let mut seen = vec![false; points.len()];
            points.iter().all(|p| {
                let cell = (p.x * nx as f32) as u32 + nx * (p.y * ny as f32) as u32;
                !std::mem::replace(&mut seen[cell as usize], true)
            })
        })
    }

    #[test]
    fn pixels_have_nets_over_their_samples_and_over_the_screen() {
        for dimension in [0, 3, SCREEN_DIMENSIONS - 1, SCREEN_DIMENSIONS] {
            for (x, y) in [(0, 0), (517, 300), (255, 1)] {
                for n in [1, 4, 16, 64, 256, 1024] {
                    let own: Vec<_> = (n..2 * n).map(|s| Sampler::of_pixel(9, x, y, s).pair(dimension)).collect();
                    assert!(is_net(&own), "{n} samples of pixel ({x}, {y}) in dimension {dimension}");
                }
            }
            for (x, y, side) in [(0, 0, 2), (514, 302, 2), (260, 8, 4), (64, 128, 32)] {
                for sample in [0, 1, 5, 64] {
                    let around = (0..side * side).map(|i| Sampler::of_pixel(9, x + i % side, y + i / side, sample));
                    let points: Vec<_> = around.clone().map(|sampler| sampler.pair(dimension)).collect();
                    let on_screen = dimension < SCREEN_DIMENSIONS;
                    // Without the screen, four points would make a net by chance once in ten.
                    assert!(
                        is_net(&points) == on_screen || side == 2 && !on_screen,
                        "{side} at ({x}, {y}), {dimension}"
                    );
                    let mut strata: Vec<_> =
                        around.map(|sampler| (sampler.single(dimension) * (side * side) as f32) as u32).collect();
                    strata.sort_unstable();
                    assert!(!on_screen || strata.iter().copied().eq(0..side * side));
                }
            }
        }
    }

    /// Neighbours must not share the fine digits of their points: their errors would be alike.
    #[test]
    fn errors_of_neighbours_are_independent_when_samples_have_come_in() {
        let f = |p: Vec2| f64::from((p.x - 0.31).abs() + (p.x * p.y + 0.2).sqrt());
        let mean = |x: u32, y: u32| (0..64).map(|s| f(Sampler::of_pixel(5, x, y, s).pair(2))).sum::<f64>() / 64.0;
        let side = 128u32;
        let means: Vec<f64> = (0..side * side).map(|i| mean(i % side, i / side)).collect();
        let truth = means.iter().sum::<f64>() / means.len() as f64;
        let variance = means.iter().map(|m| (m - truth).powi(2)).sum::<f64>() / means.len() as f64;
        for (dx, dy) in [(1, 0), (0, 1), (1, 1), (2, 0), (4, 4), (8, 0), (16, 16)] {
            let pairs = (0..side - dx).flat_map(|x| (0..side - dy).map(move |y| (x, y)));
            let products = pairs.map(|(x, y)| {
                (means[(y * side + x) as usize] - truth) * (means[((y + dy) * side + x + dx) as usize] - truth)
            });
            let correlation = products.sum::<f64>() / f64::from((side - dx) * (side - dy)) / variance;
            // Noise that evens out nearby is welcome, noise in blotches is not.
            assert!((-0.25..0.1).contains(&correlation), "({dx}, {dy}): {correlation}");
        }
    }

    #[test]
    fn independent_samples_fill_the_square_evenly_and_know_nothing_of_each_other() {
        // Pairs of one sample, and one coordinate in two samples that follow each other, in 16 × 16 cells.
        let n = 1 << 16;
        let (mut within, mut between) = ([0.0; 256], [0.0; 256]);
        let cell = |x: f32, y: f32| (16.0 * x) as usize + 16 * (16.0 * y) as usize;
        for i in 0..n {
            let at = |s| Sampler::independent(3, i % 256, i / 256, s).pair(4);
            within[cell(at(0).x, at(0).y)] += 1.0;
            between[cell(at(6).x, at(7).x)] += 1.0;
        }
        let expected = f64::from(n) / 256.0;
        for counts in [within, between] {
            ChiSquared::of(&counts, &[expected; 256], 0.0).assert_below(3.0, "pairs");
        }
    }

    #[test]
    fn pairs_are_independent_of_each_other() {
        // Correlation of all coordinates over many pixels: σ = 1/√n per estimate, 66 estimates, 4.5 σ.
        let n = 1 << 14;
        let rows: Vec<[f32; 12]> = (0..n)
            .map(|i| {
                // Each pixel is in the family of its seed and in that of the screen.
                let sampler = Sampler::new(7, i % 128, i / 128, i % 64);
                let on_screen = Sampler::of_pixel(i / 256, i % 16, i / 16 % 16, i % 64);
                let pairs = [0, 1, 2].map(|d| sampler.pair(d));
                let others = [0, 1, 2].map(|d| on_screen.pair(d));
                std::array::from_fn(|k| if k < 6 { pairs[k / 2][k % 2] } else { others[k / 2 - 3][k % 2] } - 0.5)
            })
            .collect();
        for a in 0..12 {
            for b in 0..a {
                let correlation = rows.iter().map(|r| 12.0 * f64::from(r[a] * r[b])).sum::<f64>() / f64::from(n);
                assert!(correlation.abs() < 4.5 / f64::from(n).sqrt(), "dimensions {a} and {b}: {correlation}");
            }
        }
    }
}
