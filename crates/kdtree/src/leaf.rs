//! The interface of leaf blocks, sixteen primitives each, and of rays prepared for them.

use super::lanes::{LaneHits, shear};
use super::present::PresentPrimitives;
use super::ray::Nearest;
use super::simd::{KernelSimd, LANES, Mask};
use crate::geometry::{Ray, Shear};
use std::convert::Infallible;
use std::marker::PhantomData;

/// Primitives in a leaf block: as many as one AVX-512 instruction tests.
pub(super) const BLOCK: usize = LANES;

/// A ray prepared for leaf tests, once for all leaves.
pub(super) trait LeafRay: Copy + Send {
    const IDLE: Self;

    fn new(ray: &Ray, shear: &Shear) -> Self;
}

/// Up to sixteen primitives of one kind.
pub(super) trait LeafBlock: Sized + Send {
    type Ray: LeafRay;

    /// A smaller form for leaves whose primitives share data.
    type Compact: LeafBlock<Ray = Self::Ray>;

    fn prims(&self) -> &Prims;

    fn prims_mut(&mut self) -> &mut Prims;

    /// Returns all lanes that the ray hits, with any sign of `t`.
    fn hits<S: KernelSimd>(s: S, block: &Self, ray: &Self::Ray) -> LaneHits<S>;

    /// Offers the nearest hit of the block among the primitives that `present` keeps; `None` keeps all.
    #[inline(always)]
    fn test<S: KernelSimd>(
        s: S,
        block: &Self,
        ray: &Self::Ray,
        nearest: &mut Nearest,
        present: Option<&PresentPrimitives>,
    ) {
        offer(s, Self::hits(s, block, ray), nearest, present, |lane| block.prims().get(lane));
    }

    /// Does [`Self::test`] for a ray that is prepared for this block alone.
    #[inline(always)]
    fn test_once<S: KernelSimd>(
        s: S,
        block: &Self,
        ray: &Self::Ray,
        nearest: &mut Nearest,
        present: Option<&PresentPrimitives>,
    ) {
        Self::test(s, block, ray, nearest, present);
    }
}

/// Offers the nearest of the hits that `present` keeps; they belong to ascending primitives.
#[inline(always)]
pub(super) fn offer<S: KernelSimd>(
    s: S,
    hits: LaneHits<S>,
    nearest: &mut Nearest,
    present: Option<&PresentPrimitives>,
    prim: impl Fn(usize) -> u32,
) {
    if hits.mask == 0 {
        return;
    }
    let mut valid = hits.mask & s.lt(s.splat(0.0), hits.t) & s.le(hits.t, s.splat(nearest.t));
    if let Some(present) = present {
        let mut left = valid;
        while left != 0 {
            let lane = left.trailing_zeros() as usize % BLOCK;
            left &= left - 1;
            valid &= !(Mask::from(!present.has(prim(lane))) << lane);
        }
    }
    if valid == 0 {
        return;
    }
    let t = s.least(valid, hits.t);
    // The first lane has the lowest index among those at the same `t`.
    let lane = (valid & s.eq(hits.t, s.splat(t))).trailing_zeros() as usize % BLOCK;
    let (mut u, mut v) = ([0.0; BLOCK], [0.0; BLOCK]);
    s.store(hits.u, &mut u);
    s.store(hits.v, &mut v);
    nearest.offer(t, u[lane], v[lane], prim(lane));
}

/// The indices of a block's primitives, ascending; empty lanes come last.
///
/// The highest bit of the first is set if the leaf continues in the next block.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Prims([u32; BLOCK]);

const FOLLOWED: u32 = 1 << 31;

/// Exclusive limit on primitive indices.
pub(super) const MAX_PRIMS: usize = FOLLOWED as usize;

impl Prims {
    pub fn new(prims: &[u32]) -> Self {
        let mut all = [u32::MAX; BLOCK];
        all[..prims.len()].copy_from_slice(prims);
        Self(all)
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> u32 {
        self.0[lane] & !FOLLOWED
    }

    /// Whether the leaf continues in the next block.
    #[inline(always)]
    pub fn is_followed(&self) -> bool {
        self.0[0] & FOLLOWED != 0
    }

    pub fn set_followed(&mut self) {
        self.0[0] |= FOLLOWED;
    }

    /// The lanes that hold a primitive.
    #[inline(always)]
    pub fn lanes<S: KernelSimd>(&self, s: S) -> Mask {
        s.lt_u(s.load_u(&self.0), s.splat_u(u32::MAX))
    }

    /// Number of lanes that hold a primitive.
    pub fn len(&self) -> usize {
        self.0.iter().filter(|&&prim| prim != u32::MAX).count()
    }

    pub fn iter(&self) -> impl Iterator<Item = u32> {
        (0..self.len()).map(|lane| self.get(lane))
    }
}

/// Compact form of primitives that share no data: never constructed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct NoBlock<R>(Infallible, PhantomData<R>);

impl<R: LeafRay> LeafBlock for NoBlock<R> {
    type Ray = R;
    type Compact = Self;

    fn prims(&self) -> &Prims {
        match self.0 {}
    }

    fn prims_mut(&mut self) -> &mut Prims {
        match self.0 {}
    }

    #[inline(always)]
    fn hits<S: KernelSimd>(_: S, block: &Self, _: &R) -> LaneHits<S> {
        match block.0 {}
    }
}

/// A ray prepared for the watertight test: its shear and its origin along the sheared axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ShearedRay {
    /// The two axes across the ray and the axis along it.
    pub axes: [u32; 3],
    /// The origin along these axes.
    pub origin: [f32; 3],
    pub sx: f32,
    pub sy: f32,
    pub sz: f32,
}

impl LeafRay for ShearedRay {
    const IDLE: Self = Self { axes: [0, 1, 2], origin: [0.0; 3], sx: 0.0, sy: 0.0, sz: 0.0 };

    #[inline(always)]
    fn new(ray: &Ray, shear: &Shear) -> Self {
        let axes = [shear.kx, shear.ky, shear.kz];
        Self {
            axes: axes.map(|k| k as u32),
            origin: axes.map(|k| ray.origin[k]),
            sx: shear.sx,
            sy: shear.sy,
            sz: shear.sz,
        }
    }
}

impl ShearedRay {
    /// Transforms sixteen points into the sheared frame.
    #[inline(always)]
    pub fn shear<S: KernelSimd>(&self, s: S, points: &[[f32; BLOCK]; 3]) -> [S::F; 3] {
        let [kx, ky, kz] = self.axes.map(|k| k as usize);
        let origin = [s.splat(self.origin[0]), s.splat(self.origin[1]), s.splat(self.origin[2])];
        let point = [s.load(&points[kx]), s.load(&points[ky]), s.load(&points[kz])];
        shear(s, point, origin, s.splat(self.sx), s.splat(self.sy))
    }
}
