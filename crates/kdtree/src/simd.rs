//! SIMD operations of the traversal beyond [`firstlight_simd`]: visiting a node of eight children, and prefetching.

use super::node8::{DescentRay, Node8, Stack, descend_plain};
use firstlight_simd::Portable;
pub(super) use firstlight_simd::{InstructionSet, LANES, Mask, dispatch};

/// Extends [`firstlight_simd::Simd`].
pub(super) trait KernelSimd: firstlight_simd::Simd {
    /// Visits a node: see `node8::descend_plain`.
    fn descend(self, node: &Node8, ray: &DescentRay, t0: f32, t1: f32, stack: &mut Stack, height: usize) -> usize;

    /// Prefetches the cache line at `at`; any address is allowed.
    fn prefetch(self, at: *const u8);
}

impl KernelSimd for Portable {
    #[inline(always)]
    fn descend(self, node: &Node8, ray: &DescentRay, t0: f32, t1: f32, stack: &mut Stack, height: usize) -> usize {
        descend_plain(node, ray, t0, t1, stack, height)
    }

    #[inline(always)]
    fn prefetch(self, _at: *const u8) {}
}

#[cfg(target_arch = "x86_64")]
#[path = "simd_x86.rs"]
mod x86;
