//! Kd-tree over primitives of one kind: the binary nodes, the wide ones, and the leaf blocks below both.

use super::blocks::{BLOCK, LeafBlock};
use super::build::{BuildConfig, Primitives, build};
use super::nodes::KdNodes;
use super::wide::{WideNode, widen};

#[derive(Debug, PartialEq)]
pub(super) struct BlockTree<B> {
    /// The tree for packets, picking and as the reference.
    pub nodes: KdNodes,
    /// The same tree for streams.
    pub wide: Vec<WideNode>,
    pub blocks: Vec<B>,
    /// The largest side of the bounds.
    pub extent: f32,
}

impl<B: LeafBlock> BlockTree<B> {
    /// - `make_block`: up to sixteen primitives as a block.
    pub fn build(primitives: &impl Primitives, config: &BuildConfig, make_block: impl Fn(&[u32]) -> B) -> Self {
        let mut blocks: Vec<B> = Vec::new();
        let nodes = build(primitives, config, |prims| {
            let first = blocks.len();
            blocks.extend(prims.chunks(BLOCK).map(&make_block));
            let count = blocks.len() - first;
            blocks[first..].iter_mut().take(count.saturating_sub(1)).for_each(|block| block.prims_mut().set_followed());
            (first as u32, count as u32)
        });
        let (extent, wide) = (nodes.extent(), widen(&nodes));
        Self { nodes, wide, blocks, extent }
    }

    /// Whether the tree outgrows the caches, so that asking for memory in advance pays.
    pub fn is_large(&self) -> bool {
        self.blocks.len() * size_of::<B>() > 1 << 20
    }

    pub fn leaf(&self, first: u32, count: u32) -> &[B] {
        &self.blocks[first as usize..][..count as usize]
    }
}
