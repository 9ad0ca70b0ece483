//! Sixteen numbers at a time: the operations of each instruction set, and numbers and vectors that read like plain ones.
//!
//! [`Simd`] is what a processor can do; [`Float`], [`Bits`] and [`Vector`] give it operators. Code is generic over
//! `S: Simd`, `#[inline(always)]` all the way down, and compiled once a set by [`dispatch`]. Nothing is contracted or
//! approximated differently from one set to the next: all give the same bits.
//!
//! A formula is written once, generic over [`Real`], [`Word`] and [`Vector3`]: with `f32` it is the code for one point, with
//! [`Float`] that for sixteen.

mod math;
mod number;
mod real;
mod simd;
mod vector;
mod word;

pub use math::{Elementary, sin_cos_eighth};
pub use number::{Bits, Float, padded};
pub use real::{Real, Truth, select};
pub use simd::InstructionSet;
#[cfg(target_arch = "x86_64")]
pub use simd::{Avx2, Avx512};
pub use simd::{Kernel, LANES, Mask, Portable, Simd};
pub use vector::{Vector, Vector3, frame_around, select_vector};
pub use word::Word;

/// The array of an expression for 0, 1 and 2.
///
/// Written out, where a closure given to `array::map` may end up as a function of its own: compiled without the
/// instructions of its caller, it would call each of them.
#[macro_export]
macro_rules! three {
    (|$k:ident| $of:expr) => {
        [
            {
                let $k: usize = 0;
                $of
            },
            {
                let $k: usize = 1;
                $of
            },
            {
                let $k: usize = 2;
                $of
            },
        ]
    };
}

/// The same for 0 and 1.
#[macro_export]
macro_rules! two {
    (|$k:ident| $of:expr) => {
        [
            {
                let $k: usize = 0;
                $of
            },
            {
                let $k: usize = 1;
                $of
            },
        ]
    };
}
