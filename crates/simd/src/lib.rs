//! Sixteen-lane SIMD: the operations of each instruction set, and number and vector types with operators.
//!
//! [`Simd`] is the interface of an instruction set; [`Float`], [`Bits`] and [`Vector`] add operators. Code is generic
//! over `S: Simd`, `#[inline(always)]` throughout, and compiled once per set by [`dispatch`]. No set contracts or
//! approximates operations that another does not: all give the same bits.
//!
//! A formula is written once, generic over [`Real`], [`Word`] and [`Vector3`]: with `f32` it is the code for one point,
//! with [`Float`] the code for sixteen.

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
pub use simd::{Kernel, LANES, Mask, Portable, SET_BITS, Simd};
pub use vector::{Vector, Vector3, frame_around, select_vector};
pub use word::Word;

/// Evaluates an expression for 0, 1 and 2 and returns the array.
///
/// It is expanded inline, whereas a closure passed to `array::map` may be compiled as a separate function without the
/// target features of its caller, and then each of its operations would be a call.
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

/// Like [`three!`], for 0 and 1.
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
