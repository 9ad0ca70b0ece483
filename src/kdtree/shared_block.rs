//! Leaf blocks of half the bytes: triangles that share their vertices.
//!
//! The triangles of a leaf are neighbours on a surface, and sixteen of them rarely have more than sixteen vertices.
//! Each vertex is kept, fetched and sheared once; the corners are looked up in registers. A corner gets the bits that it has in a
//! [`TriangleBlock`](super::blocks::TriangleBlock), so both find the same hits.

use super::blocks::{BLOCK, LeafBlock, NoBlock, Prims, ShearedRay};
use super::lanes::{LaneHits, may_hit, resolve};
use super::simd::Simd;
use glam::Vec3;

/// Up to sixteen triangles over up to sixteen vertices.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct SharedBlock {
    /// `[axis][vertex]`; 0 where there is none.
    vertices: [[f32; BLOCK]; 3],
    /// For each triangle the numbers of its vertices, four bits each. Lanes without a triangle repeat the first one, which
    /// loses every tie against itself.
    corners: [u32; BLOCK],
    prims: Prims,
}
const _: () = assert!(size_of::<SharedBlock>() == 320);

/// Bit by bit.
impl PartialEq for SharedBlock {
    fn eq(&self, other: &Self) -> bool {
        let bits = |block: &Self| (block.vertices.map(|axis| axis.map(f32::to_bits)), block.corners);
        self.prims == other.prims && bits(self) == bits(other)
    }
}

impl SharedBlock {
    /// The blocks of a leaf, or none where vertices are shared so little that plain blocks would be fewer.
    pub fn pack_if_small(prims: &[u32], triangle: impl Fn(u32) -> [Vec3; 3]) -> Vec<Self> {
        let blocks = Self::pack(prims, triangle);
        if blocks.len() > prims.len().div_ceil(BLOCK) { Vec::new() } else { blocks }
    }

    /// As many blocks as these primitives need, in their order.
    fn pack(prims: &[u32], triangle: impl Fn(u32) -> [Vec3; 3]) -> Vec<Self> {
        let mut blocks = Vec::new();
        let mut table = VertexTable::EMPTY;
        let mut first = 0;
        let mut corners = [0; BLOCK];
        for (i, &prim) in prims.iter().enumerate() {
            let points = triangle(prim);
            let mut packed = if i - first < BLOCK { table.add(&points) } else { None };
            if packed.is_none() {
                blocks.push(Self::new(&table, &corners[..i - first], &prims[first..i]));
                (table, first) = (VertexTable::EMPTY, i);
                packed = table.add(&points);
            }
            corners[i - first] = packed.unwrap_or(0);
        }
        blocks.push(Self::new(&table, &corners[..prims.len() - first], &prims[first..]));
        blocks
    }

    fn new(table: &VertexTable, corners: &[u32], prims: &[u32]) -> Self {
        let mut all = [corners[0]; BLOCK];
        all[..corners.len()].copy_from_slice(corners);
        Self { vertices: table.points.map(|axis| axis.map(f32::from_bits)), corners: all, prims: Prims::new(prims) }
    }

    #[inline(always)]
    pub fn corner(&self, lane: usize, corner: usize) -> [f32; 3] {
        let vertex = (self.corners[lane] >> (4 * corner)) as usize % BLOCK;
        [self.vertices[0][vertex], self.vertices[1][vertex], self.vertices[2][vertex]]
    }

    /// What sixteen vertices have, for each of the three corners of sixteen triangles.
    #[inline(always)]
    pub fn by_corner<S: Simd>(&self, s: S, of_vertices: S::F) -> [S::F; 3] {
        let corners = s.load_u(&self.corners);
        [
            s.lookup(of_vertices, corners),
            s.lookup(of_vertices, s.shr_u(corners, 4)),
            s.lookup(of_vertices, s.shr_u(corners, 8)),
        ]
    }

    #[inline(always)]
    pub fn vertices(&self) -> &[[f32; BLOCK]; 3] {
        &self.vertices
    }
}

/// Vertices so far, by their bits.
struct VertexTable {
    /// `[axis][vertex]`.
    points: [[u32; BLOCK]; 3],
    len: usize,
}

impl VertexTable {
    const EMPTY: Self = Self { points: [[0; BLOCK]; 3], len: 0 };

    /// The packed numbers of three vertices; `None`, and nothing is changed, if there is no room for them.
    fn add(&mut self, triangle: &[Vec3; 3]) -> Option<u32> {
        let (len, mut packed) = (self.len, 0);
        for (corner, point) in triangle.iter().enumerate() {
            let [x, y, z] = point.to_array().map(f32::to_bits);
            let [xs, ys, zs] = &self.points;
            // All at once, which takes fewer steps than stopping at the right one.
            let same = (0..BLOCK).fold(0u32, |same, i| same | u32::from(xs[i] == x && ys[i] == y && zs[i] == z) << i);
            let known = same & ((1 << self.len) - 1);
            let vertex = if known != 0 { known.trailing_zeros() as usize } else { self.len };
            if vertex == BLOCK {
                self.len = len;
                return None;
            }
            (self.points[0][vertex], self.points[1][vertex], self.points[2][vertex]) = (x, y, z);
            self.len = self.len.max(vertex + 1);
            packed |= (vertex as u32) << (4 * corner);
        }
        Some(packed)
    }
}

impl LeafBlock for SharedBlock {
    type Ray = ShearedRay;
    type Compact = NoBlock<ShearedRay>;

    #[inline(always)]
    fn prims(&self) -> &Prims {
        &self.prims
    }

    fn prims_mut(&mut self) -> &mut Prims {
        &mut self.prims
    }

    #[inline(always)]
    fn hits<S: Simd>(s: S, block: &Self, ray: &ShearedRay) -> LaneHits<S> {
        let [x, y, z] = ray.shear(s, &block.vertices);
        let ([ax, bx, cx], [ay, by, cy]) = (block.by_corner(s, x), block.by_corner(s, y));
        let mask = may_hit(s, &[ax, ay, z], &[bx, by, z], &[cx, cy, z]);
        if mask == 0 {
            return LaneHits::none(s);
        }
        let [az, bz, cz] = block.by_corner(s, z);
        resolve(s, mask, &[ax, ay, az], &[bx, by, bz], &[cx, cy, cz], s.splat(ray.sz))
    }
}
