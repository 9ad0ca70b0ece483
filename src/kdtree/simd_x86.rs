//! The x86 implementations of [`Simd`]: one AVX-512 register, or two of AVX2, for sixteen numbers.

use super::{LANES, Mask, Simd};
use crate::kdtree::wide::{DescentRay, EMPTY, STACK, Stack, WideNode};
use std::arch::x86_64::*;

/// Proof that the processor has AVX-512 F, VL, DQ and BW.
#[derive(Clone, Copy)]
pub(in crate::kdtree) struct Avx512(());

/// Proof that the processor has AVX2, FMA and BMI.
#[derive(Clone, Copy)]
pub(in crate::kdtree) struct Avx2(());

impl Avx512 {
    /// # Safety
    /// The processor must have the instructions.
    #[inline(always)]
    pub unsafe fn new() -> Self {
        Self(())
    }
}

impl Avx2 {
    /// # Safety
    /// The processor must have the instructions.
    #[inline(always)]
    pub unsafe fn new() -> Self {
        Self(())
    }
}

/// Functions whose body is one expression of intrinsics.
///
/// SAFETY of all of them: `self` proves that the processor has the instructions; pointers come from references to
/// arrays of the size that is read or written.
macro_rules! operations {
    ($($(#[$attribute:meta])* fn $name:ident($($arg:ident: $kind:ty),*) $(-> $result:ty)? $body:block)*) => {
        $($(#[$attribute])*
        #[inline(always)]
        fn $name(self, $($arg: $kind),*) $(-> $result)? { unsafe { $body } })*
    };
}

impl Simd for Avx512 {
    type F = __m512;
    type U = __m512i;
    type D = [__m512d; 2];

    operations! {
        fn splat(x: f32) -> __m512 { _mm512_set1_ps(x) }
        fn load(from: &[f32; LANES]) -> __m512 { _mm512_loadu_ps(from.as_ptr()) }
        fn store(a: __m512, to: &mut [f32; LANES]) { _mm512_storeu_ps(to.as_mut_ptr(), a) }
        fn add(a: __m512, b: __m512) -> __m512 { _mm512_add_ps(a, b) }
        fn sub(a: __m512, b: __m512) -> __m512 { _mm512_sub_ps(a, b) }
        fn mul(a: __m512, b: __m512) -> __m512 { _mm512_mul_ps(a, b) }
        fn div(a: __m512, b: __m512) -> __m512 { _mm512_div_ps(a, b) }
        fn min(a: __m512, b: __m512) -> __m512 { _mm512_min_ps(a, b) }
        fn max(a: __m512, b: __m512) -> __m512 { _mm512_max_ps(a, b) }
        fn abs(a: __m512) -> __m512 { _mm512_abs_ps(a) }
        fn mul_sub(a: __m512, b: __m512, c: __m512) -> __m512 { _mm512_fmsub_ps(a, b, c) }
        fn neg_mul_add(a: __m512, b: __m512, c: __m512) -> __m512 { _mm512_fnmadd_ps(a, b, c) }
        fn negative(a: __m512) -> Mask { _mm512_movepi32_mask(_mm512_castps_si512(a)) }
        fn lt(a: __m512, b: __m512) -> Mask { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b) }
        fn le(a: __m512, b: __m512) -> Mask { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b) }
        fn eq(a: __m512, b: __m512) -> Mask { _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(a, b) }
        fn select(mask: Mask, a: __m512, b: __m512) -> __m512 { _mm512_mask_blend_ps(mask, b, a) }
        fn least(mask: Mask, a: __m512) -> f32 { _mm512_mask_reduce_min_ps(mask, a) }
        fn pick(point: &[f32; 4], axes: __m512i) -> __m512 {
            _mm512_permutevar_ps(_mm512_broadcast_f32x4(_mm_loadu_ps(point.as_ptr())), axes)
        }
        fn splat_u(x: u32) -> __m512i { _mm512_set1_epi32(x as i32) }
        fn load_u(from: &[u32; LANES]) -> __m512i { _mm512_loadu_si512(from.as_ptr().cast()) }
        fn store_u(a: __m512i, to: &mut [u32; LANES]) { _mm512_storeu_si512(to.as_mut_ptr().cast(), a) }
        fn lt_u(a: __m512i, b: __m512i) -> Mask { _mm512_cmplt_epu32_mask(a, b) }
        fn select_u(mask: Mask, a: __m512i, b: __m512i) -> __m512i { _mm512_mask_blend_epi32(mask, b, a) }
        fn splat_d(x: f64) -> Self::D { [_mm512_set1_pd(x); 2] }
        fn widen(a: __m512) -> Self::D {
            [_mm512_cvtps_pd(_mm512_castps512_ps256(a)), _mm512_cvtps_pd(_mm512_extractf32x8_ps::<1>(a))]
        }
        fn narrow(a: Self::D) -> __m512 {
            let low = _mm512_castps256_ps512(_mm512_cvtpd_ps(a[0]));
            _mm512_insertf32x8::<1>(low, _mm512_cvtpd_ps(a[1]))
        }
        fn add_d(a: Self::D, b: Self::D) -> Self::D { [_mm512_add_pd(a[0], b[0]), _mm512_add_pd(a[1], b[1])] }
        fn sub_d(a: Self::D, b: Self::D) -> Self::D { [_mm512_sub_pd(a[0], b[0]), _mm512_sub_pd(a[1], b[1])] }
        fn mul_d(a: Self::D, b: Self::D) -> Self::D { [_mm512_mul_pd(a[0], b[0]), _mm512_mul_pd(a[1], b[1])] }
        fn div_d(a: Self::D, b: Self::D) -> Self::D { [_mm512_div_pd(a[0], b[0]), _mm512_div_pd(a[1], b[1])] }
        fn sqrt_d(a: Self::D) -> Self::D { [_mm512_sqrt_pd(a[0]), _mm512_sqrt_pd(a[1])] }
        fn le_d(a: Self::D, b: Self::D) -> Mask {
            let low = Mask::from(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(a[0], b[0]));
            low | Mask::from(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(a[1], b[1])) << 8
        }
        fn descend(node: &WideNode, ray: &DescentRay, t0: f32, t1: f32, stack: &mut Stack, height: usize) -> usize {
            // The stores below write eight entries each.
            assert!(height <= STACK - 8);
            let shifts = _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21);
            let shifts = _mm512_inserti64x4::<1>(_mm512_castsi256_si512(shifts), shifts);
            // The lower half is about entries and holds times, the upper half about exits and holds their negatives:
            // then both only ever grow.
            let upper_half = _mm512_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0, 8, 8, 8, 8, 8, 8, 8, 8);
            // Lane 7 holds the axes: a plane that no child asks for.
            let splits = _mm256_load_ps(std::ptr::from_ref(node).cast());
            let splits = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(splits), splits);
            let axes = _mm512_srlv_epi32(_mm512_set1_epi32(node.axes as i32), shifts);
            // Only three bits of the axes are their own.
            let axes = _mm512_ternarylogic_epi32::<0xF8>(upper_half, axes, _mm512_set1_epi32(7));
            let origin = _mm512_permutexvar_ps(axes, _mm512_load_ps(ray.origin.as_ptr().cast()));
            let inv = _mm512_permutexvar_ps(axes, _mm512_load_ps(ray.inv.as_ptr().cast()));
            let times = _mm512_mul_ps(_mm512_sub_ps(splits, origin), inv);
            let times = _mm512_sub_ps(times, _mm512_set1_ps(ray.slack));
            let root = _mm512_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0, 8, 8, 8, 8, 8, 8, 8, 8);
            let middle = _mm512_setr_epi32(1, 1, 1, 1, 2, 2, 2, 2, 9, 9, 9, 9, 10, 10, 10, 10);
            let bottom = _mm512_setr_epi32(3, 3, 4, 4, 5, 5, 6, 6, 11, 11, 12, 12, 13, 13, 14, 14);
            // The far side has a new entry, the near side a new exit.
            let octant = node.octants[ray.octant & 7];
            let bounds = _mm512_mask_blend_ps(0xFF00, _mm512_set1_ps(t0), _mm512_set1_ps(-t1));
            // NaN as the first argument loses against the second.
            let mask = both_halves(octant >> 24);
            let bounds = _mm512_mask_max_ps(bounds, mask, _mm512_permutexvar_ps(root, times), bounds);
            let mask = both_halves(octant >> 32);
            let bounds = _mm512_mask_max_ps(bounds, mask, _mm512_permutexvar_ps(middle, times), bounds);
            let mask = both_halves(octant >> 40);
            let bounds = _mm512_mask_max_ps(bounds, mask, _mm512_permutexvar_ps(bottom, times), bounds);
            let order = _mm512_srlv_epi32(_mm512_set1_epi32(octant as i32), shifts);
            let order_twice = _mm512_ternarylogic_epi32::<0xF8>(upper_half, order, _mm512_set1_epi32(7));
            let bounds = _mm512_permutexvar_ps(order_twice, bounds);
            let first = _mm512_castps512_ps256(bounds);
            let last = _mm256_xor_ps(_mm512_extractf32x8_ps::<1>(bounds), _mm256_set1_ps(-0.0));
            let children = _mm256_load_si256(node.children.as_ptr().cast());
            let children = _mm256_permutexvar_epi32(_mm512_castsi512_si256(order), children);
            let some = _mm256_cmpneq_epi32_mask(children, _mm256_set1_epi32(EMPTY as i32));
            let met = _mm256_mask_cmp_ps_mask::<_CMP_LE_OQ>(some, first, last);
            _mm256_storeu_si256(stack.child.as_mut_ptr().add(height).cast(), _mm256_maskz_compress_epi32(met, children));
            _mm256_storeu_ps(stack.t0.as_mut_ptr().add(height), _mm256_maskz_compress_ps(met, first));
            _mm256_storeu_ps(stack.t1.as_mut_ptr().add(height), _mm256_maskz_compress_ps(met, last));
            height + met.count_ones() as usize
        }
        fn prefetch(at: *const u8) { _mm_prefetch::<_MM_HINT_T0>(at.cast()) }
    }
}

/// The low byte, and its complement above it.
#[inline(always)]
fn both_halves(far: u64) -> Mask {
    let far = far as Mask & 0xFF;
    far | (far ^ 0xFF) << 8
}

/// A mask of 8 bits as a register of lanes that are all ones or all zeros.
#[inline(always)]
unsafe fn lanes_of(mask: Mask) -> __m256 {
    unsafe {
        let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        let both = _mm256_and_si256(_mm256_set1_epi32(i32::from(mask)), bit);
        _mm256_castsi256_ps(_mm256_cmpeq_epi32(both, bit))
    }
}

#[inline(always)]
unsafe fn bits_of(low: __m256, high: __m256) -> Mask {
    unsafe { _mm256_movemask_ps(low) as Mask | (_mm256_movemask_ps(high) as Mask) << 8 }
}

#[inline(always)]
unsafe fn blend(mask: Mask, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
    unsafe { [_mm256_blendv_ps(b[0], a[0], lanes_of(mask)), _mm256_blendv_ps(b[1], a[1], lanes_of(mask >> 8))] }
}

/// For each child its plane's number: from `upper` where the bit is set, else from `lower`.
#[inline(always)]
unsafe fn sides<const UPPER: i32>(lower: __m256, planes: __m256i, upper: __m256) -> __m256 {
    unsafe {
        let (lower, upper) = (_mm256_permutevar8x32_ps(lower, planes), _mm256_permutevar8x32_ps(upper, planes));
        _mm256_blend_ps::<UPPER>(lower, upper)
    }
}

/// The same operation on both halves.
macro_rules! halves {
    ($operation:ident($($arg:ident),+)) => { [$operation($($arg[0]),+), $operation($($arg[1]),+)] };
    ($operation:ident($($arg:ident),+), 4) => {
        [$operation($($arg[0]),+), $operation($($arg[1]),+), $operation($($arg[2]),+), $operation($($arg[3]),+)]
    };
}

impl Simd for Avx2 {
    type F = [__m256; 2];
    type U = [__m256i; 2];
    type D = [__m256d; 4];

    operations! {
        fn splat(x: f32) -> Self::F { [_mm256_set1_ps(x); 2] }
        fn load(from: &[f32; LANES]) -> Self::F { [_mm256_loadu_ps(from.as_ptr()), _mm256_loadu_ps(from.as_ptr().add(8))] }
        fn store(a: Self::F, to: &mut [f32; LANES]) {
            _mm256_storeu_ps(to.as_mut_ptr(), a[0]);
            _mm256_storeu_ps(to.as_mut_ptr().add(8), a[1]);
        }
        fn add(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_add_ps(a, b)) }
        fn sub(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_sub_ps(a, b)) }
        fn mul(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_mul_ps(a, b)) }
        fn div(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_div_ps(a, b)) }
        fn min(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_min_ps(a, b)) }
        fn max(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_max_ps(a, b)) }
        fn abs(a: Self::F) -> Self::F {
            let sign = _mm256_set1_ps(-0.0);
            [_mm256_andnot_ps(sign, a[0]), _mm256_andnot_ps(sign, a[1])]
        }
        fn mul_sub(a: Self::F, b: Self::F, c: Self::F) -> Self::F { halves!(_mm256_fmsub_ps(a, b, c)) }
        fn neg_mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F { halves!(_mm256_fnmadd_ps(a, b, c)) }
        fn negative(a: Self::F) -> Mask { bits_of(a[0], a[1]) }
        fn lt(a: Self::F, b: Self::F) -> Mask {
            bits_of(_mm256_cmp_ps::<_CMP_LT_OQ>(a[0], b[0]), _mm256_cmp_ps::<_CMP_LT_OQ>(a[1], b[1]))
        }
        fn le(a: Self::F, b: Self::F) -> Mask {
            bits_of(_mm256_cmp_ps::<_CMP_LE_OQ>(a[0], b[0]), _mm256_cmp_ps::<_CMP_LE_OQ>(a[1], b[1]))
        }
        fn eq(a: Self::F, b: Self::F) -> Mask {
            bits_of(_mm256_cmp_ps::<_CMP_EQ_OQ>(a[0], b[0]), _mm256_cmp_ps::<_CMP_EQ_OQ>(a[1], b[1]))
        }
        fn select(mask: Mask, a: Self::F, b: Self::F) -> Self::F { blend(mask, a, b) }
        fn least(mask: Mask, a: Self::F) -> f32 {
            let [low, high] = blend(mask, a, [_mm256_set1_ps(f32::INFINITY); 2]);
            let eight = _mm256_min_ps(low, high);
            let four = _mm_min_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps::<1>(eight));
            let two = _mm_min_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
        fn pick(point: &[f32; 4], axes: Self::U) -> Self::F {
            let point = _mm_loadu_ps(point.as_ptr());
            let point = _mm256_set_m128(point, point);
            [_mm256_permutevar_ps(point, axes[0]), _mm256_permutevar_ps(point, axes[1])]
        }
        fn splat_u(x: u32) -> Self::U { [_mm256_set1_epi32(x as i32); 2] }
        fn load_u(from: &[u32; LANES]) -> Self::U {
            [_mm256_loadu_si256(from.as_ptr().cast()), _mm256_loadu_si256(from.as_ptr().add(8).cast())]
        }
        fn store_u(a: Self::U, to: &mut [u32; LANES]) {
            _mm256_storeu_si256(to.as_mut_ptr().cast(), a[0]);
            _mm256_storeu_si256(to.as_mut_ptr().add(8).cast(), a[1]);
        }
        fn lt_u(a: Self::U, b: Self::U) -> Mask {
            // Only signed comparisons exist.
            let flip = _mm256_set1_epi32(i32::MIN);
            let low = _mm256_cmpgt_epi32(_mm256_xor_si256(b[0], flip), _mm256_xor_si256(a[0], flip));
            let high = _mm256_cmpgt_epi32(_mm256_xor_si256(b[1], flip), _mm256_xor_si256(a[1], flip));
            bits_of(_mm256_castsi256_ps(low), _mm256_castsi256_ps(high))
        }
        fn select_u(mask: Mask, a: Self::U, b: Self::U) -> Self::U {
            let a = [_mm256_castsi256_ps(a[0]), _mm256_castsi256_ps(a[1])];
            let b = [_mm256_castsi256_ps(b[0]), _mm256_castsi256_ps(b[1])];
            let [low, high] = blend(mask, a, b);
            [_mm256_castps_si256(low), _mm256_castps_si256(high)]
        }
        fn splat_d(x: f64) -> Self::D { [_mm256_set1_pd(x); 4] }
        fn widen(a: Self::F) -> Self::D {
            [
                _mm256_cvtps_pd(_mm256_castps256_ps128(a[0])), _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(a[0])),
                _mm256_cvtps_pd(_mm256_castps256_ps128(a[1])), _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(a[1])),
            ]
        }
        fn narrow(a: Self::D) -> Self::F {
            [
                _mm256_set_m128(_mm256_cvtpd_ps(a[1]), _mm256_cvtpd_ps(a[0])),
                _mm256_set_m128(_mm256_cvtpd_ps(a[3]), _mm256_cvtpd_ps(a[2])),
            ]
        }
        fn add_d(a: Self::D, b: Self::D) -> Self::D { halves!(_mm256_add_pd(a, b), 4) }
        fn sub_d(a: Self::D, b: Self::D) -> Self::D { halves!(_mm256_sub_pd(a, b), 4) }
        fn mul_d(a: Self::D, b: Self::D) -> Self::D { halves!(_mm256_mul_pd(a, b), 4) }
        fn div_d(a: Self::D, b: Self::D) -> Self::D { halves!(_mm256_div_pd(a, b), 4) }
        fn sqrt_d(a: Self::D) -> Self::D { halves!(_mm256_sqrt_pd(a), 4) }
        fn le_d(a: Self::D, b: Self::D) -> Mask {
            let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(a[0], b[0]))
                | _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(a[1], b[1])) << 4;
            let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(a[2], b[2]))
                | _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(a[3], b[3])) << 4;
            (low | high << 8) as Mask
        }
        fn descend(node: &WideNode, ray: &DescentRay, t0: f32, t1: f32, stack: &mut Stack, height: usize) -> usize {
            // The stores below write eight entries each.
            assert!(height <= STACK - 8);
            let shifts = _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21);
            // Lane 7 holds the axes: a plane that no child asks for.
            let splits = _mm256_loadu_ps(std::ptr::from_ref(node).cast());
            let axes = _mm256_srlv_epi32(_mm256_set1_epi32(node.axes as i32), shifts);
            let inv_lo = _mm256_permutevar8x32_ps(_mm256_load_ps(ray.inv[0].as_ptr()), axes);
            let minus_inv_hi = _mm256_permutevar8x32_ps(_mm256_load_ps(ray.inv[1].as_ptr()), axes);
            let origin = _mm256_permutevar8x32_ps(_mm256_load_ps(ray.origin[0].as_ptr()), axes);
            let slack = _mm256_set1_ps(ray.slack);
            let distance = _mm256_sub_ps(splits, origin);
            let lo = _mm256_sub_ps(_mm256_mul_ps(distance, inv_lo), slack);
            let hi = _mm256_sub_ps(slack, _mm256_mul_ps(distance, minus_inv_hi));
            let (never, always) = (_mm256_set1_ps(f32::NEG_INFINITY), _mm256_set1_ps(f32::INFINITY));
            // Where the direction points down, the upper side comes first.
            let down = _mm256_castps_si256(inv_lo);
            let down = _mm256_castsi256_ps(_mm256_srai_epi32::<31>(down));
            let lower_t0 = _mm256_blendv_ps(never, lo, down);
            let upper_t0 = _mm256_blendv_ps(lo, never, down);
            let lower_t1 = _mm256_blendv_ps(hi, always, down);
            let upper_t1 = _mm256_blendv_ps(always, hi, down);
            // For each child the plane of each level, and which children are on its upper side.
            let root = _mm256_setzero_si256();
            let middle = _mm256_setr_epi32(1, 1, 1, 1, 2, 2, 2, 2);
            let bottom = _mm256_setr_epi32(3, 3, 4, 4, 5, 5, 6, 6);
            // NaN as the first argument loses against the second.
            let mut first = _mm256_set1_ps(t0);
            first = _mm256_max_ps(sides::<0b1111_0000>(lower_t0, root, upper_t0), first);
            first = _mm256_max_ps(sides::<0b1100_1100>(lower_t0, middle, upper_t0), first);
            first = _mm256_max_ps(sides::<0b1010_1010>(lower_t0, bottom, upper_t0), first);
            let mut last = _mm256_set1_ps(t1);
            last = _mm256_min_ps(sides::<0b1111_0000>(lower_t1, root, upper_t1), last);
            last = _mm256_min_ps(sides::<0b1100_1100>(lower_t1, middle, upper_t1), last);
            last = _mm256_min_ps(sides::<0b1010_1010>(lower_t1, bottom, upper_t1), last);
            let order = _mm256_srlv_epi32(_mm256_set1_epi32(node.octants[ray.octant & 7] as i32), shifts);
            let first = _mm256_permutevar8x32_ps(first, order);
            let last = _mm256_permutevar8x32_ps(last, order);
            let children = _mm256_permutevar8x32_epi32(_mm256_load_si256(node.children.as_ptr().cast()), order);
            let empty = _mm256_cmpeq_epi32(children, _mm256_set1_epi32(EMPTY as i32));
            let within = _mm256_cmp_ps::<_CMP_LE_OQ>(first, last);
            let met = _mm256_movemask_ps(_mm256_andnot_ps(_mm256_castsi256_ps(empty), within)) as u32;
            // Spread the mask to bytes and collect the numbers of its lanes: a compress in two steps.
            let bytes = _pdep_u64(u64::from(met), 0x0101_0101_0101_0101) * 0xFF;
            let lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(_pext_u64(0x0706_0504_0302_0100, bytes) as i64));
            let children = _mm256_permutevar8x32_epi32(children, lanes);
            _mm256_storeu_si256(stack.child.as_mut_ptr().add(height).cast(), children);
            _mm256_storeu_ps(stack.t0.as_mut_ptr().add(height), _mm256_permutevar8x32_ps(first, lanes));
            _mm256_storeu_ps(stack.t1.as_mut_ptr().add(height), _mm256_permutevar8x32_ps(last, lanes));
            height + met.count_ones() as usize
        }
        fn prefetch(at: *const u8) { _mm_prefetch::<_MM_HINT_T0>(at.cast()) }
    }
}
