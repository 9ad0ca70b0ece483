//! Numbers that formulas are generic over: one `f32` or sixteen.
//!
//! Code that is generic over [`Real`] is `#[inline(always)]` throughout, like all sixteen-lane code. With `f32` it is
//! the scalar code, which is the reference of tests for the SIMD code.

use super::simd::Mask;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, BitAnd, BitAndAssign, BitOr, BitOrAssign, Div, Mul, Neg, Not, Sub};

/// Result of a comparison: a `bool`, or one bit per lane.
pub trait Truth:
    Copy
    + Debug
    + PartialEq
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + Not<Output = Self>
    + BitAndAssign
    + BitOrAssign
{
    /// Whether it is true in any lane.
    fn any(self) -> bool;
}

/// One number or sixteen. All operations round according to IEEE 754, so each of the sixteen lanes agrees with scalar
/// code to the last bit; functions that do not agree are in [`crate::Elementary`].
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + Add<f32, Output = Self>
    + Sub<f32, Output = Self>
    + Mul<f32, Output = Self>
    + Div<f32, Output = Self>
{
    /// Result of a comparison: `bool` for one number, [`Mask`] for sixteen.
    type Mask: Truth;

    /// The same number in all lanes.
    fn all(self, x: f32) -> Self;

    /// `a` where the mask is true, else `b`; see [`select`].
    fn choose(mask: Self::Mask, a: Self, b: Self) -> Self;

    /// Square root, rounded to nearest; NaN for negative numbers.
    fn sqrt(self) -> Self;

    /// Absolute value, with the sign bit cleared.
    fn abs(self) -> Self;

    /// The smaller of the two; `other` if either is NaN.
    fn min(self, other: Self) -> Self;

    /// The larger of the two; `other` if either is NaN.
    fn max(self, other: Self) -> Self;

    /// The magnitude of `self` with the sign bit of `sign`.
    fn copysign(self, sign: Self) -> Self;

    /// Whether `self < other`; false if either is NaN.
    fn lt(self, other: Self) -> Self::Mask;

    /// Whether `self <= other`; false if either is NaN.
    fn le(self, other: Self) -> Self::Mask;

    /// Whether `self == other`; false if either is NaN.
    fn equals(self, other: Self) -> Self::Mask;

    /// Rounds towards zero, for numbers within the range of `i32`; the sign of zero may differ.
    fn whole(self) -> Self;

    /// The entry of a table at this index, a whole number; all lanes must be in range, or their entry is unspecified.
    fn entry_of(self, table: &[f32]) -> Self;

    /// Applies a function to each lane of the mask, for what has no formula for sixteen; other lanes are 0.
    fn each<const N: usize>(mask: Self::Mask, of: [Self; N], f: impl Fn([f32; N]) -> f32) -> Self;

    /// The larger of `self` and `least`; `least` for NaN.
    #[inline(always)]
    fn at_least(self, least: f32) -> Self {
        self.max(self.all(least))
    }

    /// The smaller of `self` and `most`; `most` for NaN.
    #[inline(always)]
    fn at_most(self, most: f32) -> Self {
        self.min(self.all(most))
    }

    /// Whether the number is greater than zero; false for NaN.
    #[inline(always)]
    fn is_positive(self) -> Self::Mask {
        self.all(0.0).lt(self)
    }

    /// Whether the number is less than zero; false for −0 and NaN.
    #[inline(always)]
    fn is_negative(self) -> Self::Mask {
        self.lt(self.all(0.0))
    }

    /// Whether the number is 0 or −0.
    #[inline(always)]
    fn is_zero(self) -> Self::Mask {
        self.equals(self.all(0.0))
    }

    /// Whether the number is NaN.
    #[inline(always)]
    fn is_nan(self) -> Self::Mask {
        !self.equals(self)
    }
}

/// `a` where the mask is true, else `b`.
#[inline(always)]
pub fn select<R: Real>(mask: R::Mask, a: R, b: R) -> R {
    R::choose(mask, a, b)
}

impl Truth for bool {
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

impl Truth for Mask {
    #[inline(always)]
    fn any(self) -> bool {
        self != 0
    }
}

impl Real for f32 {
    type Mask = bool;

    #[inline(always)]
    fn all(self, x: f32) -> Self {
        x
    }

    #[inline(always)]
    fn choose(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        f32::copysign(self, sign)
    }

    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn equals(self, other: Self) -> bool {
        self == other
    }

    #[inline(always)]
    fn whole(self) -> Self {
        self as i32 as f32
    }

    #[inline(always)]
    fn entry_of(self, table: &[f32]) -> Self {
        table[self as usize]
    }

    #[inline(always)]
    fn each<const N: usize>(mask: bool, of: [Self; N], f: impl Fn([f32; N]) -> f32) -> Self {
        if mask { f(of) } else { 0.0 }
    }
}
