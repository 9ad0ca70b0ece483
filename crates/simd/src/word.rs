//! Integers that formulas are generic over: one `u32` or sixteen; see [`Real`].

use super::number::{Bits, Float};
use super::real::{Real, Truth};
use super::simd::{Mask, Simd};
use std::ops::{BitAnd, BitOr, BitXor};

/// One 32-bit number or sixteen; sums and products are modulo 2³².
pub trait Word:
    Copy
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + BitAnd<u32, Output = Self>
    + BitOr<u32, Output = Self>
    + BitXor<u32, Output = Self>
{
    /// Result of a comparison: `bool` for one number, [`Mask`] for sixteen.
    type Mask: Truth;
    /// The type of converted numbers: `f32`, or [`Float`].
    type Real: Real;

    /// The same number in all lanes.
    fn all(self, x: u32) -> Self;

    /// `self + other` modulo 2³².
    fn plus(self, other: Self) -> Self;

    /// `self · other` modulo 2³².
    fn times(self, other: Self) -> Self;

    /// `self << bits`, for `bits` below 32; shifts in zeros.
    fn shift_left(self, bits: u32) -> Self;

    /// `self >> bits`, for `bits` below 32; shifts in zeros.
    fn shift_right(self, bits: u32) -> Self;

    /// The bits in reversed order.
    fn reversed(self) -> Self;

    /// Whether the number is equal to `x`.
    fn equals(self, x: u32) -> Self::Mask;

    /// Looks up table entries; the index must be in range.
    fn gather(from: &[u32], index: Self) -> Self;

    /// Converts numbers below 2³¹ to floating point, rounded.
    fn to_real(self) -> Self::Real;

    /// `self · x` modulo 2³², with the same `x` in all lanes.
    #[inline(always)]
    fn times_all(self, x: u32) -> Self {
        self.times(self.all(x))
    }
}

impl Word for u32 {
    type Mask = bool;
    type Real = f32;

    #[inline(always)]
    fn all(self, x: u32) -> Self {
        x
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self.wrapping_add(other)
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        self.wrapping_mul(other)
    }

    #[inline(always)]
    fn shift_left(self, bits: u32) -> Self {
        self << bits
    }

    #[inline(always)]
    fn shift_right(self, bits: u32) -> Self {
        self >> bits
    }

    #[inline(always)]
    fn reversed(self) -> Self {
        self.reverse_bits()
    }

    #[inline(always)]
    fn equals(self, x: u32) -> bool {
        self == x
    }

    #[inline(always)]
    fn gather(from: &[u32], index: Self) -> Self {
        from[index as usize]
    }

    #[inline(always)]
    fn to_real(self) -> f32 {
        self as i32 as f32
    }
}

impl<S: Simd> Word for Bits<S> {
    type Mask = Mask;
    type Real = Float<S>;

    #[inline(always)]
    fn all(self, x: u32) -> Self {
        Self::splat(self.s, x)
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        self * other
    }

    #[inline(always)]
    fn shift_left(self, bits: u32) -> Self {
        Self { s: self.s, v: self.s.shl_u(self.v, bits) }
    }

    #[inline(always)]
    fn shift_right(self, bits: u32) -> Self {
        Self { s: self.s, v: self.s.shr_u(self.v, bits) }
    }

    #[inline(always)]
    fn reversed(self) -> Self {
        let x = self.shift_right(16) | self.shift_left(16);
        let x = (x & 0xff00_ff00).shift_right(8) | (x & 0x00ff_00ff).shift_left(8);
        let x = (x & 0xf0f0_f0f0).shift_right(4) | (x & 0x0f0f_0f0f).shift_left(4);
        let x = (x & 0xcccc_cccc).shift_right(2) | (x & 0x3333_3333).shift_left(2);
        (x & 0xaaaa_aaaa).shift_right(1) | (x & 0x5555_5555).shift_left(1)
    }

    #[inline(always)]
    fn equals(self, x: u32) -> Mask {
        Bits::equals(self, x)
    }

    #[inline(always)]
    fn gather(from: &[u32], index: Self) -> Self {
        Bits::gather(from, index)
    }

    #[inline(always)]
    fn to_real(self) -> Float<S> {
        self.to_float()
    }
}
