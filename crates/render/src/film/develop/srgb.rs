//! The sRGB transfer function (IEC 61966-2-1).

use firstlight_simd::{Bits, Float, Real, Simd, Word};
use std::sync::OnceLock;

/// Bits of a number below the first threshold between two bytes: everything below it is encoded as 0.
const LEAST: u32 = (127 - 13) << 23;
/// Numbers that share sign, exponent and 8 bits of the mantissa share an entry.
const SHIFT: u32 = 15;
const ENTRIES: usize = (((127 << 23) - LEAST) >> SHIFT) as usize + 1;

/// Bytes of all numbers in 0..1: the curve is so flat that at most one threshold between two bytes lies within the
/// numbers of an entry.
struct Table {
    /// The byte of the smallest number of an entry.
    bytes: [u32; ENTRIES],
    /// Threshold from which on the next byte applies.
    borders: [f32; ENTRIES],
}

fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| {
        // Thresholds: the smallest number that is nearer to a byte than to the one before it.
        let borders: Vec<f32> = (1..256).map(|byte| decode_srgb((f64::from(byte) - 0.5) / 255.0) as f32).collect();
        let first = |i: usize| f32::from_bits(LEAST + ((i as u32) << SHIFT));
        let byte = |x: f32| borders.partition_point(|&border| border <= x);
        Table {
            bytes: std::array::from_fn(|i| byte(first(i)) as u32),
            borders: std::array::from_fn(|i| borders.get(byte(first(i))).copied().unwrap_or(f32::INFINITY)),
        }
    })
}

/// Encodes linear light as sRGB, rounded exactly to the nearest of 256 values. Clamps to 0..1; NaN becomes 0.
#[inline]
pub fn encode_srgb(linear: f32) -> u8 {
    let table = table();
    let x = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    let i = (x.to_bits().max(LEAST) - LEAST) >> SHIFT;
    (table.bytes[i as usize] + u32::from(x >= table.borders[i as usize])) as u8
}

/// Like [`encode_srgb`], for sixteen numbers.
pub(crate) struct Encoder<S: Simd> {
    s: S,
    table: &'static Table,
}

impl<S: Simd> Encoder<S> {
    #[inline(always)]
    pub fn new(s: S) -> Self {
        Self { s, table: table() }
    }

    /// See [`encode_srgb`].
    #[inline(always)]
    pub fn encode(&self, linear: Float<S>) -> Bits<S> {
        let s = self.s;
        // Clamped to the table's smallest number before its bits are taken; all numbers up to it are encoded as 0.
        let x = linear.at_least(f32::from_bits(LEAST)).at_most(1.0);
        let i = (x.to_bits() + LEAST.wrapping_neg()).shift_right(SHIFT);
        let byte = Bits::gather(&self.table.bytes, i);
        let stays = x.lt(Float::gather(&self.table.borders, i));
        Bits { s, v: s.select_u(stays, byte.v, (byte + 1).v) }
    }
}

/// Inverse of the sRGB transfer function, 0..1 to 0..1.
pub fn decode_srgb(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_rounds_to_the_nearest_byte() {
        let table = table();
        // No entry contains two thresholds.
        assert!((1..ENTRIES).all(|i| table.bytes[i] - table.bytes[i - 1] <= 1));
        let near_borders = (1..256).flat_map(|byte| {
            let border = (decode_srgb((f64::from(byte) - 0.5) / 255.0) as f32).to_bits();
            (border - 2..border + 3).map(f32::from_bits)
        });
        for x in (0..200_000).map(|i| i as f32 / 199_999.0).chain(near_borders) {
            let exact = f64::from(x);
            let encoded =
                if exact <= 0.003_130_8 { 12.92 * exact } else { 1.055 * exact.powf(1.0 / 2.4) - 0.055 } * 255.0;
            let byte = f64::from(encode_srgb(x));
            assert!((byte - encoded).abs() <= 0.5 + 1e-3, "{x}: {byte} for {encoded}");
        }
        assert_eq!((encode_srgb(-1.0), encode_srgb(7.0), encode_srgb(f32::NAN)), (0, 255, 0));
        assert!((0..=255).all(|b| encode_srgb(decode_srgb(f64::from(b) / 255.0) as f32) == b));
    }
}
