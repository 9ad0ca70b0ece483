//! Bilinear scaling of RGBA images, for previews during motion.

use crate::film::develop::pixels::write_pixels;
use firstlight_simd::{Bits, InstructionSet, LANES, Simd, Word, dispatch, padded};
use rayon::prelude::*;

/// Scales from one size (width, height in pixels) to another; both images have four bytes per pixel.
pub fn scale(set: InstructionSet, from: &[u8], from_size: [u32; 2], to_size: [u32; 2], to: &mut [u8]) {
    let ([from_width, from_height], [width, height]) = (from_size, to_size);
    let columns = PixelColumns::new(width, from_width);
    let stride = 4 * from_width as usize;
    to.par_chunks_exact_mut(4 * width as usize).enumerate().for_each_init(Vec::new, |mixed, (y, to)| {
        let tap = Tap::new(y as u32, height, from_height);
        let row = |y: u32| &from[y as usize * stride..][..stride];
        mixed.resize((from_width as usize).next_multiple_of(LANES), 0);
        for ((mixed, above), below) in mixed.iter_mut().zip(row(tap.low).chunks(4)).zip(row(tap.high).chunks(4)) {
            let pixel = |bytes: &[u8]| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            *mixed = mix(pixel(above), pixel(below), tap.weight);
        }
        columns.scale_row(set, mixed, to);
    });
}

/// Two neighbours and the weight of the second, 0..=256.
struct Tap {
    low: u32,
    high: u32,
    weight: u32,
}

impl Tap {
    /// Returns the tap for pixel centre `i` of `n` in a row of `n_source` pixels.
    fn new(i: u32, n: u32, n_source: u32) -> Self {
        let position = ((f64::from(i) + 0.5) * f64::from(n_source) / f64::from(n) - 0.5).max(0.0);
        let low = (position as u32).min(n_source - 1);
        let weight = ((position - f64::from(low)) * 256.0) as u32;
        Self { low, high: (low + 1).min(n_source - 1), weight: weight.min(256) }
    }
}

/// Mask of bytes 0 and 2 of a pixel, with space above each.
const EVEN: u32 = 0x00ff_00ff;
/// Half a unit for each of them, so that sums are rounded.
const HALF: u32 = 0x0080_0080;

/// Mixes all four bytes; `weight` of `b`, 0..=256.
fn mix(a: u32, b: u32, weight: u32) -> u32 {
    let mix_even = |a: u32, b: u32| (((a & EVEN) * (256 - weight) + (b & EVEN) * weight + HALF) >> 8) & EVEN;
    mix_even(a, b) | mix_even(a >> 8, b >> 8) << 8
}

/// The taps of a row, one list per field, padded to a multiple of sixteen.
struct PixelColumns {
    low: Vec<u32>,
    high: Vec<u32>,
    weight: Vec<u32>,
}

impl PixelColumns {
    fn new(n: u32, n_source: u32) -> Self {
        let list = |of: fn(Tap) -> u32| padded((0..n).map(|i| of(Tap::new(i, n, n_source))).collect());
        Self { low: list(|tap| tap.low), high: list(|tap| tap.high), weight: list(|tap| tap.weight) }
    }

    /// - `from`: pixels, padded to a multiple of sixteen.
    fn scale_row(&self, set: InstructionSet, from: &[u32], to: &mut [u8]) {
        let columns = self;
        dispatch!(set, scale_row(columns: &PixelColumns, from: &[u32], to: &mut [u8]));
    }
}

#[inline(always)]
fn scale_row<S: Simd>(s: S, columns: &PixelColumns, from: &[u32], to: &mut [u8]) {
    let lists = columns.low.chunks_exact(LANES).zip(columns.high.chunks_exact(LANES));
    for (((low, high), weight), to) in lists.zip(columns.weight.chunks_exact(LANES)).zip(to.chunks_mut(4 * LANES)) {
        let [low, high, weight] = [load(s, low), load(s, high), load(s, weight)];
        let rest = (weight ^ u32::MAX) + 257;
        let (a, b) = (Bits::gather(from, low), Bits::gather(from, high));
        let even = ((a & EVEN) * rest + (b & EVEN) * weight + HALF).shift_right(8) & EVEN;
        let odd = ((a.shift_right(8) & EVEN) * rest + (b.shift_right(8) & EVEN) * weight + HALF).shift_right(8) & EVEN;
        write_pixels(even | odd.shift_left(8), to);
    }
}

#[inline(always)]
fn load<S: Simd>(s: S, list: &[u32]) -> Bits<S> {
    Bits::load(s, list.first_chunk().expect("chunks are of sixteen"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_mixed_of_its_neighbours_as_plain_numbers_say() {
        let sizes =
            [([1, 1], [5, 3]), ([7, 3], [50, 31]), ([40, 30], [129, 90]), ([33, 17], [20, 9]), ([6, 5], [6, 5])];
        for (from_size @ [from_width, from_height], to_size @ [width, height]) in sizes {
            let from: Vec<u8> = (0..4 * from_width * from_height).map(|i| (i * 97 % 251) as u8).collect();
            let at = |x: f64, y: f64, c: u32| {
                let (x, y) = (x.min(f64::from(from_width - 1)) as u32, y.min(f64::from(from_height - 1)) as u32);
                f64::from(from[(4 * (y * from_width + x) + c) as usize])
            };
            for set in InstructionSet::available() {
                let mut to = vec![0; (4 * width * height) as usize];
                scale(set, &from, from_size, to_size, &mut to);
                for (i, byte) in (0..).zip(&to) {
                    let (x, y, c) = (i / 4 % width, i / 4 / width, i % 4);
                    let place = |i: u32, n: u32, n_source: u32| {
                        ((f64::from(i) + 0.5) * f64::from(n_source) / f64::from(n) - 0.5).max(0.0)
                    };
                    let (u, v) = (place(x, width, from_width), place(y, height, from_height));
                    let (fx, fy) = (u.fract(), v.fract());
                    let above = at(u, v, c) * (1.0 - fx) + at(u + 1.0, v, c) * fx;
                    let below = at(u, v + 1.0, c) * (1.0 - fx) + at(u + 1.0, v + 1.0, c) * fx;
                    let expected = above * (1.0 - fy) + below * fy;
                    // Rounded to a byte twice, and weights to 1/256.
                    assert!(
                        (f64::from(*byte) - expected).abs() <= 3.0,
                        "{set:?} {from_size:?} {to_size:?} {x} {y} {c}"
                    );
                }
                if from_size == to_size {
                    assert_eq!(to, from);
                }
            }
        }
    }
}
