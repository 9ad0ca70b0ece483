//! Input of the builder: its configuration, the primitives, and references to their parts in a cell.

use super::simd::LANES;
use crate::geometry::Aabb;

/// Parameters of the builder; [`super::BuildPreset`] has the values.
#[derive(Clone, Copy, Debug)]
pub(super) struct BuildConfig {
    /// Split candidates per axis in large nodes.
    pub bins: usize,
    /// Nodes with at most this many references evaluate every face instead.
    pub exact_below: usize,
    /// Primitives tested at once.
    pub block: usize,
    /// Cost of testing a block, relative to visiting an inner node.
    pub block_cost: f32,
    /// Factor on the cost of a split that cuts off empty space.
    pub empty_factor: f32,
    /// Nodes with at most this many references become leaves, whatever the cost.
    pub leaf_limit: usize,
    /// Greatest depth of a leaf.
    pub max_depth: u32,
    /// References per primitive that the whole tree may add.
    pub max_growth: f32,
    /// Whether references shrink to their part in the cell.
    pub clip: bool,
    /// Whether to split at the median of the longest axis and ignore the cost.
    pub median: bool,
}

/// The primitives that a tree is built over.
pub(super) trait Primitives: Sync {
    fn len(&self) -> usize;
    /// Bounds of a primitive; empty if no ray can hit it.
    fn bounds(&self, prim: u32) -> Aabb;
    /// Bounds of the part of the primitive with `axis <= limit` (`below`) or `axis >= limit`, padded by `padding`.
    fn clipped(&self, prim: u32, axis: usize, limit: f32, below: bool, padding: f32) -> Option<Aabb>;
    /// Bits that determine every hit of a primitive: of primitives with equal bits only the first can be hit.
    fn shape(&self, _prim: u32) -> Option<[u32; 10]> {
        None
    }
}

/// A primitive in a cell: the bounds of its part in the cell.
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

    /// Two references in their memory layout.
    #[inline(always)]
    pub fn pair([a, b]: &[Self; 2]) -> [f32; LANES] {
        let (a_prim, b_prim) = (f32::from_bits(a.prim), f32::from_bits(b.prim));
        let (a_unused, b_unused) = (f32::from_bits(a.unused), f32::from_bits(b.unused));
        [
            a.min[0], a.min[1], a.min[2], a_prim, a.max[0], a.max[1], a.max[2], a_unused, b.min[0], b.min[1], b.min[2],
            b_prim, b.max[0], b.max[1], b.max[2], b_unused,
        ]
    }

    /// Whether a part is below the plane. A flat reference in the plane counts as below.
    #[inline]
    pub fn is_below(&self, axis: usize, split: f32) -> bool {
        self.min[axis] < split || self.max[axis] <= split
    }

    #[inline]
    pub fn is_above(&self, axis: usize, split: f32) -> bool {
        self.max[axis] > split
    }
}

/// Padding of the bounds of a clipped primitive.
///
/// Covers the rounding of the clip and the distance by which the watertight test moves an edge (see `super::ray`).
pub(super) fn clip_padding(bounds: &Aabb) -> f32 {
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    super::ray::RELATIVE_PADDING * (bounds.size().max_element() + 0.25 * largest)
}
