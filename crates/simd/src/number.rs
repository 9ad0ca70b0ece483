//! Sixteen `f32` or `u32` with operators.

use super::real::Real;
use super::simd::{LANES, Mask, Simd};
use std::ops::{Add, AddAssign, BitAnd, BitOr, BitXor, Div, Mul, Neg, Sub};

/// Sixteen `f32`.
#[derive(Clone, Copy)]
pub struct Float<S: Simd> {
    /// Instruction set that operates on the lanes.
    pub s: S,
    /// The sixteen lanes, in a type of the instruction set.
    pub v: S::F,
}

/// Sixteen `u32`; sums and products are modulo 2³².
#[derive(Clone, Copy)]
pub struct Bits<S: Simd> {
    /// Instruction set that operates on the lanes.
    pub s: S,
    /// The sixteen lanes, in a type of the instruction set.
    pub v: S::U,
}

/// Pads a table to a multiple of sixteen entries, which [`Float::gather`] reads fastest.
pub fn padded<T: Copy + Default>(mut table: Vec<T>) -> Vec<T> {
    table.resize(table.len().next_multiple_of(LANES).max(LANES), T::default());
    table
}

impl<S: Simd> Float<S> {
    /// `x` in all lanes.
    #[inline(always)]
    pub fn splat(s: S, x: f32) -> Self {
        Self { s, v: s.splat(x) }
    }

    /// One lane per entry of the array, in order.
    #[inline(always)]
    pub fn load(s: S, from: &[f32; LANES]) -> Self {
        Self { s, v: s.load(from) }
    }

    /// Writes the lanes to an array, in order.
    #[inline(always)]
    pub fn store(self, to: &mut [f32; LANES]) {
        self.s.store(self.v, to);
    }

    /// The lanes as an array, in order.
    #[inline(always)]
    pub fn to_array(self) -> [f32; LANES] {
        let mut array = [0.0; LANES];
        self.store(&mut array);
        array
    }

    /// Looks up an entry per lane; see [`Simd::gather`].
    #[inline(always)]
    pub fn gather(from: &[f32], indices: Bits<S>) -> Self {
        Self { s: indices.s, v: indices.s.gather(from, indices.v) }
    }

    /// The IEEE 754 bits of each lane.
    #[inline(always)]
    pub fn to_bits(self) -> Bits<S> {
        Bits { s: self.s, v: self.s.to_bits(self.v) }
    }

    /// Rounds towards zero; the result must be within the range of `i32`.
    #[inline(always)]
    pub fn truncate(self) -> Bits<S> {
        Bits { s: self.s, v: self.s.truncate(self.v) }
    }

    /// Moves the lanes with their bit set to the front, in order; what follows them is unspecified.
    #[inline(always)]
    pub fn compress(self, mask: Mask) -> Self {
        Self { s: self.s, v: self.s.compress(mask, self.v) }
    }
}

impl<S: Simd> Real for Float<S> {
    type Mask = Mask;

    #[inline(always)]
    fn all(self, x: f32) -> Self {
        Self::splat(self.s, x)
    }

    #[inline(always)]
    fn choose(mask: Mask, a: Self, b: Self) -> Self {
        Self { s: a.s, v: a.s.select(mask, a.v, b.v) }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self { s: self.s, v: self.s.sqrt(self.v) }
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self { s: self.s, v: self.s.abs(self.v) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self { s: self.s, v: self.s.min(self.v, other.v) }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self { s: self.s, v: self.s.max(self.v, other.v) }
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        (self.abs().to_bits() | (sign.to_bits() & (1 << 31))).as_float()
    }

    #[inline(always)]
    fn lt(self, other: Self) -> Mask {
        self.s.lt(self.v, other.v)
    }

    #[inline(always)]
    fn le(self, other: Self) -> Mask {
        self.s.le(self.v, other.v)
    }

    #[inline(always)]
    fn equals(self, other: Self) -> Mask {
        self.s.eq(self.v, other.v)
    }

    #[inline(always)]
    fn whole(self) -> Self {
        self.truncate().to_float()
    }

    #[inline(always)]
    fn entry_of(self, table: &[f32]) -> Self {
        Self::gather(table, self.truncate())
    }

    #[inline(always)]
    fn each<const N: usize>(mask: Mask, of: [Self; N], f: impl Fn([f32; N]) -> f32) -> Self {
        let (mut arrays, mut found) = ([[0.0; LANES]; N], [0.0; LANES]);
        arrays.iter_mut().zip(&of).for_each(|(array, number)| number.store(array));
        for (lane, found) in found.iter_mut().enumerate().filter(|(lane, _)| mask >> lane & 1 != 0) {
            *found = f(arrays.map(|array| array[lane]));
        }
        Self::load(of[0].s, &found)
    }
}

impl<S: Simd> Bits<S> {
    /// `x` in all lanes.
    #[inline(always)]
    pub fn splat(s: S, x: u32) -> Self {
        Self { s, v: s.splat_u(x) }
    }

    /// One lane per entry of the array, in order.
    #[inline(always)]
    pub fn load(s: S, from: &[u32; LANES]) -> Self {
        Self { s, v: s.load_u(from) }
    }

    /// Writes the lanes to an array, in order.
    #[inline(always)]
    pub fn store(self, to: &mut [u32; LANES]) {
        self.s.store_u(self.v, to);
    }

    /// The lanes as an array, in order.
    #[inline(always)]
    pub fn to_array(self) -> [u32; LANES] {
        let mut array = [0; LANES];
        self.store(&mut array);
        array
    }

    /// Looks up an entry per lane; see [`Simd::gather`].
    #[inline(always)]
    pub fn gather(from: &[u32], indices: Self) -> Self {
        Self { s: indices.s, v: indices.s.gather_u(from, indices.v) }
    }

    /// Lanes that are equal to `x`.
    #[inline(always)]
    pub fn equals(self, x: u32) -> Mask {
        self.s.eq_u(self.v, self.s.splat_u(x))
    }

    /// Lanes with any of these bits set.
    #[inline(always)]
    pub fn has(self, bits: u32) -> Mask {
        !(self & Self::splat(self.s, bits)).equals(0)
    }

    /// Reinterprets the bits as `f32`.
    #[inline(always)]
    pub fn as_float(self) -> Float<S> {
        Float { s: self.s, v: self.s.float_of(self.v) }
    }

    /// Converts numbers below 2³¹ to `f32`, rounded.
    #[inline(always)]
    pub fn to_float(self) -> Float<S> {
        Float { s: self.s, v: self.s.to_f(self.v) }
    }

    /// Moves the lanes with their bit set to the front, in order; what follows them is unspecified.
    #[inline(always)]
    pub fn compress(self, mask: Mask) -> Self {
        Self { s: self.s, v: self.s.compress_u(mask, self.v) }
    }
}

macro_rules! operators {
    ($kind:ident, $plain:ty: $($trait:ident $method:ident $operation:ident),*) => {
        $(impl<S: Simd> $trait for $kind<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self { s: self.s, v: self.s.$operation(self.v, other.v) }
            }
        }
        impl<S: Simd> $trait<$plain> for $kind<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: $plain) -> Self {
                self.$method(Self::splat(self.s, other))
            }
        })*
    };
}

operators!(Float, f32: Add add add, Sub sub sub, Mul mul mul, Div div div);
operators!(Bits, u32: Add add add_u, Mul mul mul_u, BitAnd bitand and_u, BitOr bitor or_u, BitXor bitxor xor_u);

impl<S: Simd> AddAssign for Float<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Simd> Neg for Float<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        (self.to_bits() ^ (1 << 31)).as_float()
    }
}
