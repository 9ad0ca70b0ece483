//! Kd-tree over the triangles of one mesh, in the mesh's own space.

use super::build::{BuildConfig, Primitives, build, clip_triangle};
use super::nodes::KdNodes;
use super::ray::{Nearest, TreeRay};
use super::simd::Simd;
use super::stats::Visits;
use super::wide::{WideNode, widen};
use crate::geometry::{Aabb, Ray, Shear, intersect_triangle};
use glam::Vec3;

/// How much time a build spends on the speed of its rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildPreset {
    /// A first picture within tens of milliseconds.
    Quick,
    /// The full surface area heuristic.
    #[default]
    Best,
    /// Split at the median, axes in turn: what the 1990s did; kept for comparison.
    Median,
}

impl BuildPreset {
    pub(super) fn config(self, block: usize) -> BuildConfig {
        let best = BuildConfig {
            bins: 16,
            exact_below: 32,
            block,
            block_cost: 3.0,
            empty_factor: 0.9,
            max_depth: 40,
            max_growth: 8.0,
            clip: true,
            median: false,
        };
        match self {
            Self::Best => best,
            Self::Quick => BuildConfig { bins: 8, exact_below: 0, clip: false, max_growth: 2.0, max_depth: 32, ..best },
            Self::Median => BuildConfig { clip: false, median: true, max_depth: 24, ..best },
        }
    }
}

/// Triangles in a leaf block: what one AVX-512 instruction tests.
pub(super) const BLOCK: usize = 16;

/// Triangles of a leaf side by side, one array per coordinate.
///
/// Lanes without a triangle hold NaN, which no comparison lets through.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct TriangleBlock {
    /// `vertices[k][axis][lane]`.
    pub vertices: [[[f32; BLOCK]; 3]; 3],
    /// Ascending. The highest bit of the first says that the leaf goes on in the next block.
    prims: [u32; BLOCK],
}

const FOLLOWED: u32 = 1 << 31;
const _: () = assert!(size_of::<TriangleBlock>() == 640);

/// Bit by bit, for the empty lanes are NaN.
impl PartialEq for TriangleBlock {
    fn eq(&self, other: &Self) -> bool {
        let bits = |block: &Self| block.vertices.map(|vertex| vertex.map(|axis| axis.map(f32::to_bits)));
        self.prims == other.prims && bits(self) == bits(other)
    }
}

impl TriangleBlock {
    fn new(prims: &[u32], triangle: impl Fn(u32) -> [Vec3; 3]) -> Self {
        let mut block = Self { vertices: [[[f32::NAN; BLOCK]; 3]; 3], prims: [u32::MAX; BLOCK] };
        for (lane, &prim) in prims.iter().enumerate() {
            block.prims[lane] = prim;
            for (vertex, position) in block.vertices.iter_mut().zip(triangle(prim)) {
                for axis in 0..3 {
                    vertex[axis][lane] = position[axis];
                }
            }
        }
        block
    }

    #[inline(always)]
    pub fn prim(&self, lane: usize) -> u32 {
        self.prims[lane] & !FOLLOWED
    }

    /// Whether the leaf goes on in the next block.
    #[inline(always)]
    pub fn is_followed(&self) -> bool {
        self.prims[0] & FOLLOWED != 0
    }

    /// [`Self::len`] in two instructions.
    #[inline(always)]
    pub fn count<S: Simd>(&self, s: S) -> usize {
        s.lt_u(s.load_u(&self.prims), s.splat_u(u32::MAX)).count_ones() as usize
    }

    /// How many lanes hold a triangle.
    pub fn len(&self) -> usize {
        self.prims.iter().filter(|&&prim| prim != u32::MAX).count()
    }

    fn triangle(&self, lane: usize) -> [Vec3; 3] {
        self.vertices.map(|vertex| Vec3::from_array(vertex.map(|axis| axis[lane])))
    }
}

/// Built once from a mesh and never edited; a changed mesh gets a new tree.
#[derive(Debug, PartialEq)]
pub struct MeshTree {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// The tree for packets, picking and as the reference.
    pub(super) nodes: KdNodes,
    /// The same tree for streams.
    pub(super) wide: Vec<WideNode>,
    pub(super) blocks: Vec<TriangleBlock>,
    pub(super) extent: f32,
}

/// What the builder sees of a mesh.
struct Triangles<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
}

impl Triangles<'_> {
    fn vertices(&self, prim: u32) -> [Vec3; 3] {
        self.triangles[prim as usize].map(|vertex| self.positions[vertex as usize])
    }
}

impl Primitives for Triangles<'_> {
    fn len(&self) -> usize {
        self.triangles.len()
    }

    fn bounds(&self, prim: u32) -> Aabb {
        let [a, b, c] = self.vertices(prim);
        // Two equal vertices: the edge functions cancel exactly, no ray can hit.
        if a == b || b == c || c == a { Aabb::EMPTY } else { Aabb::from_points([a, b, c]) }
    }

    fn clipped(&self, prim: u32, axis: usize, limit: f32, below: bool, padding: f32) -> Option<Aabb> {
        clip_triangle(&self.vertices(prim), axis, limit, below, padding)
    }
}

impl MeshTree {
    /// Indices must lie within `positions`, and positions must be finite.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]], preset: BuildPreset) -> Self {
        assert!(triangles.len() < FOLLOWED as usize, "a mesh of more than 2^31 triangles");
        let (positions, triangles) = (positions.to_vec(), triangles.to_vec());
        let view = Triangles { positions: &positions, triangles: &triangles };
        let mut blocks = Vec::new();
        let nodes = build(&view, &preset.config(BLOCK), |prims| {
            let first = blocks.len() as u32;
            blocks.extend(prims.chunks(BLOCK).map(|prims| TriangleBlock::new(prims, |prim| view.vertices(prim))));
            let n_followed = blocks.len().saturating_sub(first as usize + 1);
            blocks[first as usize..][..n_followed]
                .iter_mut()
                .for_each(|block: &mut TriangleBlock| block.prims[0] |= FOLLOWED);
            (first, blocks.len() as u32 - first)
        });
        let (extent, wide) = (nodes.extent(), widen(&nodes));
        Self { positions, triangles, nodes, wide, blocks, extent }
    }

    /// The box around all triangles with an area; empty if there are none.
    pub fn bounds(&self) -> Aabb {
        self.nodes.bounds
    }

    pub fn n_triangles(&self) -> usize {
        self.triangles.len()
    }

    /// The three corners of a triangle, in the mesh's own space.
    #[inline]
    pub fn vertices(&self, prim: u32) -> [Vec3; 3] {
        self.triangles[prim as usize].map(|vertex| self.positions[vertex as usize])
    }

    /// Whether the tree outgrows the caches, so that asking for memory in advance pays.
    pub(super) fn is_large(&self) -> bool {
        self.blocks.len() * size_of::<TriangleBlock>() > 1 << 20
    }

    /// Offers the triangles along the ray until nothing nearer can come; `ray.t_max` does not count, `nearest` does.
    pub(super) fn offer_hits(&self, ray: &Ray, shear: &Shear, nearest: &mut Nearest, any: bool) {
        let tree_ray = TreeRay::new(ray.origin, ray.dir, shear, self.extent);
        self.nodes.walk(&tree_ray, nearest.t, |first, count| {
            self.offer_leaf(ray, shear, nearest, first, count);
            if any && nearest.found { f32::NEG_INFINITY } else { nearest.t }
        });
    }

    /// What the nearest hit of a ray costs, whatever traversal finds it.
    pub fn count_visits(&self, ray: &Ray) -> Visits {
        let shear = Shear::new(ray.dir);
        let tree_ray = TreeRay::new(ray.origin, ray.dir, &shear, self.extent);
        let mut nearest = Nearest::before(ray.t_max);
        let (mut leaves, mut blocks, mut inner) = (0, 0, 0);
        let visit = |first, count| {
            (leaves, blocks) = (leaves + 1, blocks + count as usize);
            self.offer_leaf(ray, &shear, &mut nearest, first, count);
            nearest.t
        };
        self.nodes.walk_counting(&tree_ray, ray.t_max, visit, || inner += 1);
        Visits { inner, leaves, blocks }
    }

    #[inline]
    fn offer_leaf(&self, ray: &Ray, shear: &Shear, nearest: &mut Nearest, first: u32, count: u32) {
        for block in &self.blocks[first as usize..][..count as usize] {
            for lane in 0..BLOCK {
                if let Some(hit) = intersect_triangle(ray.origin, shear, &block.triangle(lane)) {
                    nearest.offer(hit.t, hit.u, hit.v, block.prim(lane));
                }
            }
        }
    }

    /// The same by trying every triangle: the reference for all trees.
    pub(super) fn offer_hits_naive(&self, ray: &Ray, shear: &Shear, nearest: &mut Nearest) {
        for prim in 0..self.triangles.len() as u32 {
            if let Some(hit) = intersect_triangle(ray.origin, shear, &self.vertices(prim)) {
                nearest.offer(hit.t, hit.u, hit.v, prim);
            }
        }
    }
}
