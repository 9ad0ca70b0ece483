//! The points of [`super::Sampler`], those of sixteen paths at a time, bit for bit.

use super::hash::hash_u32;
use crate::lanes::{Bits, Float, Simd};

/// The random numbers of sixteen samples.
#[derive(Clone, Copy)]
pub(crate) struct SamplerLanes<S: Simd> {
    pub stream: Bits<S>,
    pub reversed_index: Bits<S>,
}

impl<S: Simd> SamplerLanes<S> {
    /// See [`super::Sampler::pair`].
    #[inline(always)]
    pub fn pair(&self, dimension: u32) -> [Float<S>; 2] {
        let seed = hash_combine(self.stream, dimension);
        let index = reverse(scramble(self.reversed_index, seed));
        let x = scramble(index, hash(seed ^ 0x68bc_21eb));
        let y = scramble(sobol_second_reversed(index), hash(seed ^ 0x02e5_be93));
        [to_unit(reverse(x)), to_unit(reverse(y))]
    }

    /// See [`super::Sampler::single`].
    #[inline(always)]
    pub fn single(&self, dimension: u32) -> Float<S> {
        let seed = hash_combine(self.stream, dimension);
        let index = reverse(scramble(self.reversed_index, seed));
        to_unit(reverse(scramble(index, hash(seed ^ 0x68bc_21eb))))
    }
}

#[inline(always)]
fn hash<S: Simd>(x: Bits<S>) -> Bits<S> {
    let x = (x ^ x.shr(16)) * 0x7feb_352d;
    let x = (x ^ x.shr(15)) * 0x846c_a68b;
    x ^ x.shr(16)
}

#[inline(always)]
fn hash_combine<S: Simd>(seed: Bits<S>, value: u32) -> Bits<S> {
    hash(seed * 0x9e37_79b1 + hash_u32(value ^ 0x5bd1_e995))
}

impl<S: Simd> Bits<S> {
    /// See [`super::hash_combine`].
    #[inline(always)]
    pub fn hash_combine(self, value: Self) -> Self {
        hash(self * 0x9e37_79b1 + hash(value ^ 0x5bd1_e995))
    }
}

#[inline(always)]
fn scramble<S: Simd>(reversed: Bits<S>, seed: Bits<S>) -> Bits<S> {
    let x = (reversed ^ (reversed * 0x3d20_adea)) + seed;
    let x = x * (seed.shr(16) | 1);
    let x = x ^ (x * 0x0552_6c56);
    x ^ (x * 0x53a2_2864)
}

#[inline(always)]
fn sobol_second_reversed<S: Simd>(index: Bits<S>) -> Bits<S> {
    let v = index ^ index.shr(16);
    let v = v ^ (v & 0xff00_ff00).shr(8);
    let v = v ^ (v & 0xf0f0_f0f0).shr(4);
    let v = v ^ (v & 0xcccc_cccc).shr(2);
    v ^ (v & 0xaaaa_aaaa).shr(1)
}

/// Bits back to front.
#[inline(always)]
fn reverse<S: Simd>(x: Bits<S>) -> Bits<S> {
    let x = x.shr(16) | x.shl(16);
    let x = (x & 0xff00_ff00).shr(8) | (x & 0x00ff_00ff).shl(8);
    let x = (x & 0xf0f0_f0f0).shr(4) | (x & 0x0f0f_0f0f).shl(4);
    let x = (x & 0xcccc_cccc).shr(2) | (x & 0x3333_3333).shl(2);
    (x & 0xaaaa_aaaa).shr(1) | (x & 0x5555_5555).shl(1)
}

#[inline(always)]
fn to_unit<S: Simd>(bits: Bits<S>) -> Float<S> {
    bits.shr(8).to_float() * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{InstructionSet, LANES, dispatch};
    use crate::sampling::Sampler;

    #[inline(always)]
    fn draw<S: Simd>(s: S, samplers: &[Sampler; LANES], dimension: u32, out: &mut [[f32; LANES]; 3]) {
        let stream = Bits::load(s, &samplers.map(|sampler| sampler.parts()[0]));
        let reversed_index = Bits::load(s, &samplers.map(|sampler| sampler.parts()[1]));
        let lanes = SamplerLanes { stream, reversed_index };
        let [x, y] = lanes.pair(dimension);
        x.store(&mut out[0]);
        y.store(&mut out[1]);
        lanes.single(dimension).store(&mut out[2]);
    }

    #[test]
    fn lanes_draw_the_same_bits() {
        for i in 0..1000 {
            let samplers: [Sampler; LANES] =
                std::array::from_fn(|k| Sampler::new(5, i, k as u32, hash_u32(i) >> (k % 32)));
            for set in InstructionSet::available() {
                let mut out = [[0.0; LANES]; 3];
                let (samplers, to) = (&samplers, &mut out);
                dispatch!(set, draw(samplers: &[Sampler; LANES], i: u32, to: &mut [[f32; LANES]; 3]));
                for (k, sampler) in samplers.iter().enumerate() {
                    let pair = sampler.pair(i);
                    assert_eq!([pair.x, pair.y, sampler.single(i)], out.map(|numbers| numbers[k]), "{set:?}");
                }
            }
        }
    }
}
