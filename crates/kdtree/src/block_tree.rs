//! Kd-tree over primitives of one kind: binary nodes, the same nodes collapsed to [`Node8`], and leaf blocks shared by
//! both.

use super::build::{LeafMaker, append_part, build};
use super::leaf::{BLOCK, LeafBlock, Prims};
use super::node8::{LEAF, Node8, collapse};
use super::nodes::{KdNode, KdNodes};
use super::present::PresentPrimitives;
use super::ray::Nearest;
use super::reference::{BuildConfig, Primitives};
use super::simd::KernelSimd;

#[derive(Debug, PartialEq)]
pub(super) struct BlockTree<B: LeafBlock> {
    /// Binary nodes, for packets, for single rays, and as the reference.
    pub nodes: KdNodes,
    /// The same tree as [`Node8`], for streams.
    pub nodes8: Vec<Node8>,
    blocks: Vec<B>,
    /// The blocks of leaves whose first block has the bit [`COMPACT`] set.
    compact: Vec<B::Compact>,
    /// The largest side of the bounds.
    pub extent: f32,
}

/// The blocks of one leaf, all regular or all compact.
pub(super) struct Leaf<'a, B: LeafBlock> {
    pub blocks: &'a [B],
    pub compact: &'a [B::Compact],
}

/// Bit in the number of a leaf's first block that marks compact blocks: the highest bit that a node can store.
const COMPACT: u32 = 1 << 29;

impl<B: LeafBlock> BlockTree<B> {
    /// Builds nodes and blocks.
    ///
    /// - `make_block`: packs up to sixteen primitives into a block.
    /// - `make_compact`: packs any number of primitives into compact blocks; returns none where that does not pay.
    pub fn build(
        primitives: &impl Primitives,
        config: &BuildConfig,
        make_block: impl Fn(&[u32]) -> B + Sync,
        make_compact: impl Fn(&[u32]) -> Vec<B::Compact> + Sync,
    ) -> Self {
        let (nodes, Blocks { blocks, compact }) = build(primitives, config, &BlockMaker { make_block, make_compact });
        let (extent, nodes8) = (nodes.extent(), collapse(&nodes));
        Self { nodes, nodes8, blocks, compact, extent }
    }

    /// Whether prefetching pays: nodes and blocks often come from main memory. What the second- or third-level cache
    /// holds arrives in time without it, and the prefetched lines evict others from the first level.
    pub fn is_large(&self) -> bool {
        self.block_bytes() > 8 << 20
    }

    pub fn bytes(&self) -> usize {
        self.nodes.nodes.len() * size_of::<KdNode>() + self.nodes8.len() * size_of::<Node8>() + self.block_bytes()
    }

    fn block_bytes(&self) -> usize {
        self.blocks.len() * size_of::<B>() + self.compact.len() * size_of::<B::Compact>()
    }

    pub fn n_blocks(&self) -> usize {
        self.blocks.len() + self.compact.len()
    }

    /// Returns the leaf of a binary node.
    pub fn leaf(&self, first: u32, count: u32) -> Leaf<'_, B> {
        let range = (first & !COMPACT) as usize..(first & !COMPACT) as usize + count as usize;
        if first & COMPACT == 0 {
            Leaf { blocks: &self.blocks[range], compact: &[] }
        } else {
            Leaf { blocks: &[], compact: &self.compact[range] }
        }
    }

    /// Offers the hits of a leaf, which is a child of a [`Node8`], among the primitives that `present` keeps.
    #[inline(always)]
    pub fn test_leaf<S: KernelSimd>(
        &self,
        s: S,
        child: u32,
        ray: &B::Ray,
        nearest: &mut Nearest,
        present: Option<&PresentPrimitives>,
    ) {
        let first = (child & !(LEAF | COMPACT)) as usize;
        if child & COMPACT == 0 {
            test_blocks(s, &self.blocks, first, ray, nearest, present);
        } else {
            test_blocks(s, &self.compact, first, ray, nearest, present);
        }
    }

    /// Prefetches the first `LINES` cache lines of a child of a [`Node8`], be it a node or a leaf; 0 for all of a
    /// block.
    #[inline(always)]
    pub fn prefetch<S: KernelSimd, const LINES: usize>(&self, s: S, child: u32) {
        let first = (child & !(LEAF | COMPACT)) as usize;
        let node = self.nodes8.as_ptr().wrapping_add(child as usize).cast::<u8>();
        let block = self.blocks.as_ptr().wrapping_add(first).cast::<u8>();
        let compact = self.compact.as_ptr().wrapping_add(first).cast::<u8>();
        let is_compact = child & COMPACT != 0;
        let leaf = if is_compact { compact } else { block };
        let at = if child & LEAF != 0 { leaf } else { node };
        let all = if is_compact { size_of::<B::Compact>() / 64 } else { size_of::<B>() / 64 };
        for line in 0..if LINES == 0 { all } else { LINES } {
            s.prefetch(at.wrapping_add(64 * line));
        }
    }
}

/// The blocks of a set of leaves.
struct Blocks<B: LeafBlock> {
    blocks: Vec<B>,
    compact: Vec<B::Compact>,
}

impl<B: LeafBlock> Default for Blocks<B> {
    fn default() -> Self {
        Self { blocks: Vec::new(), compact: Vec::new() }
    }
}

struct BlockMaker<M, C> {
    make_block: M,
    make_compact: C,
}

impl<B: LeafBlock, M: Fn(&[u32]) -> B + Sync, C: Fn(&[u32]) -> Vec<B::Compact> + Sync> LeafMaker for BlockMaker<M, C> {
    type Leaves = Blocks<B>;

    fn make(&self, leaves: &mut Blocks<B>, prims: &[u32]) -> (u32, u32) {
        if prims.is_empty() {
            return (0, 0);
        }
        let small = (self.make_compact)(prims);
        if small.is_empty() {
            append(&mut leaves.blocks, prims.chunks(BLOCK).map(&self.make_block))
        } else {
            let (first, count) = append(&mut leaves.compact, small);
            (first | COMPACT, count)
        }
    }

    fn add_part(&self, leaves: &mut Blocks<B>, part: Blocks<B>, share: f64) -> impl Fn(u32) -> u32 {
        let (n_blocks, n_compact) = (leaves.blocks.len(), leaves.compact.len());
        append_part(&mut leaves.blocks, part.blocks, share);
        append_part(&mut leaves.compact, part.compact, share);
        check_count(leaves.blocks.len().max(leaves.compact.len()));
        move |first| first + if first & COMPACT == 0 { n_blocks } else { n_compact } as u32
    }
}

/// Appends the blocks of a leaf; returns the number of the first block and the count.
fn append<B: LeafBlock>(to: &mut Vec<B>, blocks: impl IntoIterator<Item = B>) -> (u32, u32) {
    let first = to.len();
    to.extend(blocks);
    let count = to.len() - first;
    to[first..].iter_mut().take(count.saturating_sub(1)).for_each(|block| block.prims_mut().set_followed());
    check_count(to.len());
    (first as u32, count as u32)
}

fn check_count(n_blocks: usize) {
    assert!(n_blocks < COMPACT as usize, "a tree of more than 2^29 leaf blocks");
}

#[inline(always)]
fn test_blocks<S: KernelSimd, B: LeafBlock>(
    s: S,
    blocks: &[B],
    mut block: usize,
    ray: &B::Ray,
    nearest: &mut Nearest,
    present: Option<&PresentPrimitives>,
) {
    loop {
        B::test(s, &blocks[block], ray, nearest, present);
        if !blocks[block].prims().is_followed() {
            return;
        }
        block += 1;
    }
}

impl<'a, B: LeafBlock> Leaf<'a, B> {
    pub fn prims(&self) -> impl Iterator<Item = u32> + use<'a, B> {
        self.blocks.iter().map(B::prims).chain(self.compact.iter().map(B::Compact::prims)).flat_map(Prims::iter)
    }

    pub fn n_blocks(&self) -> usize {
        self.blocks.len() + self.compact.len()
    }
}
