//! The x86 implementations of [`KernelSimd`].

use super::{Corners, Eight, KernelSimd, places};
use crate::node8::{CHILD_ORDERS, DescentRay, EMPTY, Node8, PLANES, STACK, Stack};
use firstlight_simd::{Avx2, Avx512, Mask, SET_BITS, three, two};
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

    const IS_NARROW: bool = false;

    #[inline(always)]
    fn first_eight(self, triangles: Mask, corners: &Corners) -> Eight<Self> {
        let places = places(triangles);
        // SAFETY: `self` proves that the processor has the instructions; rows of corners have the size that is read.
        let corners = unsafe {
            let moved = moved(places, corners);
            three!(|k| _mm512_cvtepu8_epi32(moved[k]))
        };
        Eight { corners, places }
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
            // The planes above the lower four children are in the lower half, those above the others in the upper one:
            // so the steps from planes to children need not cross the halves.
            let planes = load_lanes(&PLANE_OF_LANE);
            let splits = _mm256_permutevar8x32_ps(_mm256_load_ps(std::ptr::from_ref(node).cast()), planes);
            let axes = _mm256_srlv_epi32(_mm256_set1_epi32(node.axes as i32), load_lanes(&AXIS_OF_LANE));
            // The permutation within rows uses the low two bits of each lane, which are its axis.
            let rows = std::ptr::from_ref(ray).cast::<__m128>();
            let origin = _mm256_permutevar_ps(_mm256_broadcast_ps(&*rows), axes);
            let inv_lo = _mm256_permutevar_ps(_mm256_broadcast_ps(&*rows.add(1)), axes);
            let minus_inv_hi = _mm256_permutevar_ps(_mm256_broadcast_ps(&*rows.add(2)), axes);
            let padding = _mm256_set1_ps(ray.padding);
            let distance = _mm256_sub_ps(splits, origin);
            let lo = _mm256_sub_ps(_mm256_mul_ps(distance, inv_lo), padding);
            let hi = _mm256_sub_ps(padding, _mm256_mul_ps(distance, minus_inv_hi));
            let (mut first, mut last) = (_mm256_set1_ps(t0), _mm256_set1_ps(t1));
            // At each level, the upper side of a plane is the far one, unless the ray descends its axis.
            (first, last) = clip::<0b00_00_00_00, 0b1111_0000>(first, last, lo, hi, inv_lo);
            (first, last) = clip::<0b01_01_01_01, 0b1100_1100>(first, last, lo, hi, inv_lo);
            (first, last) = clip::<0b11_11_10_10, 0b1010_1010>(first, last, lo, hi, inv_lo);
            let down = _mm256_movemask_ps(inv_lo) as u32;
            let order = ORDERS_BY_LANES[usize::from((down ^ ray.reversed) as u8)];
            let order =
                _mm256_srlv_epi32(_mm256_set1_epi32(order as i32), _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21));
            let children = _mm256_load_si256(node.children.as_ptr().cast());
            let empty = _mm256_cmpeq_epi32(children, _mm256_set1_epi32(EMPTY as i32));
            let within = _mm256_andnot_ps(_mm256_castsi256_ps(empty), _mm256_cmp_ps::<_CMP_LE_OQ>(first, last));
            let met = _mm256_movemask_ps(_mm256_permutevar8x32_ps(within, order)) as u32;
            let order = _mm256_permutevar8x32_epi32(order, lanes_in(met as u8));
            let children = _mm256_permutevar8x32_epi32(children, order);
            _mm256_storeu_si256(stack.child.as_mut_ptr().add(height).cast(), children);
            _mm256_storeu_ps(stack.t0.as_mut_ptr().add(height), _mm256_permutevar8x32_ps(first, order));
            _mm256_storeu_ps(stack.t1.as_mut_ptr().add(height), _mm256_permutevar8x32_ps(last, order));
            height + met.count_ones() as usize
        }
    }

    const IS_NARROW: bool = true;

    #[inline(always)]
    fn beside(self, low: Self::F, high: Self::F, corners: &Corners) -> Mask {
        // SAFETY: `self` proves that the processor has the instructions; rows of corners have the size that is read.
        unsafe {
            let zero = _mm256_setzero_ps();
            let [a, b] = two!(|half| _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LT_OQ>(zero, low[half])));
            let [c, d] = two!(|half| _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LT_OQ>(high[half], zero)));
            // A byte for each vertex: above in the lower half, below in the upper one. Packing interleaves the halves.
            let packed = _mm256_packs_epi16(_mm256_packs_epi32(a, b), _mm256_packs_epi32(c, d));
            let sides = _mm256_permutevar8x32_epi32(packed, _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7));
            let [a, b, c] = three!(|k| {
                let vertices = _mm256_broadcastsi128_si256(_mm_loadu_si128(corners[k].as_ptr().cast()));
                _mm256_shuffle_epi8(sides, vertices)
            });
            let all = _mm256_and_si256(_mm256_and_si256(a, b), c);
            let all = _mm256_movemask_epi8(all) as u32;
            (all | all >> 16) as Mask
        }
    }

    #[inline(always)]
    fn first_eight(self, triangles: Mask, corners: &Corners) -> Eight<Self> {
        let places = places(triangles);
        // SAFETY: `self` proves that the processor has the instructions; rows of corners have the size that is read.
        // Both halves are the same value, so the compiler computes what follows once.
        let corners = unsafe {
            let moved = moved(places, corners);
            three!(|k| [_mm256_cvtepu8_epi32(moved[k]); 2])
        };
        Eight { corners, places }
    }

    #[inline(always)]
    fn prefetch(self, at: *const u8) {
        // SAFETY: a prefetch of a bad address does nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(at.cast()) }
    }
}

/// Moves the bytes of each row at these places, which are below sixteen, to the front.
///
/// # Safety
///
/// The processor must have AVX2.
#[inline(always)]
unsafe fn moved(places: u64, corners: &Corners) -> [__m128i; 3] {
    // SAFETY: the caller ensures that the processor has AVX2; rows have the size that is read.
    unsafe {
        let places = _mm_cvtsi64_si128(places as i64);
        three!(|k| _mm_shuffle_epi8(_mm_loadu_si128(corners[k].as_ptr().cast()), places))
    }
}

/// The plane in each lane of an AVX2 visit: in each half the root, one of the second level, two of the third level.
const PLANE_OF_LANE: [u32; 8] = [0, 1, 3, 4, 0, 2, 5, 6];

/// Where the axis of this plane begins in [`Node8::axes`].
const AXIS_OF_LANE: [u32; 8] = {
    let mut shifts = PLANE_OF_LANE;
    let mut lane = 0;
    while lane < 8 {
        shifts[lane] *= 3;
        lane += 1;
    }
    shifts
};

/// The orders of [`CHILD_ORDERS`] for each set of lanes of [`PLANE_OF_LANE`] whose axis the ray descends.
static ORDERS_BY_LANES: [u32; 256] = {
    let mut orders = [0; 256];
    let mut lanes = 0;
    while lanes < 256 {
        let (mut down, mut lane) = (0, 0);
        while lane < 8 {
            down |= (lanes >> lane & 1) << PLANE_OF_LANE[lane];
            lane += 1;
        }
        orders[lanes] = CHILD_ORDERS[down] as u32 & 0xFF_FFFF;
        lanes += 1;
    }
    orders
};

/// Loads eight integers.
///
/// # Safety
///
/// The processor must have AVX2.
#[inline(always)]
unsafe fn load_lanes(from: &'static [u32; 8]) -> __m256i {
    // SAFETY: the caller ensures that the processor has AVX2; the array has the size that is read.
    unsafe { _mm256_loadu_si256(from.as_ptr().cast()) }
}

/// Returns the indices of the set bits of a mask, ascending, followed by zeros.
///
/// # Safety
///
/// The processor must have AVX2.
#[inline(always)]
unsafe fn lanes_in(mask: u8) -> __m256i {
    // SAFETY: the caller ensures that the processor has AVX2.
    unsafe { _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(SET_BITS[usize::from(mask)] as i64)) }
}

/// Clips the intervals of eight children by their planes at one level: `PLANES` selects them within each half, `UPPER`
/// marks the children on the upper side.
///
/// # Safety
///
/// The processor must have AVX2.
#[inline(always)]
unsafe fn clip<const PLANES: i32, const UPPER: i32>(
    first: __m256,
    last: __m256,
    lo: __m256,
    hi: __m256,
    inv: __m256,
) -> (__m256, __m256) {
    // SAFETY: the caller ensures that the processor has AVX2; only registers are read.
    unsafe {
        let (lo, hi) = (_mm256_permute_ps::<PLANES>(lo), _mm256_permute_ps::<PLANES>(hi));
        // The sign bit is set where the child is on the far side.
        let sides = _mm256_blend_ps::<UPPER>(_mm256_setzero_ps(), _mm256_set1_ps(-0.0));
        let far = _mm256_xor_ps(_mm256_permute_ps::<PLANES>(inv), sides);
        // NaN as the first argument yields the second.
        let entered = _mm256_max_ps(lo, first);
        let left = _mm256_min_ps(hi, last);
        (_mm256_blendv_ps(first, entered, far), _mm256_blendv_ps(left, last, far))
    }
}
