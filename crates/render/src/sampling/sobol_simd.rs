//! The points of [`super::Sampler`], those of sixteen paths at a time, bit for bit.

use super::hash::hash_u32;
use super::sobol::{BLOCK_PIXELS, LOG_BLOCK, LOW, SCREEN_DIMENSIONS, SHIFTS};
use firstlight_simd::{Bits, Float, Mask, Simd};

/// The random numbers of sixteen samples.
#[derive(Clone, Copy)]
pub(crate) struct SamplerLanes<S: Simd> {
    pub stream: Bits<S>,
    pub reversed_index: Bits<S>,
    /// Either all lanes are pixels or none is.
    pub screen: Bits<S>,
}

impl<S: Simd> SamplerLanes<S> {
    /// Of pixels, see [`super::Sampler::of_pixel`].
    #[inline(always)]
    pub fn of_pixels(s: S, seed: u32, [x, y]: [Bits<S>; 2], sample: u32) -> Self {
        let first = Bits::splat(s, hash_u32(seed));
        let block = combine(combine(first, x.shift_right(LOG_BLOCK)), y.shift_right(LOG_BLOCK));
        let z = spread_bits(x & LOW) | spread_bits(y & LOW).shift_left(1);
        Self {
            stream: combine(combine(first, x), y),
            reversed_index: Bits::splat(s, sample.reverse_bits()),
            screen: (block | BLOCK_PIXELS) & !(BLOCK_PIXELS - 1) | z,
        }
    }

    /// See [`super::Sampler::independent`].
    #[inline(always)]
    pub fn independent(s: S, seed: u32, [x, y]: [Bits<S>; 2], sample: u32) -> Self {
        let stream = combine(combine(Bits::splat(s, hash_u32(seed)), x), y);
        let zero = Bits::splat(s, 0);
        Self { stream: combine(stream, Bits::splat(s, sample)), reversed_index: zero, screen: zero }
    }

    /// See [`super::Sampler::pair`].
    #[inline(always)]
    pub fn pair(&self, dimension: u32) -> [Float<S>; 2] {
        let [x, y] = if self.is_on_screen(dimension) {
            let shared = sobol_pair(self.reversed_index, self.screen_seed(dimension));
            let (shifts, at) = (&*SHIFTS, self.shift_at(dimension));
            [shared[0] ^ Bits::gather(&shifts[0], at), shared[1] ^ Bits::gather(&shifts[1], at)]
        } else {
            sobol_pair(self.reversed_index, hash_combine(self.stream, dimension))
        };
        [to_unit(reverse(x)), to_unit(reverse(y))]
    }

    /// See [`super::Sampler::single`].
    #[inline(always)]
    pub fn single(&self, dimension: u32) -> Float<S> {
        let x = if self.is_on_screen(dimension) {
            let shared = van_der_corput(self.reversed_index, self.screen_seed(dimension));
            shared ^ Bits::gather(&SHIFTS[0], self.shift_at(dimension))
        } else {
            van_der_corput(self.reversed_index, hash_combine(self.stream, dimension))
        };
        to_unit(reverse(x))
    }

    #[inline(always)]
    fn is_on_screen(&self, dimension: u32) -> bool {
        dimension < SCREEN_DIMENSIONS && self.screen.equals(0) != Mask::MAX
    }

    #[inline(always)]
    fn screen_seed(&self, dimension: u32) -> Bits<S> {
        hash_combine(self.screen.shift_right(2 * LOG_BLOCK), dimension)
    }

    #[inline(always)]
    fn shift_at(&self, dimension: u32) -> Bits<S> {
        self.screen & (BLOCK_PIXELS - 1) | (dimension << (2 * LOG_BLOCK))
    }
}

#[inline(always)]
fn spread_bits<S: Simd>(x: Bits<S>) -> Bits<S> {
    let x = (x | x.shift_left(4)) & 0x0f0f;
    let x = (x | x.shift_left(2)) & 0x3333;
    (x | x.shift_left(1)) & 0x5555
}

#[inline(always)]
fn sobol_pair<S: Simd>(reversed_index: Bits<S>, seed: Bits<S>) -> [Bits<S>; 2] {
    let index = reverse(scramble(reversed_index, seed));
    let x = scramble(index, hash(seed ^ 0x68bc_21eb));
    [x, scramble(sobol_second_reversed(index), hash(seed ^ 0x02e5_be93))]
}

#[inline(always)]
fn van_der_corput<S: Simd>(reversed_index: Bits<S>, seed: Bits<S>) -> Bits<S> {
    scramble(reverse(scramble(reversed_index, seed)), hash(seed ^ 0x68bc_21eb))
}

#[inline(always)]
fn hash<S: Simd>(x: Bits<S>) -> Bits<S> {
    let x = (x ^ x.shift_right(16)) * 0x7feb_352d;
    let x = (x ^ x.shift_right(15)) * 0x846c_a68b;
    x ^ x.shift_right(16)
}

#[inline(always)]
fn hash_combine<S: Simd>(seed: Bits<S>, value: u32) -> Bits<S> {
    hash(seed * 0x9e37_79b1 + hash_u32(value ^ 0x5bd1_e995))
}

/// See [`super::hash_combine`].
#[inline(always)]
fn combine<S: Simd>(seed: Bits<S>, value: Bits<S>) -> Bits<S> {
    hash(seed * 0x9e37_79b1 + hash(value ^ 0x5bd1_e995))
}

#[inline(always)]
fn scramble<S: Simd>(reversed: Bits<S>, seed: Bits<S>) -> Bits<S> {
    let x = (reversed ^ (reversed * 0x3d20_adea)) + seed;
    let x = x * (seed.shift_right(16) | 1);
    let x = x ^ (x * 0x0552_6c56);
    x ^ (x * 0x53a2_2864)
}

#[inline(always)]
fn sobol_second_reversed<S: Simd>(index: Bits<S>) -> Bits<S> {
    let v = index ^ index.shift_right(16);
    let v = v ^ (v & 0xff00_ff00).shift_right(8);
    let v = v ^ (v & 0xf0f0_f0f0).shift_right(4);
    let v = v ^ (v & 0xcccc_cccc).shift_right(2);
    v ^ (v & 0xaaaa_aaaa).shift_right(1)
}

/// Bits back to front.
#[inline(always)]
fn reverse<S: Simd>(x: Bits<S>) -> Bits<S> {
    let x = x.shift_right(16) | x.shift_left(16);
    let x = (x & 0xff00_ff00).shift_right(8) | (x & 0x00ff_00ff).shift_left(8);
    let x = (x & 0xf0f0_f0f0).shift_right(4) | (x & 0x0f0f_0f0f).shift_left(4);
    let x = (x & 0xcccc_cccc).shift_right(2) | (x & 0x3333_3333).shift_left(2);
    (x & 0xaaaa_aaaa).shift_right(1) | (x & 0x5555_5555).shift_left(1)
}

#[inline(always)]
fn to_unit<S: Simd>(bits: Bits<S>) -> Float<S> {
    bits.shift_right(8).to_float() * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use firstlight_simd::{InstructionSet, LANES, dispatch};

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
            (SamplerLanes::of_pixels(s, 6, [x, y], sample), SamplerLanes::independent(s, 6, [x, y], sample));
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
