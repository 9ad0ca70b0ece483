//! The x86 implementations of [`KernelSimd`].

use super::KernelSimd;
use crate::node8::{CHILD_ORDERS, DescentRay, EMPTY, Node8, PLANES, STACK, Stack};
use firstlight_simd::{Avx2, Avx512, Mask};
use std::arch::x86_64::*;

impl KernelSimd for Avx512 {
    #[inline(always)]
    fn descend(self, node: &Node8, ray: &DescentRay, t0: f32, t1: f32, stack: &mut Stack, height: usize) -> usize {
        // SAFETY: `self` proves that the processor has the instructions; rays and nodes are aligned as they are read.
        unsafe {
            // The stores below write eight entries each.
            assert!(height <= STACK - 8);
            let shifts = _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21);
            let shifts = _mm512_inserti64x4::<1>(_mm512_castsi256_si512(shifts), shifts);
            let rows = std::ptr::from_ref(ray).cast::<f32>();
            // Lane 7 holds the axes: no child refers to this plane.
            let splits = _mm256_load_ps(std::ptr::from_ref(node).cast());
            let splits = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(splits), splits);
            let axes = _mm512_srlv_epi32(_mm512_set1_epi32(node.axes as i32), shifts);
            // The permutation within rows uses the low two bits of each lane, which are its axis.
            let origin = _mm512_broadcast_f32x4(_mm_load_ps(rows));
            let origin = _mm512_permutevar_ps(origin, axes);
            // The lower half holds entry times, the upper half negated exit times: then both are updated by a maximum.
            let second_row = _mm512_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0, 4, 4, 4, 4, 4, 4, 4, 4);
            let axes = _mm512_ternarylogic_epi32::<0xF8>(second_row, axes, _mm512_set1_epi32(3));
            let inv = _mm512_castps256_ps512(_mm256_loadu_ps(rows.add(4)));
            let inv = _mm512_permutexvar_ps(axes, inv);
            let down = u32::from(_mm512_movepi32_mask(_mm512_castps_si512(inv))) & PLANES;
            let times = _mm512_mul_ps(_mm512_sub_ps(splits, origin), inv);
            let times = _mm512_sub_ps(times, _mm512_set1_ps(ray.padding));
            let root = _mm512_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0, 8, 8, 8, 8, 8, 8, 8, 8);
            let middle = _mm512_setr_epi32(1, 1, 1, 1, 2, 2, 2, 2, 9, 9, 9, 9, 10, 10, 10, 10);
            let bottom = _mm512_setr_epi32(3, 3, 4, 4, 5, 5, 6, 6, 11, 11, 12, 12, 13, 13, 14, 14);
            // The far side gets a new entry, the near side a new exit.
            let far = CHILD_ORDERS[(down & PLANES) as usize];
            let bounds = _mm512_mask_blend_ps(0xFF00, _mm512_set1_ps(t0), _mm512_set1_ps(-t1));
            // NaN as the first argument yields the second.
            let mask = both_halves(far >> 24);
            let bounds = _mm512_mask_max_ps(bounds, mask, _mm512_permutexvar_ps(root, times), bounds);
            let mask = both_halves(far >> 32);
            let bounds = _mm512_mask_max_ps(bounds, mask, _mm512_permutexvar_ps(middle, times), bounds);
            let mask = both_halves(far >> 40);
            let bounds = _mm512_mask_max_ps(bounds, mask, _mm512_permutexvar_ps(bottom, times), bounds);
            let order = CHILD_ORDERS[((down ^ ray.reversed) & PLANES) as usize];
            let order = _mm512_srlv_epi32(_mm512_set1_epi32(order as i32), shifts);
            let upper_half = _mm512_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0, 8, 8, 8, 8, 8, 8, 8, 8);
            let order_twice = _mm512_ternarylogic_epi32::<0xF8>(upper_half, order, _mm512_set1_epi32(7));
            let bounds = _mm512_permutexvar_ps(order_twice, bounds);
            let first = _mm512_castps512_ps256(bounds);
            let last = _mm256_xor_ps(_mm512_extractf32x8_ps::<1>(bounds), _mm256_set1_ps(-0.0));
            let children = _mm256_load_si256(node.children.as_ptr().cast());
            let children = _mm256_permutexvar_epi32(_mm512_castsi512_si256(order), children);
            let some = _mm256_cmpneq_epi32_mask(children, _mm256_set1_epi32(EMPTY as i32));
            let met = _mm256_mask_cmp_ps_mask::<_CMP_LE_OQ>(some, first, last);
            _mm256_storeu_si256(
                stack.child.as_mut_ptr().add(height).cast(),
                _mm256_maskz_compress_epi32(met, children),
            );
            _mm256_storeu_ps(stack.t0.as_mut_ptr().add(height), _mm256_maskz_compress_ps(met, first));
            _mm256_storeu_ps(stack.t1.as_mut_ptr().add(height), _mm256_maskz_compress_ps(met, last));
            height + met.count_ones() as usize
        }
    }
    #[inline(always)]
    fn prefetch(self, at: *const u8) {
        // SAFETY: a prefetch of a bad address does nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(at.cast()) }
    }
}

/// Returns the low byte, with its complement in the byte above.
#[inline(always)]
fn both_halves(far: u64) -> Mask {
    let far = far as Mask & 0xFF;
    far | (far ^ 0xFF) << 8
}

impl KernelSimd for Avx2 {
    #[inline(always)]
    fn descend(self, node: &Node8, ray: &DescentRay, t0: f32, t1: f32, stack: &mut Stack, height: usize) -> usize {
        // SAFETY: `self` proves that the processor has the instructions; rays and nodes are aligned as they are read.
        unsafe {
            // The stores below write eight entries each.
            assert!(height <= STACK - 8);
            let shifts = _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21);
            // Lane 7 holds the axes: no child refers to this plane.
            let splits = _mm256_loadu_ps(std::ptr::from_ref(node).cast());
            let axes = _mm256_srlv_epi32(_mm256_set1_epi32(node.axes as i32), shifts);
            // The permutation within rows uses the low two bits of each lane, which are its axis.
            let rows = std::ptr::from_ref(ray).cast::<__m128>();
            let origin = _mm256_permutevar_ps(_mm256_broadcast_ps(&*rows), axes);
            let inv_lo = _mm256_permutevar_ps(_mm256_broadcast_ps(&*rows.add(1)), axes);
            let minus_inv_hi = _mm256_permutevar_ps(_mm256_broadcast_ps(&*rows.add(2)), axes);
            let padding = _mm256_set1_ps(ray.padding);
            let distance = _mm256_sub_ps(splits, origin);
            let lo = _mm256_sub_ps(_mm256_mul_ps(distance, inv_lo), padding);
            let hi = _mm256_sub_ps(padding, _mm256_mul_ps(distance, minus_inv_hi));
            let (never, always) = (_mm256_set1_ps(f32::NEG_INFINITY), _mm256_set1_ps(f32::INFINITY));
            // Where the direction is negative, the upper side comes first.
            let lower_t0 = _mm256_blendv_ps(never, lo, inv_lo);
            let upper_t0 = _mm256_blendv_ps(lo, never, inv_lo);
            let lower_t1 = _mm256_blendv_ps(hi, always, inv_lo);
            let upper_t1 = _mm256_blendv_ps(always, hi, inv_lo);
            let down = _mm256_movemask_ps(inv_lo) as u32;
            // For each child its plane at each level, and which children are on the upper side.
            let root = _mm256_setzero_si256();
            let middle = _mm256_setr_epi32(1, 1, 1, 1, 2, 2, 2, 2);
            let bottom = _mm256_setr_epi32(3, 3, 4, 4, 5, 5, 6, 6);
            // NaN as the first argument yields the second.
            let mut first = _mm256_set1_ps(t0);
            first = _mm256_max_ps(sides::<0b1111_0000>(lower_t0, root, upper_t0), first);
            first = _mm256_max_ps(sides::<0b1100_1100>(lower_t0, middle, upper_t0), first);
            first = _mm256_max_ps(sides::<0b1010_1010>(lower_t0, bottom, upper_t0), first);
            let mut last = _mm256_set1_ps(t1);
            last = _mm256_min_ps(sides::<0b1111_0000>(lower_t1, root, upper_t1), last);
            last = _mm256_min_ps(sides::<0b1100_1100>(lower_t1, middle, upper_t1), last);
            last = _mm256_min_ps(sides::<0b1010_1010>(lower_t1, bottom, upper_t1), last);
            let order = CHILD_ORDERS[((down ^ ray.reversed) & PLANES) as usize];
            let order = _mm256_srlv_epi32(_mm256_set1_epi32(order as i32), shifts);
            let first = _mm256_permutevar8x32_ps(first, order);
            let last = _mm256_permutevar8x32_ps(last, order);
            let children = _mm256_permutevar8x32_epi32(_mm256_load_si256(node.children.as_ptr().cast()), order);
            let empty = _mm256_cmpeq_epi32(children, _mm256_set1_epi32(EMPTY as i32));
            let within = _mm256_cmp_ps::<_CMP_LE_OQ>(first, last);
            let met = _mm256_movemask_ps(_mm256_andnot_ps(_mm256_castsi256_ps(empty), within)) as u32;
            // Spreads the mask to bytes and collects its lane indices: a compress in two steps.
            let bytes = _pdep_u64(u64::from(met), 0x0101_0101_0101_0101) * 0xFF;
            let lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(_pext_u64(0x0706_0504_0302_0100, bytes) as i64));
            let children = _mm256_permutevar8x32_epi32(children, lanes);
            _mm256_storeu_si256(stack.child.as_mut_ptr().add(height).cast(), children);
            _mm256_storeu_ps(stack.t0.as_mut_ptr().add(height), _mm256_permutevar8x32_ps(first, lanes));
            _mm256_storeu_ps(stack.t1.as_mut_ptr().add(height), _mm256_permutevar8x32_ps(last, lanes));
            height + met.count_ones() as usize
        }
    }
    #[inline(always)]
    fn prefetch(self, at: *const u8) {
        // SAFETY: a prefetch of a bad address does nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(at.cast()) }
    }
}

/// Returns for each child the value of its plane: from `upper` where the bit is set, else from `lower`.
///
/// # Safety
///
/// The processor must have AVX2.
#[inline(always)]
unsafe fn sides<const UPPER: i32>(lower: __m256, planes: __m256i, upper: __m256) -> __m256 {
    // SAFETY: the caller ensures that the processor has AVX2; only registers are read.
    unsafe {
        let (lower, upper) = (_mm256_permutevar8x32_ps(lower, planes), _mm256_permutevar8x32_ps(upper, planes));
        _mm256_blend_ps::<UPPER>(lower, upper)
    }
}
