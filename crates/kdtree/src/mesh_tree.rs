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

/// A kd-tree over a mesh, built once and never edited; a changed mesh gets a new tree.
#[derive(Debug, PartialEq)]
pub struct MeshTree {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) tree: BlockTree<TriangleBlock>,
}

/// The builder's view of a mesh.
struct LeafTriangles<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
}

impl LeafTriangles<'_> {
    fn vertices(&self, prim: u32) -> [Vec3; 3] {
        self.triangles[prim as usize].map(|vertex| self.positions[vertex as usize])
    }
}

impl Primitives for LeafTriangles<'_> {
    fn len(&self) -> usize {
        self.triangles.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        let [a, b, c] = self.vertices(prim);
        // With two equal vertices the edge functions cancel exactly, so no ray can hit.
        if a == b || b == c || c == a { Aabb::EMPTY } else { Aabb::from_points([a, b, c]) }
    }

    fn clipped(&self, prim: u32, axis: usize, limit: f32, below: bool, padding: f32) -> Option<Aabb> {
        clip_triangle(&self.vertices(prim), axis, limit, below, padding)
    }

    fn shape(&self, prim: u32) -> Option<[u32; 9]> {
        let [a, b, c] = self.vertices(prim).map(|vertex| vertex.to_array().map(f32::to_bits));
        Some([a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]])
    }
}

impl MeshTree {
    /// Builds the tree. Indices must lie within `positions`, and positions must be finite.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]], preset: BuildPreset) -> Self {
        Self::build_by(positions, triangles, &preset.config(BLOCK))
    }

    /// Like [`build`](Self::build), but leaves of at most `leaf_limit` triangles, at least 1, are never split further,
    /// whatever the cost; for comparison. [`Self::build`] decides by the cost, or in a median tree by the block size.
    pub fn build_limited(positions: &[Vec3], triangles: &[[u32; 3]], preset: BuildPreset, leaf_limit: usize) -> Self {
        Self::build_by(positions, triangles, &BuildConfig { leaf_limit: leaf_limit.max(1), ..preset.config(BLOCK) })
    }

    fn build_by(positions: &[Vec3], triangles: &[[u32; 3]], config: &BuildConfig) -> Self {
        assert!(triangles.len() < MAX_PRIMS, "a mesh of more than 2^31 triangles");
        let (positions, triangles) = (positions.to_vec(), triangles.to_vec());
        let view = LeafTriangles { positions: &positions, triangles: &triangles };
        let vertices = |prim| view.vertices(prim);
        let make_block = |prims: &[u32]| TriangleBlock::new(prims, vertices);
        let tree = BlockTree::build(&view, config, make_block, |prims| SharedBlock::pack_if_small(prims, vertices));
        Self { positions, triangles, tree }
    }

    /// The box around all triangles with an area; empty if there are none.
    pub fn bounds(&self) -> Aabb {
        self.tree.nodes.bounds
    }

    /// Number of triangles of the mesh, including those without area.
    pub fn n_triangles(&self) -> usize {
        self.triangles.len()
    }

    /// The three corners of a triangle, in the mesh's own space.
    #[inline]
    pub fn vertices(&self, prim: u32) -> [Vec3; 3] {
        self.triangles[prim as usize].map(|vertex| self.positions[vertex as usize])
    }

    /// Offers the triangles along the ray until no nearer hit is possible; `nearest` limits the ray, not `ray.t_max`.
    pub(super) fn offer_hits(&self, ray: &Ray, shear: &Shear, nearest: &mut Nearest, any: bool) {
        let tree_ray = TreeRay::new(ray.origin, ray.dir, shear, self.tree.extent);
        self.tree.nodes.walk(&tree_ray, nearest.t, |first, count| {
            self.offer_leaf(ray, shear, nearest, first, count);
            if any && nearest.found { f32::NEG_INFINITY } else { nearest.t }
        });
    }

    /// Counts the nodes, leaves and blocks that the closest-hit query of a ray visits, independent of the traversal
    /// used.
    pub fn count_visits(&self, ray: &Ray) -> Visits {
        let shear = Shear::new(ray.dir);
        let tree_ray = TreeRay::new(ray.origin, ray.dir, &shear, self.tree.extent);
        let mut nearest = Nearest::before(ray.t_max);
        let (mut leaves, mut blocks, mut inner) = (0, 0, 0);
        let visit = |first, count, _| {
            (leaves, blocks) = (leaves + 1, blocks + count as usize);
            self.offer_leaf(ray, &shear, &mut nearest, first, count);
            nearest.t
        };
        self.tree.nodes.walk_cells(&tree_ray, 0.0, ray.t_max, visit, || inner += 1);
        Visits { inner, leaves, blocks }
    }

    /// Counts the nodes, leaves and blocks along an unobstructed ray, without empty leaves: [`KdTreeStats`] has the
    /// mean over all lines through the bounds.
    ///
    /// [`KdTreeStats`]: super::KdTreeStats
    pub fn count_visits_through(&self, ray: &Ray) -> Visits {
        let tree_ray = TreeRay::new(ray.origin, ray.dir, &Shear::new(ray.dir), self.tree.extent);
        let (mut leaves, mut blocks, mut inner) = (0, 0, 0);
        let visit = |_, count, _| {
            (leaves, blocks) = (leaves + 1, blocks + count as usize);
            ray.t_max
        };
        self.tree.nodes.walk_cells(&tree_ray, 0.0, ray.t_max, visit, || inner += 1);
        Visits { inner, leaves, blocks }
    }

    #[inline]
    fn offer_leaf(&self, ray: &Ray, shear: &Shear, nearest: &mut Nearest, first: u32, count: u32) {
        for prim in self.tree.leaf(first, count).prims() {
            if let Some(hit) = intersect_triangle(ray.origin, shear, &self.vertices(prim)) {
                nearest.offer(hit.t, hit.u, hit.v, prim);
            }
        }
    }

    /// Like [`offer_hits`](Self::offer_hits), by brute force: the reference for all trees.
    pub(super) fn offer_hits_naive(&self, ray: &Ray, shear: &Shear, nearest: &mut Nearest) {
        for prim in 0..self.triangles.len() as u32 {
            if let Some(hit) = intersect_triangle(ray.origin, shear, &self.vertices(prim)) {
                nearest.offer(hit.t, hit.u, hit.v, prim);
            }
        }
    }
}
