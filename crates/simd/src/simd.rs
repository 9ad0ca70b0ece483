//! The [`Simd`] trait and its implementations: AVX-512, AVX2 and portable arrays.
//!
//! Kernels are generic over [`Simd`] and compiled once per implementation inside a function that enables its
//! instructions; [`InstructionSet::detect`] selects one on first use. All operations round like the scalar ones,
//! nothing is contracted or approximated, so all builds give the same bits. The exceptions are the three operations
//! whose name ends in `about`, which only serve to decide what need not be computed.

use std::sync::OnceLock;

/// Number of lanes.
pub const LANES: usize = 16;

/// One bit per lane.
pub type Mask = u16;

/// An instruction set with sixteen lanes.
///
/// Implementations must be called from functions compiled for their instruction set, or they are slow. Values must not
/// be created unless the processor supports the set.
///
/// Comparisons with NaN are false; `min` and `max` return the second argument if either is NaN.
pub trait Simd: Copy {
    /// 16 `f32`.
    type F: Copy;
    /// 16 `u32`.
    type U: Copy;
    /// 16 `f64`.
    type D: Copy;

    /// Runs a kernel as a separate function, compiled once for the instruction set, however many call sites it has.
    fn call<K: Kernel<Self>>(self, kernel: K) -> K::Output;

    /// `x` in all lanes.
    fn splat(self, x: f32) -> Self::F;
    /// One lane per entry of the array, in order.
    fn load(self, from: &[f32; LANES]) -> Self::F;
    /// Writes the lanes to an array, in order.
    fn store(self, a: Self::F, to: &mut [f32; LANES]);
    /// `a + b`.
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a - b`.
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a · b`.
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a / b`.
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// The smaller of the two; `b` if either is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// The larger of the two; `b` if either is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// Absolute value, with the sign bit cleared.
    fn abs(self, a: Self::F) -> Self::F;
    /// `a · b - c`, rounded once.
    fn mul_sub(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `c - a · b`, rounded once.
    fn neg_mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `a · b + c`, rounded once or twice, whichever is fastest: for bounds only, since the bits depend on the build.
    fn mul_add_about(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `c - a · b`, rounded like [`mul_add_about`](Self::mul_add_about).
    fn neg_mul_add_about(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `1 / a` with relative error below 2⁻²², for bounds only. NaN or infinite if `a` is 0 or subnormal.
    fn reciprocal_about(self, a: Self::F) -> Self::F;
    /// Lanes whose sign bit is set.
    fn negative(self, a: Self::F) -> Mask;
    /// Lanes where `a < b`.
    fn lt(self, a: Self::F, b: Self::F) -> Mask;
    /// Lanes where `a <= b`.
    fn le(self, a: Self::F, b: Self::F) -> Mask;
    /// Lanes where `a == b`.
    fn eq(self, a: Self::F, b: Self::F) -> Mask;
    /// `a` where the bit is set, else `b`.
    fn select(self, mask: Mask, a: Self::F, b: Self::F) -> Self::F;
    /// The minimum over the lanes with their bit set, which must not be NaN.
    fn least(self, mask: Mask, a: Self::F) -> f32;
    /// The coordinate of the point that each lane selects by axis.
    fn pick(self, point: &[f32; 4], axes: Self::U) -> Self::F;
    /// Looks up table entries by the low four bits of the indices.
    fn lookup(self, table: Self::F, indices: Self::U) -> Self::F;

    /// `x` in all lanes.
    fn splat_u(self, x: u32) -> Self::U;
    /// One lane per entry of the array, in order.
    fn load_u(self, from: &[u32; LANES]) -> Self::U;
    /// One lane per byte of the array, in order.
    fn load_bytes(self, from: &[u8; LANES]) -> Self::U;
    /// Writes the lanes to an array, in order.
    fn store_u(self, a: Self::U, to: &mut [u32; LANES]);
    /// Lanes where `a < b`, both unsigned.
    fn lt_u(self, a: Self::U, b: Self::U) -> Mask;
    /// `a` where the bit is set, else `b`.
    fn select_u(self, mask: Mask, a: Self::U, b: Self::U) -> Self::U;

    /// `x` in all lanes.
    fn splat_d(self, x: f64) -> Self::D;
    /// Each `f32` as an `f64`, exactly.
    fn widen(self, a: Self::F) -> Self::D;
    /// Each `f64` as an `f32`, rounded to nearest.
    fn narrow(self, a: Self::D) -> Self::F;
    /// `a + b`.
    fn add_d(self, a: Self::D, b: Self::D) -> Self::D;
    /// `a - b`.
    fn sub_d(self, a: Self::D, b: Self::D) -> Self::D;
    /// `a · b`.
    fn mul_d(self, a: Self::D, b: Self::D) -> Self::D;
    /// `a / b`.
    fn div_d(self, a: Self::D, b: Self::D) -> Self::D;
    /// Square root.
    fn sqrt_d(self, a: Self::D) -> Self::D;
    /// Absolute value, with the sign bit cleared.
    fn abs_d(self, a: Self::D) -> Self::D;
    /// The larger of the two; `b` if either is NaN.
    fn max_d(self, a: Self::D, b: Self::D) -> Self::D;
    /// Lanes where `a <= b`.
    fn le_d(self, a: Self::D, b: Self::D) -> Mask;

    /// Square root.
    fn sqrt(self, a: Self::F) -> Self::F;
    /// Rounds towards zero; unspecified for numbers outside the range of `i32`.
    fn truncate(self, a: Self::F) -> Self::U;
    /// Converts integers in two's complement to `f32`.
    fn to_f(self, a: Self::U) -> Self::F;
    /// The IEEE 754 bits of each lane.
    fn to_bits(self, a: Self::F) -> Self::U;
    /// The `f32` that has these IEEE 754 bits; the inverse of [`Self::to_bits`].
    fn float_of(self, a: Self::U) -> Self::F;
    /// `a + b` modulo 2³².
    fn add_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// `a · b` modulo 2³².
    fn mul_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// Bitwise `a & b`.
    fn and_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// Bitwise `a | b`.
    fn or_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// Bitwise `a ^ b`.
    fn xor_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// `a << bits`, for `bits` below 32; shifts in zeros.
    fn shl_u(self, a: Self::U, bits: u32) -> Self::U;
    /// `a >> bits`, for `bits` below 32; shifts in zeros.
    fn shr_u(self, a: Self::U, bits: u32) -> Self::U;
    /// Lanes where `a == b`.
    fn eq_u(self, a: Self::U, b: Self::U) -> Mask;
    /// `from[i]` for each index; indices beyond the end read an unspecified element. `from` must not be empty. Fastest
    /// if its length is exactly 16 or 32.
    fn gather(self, from: &[f32], indices: Self::U) -> Self::F;
    /// Like [`Self::gather`], from a table of `u32`.
    fn gather_u(self, from: &[u32], indices: Self::U) -> Self::U;
    /// Moves the lanes with their bit set to the front, in order; the remaining lanes are unspecified.
    fn compress(self, mask: Mask, a: Self::F) -> Self::F;
    /// Like [`Self::compress`], for `u32`.
    fn compress_u(self, mask: Mask, a: Self::U) -> Self::U;
}

/// The indices of the set bits of each byte, ascending from the lowest byte on, followed by zeros: compresses eight lanes
/// where no instruction does.
pub static SET_BITS: [u64; 256] = {
    let mut indices = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut bit, mut n) = (0, 0);
        while bit < 8 {
            if mask >> bit & 1 != 0 {
                indices[mask] |= bit << (8 * n);
                n += 1;
            }
            bit += 1;
        }
        mask += 1;
    }
    indices
};

/// A function and its arguments, for [`Simd::call`].
pub trait Kernel<S: Simd> {
    /// What the kernel returns.
    type Output;

    /// Runs the kernel; implementations are `#[inline(always)]`.
    fn run(self, s: S) -> Self::Output;
}

/// An instruction set that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// AVX-512 F, VL, DQ and BW, besides all of [`Self::Avx2`]: a register of 512 bits holds sixteen `f32`.
    Avx512,
    /// AVX2 with FMA, BMI 1 and 2, LZCNT and POPCNT: two registers of 256 bits hold sixteen `f32`.
    Avx2,
    /// Portable arrays, on any processor.
    Portable,
}

static DEFAULT: OnceLock<InstructionSet> = OnceLock::new();

impl InstructionSet {
    /// Returns the default set: the widest of this processor, unless [`Self::set_default`] has set another one.
    #[inline]
    pub fn detect() -> Self {
        *DEFAULT.get_or_init(Self::widest)
    }

    /// Makes this set the result of [`Self::detect`] for the rest of the process. Returns false if the processor does
    /// not support it, or if another set is already the default: call it before anything is built or rendered.
    pub fn set_default(self) -> bool {
        self.is_available() && *DEFAULT.get_or_init(|| self) == self
    }

    fn widest() -> Self {
        static WIDEST: OnceLock<InstructionSet> = OnceLock::new();
        *WIDEST.get_or_init(|| Self::available()[0])
    }

    /// Whether this processor supports the set.
    #[inline]
    pub fn is_available(self) -> bool {
        self == Self::Portable || self as usize >= Self::widest() as usize
    }

    /// Returns all sets that this processor supports, widest first; tests run them all.
    pub fn available() -> Vec<Self> {
        let mut sets = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt")
                && is_x86_feature_detected!("popcnt");
            if avx2
                && is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512bw")
            {
                sets.push(Self::Avx512);
            }
            if avx2 {
                sets.push(Self::Avx2);
            }
        }
        sets.push(Self::Portable);
        sets
    }
}

/// Runs `$kernel::<S>(simd, args..)` compiled for the given instruction set; `::<_, CONSTANT>` may follow the kernel.
/// Panics if the processor does not support the set: any caller can name one, also in `RenderSettings::simd`.
#[macro_export]
macro_rules! dispatch {
    ($set:expr, $kernel:ident $(::<_, $constant:ident>)? ( $($name:ident : $kind:ty),* $(,)? )) => {{
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn avx512($($name: $kind),*) {
            // SAFETY: this function has these instructions enabled, and its caller guarantees that the processor has
            // them.
            $kernel$(::<_, $constant>)?(unsafe { $crate::Avx512::new() }, $($name),*)
        }
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn avx2($($name: $kind),*) {
            // SAFETY: as above.
            $kernel$(::<_, $constant>)?(unsafe { $crate::Avx2::new() }, $($name),*)
        }
        // Without optimisation, kernels inlined in the caller would add their stack frames to those of the others.
        fn portable($($name: $kind),*) {
            $kernel$(::<_, $constant>)?($crate::Portable, $($name),*)
        }
        let set: $crate::InstructionSet = $set;
        assert!(set.is_available(), "this processor does not have {set:?}");
        match set {
            // SAFETY: the processor supports the set, as asserted, and with it everything that `available` checks.
            #[cfg(target_arch = "x86_64")]
            $crate::InstructionSet::Avx512 => unsafe { avx512($($name),*) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            $crate::InstructionSet::Avx2 => unsafe { avx2($($name),*) },
            _ => portable($($name),*),
        }
    }};
}

/// Portable arrays: the reference, and the implementation for all other processors.
#[derive(Clone, Copy)]
pub struct Portable;

#[inline(always)]
fn zip<T: Copy, R>(a: [T; LANES], b: [T; LANES], f: impl Fn(T, T) -> R) -> [R; LANES] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn bits(test: impl Fn(usize) -> bool) -> Mask {
    (0..LANES).fold(0, |mask, i| mask | Mask::from(test(i)) << i)
}

/// Operations on plain arrays. On x86-64, where other sets are the fast ones, each is compiled once and called.
macro_rules! operations {
    ($(fn $name:ident($($args:tt)*) $(-> $result:ty)? $body:block)*) => {
        $(
            #[cfg_attr(target_arch = "x86_64", inline(never))]
            #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
            fn $name($($args)*) $(-> $result)? $body
        )*
    };
}

impl Simd for Portable {
    type F = [f32; LANES];
    type U = [u32; LANES];
    type D = [f64; LANES];

    #[inline(never)]
    fn call<K: Kernel<Self>>(self, kernel: K) -> K::Output {
        kernel.run(self)
    }

    operations! {
        fn splat(self, x: f32) -> Self::F { [x; LANES] }
        fn load(self, from: &[f32; LANES]) -> Self::F { *from }
        fn store(self, a: Self::F, to: &mut [f32; LANES]) { *to = a; }
        fn add(self, a: Self::F, b: Self::F) -> Self::F { zip(a, b, |a, b| a + b) }
        fn sub(self, a: Self::F, b: Self::F) -> Self::F { zip(a, b, |a, b| a - b) }
        fn mul(self, a: Self::F, b: Self::F) -> Self::F { zip(a, b, |a, b| a * b) }
        fn div(self, a: Self::F, b: Self::F) -> Self::F { zip(a, b, |a, b| a / b) }
        fn min(self, a: Self::F, b: Self::F) -> Self::F { zip(a, b, |a, b| if a < b { a } else { b }) }
        fn max(self, a: Self::F, b: Self::F) -> Self::F { zip(a, b, |a, b| if a > b { a } else { b }) }
        fn abs(self, a: Self::F) -> Self::F { a.map(f32::abs) }
        fn mul_sub(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
            std::array::from_fn(|i| a[i].mul_add(b[i], -c[i]))
        }
        fn neg_mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
            std::array::from_fn(|i| (-a[i]).mul_add(b[i], c[i]))
        }
        fn mul_add_about(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
            std::array::from_fn(|i| a[i] * b[i] + c[i])
        }
        fn neg_mul_add_about(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
            std::array::from_fn(|i| c[i] - a[i] * b[i])
        }
        fn reciprocal_about(self, a: Self::F) -> Self::F { a.map(f32::recip) }
        fn negative(self, a: Self::F) -> Mask { bits(|i| a[i].is_sign_negative()) }
        fn lt(self, a: Self::F, b: Self::F) -> Mask { bits(|i| a[i] < b[i]) }
        fn le(self, a: Self::F, b: Self::F) -> Mask { bits(|i| a[i] <= b[i]) }
        fn eq(self, a: Self::F, b: Self::F) -> Mask { bits(|i| a[i] == b[i]) }
        fn select(self, mask: Mask, a: Self::F, b: Self::F) -> Self::F {
            std::array::from_fn(|i| if mask >> i & 1 != 0 { a[i] } else { b[i] })
        }
        fn least(self, mask: Mask, a: Self::F) -> f32 {
            (0..LANES).filter(|i| mask >> i & 1 != 0).fold(f32::INFINITY, |least, i| least.min(a[i]))
        }
        fn pick(self, point: &[f32; 4], axes: Self::U) -> Self::F { axes.map(|axis| point[axis as usize & 3]) }
        fn lookup(self, table: Self::F, indices: Self::U) -> Self::F {
            indices.map(|index| table[index as usize % LANES])
        }
        fn splat_u(self, x: u32) -> Self::U { [x; LANES] }
        fn load_u(self, from: &[u32; LANES]) -> Self::U { *from }
        fn load_bytes(self, from: &[u8; LANES]) -> Self::U { from.map(u32::from) }
        fn store_u(self, a: Self::U, to: &mut [u32; LANES]) { *to = a; }
        fn lt_u(self, a: Self::U, b: Self::U) -> Mask { bits(|i| a[i] < b[i]) }
        fn select_u(self, mask: Mask, a: Self::U, b: Self::U) -> Self::U {
            std::array::from_fn(|i| if mask >> i & 1 != 0 { a[i] } else { b[i] })
        }
        fn splat_d(self, x: f64) -> Self::D { [x; LANES] }
        fn widen(self, a: Self::F) -> Self::D { a.map(f64::from) }
        fn narrow(self, a: Self::D) -> Self::F { a.map(|a| a as f32) }
        fn add_d(self, a: Self::D, b: Self::D) -> Self::D { zip(a, b, |a, b| a + b) }
        fn sub_d(self, a: Self::D, b: Self::D) -> Self::D { zip(a, b, |a, b| a - b) }
        fn mul_d(self, a: Self::D, b: Self::D) -> Self::D { zip(a, b, |a, b| a * b) }
        fn div_d(self, a: Self::D, b: Self::D) -> Self::D { zip(a, b, |a, b| a / b) }
        fn sqrt_d(self, a: Self::D) -> Self::D { a.map(f64::sqrt) }
        fn abs_d(self, a: Self::D) -> Self::D { a.map(f64::abs) }
        fn max_d(self, a: Self::D, b: Self::D) -> Self::D { zip(a, b, |a, b| if a > b { a } else { b }) }
        fn le_d(self, a: Self::D, b: Self::D) -> Mask { bits(|i| a[i] <= b[i]) }
        fn sqrt(self, a: Self::F) -> Self::F { a.map(f32::sqrt) }
        fn truncate(self, a: Self::F) -> Self::U { a.map(|a| a as i32 as u32) }
        fn to_f(self, a: Self::U) -> Self::F { a.map(|a| a as i32 as f32) }
        fn to_bits(self, a: Self::F) -> Self::U { a.map(f32::to_bits) }
        fn float_of(self, a: Self::U) -> Self::F { a.map(f32::from_bits) }
        fn add_u(self, a: Self::U, b: Self::U) -> Self::U { zip(a, b, u32::wrapping_add) }
        fn mul_u(self, a: Self::U, b: Self::U) -> Self::U { zip(a, b, u32::wrapping_mul) }
        fn and_u(self, a: Self::U, b: Self::U) -> Self::U { zip(a, b, |a, b| a & b) }
        fn or_u(self, a: Self::U, b: Self::U) -> Self::U { zip(a, b, |a, b| a | b) }
        fn xor_u(self, a: Self::U, b: Self::U) -> Self::U { zip(a, b, |a, b| a ^ b) }
        fn shl_u(self, a: Self::U, bits: u32) -> Self::U { a.map(|a| a << bits) }
        fn shr_u(self, a: Self::U, bits: u32) -> Self::U { a.map(|a| a >> bits) }
        fn eq_u(self, a: Self::U, b: Self::U) -> Mask { bits(|i| a[i] == b[i]) }
        fn gather(self, from: &[f32], indices: Self::U) -> Self::F {
            let last = last_index(from.len());
            indices.map(|i| from[i.min(last) as usize])
        }
        fn gather_u(self, from: &[u32], indices: Self::U) -> Self::U {
            let last = last_index(from.len());
            indices.map(|i| from[i.min(last) as usize])
        }
        fn compress(self, mask: Mask, a: Self::F) -> Self::F { pack(mask, a) }
        fn compress_u(self, mask: Mask, a: Self::U) -> Self::U { pack(mask, a) }
    }
}

#[inline(always)]
fn pack<T: Copy>(mask: Mask, a: [T; LANES]) -> [T; LANES] {
    let (mut packed, mut n) = (a, 0);
    for (i, &lane) in a.iter().enumerate() {
        packed[n] = lane;
        n += usize::from(mask >> i & 1);
        if n == LANES {
            break;
        }
    }
    packed
}

/// Returns the last index of an array that `gather` may read.
#[inline(always)]
fn last_index(len: usize) -> u32 {
    assert!(len > 0 && len <= i32::MAX as usize, "nothing to gather from, or too much");
    len as u32 - 1
}

#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
#[path = "simd_x86.rs"]
mod x86;

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs every operation on edge cases and returns all result bits.
    #[inline(always)]
    fn everything<S: Simd>(s: S, out: &mut Vec<u64>) {
        let numbers = [0.0, -0.0, 1.5, -2.25, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 3.1e-41, 7.7e37, -1e-20];
        for shift in 0..numbers.len() {
            let array = |k: usize| std::array::from_fn(|i| numbers[(i * k + shift) % numbers.len()]);
            let (a, b, c) = (s.load(&array(1)), s.load(&array(3)), s.load(&array(7)));
            let mut push = |values: S::F| {
                let mut stored = [0.0; LANES];
                s.store(values, &mut stored);
                // Sign and payload of a NaN are unspecified.
                out.extend(stored.map(|x| if x.is_nan() { 1 << 40 } else { u64::from(x.to_bits()) }));
            };
            for values in [
                s.add(a, b),
                s.sub(a, b),
                s.mul(a, b),
                s.div(a, b),
                s.min(a, b),
                s.max(a, b),
                s.abs(a),
                s.mul_sub(a, b, c),
                s.neg_mul_add(a, b, c),
                s.select(0x5A3C, a, b),
                s.pick(&[1.0, 2.0, 3.0, 4.0], s.load_u(&std::array::from_fn(|i| i as u32 % 3))),
                s.lookup(a, s.load_u(&std::array::from_fn(|i| (i * 11 + shift) as u32 % 16 + 16 * i as u32))),
                s.splat(numbers[shift]),
                s.sqrt(a),
                s.to_f(s.to_bits(a)),
                s.float_of(s.to_bits(b)),
                s.gather(&numbers, s.load_u(&std::array::from_fn(|i| i as u32 * 5 % 10))),
                s.gather(&array(7), s.load_u(&std::array::from_fn(|i| i as u32 * 5 % 16))),
                s.gather(&[array(7), array(3)].concat(), s.load_u(&std::array::from_fn(|i| i as u32 * 5 % 32))),
            ] {
                push(values);
            }
            let (x, y) = (s.widen(a), s.widen(b));
            for wide in [
                s.add_d(x, y),
                s.sub_d(x, y),
                s.mul_d(x, y),
                s.div_d(x, y),
                s.sqrt_d(x),
                s.abs_d(x),
                s.max_d(x, y),
                s.splat_d(1.0 / 3.0),
            ] {
                push(s.narrow(wide));
            }
            let (u, v) = (s.load_u(&array(1).map(f32::to_bits)), s.load_u(&array(3).map(f32::to_bits)));
            let small = s.mul(s.load(&std::array::from_fn(|i| i as f32 - 7.7)), s.splat(1e5));
            for values in [
                s.select_u(0x0FF1, u, s.splat_u(9)),
                s.truncate(small),
                s.add_u(u, v),
                s.mul_u(u, v),
                s.and_u(u, v),
                s.or_u(u, v),
                s.xor_u(u, v),
                s.shl_u(u, 7),
                s.shr_u(u, 13),
                s.load_bytes(&std::array::from_fn(|i| (i * 37 + shift) as u8)),
                s.gather_u(&[3, 1, 4, 1, 5], s.load_u(&std::array::from_fn(|i| i as u32 % 5))),
                s.gather_u(&array(7).map(f32::to_bits), s.load_u(&std::array::from_fn(|i| i as u32 * 3 % 16))),
            ] {
                let mut stored = [0; LANES];
                s.store_u(values, &mut stored);
                out.extend(stored.map(u64::from));
            }
            for mask in [0u16, 1, 0x8000, 0x5A3C, 0xFF00, 0x00FF, 0xFFFF, 0x0FF1] {
                let (mut packed, mut packed_u) = ([0.0; LANES], [0; LANES]);
                s.store(s.compress(mask, small), &mut packed);
                s.store_u(s.compress_u(mask, u), &mut packed_u);
                let n = mask.count_ones() as usize;
                out.extend(packed[..n].iter().map(|x| u64::from(x.to_bits())));
                out.extend(packed_u[..n].iter().map(|&x| u64::from(x)));
            }
            out.push(u64::from(s.eq_u(u, v)));
            let masks = [s.negative(a), s.lt(a, b), s.le(a, b), s.eq(a, b), s.lt_u(u, v), s.le_d(x, y)];
            out.extend(masks.map(u64::from));
            let numbers_only = s.eq(a, a);
            out.push(u64::from(s.least(numbers_only, a).to_bits()));
        }
    }

    #[test]
    fn all_instruction_sets_agree_with_plain_arrays() {
        let run = |set: InstructionSet| {
            let mut out = Vec::new();
            let into = &mut out;
            dispatch!(set, everything(into: &mut Vec<u64>));
            out
        };
        let expected = run(InstructionSet::Portable);
        for set in InstructionSet::available() {
            assert_eq!(run(set), expected, "{set:?}");
        }
    }
}
