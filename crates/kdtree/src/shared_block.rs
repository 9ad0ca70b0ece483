//! Compact leaf blocks of triangles that share vertices: half the bytes of a regular block.
//!
//! The triangles of a leaf are neighbours on a surface, and sixteen of them rarely have more than sixteen vertices.
//! Each vertex is stored, fetched and sheared once; the corners are looked up in registers. With eight lanes per register
//! that takes long, so triangles that lie beside the ray are left out first, by a byte for each vertex. A corner has the
//! same bits as in a [`TriangleBlock`](super::blocks::TriangleBlock), so both find the same hits.

use super::lanes::{LaneHits, Sheared, may_hit, resolve};
use super::leaf::{BLOCK, LeafBlock, NoBlock, Prims, ShearedRay, offer};
use super::present::PresentPrimitives;
use super::ray::Nearest;
use super::simd::{Corners, Eight, KernelSimd, Mask};
use firstlight_simd::three;
use glam::Vec3;

/// Up to sixteen triangles over up to sixteen vertices.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct SharedBlock {
    /// `[axis][vertex]`; 0 in unused entries.
    vertices: [[f32; BLOCK]; 3],
    /// For each corner the vertices of the triangles. Lanes without a triangle repeat the first one, which loses every
    /// tie against itself.
    corners: Corners,
    /// The lanes with a triangle.
    filled: Mask,
    prims: Prims,
}
const _: () = assert!(size_of::<SharedBlock>() == 320);

/// Compares bits.
impl PartialEq for SharedBlock {
    fn eq(&self, other: &Self) -> bool {
        let bits = |block: &Self| (block.vertices.map(|axis| axis.map(f32::to_bits)), block.corners, block.filled);
        self.prims == other.prims && bits(self) == bits(other)
    }
}

impl SharedBlock {
    /// Packs a leaf; returns no blocks if vertices are shared so little that regular blocks would be fewer.
    pub fn pack_if_small(prims: &[u32], triangle: impl Fn(u32) -> [Vec3; 3]) -> Vec<Self> {
        let blocks = Self::pack(prims, triangle);
        if blocks.len() > prims.len().div_ceil(BLOCK) { Vec::new() } else { blocks }
    }

    /// Packs the primitives, in their order, into as many blocks as they need.
    fn pack(prims: &[u32], triangle: impl Fn(u32) -> [Vec3; 3]) -> Vec<Self> {
        let mut blocks = Vec::new();
        let mut table = VertexTable::EMPTY;
        let mut first = 0;
        let mut corners = [[0; 3]; BLOCK];
        for (i, &prim) in prims.iter().enumerate() {
            let points = triangle(prim);
            let mut packed = if i - first < BLOCK { table.add(&points) } else { None };
            if packed.is_none() {
                blocks.push(Self::new(&table, &corners[..i - first], &prims[first..i]));
                (table, first) = (VertexTable::EMPTY, i);
                packed = table.add(&points);
            }
            corners[i - first] = packed.unwrap_or_default();
        }
        blocks.push(Self::new(&table, &corners[..prims.len() - first], &prims[first..]));
        blocks
    }

    fn new(table: &VertexTable, triangles: &[[u8; 3]], prims: &[u32]) -> Self {
        let of = |corner: usize| {
            let at = |lane: usize| triangles.get(lane).unwrap_or(&triangles[0])[corner];
            std::array::from_fn(at)
        };
        Self {
            vertices: table.points.map(|axis| axis.map(f32::from_bits)),
            corners: [of(0), of(1), of(2)],
            filled: Mask::MAX >> (BLOCK - triangles.len()),
            prims: Prims::new(prims),
        }
    }

    #[inline(always)]
    pub fn corner(&self, lane: usize, corner: usize) -> [f32; 3] {
        let vertex = self.corners[corner][lane] as usize % BLOCK;
        [self.vertices[0][vertex], self.vertices[1][vertex], self.vertices[2][vertex]]
    }

    /// Returns the triangles whose three vertices all lie above 0, or all below, see [`KernelSimd::beside`].
    #[inline(always)]
    pub fn beside<S: KernelSimd>(&self, s: S, low: S::F, high: S::F) -> Mask {
        s.beside(low, high, &self.corners)
    }

    #[inline(always)]
    pub fn vertices(&self) -> &[[f32; BLOCK]; 3] {
        &self.vertices
    }
}

/// The vertices of a block, compared by their bits.
struct VertexTable {
    /// `[axis][vertex]`.
    points: [[u32; BLOCK]; 3],
    len: usize,
}

impl VertexTable {
    const EMPTY: Self = Self { points: [[0; BLOCK]; 3], len: 0 };

    /// Returns the indices of three vertices; `None`, with the table unchanged, if they do not fit.
    fn add(&mut self, triangle: &[Vec3; 3]) -> Option<[u8; 3]> {
        let (len, mut corners) = (self.len, [0; 3]);
        for (corner, point) in triangle.iter().enumerate() {
            let [x, y, z] = point.to_array().map(f32::to_bits);
            let [xs, ys, zs] = &self.points;
            // Compares all entries, which takes fewer steps than stopping at the right one.
            let same = (0..BLOCK).fold(0u32, |same, i| same | u32::from(xs[i] == x && ys[i] == y && zs[i] == z) << i);
            let known = same & ((1 << self.len) - 1);
            let vertex = if known != 0 { known.trailing_zeros() as usize } else { self.len };
            if vertex == BLOCK {
                self.len = len;
                return None;
            }
            (self.points[0][vertex], self.points[1][vertex], self.points[2][vertex]) = (x, y, z);
            self.len = self.len.max(vertex + 1);
            corners[corner] = vertex as u8;
        }
        Some(corners)
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
    fn hits<S: KernelSimd>(s: S, block: &Self, ray: &ShearedRay) -> LaneHits<S> {
        let vertices = ray.shear(s, &block.vertices);
        let corners = three!(|k| s.load_bytes(&block.corners[k]));
        hits_of(s, &vertices, &corners, ray.sz)
    }

    #[inline(always)]
    fn test<S: KernelSimd>(
        s: S,
        block: &Self,
        ray: &ShearedRay,
        nearest: &mut Nearest,
        present: Option<&PresentPrimitives>,
    ) {
        if !S::IS_NARROW {
            return offer(s, Self::hits(s, block, ray), nearest, present, |lane| block.prims.get(lane));
        }
        let vertices = ray.shear(s, &block.vertices);
        let [x, y, _] = vertices;
        let mut left = block.filled & !(block.beside(s, x, x) | block.beside(s, y, y));
        while left != 0 {
            let some = if left.count_ones() <= 8 { left } else { left & 0xFF };
            left &= !some;
            let Eight { corners, places } = s.first_eight(some, &block.corners);
            let mut hits = hits_of(s, &vertices, &corners, ray.sz);
            hits.mask &= (1 << some.count_ones()) - 1;
            offer(s, hits, nearest, present, |lane| block.prims.get((places >> (8 * lane)) as usize % BLOCK));
        }
    }
}

/// Intersects triangles over sheared vertices, with all lanes of `corners`.
#[inline(always)]
fn hits_of<S: KernelSimd>(s: S, vertices: &Sheared<S>, corners: &[S::U; 3], sz: f32) -> LaneHits<S> {
    let [x, y, z] = *vertices;
    let [ax, bx, cx] = three!(|k| s.lookup(x, corners[k]));
    let [ay, by, cy] = three!(|k| s.lookup(y, corners[k]));
    let mask = may_hit(s, &[ax, ay, z], &[bx, by, z], &[cx, cy, z]);
    if mask == 0 {
        return LaneHits::none(s);
    }
    let [az, bz, cz] = three!(|k| s.lookup(z, corners[k]));
    resolve(s, mask, &[ax, ay, az], &[bx, by, bz], &[cx, cy, cz], s.splat(sz))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::TriangleBlock;
    use crate::geometry::{Ray, Shear};
    use crate::leaf::LeafRay;
    use crate::ray::Nearest;
    use crate::simd::{InstructionSet, dispatch};
    use glam::vec3;
    use proptest::prelude::*;

    /// Triangles over few distinct points, some of which differ in the sign of a zero only.
    fn triangles() -> impl Strategy<Value = Vec<[Vec3; 3]>> {
        (2usize..60, any::<u64>(), 1usize..70).prop_map(|(n_places, seed, n_triangles)| {
            let mut state = seed;
            let mut next = move || {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 33) as u32
            };
            let mut number = || [0.0, -0.0, 1.0, next() as f32 / 1e9 - 1.0][next() as usize % 4];
            let places: Vec<Vec3> = (0..n_places).map(|_| vec3(number(), number(), number())).collect();
            (0..n_triangles).map(|_| [0; 3].map(|_| places[next() as usize % n_places])).collect()
        })
    }

    fn bits(triangle: [Vec3; 3]) -> [[u32; 3]; 3] {
        triangle.map(|vertex| vertex.to_array().map(f32::to_bits))
    }

    type Answer = Vec<Option<(u32, [u32; 3])>>;

    #[inline(always)]
    fn nearest_of<S: KernelSimd, B: LeafBlock<Ray = ShearedRay>>(
        s: S,
        blocks: &[B],
        ray: &Ray,
    ) -> Option<(u32, [u32; 3])> {
        let sheared = ShearedRay::new(ray, &Shear::new(ray.dir));
        let mut nearest = Nearest::before(f32::INFINITY);
        for block in blocks {
            B::test(s, block, &sheared, &mut nearest, None);
        }
        nearest.found.then(|| (nearest.prim, [nearest.t, nearest.u, nearest.v].map(f32::to_bits)))
    }

    #[inline(always)]
    fn test_both<S: KernelSimd>(
        s: S,
        shared: &[SharedBlock],
        plain: &[TriangleBlock],
        rays: &[Ray],
        out: &mut [Answer; 2],
    ) {
        for ray in rays {
            out[0].push(nearest_of(s, shared, ray));
            out[1].push(nearest_of(s, plain, ray));
        }
    }

    proptest! {
        #![proptest_config(crate::geometry::robust::fixed_cases(400))]

        #[test]
        fn every_corner_keeps_its_bits_and_its_place(triangles in triangles()) {
            let prims: Vec<u32> = (0..triangles.len() as u32).map(|prim| 3 * prim + 1).collect();
            let blocks = SharedBlock::pack(&prims, |prim| triangles[prim as usize / 3]);
            let mut unpacked = Vec::new();
            for block in &blocks {
                for lane in 0..block.prims.len() {
                    let corner = |corner| Vec3::from_array(block.corner(lane, corner));
                    unpacked.push((block.prims.get(lane), bits([corner(0), corner(1), corner(2)])));
                }
            }
            let expected: Vec<_> = prims.iter().map(|&prim| (prim, bits(triangles[prim as usize / 3]))).collect();
            prop_assert_eq!(unpacked, expected);
            // With all vertices in one block, only the number of triangles limits it.
            let mut places: Vec<_> = triangles.iter().flat_map(|triangle| bits(*triangle)).collect();
            places.sort_unstable();
            places.dedup();
            if places.len() <= BLOCK {
                prop_assert_eq!(blocks.len(), prims.len().div_ceil(BLOCK));
            }
        }

        #[test]
        fn hits_are_those_of_plain_blocks(triangles in triangles(), aims in proptest::array::uniform8(-1.0f32..1.0)) {
            let prims: Vec<u32> = (0..triangles.len() as u32).collect();
            let triangle = |prim: u32| triangles[prim as usize];
            let shared = &SharedBlock::pack(&prims, triangle)[..];
            let plain: Vec<_> = prims.chunks(BLOCK).map(|prims| TriangleBlock::new(prims, triangle)).collect();
            let plain = &plain[..];
            // Rays into the middle of a triangle or past all of them; some along an axis.
            let rays: Vec<Ray> = (0..32)
                .map(|i| {
                    let origin = vec3(2.0, -1.5, 3.0) * aims[i % 8];
                    let to = triangles[i % triangles.len()].iter().sum::<Vec3>() / 3.0 - origin;
                    let dir = if i % 5 == 0 { vec3(0.0, 0.0, to.z) } else { to };
                    Ray::new(origin, if dir == Vec3::ZERO { Vec3::X } else { dir })
                })
                .collect();
            let rays = &rays[..];
            for set in InstructionSet::available() {
                let mut answers: [Answer; 2] = Default::default();
                let out = &mut answers;
                dispatch!(set, test_both(shared: &[SharedBlock], plain: &[TriangleBlock], rays: &[Ray], out: &mut [Answer; 2]));
                prop_assert_eq!(&answers[0], &answers[1], "{:?}", set);
            }
        }
    }

    #[test]
    fn a_leaf_without_shared_vertices_is_not_packed() {
        let apart = |prim: u32| [0.0, 1.0, 2.0].map(|x| Vec3::splat(3.0 * prim as f32 + x));
        let fan = |prim: u32| [Vec3::ZERO, Vec3::splat(prim as f32 + 1.0), Vec3::splat(prim as f32 + 2.0)];
        let prims: Vec<u32> = (0..14).collect();
        assert!(SharedBlock::pack_if_small(&prims, apart).is_empty());
        assert_eq!(SharedBlock::pack_if_small(&prims, fan).len(), 1);
    }
}
