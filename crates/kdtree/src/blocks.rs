//! Leaf blocks of triangles, quads and spheres: sixteen primitives as structure of arrays, tested against one ray at a
//! time.

use super::lanes::{LaneHits, may_hit, quad_hits, resolve, sphere_hits};
use super::leaf::{BLOCK, LeafBlock, LeafRay, NoBlock, Prims, ShearedRay};
use super::shared_block::SharedBlock;
use super::simd::{KernelSimd, Mask};
use crate::geometry::{Ray, Shear};
use glam::Vec3;

/// `points[k][axis][lane]`; lanes without a primitive hold NaN, which fails every comparison.
type Points<const N: usize> = [[[f32; BLOCK]; 3]; N];

fn gather<const N: usize>(prims: &[u32], points: impl Fn(u32) -> [Vec3; N]) -> Points<N> {
    let mut gathered = [[[f32::NAN; BLOCK]; 3]; N];
    for (lane, &prim) in prims.iter().enumerate() {
        for (to, from) in gathered.iter_mut().zip(points(prim)) {
            (0..3).for_each(|axis| to[axis][lane] = from[axis]);
        }
    }
    gathered
}

/// Triangles by their vertices.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct TriangleBlock {
    pub vertices: Points<3>,
    pub prims: Prims,
}
const _: () = assert!(size_of::<TriangleBlock>() == 640);

/// Compares bits, because empty lanes are NaN.
impl PartialEq for TriangleBlock {
    fn eq(&self, other: &Self) -> bool {
        let bits = |block: &Self| block.vertices.map(|vertex| vertex.map(|axis| axis.map(f32::to_bits)));
        self.prims == other.prims && bits(self) == bits(other)
    }
}

impl TriangleBlock {
    pub fn new(prims: &[u32], triangle: impl Fn(u32) -> [Vec3; 3]) -> Self {
        Self { vertices: gather(prims, triangle), prims: Prims::new(prims) }
    }
}

impl LeafBlock for TriangleBlock {
    type Ray = ShearedRay;
    type Compact = SharedBlock;

    #[inline(always)]
    fn prims(&self) -> &Prims {
        &self.prims
    }

    fn prims_mut(&mut self) -> &mut Prims {
        &mut self.prims
    }

    #[inline(always)]
    fn hits<S: KernelSimd>(s: S, block: &Self, ray: &ShearedRay) -> LaneHits<S> {
        let [a, b, c] = &block.vertices;
        let (a, b, c) = (ray.shear(s, a), ray.shear(s, b), ray.shear(s, c));
        let mask = may_hit(s, &a, &b, &c);
        if mask == 0 {
            return LaneHits::none(s);
        }
        resolve(s, mask, &a, &b, &c, s.splat(ray.sz))
    }
}

/// Parallelograms by their corners, in the order of `geometry::quad_corners`.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct QuadBlock {
    corners: Points<4>,
    prims: Prims,
}

impl QuadBlock {
    pub fn new(prims: &[u32], corners: impl Fn(u32) -> [Vec3; 4]) -> Self {
        Self { corners: gather(prims, corners), prims: Prims::new(prims) }
    }
}

impl LeafBlock for QuadBlock {
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
        let [a, b, c, d] = &block.corners;
        let corners = [ray.shear(s, a), ray.shear(s, b), ray.shear(s, c), ray.shear(s, d)];
        quad_hits(s, Mask::MAX, corners.each_ref(), s.splat(ray.sz))
    }
}

/// Spheres by centre and radius.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct SphereBlock {
    /// `[axis][lane]`.
    center: [[f32; BLOCK]; 3],
    radius: [f32; BLOCK],
    prims: Prims,
}

/// Compares bits, because empty lanes are NaN.
impl PartialEq for SphereBlock {
    fn eq(&self, other: &Self) -> bool {
        let bits = |block: &Self| (block.center.map(|axis| axis.map(f32::to_bits)), block.radius.map(f32::to_bits));
        self.prims == other.prims && bits(self) == bits(other)
    }
}

impl SphereBlock {
    pub fn new(prims: &[u32], sphere: impl Fn(u32) -> (Vec3, f32)) -> Self {
        let [center] = gather(prims, |prim| [sphere(prim).0]);
        let mut radius = [f32::NAN; BLOCK];
        radius.iter_mut().zip(prims).for_each(|(radius, &prim)| *radius = sphere(prim).1);
        Self { center, radius, prims: Prims::new(prims) }
    }

    pub fn sphere(&self, lane: usize) -> (Vec3, f32) {
        (Vec3::from_array(self.center.map(|axis| axis[lane])), self.radius[lane])
    }
}

/// A ray converted to `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PreciseRay {
    origin: [f64; 3],
    dir: [f64; 3],
    inv_dir_squared: f64,
}

impl LeafRay for PreciseRay {
    const IDLE: Self = Self { origin: [0.0; 3], dir: [0.0; 3], inv_dir_squared: 0.0 };

    #[inline(always)]
    fn new(ray: &Ray, _shear: &Shear) -> Self {
        Self::of(ray.origin.as_dvec3().to_array(), ray.dir.as_dvec3().to_array())
    }
}

impl PreciseRay {
    #[inline(always)]
    pub fn of(origin: [f64; 3], dir: [f64; 3]) -> Self {
        let inv_dir_squared = 1.0 / (dir[0] * dir[0] + dir[1] * dir[1] + dir[2] * dir[2]);
        Self { origin, dir, inv_dir_squared }
    }
}

impl LeafBlock for SphereBlock {
    type Ray = PreciseRay;
    type Compact = NoBlock<PreciseRay>;

    #[inline(always)]
    fn prims(&self) -> &Prims {
        &self.prims
    }

    fn prims_mut(&mut self) -> &mut Prims {
        &mut self.prims
    }

    #[inline(always)]
    fn hits<S: KernelSimd>(s: S, block: &Self, ray: &PreciseRay) -> LaneHits<S> {
        let [x, y, z] = &block.center;
        let to_center = [
            s.sub_d(s.widen(s.load(x)), s.splat_d(ray.origin[0])),
            s.sub_d(s.widen(s.load(y)), s.splat_d(ray.origin[1])),
            s.sub_d(s.widen(s.load(z)), s.splat_d(ray.origin[2])),
        ];
        let radius = s.widen(s.load(&block.radius));
        let dir = [s.splat_d(ray.dir[0]), s.splat_d(ray.dir[1]), s.splat_d(ray.dir[2])];
        sphere_hits(s, Mask::MAX, &to_center, s.mul_d(radius, radius), &dir, s.splat_d(ray.inv_dir_squared))
    }
}
