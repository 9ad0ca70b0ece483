//! The x86 implementations of [`KernelSimd`].

use super::{Corners, Eight, KernelSimd, places};
use crate::node8::{AXES, CHILD_ORDERS, EMPTY, Node8, STACK, Stack, Walk, plane_above};
use firstlight_simd::{Avx2, Avx512, Mask, SET_BITS, three, two};
use std::arch::x86_64::*;

impl KernelSimd for Avx512 {
    #[inline(always)]
    fn descend(self, node: &Node8, walk: &mut Walk, stack: &mut Stack) {
        // SAFETY: `self` proves that the processor has AVX-512, and with it AVX2.
        unsafe { descend_one(node, walk, stack) }
    }

    type VisitConstants = TwoRays;

    fn visit_constants(self) -> &'static TwoRays {
        // Where the compiler knows which lanes are moved, it replaces loads under a mask by moves of lanes, of which Intel
        // processors make one at a time.
        std::hint::black_box(&TwoRays::CONSTANTS)
    }

    /// Each ray takes half a register. All steps are in the order of the children from far to near, in which the same
    /// places are on the far side of a level's plane whatever the ray; so only the planes have to be looked up.
    #[inline(always)]
    fn descend_two(self, c: &TwoRays, nodes: [&Node8; 2], walks: [&mut Walk; 2], stacks: [&mut Stack; 2]) {
        let ([a, b], [walk_a, walk_b], [stack_a, stack_b]) = (nodes, walks, stacks);
        // The stores below write eight entries each.
        assert!(walk_a.height as usize <= STACK - 8 && walk_b.height as usize <= STACK - 8);
        // SAFETY: `self` proves that the processor has the instructions; walks, nodes and constants are aligned as they are
        // read; stacks have room for eight entries from the height on.
        unsafe {
            let constant = |of: &[u32; 16]| _mm512_load_si512(of.as_ptr().cast());
            let both = |a: f32, b: f32| _mm512_mask_mov_ps(_mm512_set1_ps(a), c.second, _mm512_set1_ps(b));
            // Volatile, so that each is a load of its own, and no lane of something loaded before.
            let both_u = |a: *const u32, b: *const u32| {
                let all = |from: *const u32| _mm512_set1_epi32(from.read_volatile() as i32);
                _mm512_mask_mov_epi32(all(a), c.second, all(b))
            };
            let halves = |a: *const f32, b: *const f32| {
                _mm512_insertf32x8::<1>(_mm512_castps256_ps512(_mm256_load_ps(a)), _mm256_load_ps(b))
            };
            let (rows_a, rows_b) = (std::ptr::from_ref(&*walk_a).cast(), std::ptr::from_ref(&*walk_b).cast());
            let row = |k: usize| {
                let row = |rows: *const f32| _mm512_broadcast_f32x4(_mm_load_ps(rows.add(4 * k)));
                _mm512_mask_mov_ps(row(rows_a), c.second, row(rows_b))
            };
            // The permutation within rows uses the low two bits of each lane, which are its axis.
            let axes = |node: &Node8| node.planes.as_ptr().add(AXES).cast();
            let axes = _mm512_srlv_epi32(both_u(axes(a), axes(b)), constant(&c.axis_shifts));
            let origin = _mm512_permutevar_ps(row(0), axes);
            let inv_lo = _mm512_permutevar_ps(row(1), axes);
            let minus_inv_hi = _mm512_permutevar_ps(row(2), axes);
            let down = usize::from(_mm512_movepi32_mask(_mm512_castps_si512(inv_lo)));
            let order = both_u(&ORDERS_OF_TWO[0][down & 0xFF], &ORDERS_OF_TWO[1][down >> 8]);
            // The permutations use the low four bits: a child, and above it the half of the ray.
            let order = _mm512_srlv_epi32(order, constant(&c.order_shifts));
            let padding = _mm512_permute_ps::<0xFF>(row(0));
            let distance = _mm512_sub_ps(halves(a.planes.as_ptr(), b.planes.as_ptr()), origin);
            let lo = _mm512_sub_ps(_mm512_mul_ps(distance, inv_lo), padding);
            let hi = _mm512_sub_ps(padding, _mm512_mul_ps(distance, minus_inv_hi));
            let (mut first, mut last) = (both(walk_a.t0, walk_b.t0), both(walk_a.t1, walk_b.t1));
            let root = constant(&c.root);
            let middle = _mm512_or_si512(order, _mm512_set1_epi32(3));
            let bottom = _mm512_and_si512(order, _mm512_set1_epi32(!1));
            for (planes, far) in [(root, c.far[0]), (middle, c.far[1]), (bottom, c.far[2])] {
                // NaN as the first argument yields the second.
                first = _mm512_mask_max_ps(first, far, _mm512_permutexvar_ps(planes, lo), first);
                last = _mm512_mask_mov_ps(_mm512_min_ps(_mm512_permutexvar_ps(planes, hi), last), far, last);
            }
            let children = _mm512_castps_si512(halves(a.children.as_ptr().cast(), b.children.as_ptr().cast()));
            let children = _mm512_permutexvar_epi32(order, children);
            let some = _mm512_cmpneq_epi32_mask(children, _mm512_set1_epi32(EMPTY as i32));
            let met = usize::from(_mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(some, first, last));
            // All bits of `reversed` are set, or none.
            let places = |walk: &Walk, met: usize| PLACES[(walk.descent.reversed & 256) as usize + met] as i64;
            let places = _mm_set_epi64x(places(walk_b, met >> 8), places(walk_a, met & 0xFF));
            let places = _mm512_or_si512(_mm512_cvtepu8_epi32(places), constant(&c.half));
            let children = _mm512_castsi512_ps(_mm512_permutexvar_epi32(places, children));
            let (first, last) = (_mm512_permutexvar_ps(places, first), _mm512_permutexvar_ps(places, last));
            let (met_a, met_b) = ((met & 0xFF).count_ones(), (met >> 8).count_ones());
            for (walk, stack, met, is_second) in [(walk_a, stack_a, met_a, false), (walk_b, stack_b, met_b, true)] {
                let height = walk.height as usize;
                let of =
                    |both| if is_second { _mm512_extractf32x8_ps::<1>(both) } else { _mm512_castps512_ps256(both) };
                _mm256_storeu_ps(stack.child.as_mut_ptr().add(height).cast(), of(children));
                _mm256_storeu_ps(stack.t0.as_mut_ptr().add(height), of(first));
                _mm256_storeu_ps(stack.t1.as_mut_ptr().add(height), of(last));
                walk.height += met;
            }
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

/// Constants of visits with two rays, each in half a register.
#[repr(C, align(64))]
pub(crate) struct TwoRays {
    axis_shifts: [u32; 16],
    order_shifts: [u32; 16],
    /// Where the lanes of each half begin.
    half: [u32; 16],
    /// The plane of the root.
    root: [u32; 16],
    /// The places on the far side at each level.
    far: [Mask; 3],
    /// The lanes of the second ray.
    second: Mask,
}

impl TwoRays {
    const CONSTANTS: Self = {
        let mut c = Self {
            axis_shifts: [0; 16],
            order_shifts: [0; 16],
            half: [0; 16],
            root: [0; 16],
            far: [0x0F0F, 0x3333, 0x5555],
            second: 0xFF00,
        };
        let mut lane = 0;
        while lane < 16 {
            let place = lane as u32 % 8;
            (c.axis_shifts[lane], c.order_shifts[lane]) = (2 * place, 4 * place);
            c.half[lane] = lane as u32 & 8;
            c.root[lane] = c.half[lane] | plane_above(0, 0) as u32;
            lane += 1;
        }
        c
    };
}

/// [`CHILD_ORDERS`] with four bits for each child, of which the highest is 0 for the first ray and 1 for the second.
static ORDERS_OF_TWO: [[u32; 256]; 2] = {
    let mut orders = [[0; 256]; 2];
    let mut down = 0;
    while down < 256 {
        let mut place = 0;
        while place < 8 {
            orders[0][down] |= (CHILD_ORDERS[down] >> (3 * place) & 7) << (4 * place);
            place += 1;
        }
        orders[1][down] = orders[0][down] | 0x8888_8888;
        down += 1;
    }
    orders
};

/// For each set of eight places from far to near: these places in the order in which they are pushed, one byte each.
/// First for near-first rays, then for far-first rays.
static PLACES: [u64; 512] = {
    let mut places = [0; 512];
    let mut set = 0;
    while set < 256 {
        places[set] = SET_BITS[set];
        let (mut place, mut n) = (8, 0);
        while place > 0 {
            place -= 1;
            if set >> place & 1 == 1 {
                places[256 + set] |= place << (8 * n);
                n += 1;
            }
        }
        set += 1;
    }
    places
};

impl KernelSimd for Avx2 {
    #[inline(always)]
    fn descend(self, node: &Node8, walk: &mut Walk, stack: &mut Stack) {
        // SAFETY: `self` proves that the processor has AVX2.
        unsafe { descend_one(node, walk, stack) }
    }

    type VisitConstants = ();

    fn visit_constants(self) -> &'static () {
        &()
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

/// Visits a node, see `node8::descend_plain`.
///
/// # Safety
///
/// The processor must have AVX2.
#[inline(always)]
unsafe fn descend_one(node: &Node8, walk: &mut Walk, stack: &mut Stack) {
    let height = walk.height as usize;
    // The stores below write eight entries each.
    assert!(height <= STACK - 8);
    // SAFETY: the caller ensures that the processor has AVX2; walks and nodes are aligned as they are read; the stack has
    // room for eight entries.
    unsafe {
        // The planes above the lower four children are in the lower half, those above the others in the upper one:
        // so the steps from planes to children need not cross the halves.
        let planes = load_lanes(&PLANE_OF_LANE);
        let splits = _mm256_permutevar8x32_ps(_mm256_load_ps(std::ptr::from_ref(node).cast()), planes);
        let axes = _mm256_srlv_epi32(_mm256_set1_epi32(node.planes[AXES].to_bits() as i32), load_lanes(&AXIS_OF_LANE));
        // The permutation within rows uses the low two bits of each lane, which are its axis.
        let rows = std::ptr::from_ref(&*walk).cast::<__m128>();
        let origin = _mm256_permutevar_ps(_mm256_broadcast_ps(&*rows), axes);
        let inv_lo = _mm256_permutevar_ps(_mm256_broadcast_ps(&*rows.add(1)), axes);
        let minus_inv_hi = _mm256_permutevar_ps(_mm256_broadcast_ps(&*rows.add(2)), axes);
        let padding = _mm256_set1_ps(walk.descent.padding);
        let distance = _mm256_sub_ps(splits, origin);
        let lo = _mm256_sub_ps(_mm256_mul_ps(distance, inv_lo), padding);
        let hi = _mm256_sub_ps(padding, _mm256_mul_ps(distance, minus_inv_hi));
        let (mut first, mut last) = (_mm256_set1_ps(walk.t0), _mm256_set1_ps(walk.t1));
        // At each level, the upper side of a plane is the far one, unless the ray descends its axis.
        (first, last) = clip::<0b00_00_00_00, 0b1111_0000>(first, last, lo, hi, inv_lo);
        (first, last) = clip::<0b01_01_01_01, 0b1100_1100>(first, last, lo, hi, inv_lo);
        (first, last) = clip::<0b11_11_10_10, 0b1010_1010>(first, last, lo, hi, inv_lo);
        // All planes the other way round for a far-first ray.
        let down = _mm256_movemask_ps(inv_lo) as u32 ^ walk.descent.reversed;
        let order = _mm256_set1_epi32(ORDERS_BY_LANES[usize::from(down as u8)] as i32);
        let order = _mm256_srlv_epi32(order, _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21));
        let children = _mm256_load_si256(node.children.as_ptr().cast());
        let empty = _mm256_cmpeq_epi32(children, _mm256_set1_epi32(EMPTY as i32));
        let within = _mm256_andnot_ps(_mm256_castsi256_ps(empty), _mm256_cmp_ps::<_CMP_LE_OQ>(first, last));
        let met = _mm256_movemask_ps(_mm256_permutevar8x32_ps(within, order)) as u32;
        let order = _mm256_permutevar8x32_epi32(order, lanes_in(met as u8));
        let children = _mm256_permutevar8x32_epi32(children, order);
        _mm256_storeu_si256(stack.child.as_mut_ptr().add(height).cast(), children);
        _mm256_storeu_ps(stack.t0.as_mut_ptr().add(height), _mm256_permutevar8x32_ps(first, order));
        _mm256_storeu_ps(stack.t1.as_mut_ptr().add(height), _mm256_permutevar8x32_ps(last, order));
        walk.height += met.count_ones();
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
const PLANE_OF_LANE: [u32; 8] = {
    let mut planes = [0; 8];
    let mut half = 0;
    while half < 2 {
        let (lane, child) = (4 * half, 4 * half);
        planes[lane] = plane_above(child, 0) as u32;
        planes[lane + 1] = plane_above(child, 1) as u32;
        planes[lane + 2] = plane_above(child, 2) as u32;
        planes[lane + 3] = plane_above(child + 2, 2) as u32;
        half += 1;
    }
    planes
};

/// Where the axis of this plane begins in the axes of a node.
const AXIS_OF_LANE: [u32; 8] = {
    let mut shifts = PLANE_OF_LANE;
    let mut lane = 0;
    while lane < 8 {
        shifts[lane] *= 2;
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
        orders[lanes] = CHILD_ORDERS[down];
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
