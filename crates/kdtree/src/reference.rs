//! What the builder divides: primitives, or what of them lies in a cell.

use super::simd::LANES;
use crate::geometry::Aabb;

/// What the builder weighs; [`super::BuildPreset`] has the values.
#[derive(Clone, Copy, Debug)]
pub(super) struct BuildConfig {
    /// Splits tried per axis in large nodes.
    pub bins: usize,
    /// Nodes with at most this many references try every face instead.
    pub exact_below: usize,
    /// Primitives tested at once.
    pub block: usize,
    /// Cost of testing a block, in visits of an inner node.
    pub block_cost: f32,
    /// Factor on the cost of a split that cuts off empty space.
    pub empty_factor: f32,
    /// Nodes with at most this many references are leaves, whatever a split would save.
    pub leaf_limit: usize,
    /// Depth of the deepest leaf.
    pub max_depth: u32,
    /// References per primitive that the whole tree may add.
    pub max_growth: f32,
    /// Shrink references to their part in the cell.
    pub clip: bool,
    /// Split at the median of the longest axis and ignore the cost.
    pub median: bool,
}

/// What the tree is built over.
pub(super) trait Primitives: Sync {
    fn len(&self) -> usize;
    /// Box of a primitive; empty if no ray can hit it.
    fn bounds(&self, prim: u32) -> Aabb;
    /// Box of the part of the primitive with `axis <= limit` (`below`) or `axis >= limit`, padded by `padding`.
    fn clipped(&self, prim: u32, axis: usize, limit: f32, below: bool, padding: f32) -> Option<Aabb>;
    /// What every hit of a primitive follows from, bit by bit: of primitives that share it only the first can be hit.
    fn shape(&self, _prim: u32) -> Option<[u32; 9]> {
        None
    }
}

/// A primitive in a cell: the box of what the cell holds of it.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Reference {
    pub min: [f32; 3],
    pub prim: u32,
    pub max: [f32; 3],
    unused: u32,
}
const _: () = assert!(size_of::<Reference>() == 32);

impl Reference {
    pub fn new(bounds: &Aabb, prim: u32) -> Self {
        Self { min: bounds.min.into(), prim, max: bounds.max.into(), unused: 0 }
    }

    pub fn bounds(&self) -> Aabb {
        Aabb { min: self.min.into(), max: self.max.into() }
    }

    /// Two of them, as they lie in memory.
    #[inline(always)]
    pub fn pair([a, b]: &[Self; 2]) -> [f32; LANES] {
        let (a_prim, b_prim) = (f32::from_bits(a.prim), f32::from_bits(b.prim));
        let (a_unused, b_unused) = (f32::from_bits(a.unused), f32::from_bits(b.unused));
        [
            a.min[0], a.min[1], a.min[2], a_prim, a.max[0], a.max[1], a.max[2], a_unused, b.min[0], b.min[1], b.min[2],
            b_prim, b.max[0], b.max[1], b.max[2], b_unused,
        ]
    }

    /// A flat reference inside the plane goes below.
    #[inline]
    pub fn is_below(&self, axis: usize, split: f32) -> bool {
        self.min[axis] < split || self.max[axis] <= split
    }

    #[inline]
    pub fn is_above(&self, axis: usize, split: f32) -> bool {
        self.max[axis] > split
    }
}

/// How far the box of a clipped primitive reaches beyond it.
///
/// Covers the rounding of the clip and what the watertight test moves an edge by (see `super::ray`).
pub(super) fn clip_padding(bounds: &Aabb) -> f32 {
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    super::ray::WIDEN * (bounds.size().max_element() + 0.25 * largest)
}
