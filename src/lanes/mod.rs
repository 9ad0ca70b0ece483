//! Sixteen numbers at a time: the operations of each instruction set, and numbers and vectors that read like plain ones.
//!
//! [`Simd`] is what a processor can do; [`Float`], [`Bits`] and [`Vector`] give it operators. Code is generic over
//! `S: Simd`, `#[inline(always)]` all the way down, and compiled once a set by [`dispatch`]. Nothing is contracted or
//! approximated differently from one set to the next: all give the same bits.

mod math;
mod number;
mod simd;
mod vector;

pub(crate) use math::{atan2, sin_cos, sin_cos_eighth};
pub(crate) use number::{Bits, Float, padded, select};
pub use simd::InstructionSet;
#[cfg(target_arch = "x86_64")]
pub(crate) use simd::{Avx2, Avx512};
pub(crate) use simd::{LANES, Mask, Portable, Simd, dispatch};
pub(crate) use vector::{Vector, frame_around, select_vector};
