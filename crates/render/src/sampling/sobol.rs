//! Owen-scrambled Sobol' points, padded two dimensions at a time.
//!
//! Each pair of dimensions is the two-dimensional Sobol' sequence, its points scrambled and its order shuffled by
//! hashes of (seed, pixel, pair). Any aligned power-of-two run of samples of one pair is a scrambled (0, 2)-net, and
//! the pairs are independent of each other: Burley 2020, "Practical Hash-based Owen Scrambling", with the better mixing
//! constants of Vegdahl 2021. The second Sobol' coordinate is computed without a table (Ahmed 2024). The first point is
//! kept: without it the sequence is no net (Owen 2020, "On dropping the first Sobol' point").
//!
//! The first dimensions of pixels are also stratified over the screen: all pixels of a block share one scrambled
//! sequence, each with its own digital shift, and the shifts are a scrambled sequence along a Z-order curve. So each
//! pixel still has a scrambled net, and any sample of an aligned block of 2ᵏ × 2ᵏ pixels (up to 64 × 64) is a net too,
//! which makes the remaining noise fine-grained (the idea is that of Ahmed and Wonka 2020, "Screen-Space Blue-Noise
//! Diffusion", made progressive: the number of samples need not be known).

use crate::sampling::hash::{hash_combine, hash_combine_all, hash_u32};
use firstlight_simd::{Bits, Float, Simd, Truth, Word};
use glam::Vec2;
use std::sync::LazyLock;

/// The random numbers of one sample of one pixel, or of sixteen, with the same bits; see [`Sampler`].
#[derive(Clone, Copy, Debug, Default)]
pub struct SamplerOf<W> {
    /// Hash of seed and pixel.
    pub(crate) stream: W,
    /// Bits of the sample number, lowest first.
    pub(crate) reversed_index: W,
    /// See [`screen_place`]; 0 for sequences that do not belong to pixels. Either all lanes belong to pixels or none.
    pub(crate) screen: W,
}

/// The random numbers of one sample of one pixel.
pub type Sampler = SamplerOf<u32>;

/// The random numbers of sixteen samples.
pub(crate) type SamplerLanes<S> = SamplerOf<Bits<S>>;

/// Number of dimensions that are stratified over the screen: those of the camera, of the point on a light and of the
/// direction at the first vertex of a path, whose noise is directly visible.
///
/// The choices of a light and of a lobe are not among them: what is found depends on them and on these together, and in
/// some blocks the orders of two dimensions agree at random. All pixels there would have more noise, alike in both
/// halves of their samples, which passes for detail.
pub(super) const SCREEN_DIMENSIONS: u32 = 4;

impl Sampler {
    /// Creates a sampler of one of a family of independent sequences.
    #[inline]
    pub fn new(seed: u32, x: u32, y: u32, sample: u32) -> Self {
        Self::of_family(seed, [x, y], sample)
    }

    /// Creates a sampler of a pixel: its samples are stratified together with those of neighbouring pixels.
    #[inline]
    pub fn of_pixel(seed: u32, x: u32, y: u32, sample: u32) -> Self {
        Self::of_pixels(seed, [x, y], sample)
    }

    /// Creates a sampler of independent random numbers, for comparison.
    pub fn independent(seed: u32, x: u32, y: u32, sample: u32) -> Self {
        Self::all_independent(seed, [x, y], sample)
    }

    /// Its components, see [`Self::from_parts`].
    #[inline]
    pub(crate) fn parts(&self) -> [u32; 3] {
        [self.stream, self.reversed_index, self.screen]
    }

    /// Creates a sampler from [`Self::parts`].
    #[inline]
    pub(crate) fn from_parts([stream, reversed_index, screen]: [u32; 3]) -> Self {
        Self { stream, reversed_index, screen }
    }

    /// Two numbers in `[0, 1)`, stratified together over the samples of a pixel.
    #[inline]
    pub fn pair(&self, dimension: u32) -> Vec2 {
        self.two(dimension).into()
    }
}

impl<S: Simd> SamplerLanes<S> {
    /// See [`Sampler::pair`].
    #[inline(always)]
    pub fn pair(&self, dimension: u32) -> [Float<S>; 2] {
        self.two(dimension)
    }
}

impl<W: Word> SamplerOf<W> {
    /// See [`Sampler::new`].
    #[inline(always)]
    fn of_family(seed: u32, [x, y]: [W; 2], sample: u32) -> Self {
        let stream = hash_combine(hash_combine(x.all(hash_u32(seed)), x), y);
        Self { stream, reversed_index: x.all(sample.reverse_bits()), screen: x.all(0) }
    }

    /// See [`Sampler::of_pixel`].
    #[inline(always)]
    pub(crate) fn of_pixels(seed: u32, pixel: [W; 2], sample: u32) -> Self {
        Self { screen: screen_place(seed, pixel), ..Self::of_family(seed, pixel, sample) }
    }

    /// See [`Sampler::independent`].
    #[inline(always)]
    pub(crate) fn all_independent(seed: u32, [x, y]: [W; 2], sample: u32) -> Self {
        let Self { stream, .. } = Self::of_family(seed, [x, y], 0);
        Self { stream: hash_combine_all(stream, sample), reversed_index: x.all(0), screen: x.all(0) }
    }

    #[inline(always)]
    fn two(&self, dimension: u32) -> [W::Real; 2] {
        let [x, y] = if self.is_on_screen(dimension) {
            let shared = sobol_pair(self.reversed_index, self.screen_seed(dimension));
            let (shifts, at) = (&*SHIFTS, self.shift_at(dimension));
            [shared[0] ^ W::gather(&shifts[0], at), shared[1] ^ W::gather(&shifts[1], at)]
        } else {
            sobol_pair(self.reversed_index, hash_combine_all(self.stream, dimension))
        };
        [to_unit(x.reversed()), to_unit(y.reversed())]
    }

    /// One number in `[0, 1)`, stratified over the samples of a pixel.
    #[inline(always)]
    pub fn single(&self, dimension: u32) -> W::Real {
        let x = if self.is_on_screen(dimension) {
            let shared = van_der_corput(self.reversed_index, self.screen_seed(dimension));
            shared ^ W::gather(&SHIFTS[0], self.shift_at(dimension))
        } else {
            van_der_corput(self.reversed_index, hash_combine_all(self.stream, dimension))
        };
        to_unit(x.reversed())
    }

    #[inline(always)]
    fn is_on_screen(&self, dimension: u32) -> bool {
        dimension < SCREEN_DIMENSIONS && (!self.screen.equals(0)).any()
    }

    /// Seed that the pixels of a block share, in the dimensions that are stratified over the screen.
    #[inline(always)]
    fn screen_seed(&self, dimension: u32) -> W {
        hash_combine_all(self.screen.shift_right(2 * LOG_BLOCK), dimension)
    }

    /// Index into both of [`SHIFTS`].
    #[inline(always)]
    fn shift_at(&self, dimension: u32) -> W {
        self.screen & (BLOCK_PIXELS - 1) | (dimension << (2 * LOG_BLOCK))
    }
}

/// Returns the index of a pixel along a Z-order curve through its block in the lowest bits, and above them a hash of
/// seed and block that is not 0.
#[inline(always)]
fn screen_place<W: Word>(seed: u32, [x, y]: [W; 2]) -> W {
    let first = x.all(hash_u32(seed));
    let block = hash_combine(hash_combine(first, x.shift_right(LOG_BLOCK)), y.shift_right(LOG_BLOCK));
    let z = spread_bits(x & LOW) | spread_bits(y & LOW).shift_left(1);
    (block | BLOCK_PIXELS) & !(BLOCK_PIXELS - 1) | z
}

/// Logarithm to base 2 of the side of a block in pixels: small enough for [`SHIFTS`] to stay in a cache.
const LOG_BLOCK: u32 = 6;
const BLOCK_PIXELS: u32 = 1 << (2 * LOG_BLOCK);
/// Mask of the bits of a coordinate inside of a block.
const LOW: u32 = (1 << LOG_BLOCK) - 1;

/// First and second coordinates of the shifts of all pixels of a block, dimension by dimension, along the curve, with
/// reversed bits.
static SHIFTS: LazyLock<[Vec<u32>; 2]> = LazyLock::new(|| {
    let places = (0..SCREEN_DIMENSIONS).flat_map(|dimension| (0..BLOCK_PIXELS).map(move |z| (dimension, z)));
    let (x, y) = places.map(|(dimension, z)| sobol_pair(z.reverse_bits(), hash_u32(dimension)).into()).unzip();
    [x, y]
});

/// Spreads the lower eight bits, with a zero above each.
#[inline(always)]
fn spread_bits<W: Word>(x: W) -> W {
    let x = (x | x.shift_left(4)) & 0x0f0f;
    let x = (x | x.shift_left(2)) & 0x3333;
    (x | x.shift_left(1)) & 0x5555
}

/// Returns a point of the scrambled sequence, the bits of its coordinates lowest first.
#[inline(always)]
fn sobol_pair<W: Word>(reversed_index: W, seed: W) -> [W; 2] {
    let index = scramble(reversed_index, seed).reversed();
    let x = scramble(index, hash_u32(seed ^ 0x68bc_21eb));
    [x, scramble(sobol_second_reversed(index), hash_u32(seed ^ 0x02e5_be93))]
}

/// Like [`sobol_pair`], for one dimension. Shuffling the order of a scrambled van der Corput sequence makes it
/// independent of other dimensions.
#[inline(always)]
fn van_der_corput<W: Word>(reversed_index: W, seed: W) -> W {
    let index = scramble(reversed_index, seed).reversed();
    scramble(index, hash_u32(seed ^ 0x68bc_21eb))
}

/// Returns the second Sobol' coordinate of point `index`, lowest bit first: bit i is the xor of the bits j of the index
/// with i ⊆ j, because the generator matrix is Pascal's triangle modulo 2.
#[inline(always)]
fn sobol_second_reversed<W: Word>(index: W) -> W {
    let v = index ^ index.shift_right(16);
    let v = v ^ (v & 0xff00_ff00).shift_right(8);
    let v = v ^ (v & 0xf0f0_f0f0).shift_right(4);
    let v = v ^ (v & 0xcccc_cccc).shift_right(2);
    v ^ (v & 0xaaaa_aaaa).shift_right(1)
}

/// Owen scrambling of a number with the lowest bit first: each bit is flipped by a hash of the bits below it.
#[inline(always)]
fn scramble<W: Word>(reversed: W, seed: W) -> W {
    let x = (reversed ^ reversed.times_all(0x3d20_adea)).plus(seed);
    let x = x.times(seed.shift_right(16) | 1);
    let x = x ^ x.times_all(0x0552_6c56);
    x ^ x.times_all(0x53a2_2864)
}

/// Converts the upper 24 bits to a number in `[0, 1)`, exactly.
#[inline(always)]
fn to_unit<W: Word>(bits: W) -> W::Real {
    bits.shift_right(8).to_real() * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_statistics::ChiSquared;
    use firstlight_simd::{InstructionSet, LANES, dispatch};

    /// The definition by direction numbers (primitive polynomial x + 1), to which the bit operations must be equal.
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
                    // Without stratification over the screen, four points would be a net at random once in ten.
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

    /// Neighbours must not share the low digits of their points: their errors would be correlated.
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
            // Negative correlation of neighbours is welcome, positive correlation is not.
            assert!((-0.25..0.1).contains(&correlation), "({dx}, {dy}): {correlation}");
        }
    }

    #[test]
    fn independent_samples_fill_the_square_evenly_and_know_nothing_of_each_other() {
        // Pairs of one sample, and one coordinate of two consecutive samples, in 16 × 16 cells.
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

    #[inline(always)]
    fn draw<S: Simd>(s: S, samplers: &[Sampler; LANES], dimension: u32, out: &mut [[f32; LANES]; 3]) {
        let part = |k: usize| Bits::load(s, &samplers.map(|sampler| sampler.parts()[k]));
        let lanes = SamplerLanes { stream: part(0), reversed_index: part(1), screen: part(2) };
        let [x, y] = lanes.pair(dimension);
        x.store(&mut out[0]);
        y.store(&mut out[1]);
        lanes.single(dimension).store(&mut out[2]);
    }

    #[test]
    fn lanes_draw_the_same_bits() {
        for i in 0..1000 {
            let make = if i % 2 == 0 { Sampler::new } else { Sampler::of_pixel };
            let samplers: [Sampler; LANES] = std::array::from_fn(|k| make(5, i, k as u32, hash_u32(i) >> (k % 32)));
            for set in InstructionSet::available() {
                let dimension = i / 2 % 16;
                let mut out = [[0.0; LANES]; 3];
                let (samplers, to) = (&samplers, &mut out);
                dispatch!(set, draw(samplers: &[Sampler; LANES], dimension: u32, to: &mut [[f32; LANES]; 3]));
                for (k, sampler) in samplers.iter().enumerate() {
                    let pair = sampler.pair(dimension);
                    assert_eq!([pair.x, pair.y, sampler.single(dimension)], out.map(|numbers| numbers[k]), "{set:?}");
                }
            }
        }
    }

    #[inline(always)]
    fn start<S: Simd>(s: S, first: [u32; 2], sample: u32, out: &mut [[u32; LANES]; 6]) {
        let x = Bits::load(s, &std::array::from_fn(|k| first[0] + 37 * k as u32));
        let y = Bits::load(s, &std::array::from_fn(|k| first[1] + 11 * k as u32));
        let (even, other) =
            (SamplerLanes::of_pixels(6, [x, y], sample), SamplerLanes::all_independent(6, [x, y], sample));
        for (k, sampler) in [even, other].into_iter().enumerate() {
            sampler.stream.store(&mut out[3 * k]);
            sampler.reversed_index.store(&mut out[3 * k + 1]);
            sampler.screen.store(&mut out[3 * k + 2]);
        }
    }

    #[test]
    fn lanes_begin_with_the_same_bits() {
        for (first, sample) in [([0, 0], 0), ([250, 1000], 7), ([70_000, 3], 64)] {
            for set in InstructionSet::available() {
                let mut out = [[0; LANES]; 6];
                let to = &mut out;
                dispatch!(set, start(first: [u32; 2], sample: u32, to: &mut [[u32; LANES]; 6]));
                for k in 0..LANES {
                    let (x, y) = (first[0] + 37 * k as u32, first[1] + 11 * k as u32);
                    let even = Sampler::of_pixel(6, x, y, sample).parts();
                    let other = Sampler::independent(6, x, y, sample).parts();
                    assert_eq!([even, other].concat(), out.map(|numbers| numbers[k]), "{set:?}");
                }
            }
        }
    }
}
