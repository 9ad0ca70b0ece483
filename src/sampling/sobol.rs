//! Owen-scrambled Sobol' points, padded two dimensions at a time.
//!
//! Each pair of dimensions is the two-dimensional Sobol' sequence, its points scrambled and its order shuffled by
//! hashes of (seed, pixel, pair). Any power-of-two run of samples of one pair is a scrambled (0, 2)-net, and the
//! pairs are independent of each other: Burley 2020, "Practical Hash-based Owen Scrambling", with the better mixing
//! constants of Vegdahl 2021. The second Sobol' coordinate is computed without a table (Ahmed 2024).
//! The first point is kept: without it the sequence is no net (Owen 2020, "On dropping the first Sobol' point").

use super::hash::{hash_combine, hash_u32};
use glam::Vec2;

/// The random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sampler {
    /// Hash of seed and pixel.
    stream: u32,
    /// Bits of the sample number, lowest first.
    reversed_index: u32,
}

impl Sampler {
    #[inline]
    pub fn new(seed: u32, x: u32, y: u32, sample: u32) -> Self {
        Self { stream: hash_combine(hash_combine(hash_u32(seed), x), y), reversed_index: sample.reverse_bits() }
    }

    /// Numbers that owe nothing to the other samples of the pixel: plain random sampling, to compare with.
    pub fn independent(seed: u32, x: u32, y: u32, sample: u32) -> Self {
        let Self { stream, .. } = Self::new(seed, x, y, 0);
        Self { stream: hash_combine(stream, sample), reversed_index: 0 }
    }

    /// Stream and index, see [`Self::from_parts`].
    #[inline]
    pub(crate) fn parts(&self) -> [u32; 2] {
        [self.stream, self.reversed_index]
    }

    /// The sampler that [`Self::parts`] were taken from.
    #[inline]
    pub(crate) fn from_parts([stream, reversed_index]: [u32; 2]) -> Self {
        Self { stream, reversed_index }
    }

    /// Two numbers in `[0, 1)`, well spread together over the samples of a pixel.
    #[inline]
    pub fn pair(&self, dimension: u32) -> Vec2 {
        let seed = hash_combine(self.stream, dimension);
        let index = scramble(self.reversed_index, seed).reverse_bits();
        let x = scramble(index, hash_u32(seed ^ 0x68bc_21eb)).reverse_bits();
        let y = scramble(sobol_second_reversed(index), hash_u32(seed ^ 0x02e5_be93)).reverse_bits();
        Vec2::new(to_unit(x), to_unit(y))
    }

    /// One number in `[0, 1)`, well spread over the samples of a pixel.
    #[inline]
    pub fn single(&self, dimension: u32) -> f32 {
        let seed = hash_combine(self.stream, dimension);
        // Shuffling the order of a scrambled van der Corput sequence is what keeps it independent of other dimensions.
        let index = scramble(self.reversed_index, seed).reverse_bits();
        to_unit(scramble(index, hash_u32(seed ^ 0x68bc_21eb)).reverse_bits())
    }
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

    #[test]
    fn independent_samples_fill_the_square_evenly_and_know_nothing_of_each_other() {
        // χ² of pairs of one sample, and of one coordinate in two samples that follow each other, in 16 × 16 cells:
        // 255 degrees of freedom, so 255 ± 22.6; bound at 4.5 σ.
        let n = 1 << 16;
        let (mut within, mut between) = ([0u32; 256], [0u32; 256]);
        let cell = |x: f32, y: f32| (16.0 * x) as usize + 16 * (16.0 * y) as usize;
        for i in 0..n {
            let at = |s| Sampler::independent(3, i % 256, i / 256, s).pair(4);
            within[cell(at(0).x, at(0).y)] += 1;
            between[cell(at(6).x, at(7).x)] += 1;
        }
        let expected = f64::from(n) / 256.0;
        for counts in [within, between] {
            let chi2: f64 = counts.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
            assert!((255.0 - 4.5 * 22.6..255.0 + 4.5 * 22.6).contains(&chi2), "{chi2}");
        }
    }

    #[test]
    fn pairs_are_independent_of_each_other() {
        // Correlation of all coordinates over many pixels: σ = 1/√n per estimate, 66 estimates, 4.5 σ.
        let n = 1 << 14;
        let rows: Vec<[f32; 12]> = (0..n)
            .map(|i| {
                let sampler = Sampler::new(7, i % 128, i / 128, i % 64);
                let pairs = [0, 1, 2, 3, 4, 5].map(|d| sampler.pair(d));
                std::array::from_fn(|k| pairs[k / 2][k % 2] - 0.5)
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
