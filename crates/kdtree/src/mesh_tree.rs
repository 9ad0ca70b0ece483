//! Kd-tree over the triangles of one mesh, in the mesh's own space.

use super::block_tree::BlockTree;
use super::blocks::TriangleBlock;
use super::build::clip_triangle;
use super::leaf::{BLOCK, MAX_PRIMS};
use super::ray::{Nearest, TreeRay};
use super::reference::{BuildConfig, Primitives};
use super::shared_block::SharedBlock;
use super::visits::Visits;
use crate::geometry::{Aabb, Ray, Shear, intersect_triangle};
use glam::Vec3;
use std::sync::{Arc, OnceLock};

/// Trade-off between build time and traversal speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildPreset {
    /// Fast build: a first image within tens of milliseconds.
    Quick,
    /// Full surface area heuristic.
    #[default]
    Best,
    /// Median splits along the longest axis, as was common in the 1990s; for comparison.
    Median,
}

impl BuildPreset {
    pub(super) fn config(self, block: usize) -> BuildConfig {
        let best = BuildConfig {
            bins: 16,
            exact_below: 32,
            block,
            block_cost: BLOCK_COST,
            empty_factor: 0.9,
            leaf_limit: 1,
            max_depth: 40,
            max_growth: 8.0,
            clip: true,
            median: false,
        };
        match self {
            Self::Best => best,
            Self::Quick => BuildConfig { bins: 8, exact_below: 0, clip: false, max_growth: 2.0, max_depth: 32, ..best },
            Self::Median => BuildConfig { clip: false, median: true, leaf_limit: block, max_depth: 24, ..best },
        }
    }
}

/// Cost of testing a leaf block of a mesh, relative to visiting an inner node.
pub(super) const BLOCK_COST: f32 = 3.0;

/// A mesh and its kd-tree, which is built once and never edited; a changed mesh gets a new one.
///
/// The tree may be [deferred](Self::deferred) until something asks for it: a mesh that stands still is in a
/// [`StaticTree`](super::StaticTree) and needs none of its own.
#[derive(Debug)]
pub struct MeshTree {
    pub(super) mesh: Arc<Triangles>,
    config: BuildConfig,
    blocks: OnceLock<Arc<BlockTree<TriangleBlock>>>,
}

/// Compares meshes and trees.
impl PartialEq for MeshTree {
    fn eq(&self, other: &Self) -> bool {
        self.mesh == other.mesh && self.blocks() == other.blocks()
    }
}

/// The triangles of a mesh, in its own space.
#[derive(Debug, PartialEq)]
pub(super) struct Triangles {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    /// The box around all triangles with an area.
    pub bounds: Aabb,
}

impl Triangles {
    #[inline]
    pub fn vertices(&self, prim: u32) -> [Vec3; 3] {
        self.triangles[prim as usize].map(|vertex| self.positions[vertex as usize])
    }
}

/// The builder's view of triangles.
pub(super) struct LeafTriangles<'a> {
    pub positions: &'a [Vec3],
    pub triangles: &'a [[u32; 3]],
    /// First triangle of each mesh: equal triangles of one mesh are one.
    pub firsts: &'a [u32],
}

impl LeafTriangles<'_> {
    #[inline]
    pub fn vertices(&self, prim: u32) -> [Vec3; 3] {
        self.triangles[prim as usize].map(|vertex| self.positions[vertex as usize])
    }

    /// A tree over them.
    pub fn tree(&self, config: &BuildConfig) -> BlockTree<TriangleBlock> {
        let vertices = |prim| self.vertices(prim);
        let make_block = |prims: &[u32]| TriangleBlock::new(prims, vertices);
        let make_compact = |prims: &[u32]| SharedBlock::pack_if_small(prims, vertices);
        BlockTree::build(self, config, make_block, make_compact)
    }
}

impl Primitives for LeafTriangles<'_> {
    fn len(&self) -> usize {
        self.triangles.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        triangle_bounds(self.vertices(prim))
    }

    fn clipped(&self, prim: u32, axis: usize, limit: f32, below: bool, padding: f32) -> Option<Aabb> {
        clip_triangle(&self.vertices(prim), axis, limit, below, padding)
    }

    fn shape(&self, prim: u32) -> Option<[u32; 10]> {
        // A copy in another mesh may outlive this one.
        let mesh = self.firsts.partition_point(|&first| first <= prim) as u32;
        Some(triangle_bits(self.vertices(prim), mesh))
    }
}

/// Bounds of a triangle; empty if no ray can hit it.
fn triangle_bounds([a, b, c]: [Vec3; 3]) -> Aabb {
    // With two equal vertices the edge functions cancel exactly, so no ray can hit.
    if a == b || b == c || c == a { Aabb::EMPTY } else { Aabb::from_points([a, b, c]) }
}

/// The bits of a triangle for [`Primitives::shape`], among triangles of the same group.
fn triangle_bits(vertices: [Vec3; 3], group: u32) -> [u32; 10] {
    let [a, b, c] = vertices.map(|vertex| vertex.to_array().map(f32::to_bits));
    [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2], group]
}

impl MeshTree {
    /// Builds the tree. Indices must lie within `positions`, and positions must be finite.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]], preset: BuildPreset) -> Self {
        Self::build_by(positions, triangles, preset.config(BLOCK))
    }

    /// Like [`build`](Self::build), but leaves of at most `leaf_limit` triangles, at least 1, are never split further,
    /// whatever the cost; for comparison. [`Self::build`] decides by the cost, or in a median tree by the block size.
    pub fn build_limited(positions: &[Vec3], triangles: &[[u32; 3]], preset: BuildPreset, leaf_limit: usize) -> Self {
        Self::build_by(positions, triangles, BuildConfig { leaf_limit: leaf_limit.max(1), ..preset.config(BLOCK) })
    }

    /// Like [`build`](Self::build), but the tree is built when something asks for it first.
    pub fn deferred(positions: &[Vec3], triangles: &[[u32; 3]], preset: BuildPreset) -> Self {
        assert!(triangles.len() < MAX_PRIMS, "a mesh of more than 2^31 triangles");
        let (positions, triangles) = (positions.to_vec(), triangles.to_vec());
        let view = LeafTriangles { positions: &positions, triangles: &triangles, firsts: &[] };
        let boxes = (0..triangles.len() as u32).map(|prim| view.bounds(prim));
        let bounds = boxes.fold(Aabb::EMPTY, |all, one| if one.is_empty() { all } else { all.union(one) });
        let mesh = Arc::new(Triangles { positions, triangles, bounds });
        Self { mesh, config: preset.config(BLOCK), blocks: OnceLock::new() }
    }

    fn build_by(positions: &[Vec3], triangles: &[[u32; 3]], config: BuildConfig) -> Self {
        let tree = Self { config, ..Self::deferred(positions, triangles, BuildPreset::Best) };
        tree.blocks();
        tree
    }

    /// The same mesh with a tree of this preset, built now.
    pub fn rebuilt(&self, preset: BuildPreset) -> Self {
        let tree = Self { mesh: self.mesh.clone(), config: preset.config(BLOCK), blocks: OnceLock::new() };
        tree.blocks();
        tree
    }

    /// Memory of nodes and blocks, bytes; 0 if they are not built.
    pub fn bytes(&self) -> usize {
        self.blocks.get().map_or(0, |blocks| blocks.bytes())
    }

    /// Whether the tree is built.
    pub fn is_built(&self) -> bool {
        self.blocks.get().is_some()
    }

    /// Builds the tree if it is not built yet.
    pub fn ensure_built(&self) {
        self.blocks();
    }

    /// The tree, built now if it is not yet.
    pub(super) fn blocks(&self) -> &Arc<BlockTree<TriangleBlock>> {
        if let Some(blocks) = self.blocks.get() {
            return blocks;
        }
        // Not by `get_or_init`: while this thread waits for its helpers, it may take over work that asks for this tree.
        let Triangles { positions, triangles, .. } = &*self.mesh;
        let built = Arc::new(LeafTriangles { positions, triangles, firsts: &[] }.tree(&self.config));
        self.blocks.get_or_init(|| built)
    }

    /// The box around all triangles with an area; empty if there are none.
    pub fn bounds(&self) -> Aabb {
        self.mesh.bounds
    }

    /// Number of triangles of the mesh, including those without area.
    pub fn n_triangles(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// The three corners of a triangle, in the mesh's own space.
    #[inline]
    pub fn vertices(&self, prim: u32) -> [Vec3; 3] {
        self.mesh.vertices(prim)
    }

    /// Offers the triangles along the ray until no nearer hit is possible; `nearest` limits the ray, not `ray.t_max`.
    pub(super) fn offer_hits(&self, ray: &Ray, shear: &Shear, nearest: &mut Nearest, any: bool) {
        let tree_ray = TreeRay::new(ray.origin, ray.dir, shear, self.blocks().extent);
        self.blocks().nodes.walk(&tree_ray, nearest.t, |first, count| {
            self.offer_leaf(ray, shear, nearest, first, count);
            if any && nearest.found { f32::NEG_INFINITY } else { nearest.t }
        });
    }

    /// Counts the nodes, leaves and blocks that the closest-hit query of a ray visits, independent of the traversal
    /// used.
    pub fn count_visits(&self, ray: &Ray) -> Visits {
        let shear = Shear::new(ray.dir);
        let tree_ray = TreeRay::new(ray.origin, ray.dir, &shear, self.blocks().extent);
        let mut nearest = Nearest::before(ray.t_max);
        let (mut leaves, mut blocks, mut inner) = (0, 0, 0);
        let visit = |first, count, _| {
            (leaves, blocks) = (leaves + 1, blocks + count as usize);
            self.offer_leaf(ray, &shear, &mut nearest, first, count);
            nearest.t
        };
        self.blocks().nodes.walk_cells(&tree_ray, 0.0, ray.t_max, visit, || inner += 1);
        Visits { inner, leaves, blocks }
    }

    /// Counts the nodes, leaves and blocks along an unobstructed ray, without empty leaves: [`KdTreeStats`] has the
    /// mean over all lines through the bounds.
    ///
    /// [`KdTreeStats`]: super::KdTreeStats
    pub fn count_visits_through(&self, ray: &Ray) -> Visits {
        let tree_ray = TreeRay::new(ray.origin, ray.dir, &Shear::new(ray.dir), self.blocks().extent);
        let (mut leaves, mut blocks, mut inner) = (0, 0, 0);
        let visit = |_, count, _| {
            (leaves, blocks) = (leaves + 1, blocks + count as usize);
            ray.t_max
        };
        self.blocks().nodes.walk_cells(&tree_ray, 0.0, ray.t_max, visit, || inner += 1);
        Visits { inner, leaves, blocks }
    }

    #[inline]
    fn offer_leaf(&self, ray: &Ray, shear: &Shear, nearest: &mut Nearest, first: u32, count: u32) {
        for prim in self.blocks().leaf(first, count).prims() {
            if let Some(hit) = intersect_triangle(ray.origin, shear, &self.vertices(prim)) {
                nearest.offer(hit.t, hit.u, hit.v, prim);
            }
        }
    }

    /// Like [`offer_hits`](Self::offer_hits), by brute force: the reference for all trees.
    pub(super) fn offer_hits_naive(&self, ray: &Ray, shear: &Shear, nearest: &mut Nearest) {
        for prim in 0..self.mesh.triangles.len() as u32 {
            if let Some(hit) = intersect_triangle(ray.origin, shear, &self.vertices(prim)) {
                nearest.offer(hit.t, hit.u, hit.v, prim);
            }
        }
    }
}
