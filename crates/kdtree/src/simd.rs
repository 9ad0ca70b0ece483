//! SIMD operations of the traversal beyond [`firstlight_simd`]: visiting a node of eight children, and prefetching.

use super::node8::{DescentRay, Node8, Stack, descend_plain};
pub(super) use firstlight_simd::{InstructionSet, LANES, Mask, dispatch};
use firstlight_simd::{Portable, SET_BITS, three};

/// For each corner the vertices of sixteen triangles, as indices below sixteen.
pub(super) type Corners = [[u8; LANES]; 3];

/// Up to eight of sixteen triangles.
pub(super) struct Eight<S: KernelSimd> {
    /// For each corner the vertices; the lanes beyond the triangles are unspecified.
    pub corners: [S::U; 3],
    /// The places of the triangles among the sixteen, one byte each.
    pub places: u64,
}

/// Returns the places of the triangles, one byte each: up to eight.
#[inline(always)]
fn places(triangles: Mask) -> u64 {
    let (low, high) = (triangles as u8, (triangles >> 8) as u8);
    let above = SET_BITS[usize::from(high)] + 0x0808_0808_0808_0808;
    SET_BITS[usize::from(low)] | above.checked_shl(8 * low.count_ones()).unwrap_or(0)
}

/// Extends [`firstlight_simd::Simd`].
pub(super) trait KernelSimd: firstlight_simd::Simd {
    /// Visits a node: see `node8::descend_plain`.
    fn descend(self, node: &Node8, ray: &DescentRay, t0: f32, t1: f32, stack: &mut Stack, height: usize) -> usize;

    /// Whether [`Self::beside`] takes less time than the test of sixteen triangles, and eight less than sixteen.
    const IS_NARROW: bool;

    /// Returns the triangles whose three vertices all lie above 0, or all below: `0 < low` or `high < 0`.
    ///
    /// - `low`, `high`: bounds of a coordinate of sixteen vertices; not a number lies on neither side.
    #[inline(always)]
    fn beside(self, low: Self::F, high: Self::F, corners: &Corners) -> Mask {
        let s = self;
        let [a, b, c] = three!(|k| s.load_bytes(&corners[k]));
        let lowest = s.min(s.lookup(low, a), s.min(s.lookup(low, b), s.lookup(low, c)));
        let highest = s.max(s.lookup(high, a), s.max(s.lookup(high, b), s.lookup(high, c)));
        s.lt(s.splat(0.0), lowest) | s.lt(highest, s.splat(0.0))
    }

    /// Moves the corners of up to eight triangles to the front, in order.
    ///
    /// With these, operations take half the time if [`Self::IS_NARROW`].
    fn first_eight(self, triangles: Mask, corners: &Corners) -> Eight<Self>;

    /// Prefetches the cache line at `at`; any address is allowed.
    fn prefetch(self, at: *const u8);
}

impl KernelSimd for Portable {
    #[inline(always)]
    fn descend(self, node: &Node8, ray: &DescentRay, t0: f32, t1: f32, stack: &mut Stack, height: usize) -> usize {
        descend_plain(node, ray, t0, t1, stack, height)
    }

    const IS_NARROW: bool = false;

    #[inline(always)]
    fn first_eight(self, triangles: Mask, corners: &Corners) -> Eight<Self> {
        let places = places(triangles);
        let place = |i: usize| (places >> (8 * (i % 8))) as usize % LANES;
        let corners = corners.map(|of| std::array::from_fn(|i| u32::from(of[place(i)])));
        Eight { corners, places }
    }

    #[inline(always)]
    fn prefetch(self, _at: *const u8) {}
}

#[cfg(target_arch = "x86_64")]
#[path = "simd_x86.rs"]
mod x86;
