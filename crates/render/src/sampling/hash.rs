//! Integer hashes: the only source of randomness.

/// A bijection of 32-bit numbers without visible structure ("lowbias32", Wellons 2018, exact bias 0.174).
#[inline]
pub const fn hash_u32(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Mixes `value` into `seed`; the order of the two matters.
#[inline]
pub const fn hash_combine(seed: u32, value: u32) -> u32 {
    hash_u32(seed.wrapping_mul(0x9e37_79b1).wrapping_add(hash_u32(value ^ 0x5bd1_e995)))
}
