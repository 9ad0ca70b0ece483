//! Sixteen pixels as bytes.

use firstlight_simd::{Bits, Simd};

/// Writes the first pixels, as many as fit; red is the lowest byte.
#[inline(always)]
pub(super) fn write_pixels<S: Simd>(pixels: Bits<S>, rgba: &mut [u8]) {
    for (pixel, to) in pixels.to_array().iter().zip(rgba.chunks_exact_mut(4)) {
        to.copy_from_slice(&pixel.to_le_bytes());
    }
}
