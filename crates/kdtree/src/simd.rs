//! SIMD operations of the traversal beyond [`firstlight_simd`]: visiting a node of eight children, leaving out triangles
//! beside a ray, and prefetching.

use super::node8::{Node8, Stack, Walk, descend_plain};
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
    fn descend(self, node: &Node8, walk: &mut Walk, stack: &mut Stack);

    /// Constants of [`Self::descend_two`].
    type VisitConstants: 'static;

    fn visit_constants(self) -> &'static Self::VisitConstants;

    /// Visits a node with each of two rays: does [`Self::descend`] for both.
    #[inline(always)]
    fn descend_two(self, _: &Self::VisitConstants, nodes: [&Node8; 2], walks: [&mut Walk; 2], stacks: [&mut Stack; 2]) {
        let ([first, second], [first_stack, second_stack]) = (walks, stacks);
        self.descend(nodes[0], first, first_stack);
        self.descend(nodes[1], second, second_stack);
    }

    /// Whether sixteen lanes take two registers: then it pays to look for the primitives near a ray before they are
    /// tested.
    const IS_NARROW: bool;

    /// Returns the triangles whose three vertices all lie above 0, or all below: `0 < low` or `high < 0`.
    ///
    /// - `low`, `high`: bounds of a coordinate of sixteen vertices.
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
    fn descend(self, node: &Node8, walk: &mut Walk, stack: &mut Stack) {
        descend_plain(node, walk, stack);
    }

    type VisitConstants = ();

    fn visit_constants(self) -> &'static () {
        &()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[inline(always)]
    fn beside_and_first<S: KernelSimd>(s: S, cases: &[(u64, Mask)], out: &mut Vec<u32>) {
        for &(seed, triangles) in cases {
            let mut state = seed;
            let mut next = move || {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 40) as u32
            };
            let corners: Corners = std::array::from_fn(|_| std::array::from_fn(|_| next() as u8 % 16));
            let mut numbers = || -> [f32; LANES] {
                std::array::from_fn(|_| [0.0, -0.0, 1.0, -1.0, 2.0, -1e-40, 1e-40][next() as usize % 7])
            };
            let (low, high) = (s.load(&numbers()), s.load(&numbers()));
            out.push(u32::from(s.beside(low, high, &corners)));
            let Eight { corners, places } = s.first_eight(triangles, &corners);
            for of_corner in corners {
                let mut stored = [0; LANES];
                s.store_u(of_corner, &mut stored);
                out.extend(&stored[..triangles.count_ones() as usize]);
            }
            out.extend((0..triangles.count_ones()).map(|i| (places >> (8 * i)) as u32 & 0xFF));
        }
    }

    #[test]
    fn all_instruction_sets_leave_out_the_same_triangles() {
        let masks = (0..=Mask::MAX).filter(|mask| mask.count_ones() <= 8);
        let cases: Vec<(u64, Mask)> = (0..).zip(masks).map(|(i, mask)| (i * 7919, mask)).collect();
        let cases = &cases[..];
        let run = |set| {
            let mut out = Vec::new();
            let into = &mut out;
            dispatch!(set, beside_and_first(cases: &[(u64, Mask)], into: &mut Vec<u32>));
            out
        };
        let expected = run(InstructionSet::Portable);
        for set in InstructionSet::available() {
            assert!(run(set) == expected, "{set:?}");
        }
        // Few triangles lie beside, and not all of the others.
        let portable = Portable;
        let all = |value: f32| [value; LANES];
        assert_eq!(portable.beside(all(1.0), all(1.0), &[[0; LANES]; 3]), Mask::MAX);
        assert_eq!(portable.beside(all(0.0), all(-0.0), &[[0; LANES]; 3]), 0);
        assert_eq!(portable.first_eight(0b1000_0000_0010_0001, &[[3; LANES]; 3]).places & 0xFF_FFFF, 0x0F_05_00);
    }
}
