//! Leaf blocks of triangles, quads and spheres: sixteen primitives as structure of arrays, tested against one ray at a
//! time.

use super::lanes::{LaneHits, may_hit, quad_hits, resolve, sphere_hits};
use super::leaf::{BLOCK, LeafBlock, LeafRay, NoBlock, Prims, ShearedRay, offer};
use super::present::PresentPrimitives;
use super::ray::Nearest;
use super::shared_block::SharedBlock;
use super::simd::{KernelSimd, Mask};
use crate::geometry::{Ray, Shear, intersect_sphere};
use firstlight_simd::three;
use glam::{DVec3, Vec3};

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

/// A ray converted to `f64`, and what is needed to find the spheres near it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PreciseRay {
    origin: [f64; 3],
    dir: [f64; 3],
    inv_dir_squared: f64,
    rounded: RoundedRay,
}

/// Origin, unit direction and length of the direction, rounded to `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RoundedRay {
    origin: [f32; 3],
    unit: [f32; 3],
    length: f32,
}

impl LeafRay for PreciseRay {
    const IDLE: Self = Self {
        origin: [0.0; 3],
        dir: [0.0; 3],
        inv_dir_squared: 0.0,
        rounded: RoundedRay { origin: [0.0; 3], unit: [0.0; 3], length: 0.0 },
    };

    #[inline(always)]
    fn new(ray: &Ray, _shear: &Shear) -> Self {
        Self::of(ray.origin.as_dvec3().to_array(), ray.dir.as_dvec3().to_array())
    }
}

impl PreciseRay {
    #[inline(always)]
    pub fn of(origin: [f64; 3], dir: [f64; 3]) -> Self {
        let dir_squared = dir[0] * dir[0] + dir[1] * dir[1] + dir[2] * dir[2];
        let (inv_dir_squared, length) = (1.0 / dir_squared, dir_squared.sqrt());
        let inv_length = length * inv_dir_squared;
        let rounded = RoundedRay {
            origin: origin.map(|x| x as f32),
            unit: dir.map(|x| (x * inv_length) as f32),
            length: length as f32,
        };
        Self { origin, dir, inv_dir_squared, rounded }
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

    #[inline(always)]
    fn test<S: KernelSimd>(
        s: S,
        block: &Self,
        ray: &PreciseRay,
        nearest: &mut Nearest,
        present: Option<&PresentPrimitives>,
    ) {
        /// More spheres are tested together.
        const FEW: u32 = 3;
        let mut near = block.near(s, &ray.rounded, nearest.t);
        if near.count_ones() > FEW {
            return offer(s, Self::hits(s, block, ray), nearest, present, |lane| block.prims.get(lane));
        }
        let (origin, dir) = (DVec3::from_array(ray.origin), DVec3::from_array(ray.dir));
        while near != 0 {
            let lane = near.trailing_zeros() as usize % BLOCK;
            near &= near - 1;
            let (center, radius) = block.sphere(lane);
            if let Some((t_near, t_far)) = intersect_sphere(origin, dir, ray.inv_dir_squared, center, radius) {
                let t = if t_near > 0.0 { t_near } else { t_far };
                nearest.offer(t, 0.0, 0.0, block.prims.get(lane));
            }
        }
    }

    /// The rounded ray takes as long as the test, unless sixteen lanes take two registers.
    #[inline(always)]
    fn test_once<S: KernelSimd>(
        s: S,
        block: &Self,
        ray: &PreciseRay,
        nearest: &mut Nearest,
        present: Option<&PresentPrimitives>,
    ) {
        if S::IS_NARROW {
            return Self::test(s, block, ray, nearest, present);
        }
        offer(s, Self::hits(s, block, ray), nearest, present, |lane| block.prims.get(lane));
    }
}

impl SphereBlock {
    /// Returns the spheres that the ray may hit before `end`, see [`spheres_near`].
    #[inline(always)]
    fn near<S: KernelSimd>(&self, s: S, ray: &RoundedRay, end: f32) -> Mask {
        let to_center = three!(|axis| s.sub(s.load(&self.center[axis]), s.splat(ray.origin[axis])));
        let unit = three!(|axis| s.splat(ray.unit[axis]));
        spheres_near(s, &to_center, &unit, s.load(&self.radius), s.splat(end * ray.length))
    }
}

/// Returns the lanes whose sphere the ray may meet before `end`: all that do, and few others.
///
/// In `f32`, with room for the rounding. Let C lead from the origin to the centre, and u be the roundoff 2⁻²⁴. With errors
/// of u |C| in `to_center` and of u in `unit`, the distance along the ray has an error of 8 u |C|, and the perpendicular
/// one of 14 u |C|. The radius grows by 32 u times the sum of the coordinates of C, which also covers the
/// rounding of the squares: if |C| is a fifth of the radius or more, and otherwise the perpendicular is much shorter
/// than the radius. Squares of centres farther than `FAR` may overflow.
///
/// - `to_center`: from the origin of the ray, rounded once.
/// - `end`: distance along the ray, metres, within 4 u of itself.
#[inline(always)]
pub(super) fn spheres_near<S: KernelSimd>(
    s: S,
    to_center: &[S::F; 3],
    unit: &[S::F; 3],
    radius: S::F,
    end: S::F,
) -> Mask {
    const FAR: f32 = 1e18;
    let [x, y, z] = *to_center;
    let along = s.mul_add_about(z, unit[2], s.mul_add_about(y, unit[1], s.mul(x, unit[0])));
    let [px, py, pz] = three!(|axis| s.neg_mul_add_about(unit[axis], along, to_center[axis]));
    let perpendicular = s.mul_add_about(pz, pz, s.mul_add_about(py, py, s.mul(px, px)));
    let distance = s.add(s.add(s.abs(x), s.abs(y)), s.abs(z));
    let radius = s.mul_add_about(distance, s.splat(16.0 * f32::EPSILON), radius);
    let ahead = s.le(s.sub(s.splat(0.0), radius), along);
    let before = s.le(s.sub(along, radius), s.mul(end, s.splat(1.0 + 16.0 * f32::EPSILON)));
    let met = s.le(perpendicular, s.mul(radius, radius));
    met & ahead & before | s.lt(s.splat(FAR), distance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{InstructionSet, dispatch};
    use glam::vec3;
    use proptest::prelude::*;

    type Answer = (bool, u32, u32);

    #[inline(always)]
    fn test_all<S: KernelSimd>(s: S, block: &SphereBlock, rays: &[(Ray, f32)], out: &mut Vec<Answer>) {
        for (ray, end) in rays {
            let ray = PreciseRay::of(ray.origin.as_dvec3().to_array(), ray.dir.as_dvec3().to_array());
            let mut nearest = Nearest::before(*end);
            SphereBlock::test(s, block, &ray, &mut nearest, None);
            out.push((nearest.found, nearest.t.to_bits(), nearest.prim));
        }
    }

    /// The plain test of one sphere after the other.
    fn expected(spheres: &[(Vec3, f32)], (ray, end): &(Ray, f32)) -> Answer {
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        let inv_dir_squared = 1.0 / (dir.x * dir.x + dir.y * dir.y + dir.z * dir.z);
        let mut nearest = Nearest::before(*end);
        for (prim, (center, radius)) in (0..).zip(spheres) {
            if let Some((near, far)) = intersect_sphere(origin, dir, inv_dir_squared, *center, *radius) {
                nearest.offer(if near > 0.0 { near } else { far }, 0.0, 0.0, prim);
            }
        }
        (nearest.found, nearest.t.to_bits(), nearest.prim)
    }

    proptest! {
        #![proptest_config(crate::geometry::robust::fixed_cases(600))]

        /// Rays that touch a sphere, within some roundoffs, from afar, from nearby and from inside; ends at the hit.
        #[test]
        fn spheres_left_out_are_missed(seed in any::<u64>(), n in 1usize..=16, scale in -12i32..24, length in -6i32..6) {
            let mut state = seed;
            let mut unit = move || {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
            };
            let size = (scale as f32).exp2();
            let mut point = || vec3(unit(), unit(), unit());
            let spheres: Vec<(Vec3, f32)> =
                (0..n).map(|_| (point() * size, size * [1e-3, 0.1, 1.0][n % 3] * (1.1 + point().x))).collect();
            let prims: Vec<u32> = (0..n as u32).collect();
            let block = &SphereBlock::new(&prims, |prim| spheres[prim as usize]);
            let rays: Vec<(Ray, f32)> = (0..64)
                .map(|i| {
                    let (center, radius) = spheres[i % n];
                    let origin = center + point() * size * [0.01, 1.0, 3.0, 1000.0][i % 4];
                    let aside = (center - origin).cross(point()).normalize_or(Vec3::X);
                    let rim = [0.0, 0.5, 1.0 - 1e-6, 1.0, 1.0 + 1e-6, 1.0 + 1e-5][i % 6];
                    let to = center + aside * radius * rim;
                    let dir = (to - origin).normalize_or(Vec3::X) * (length as f32).exp2();
                    let ray = Ray::new(origin, dir);
                    let (found, t, _) = expected(&spheres, &(ray, f32::INFINITY));
                    let end = if found && i % 3 == 0 { f32::from_bits(t + i as u32 % 2) } else { f32::INFINITY };
                    (ray, end)
                })
                .collect();
            let rays = &rays[..];
            let plain: Vec<Answer> = rays.iter().map(|ray| expected(&spheres, ray)).collect();
            for set in InstructionSet::available() {
                let mut answers = Vec::new();
                let out = &mut answers;
                dispatch!(set, test_all(block: &SphereBlock, rays: &[(Ray, f32)], out: &mut Vec<Answer>));
                prop_assert_eq!(&answers, &plain, "{:?}", set);
            }
        }
    }
}
