//! Integer hashes, the only source of randomness; for one number or sixteen.

use firstlight_simd::Word;

/// A bijection of 32-bit numbers without visible structure ("lowbias32", Wellons 2018, exact bias 0.174).
#[inline(always)]
pub fn hash_u32<W: Word>(x: W) -> W {
    let x = (x ^ x.shift_right(16)).times_all(0x7feb_352d);
    let x = (x ^ x.shift_right(15)).times_all(0x846c_a68b);
    x ^ x.shift_right(16)
}

/// Mixes `value` into `seed`; the order of the two matters.
#[inline(always)]
pub fn hash_combine<W: Word>(seed: W, value: W) -> W {
    mix(seed, hash_u32(value ^ FLIP))
}

/// Like [`hash_combine`], with one `value` for all lanes.
#[inline(always)]
pub(super) fn hash_combine_all<W: Word>(seed: W, value: u32) -> W {
    mix(seed, seed.all(hash_u32(value ^ FLIP)))
}

const FLIP: u32 = 0x5bd1_e995;

#[inline(always)]
fn mix<W: Word>(seed: W, hashed: W) -> W {
    hash_u32(seed.times_all(0x9e37_79b1).plus(hashed))
}
