//! Preparation of rays for a tree, sixteen at a time.
//!
//! For a single ray it takes five divisions and unpredictable branches on the direction.

use super::lanes::{longest_axis, to_own_space};
use super::leaf::ShearedRay;
use super::node8::DescentRay;
use super::ray::{Nearest, RELATIVE_PADDING};
use super::simd::{KernelSimd, LANES, Mask};
use crate::geometry::Aabb;
use firstlight_simd::three;
use glam::{Affine3A, Vec3};

type Lanes = [f32; LANES];

/// Source of rays for a stream, and receiver of their hits.
pub(super) trait Source {
    /// Upper bound on the number of remaining rays.
    fn left(&self) -> usize;
    /// Stores the next rays, up to sixteen, and returns the lanes that have one; `None` if there are no more.
    fn fetch<S: KernelSimd>(&mut self, s: S, to: &mut FetchedRays) -> Option<Mask>;
    /// Map from the space of the rays to the tree's own; `None` if they are the same.
    fn own_from_world(&self) -> Option<&Affine3A>;
    /// Called for rays that entered the tree's bounds; `nearest.found` says whether the tree has a nearer hit.
    fn finish(&mut self, ray: u32, nearest: &Nearest);
}

/// Up to sixteen rays.
#[repr(C, align(64))]
pub(super) struct FetchedRays {
    pub origin: [Lanes; 3],
    pub dir: [Lanes; 3],
    /// Nearest hit so far: `t`, and the primitive index for ties.
    pub t: Lanes,
    pub prim: [u32; LANES],
    /// Passed to [`Source::finish`].
    pub id: [u32; LANES],
}

/// Sixteen rays in the tree's own space.
#[repr(C, align(64))]
pub(super) struct RaySetup {
    rays: FetchedRays,
    /// As in `ray::TreeRay`.
    inv_lo: [Lanes; 3],
    minus_inv_hi: [Lanes; 3],
    padding: Lanes,
    /// The part of the ray inside the bounds.
    from: Lanes,
    until: Lanes,
    /// As in [`ShearedRay`].
    axes: [[u32; LANES]; 3],
    sheared_origin: [Lanes; 3],
    sx: Lanes,
    sy: Lanes,
    sz: Lanes,
    /// Lanes that have not been taken yet.
    waiting: Mask,
}

impl RaySetup {
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            rays: FetchedRays {
                origin: [[0.0; LANES]; 3],
                // Unused lanes take part in the computation and need finite values.
                dir: [[1.0; LANES]; 3],
                t: [0.0; LANES],
                prim: [0; LANES],
                id: [0; LANES],
            },
            inv_lo: [[0.0; LANES]; 3],
            minus_inv_hi: [[0.0; LANES]; 3],
            padding: [0.0; LANES],
            from: [0.0; LANES],
            until: [0.0; LANES],
            axes: [[0; LANES]; 3],
            sheared_origin: [[0.0; LANES]; 3],
            sx: [0.0; LANES],
            sy: [0.0; LANES],
            sz: [0.0; LANES],
            waiting: 0,
        }
    }

    /// Returns the lane of the next ray that enters the bounds; `None` if there are no more.
    ///
    /// - `extent`: the largest side of the tree's bounds.
    #[inline(always)]
    pub fn next<S: KernelSimd>(&mut self, s: S, bounds: &Aabb, extent: f32, source: &mut impl Source) -> Option<usize> {
        while self.waiting == 0 {
            let fetched = source.fetch(s, &mut self.rays)?;
            self.prepare(s, bounds, extent, source);
            self.waiting &= fetched;
        }
        let lane = self.waiting.trailing_zeros() as usize % LANES;
        self.waiting &= self.waiting - 1;
        Some(lane)
    }

    /// Does `Shear::new`, `TreeRay::new` and `TreeRay::clip` for all lanes, operation by operation.
    #[inline(always)]
    fn prepare<S: KernelSimd>(&mut self, s: S, bounds: &Aabb, extent: f32, source: &impl Source) {
        let mut origin = three!(|axis| s.load(&self.rays.origin[axis]));
        let mut dir = three!(|axis| s.load(&self.rays.dir[axis]));
        if let Some(map) = source.own_from_world() {
            [origin, dir] = to_own_space(s, map, &origin, &dir);
            for axis in 0..3 {
                s.store(origin[axis], &mut self.rays.origin[axis]);
                s.store(dir[axis], &mut self.rays.dir[axis]);
            }
        }
        let (along_x, along_y) = longest_axis(s, &dir);
        // The axes across the ray and along it: x y z turned until the longest comes last.
        for (place, axes) in [[1, 2, 0], [2, 0, 1], [0, 1, 2]].into_iter().enumerate() {
            let [if_x, if_y, if_z] = axes;
            let [by_x, by_y, by_z] = axes.map(|axis| s.splat_u(axis));
            s.store_u(s.select_u(along_x, by_x, s.select_u(along_y, by_y, by_z)), &mut self.axes[place]);
            let of = |axis: u32| origin[axis as usize];
            let turned = s.select(along_x, of(if_x), s.select(along_y, of(if_y), of(if_z)));
            s.store(turned, &mut self.sheared_origin[place]);
        }
        let [dx, dy, dz] = dir;
        let longest = s.select(along_x, dx, s.select(along_y, dy, dz));
        let first = s.select(along_x, dy, s.select(along_y, dz, dx));
        let second = s.select(along_x, dz, s.select(along_y, dx, dy));
        let one = s.splat(1.0);
        let sz = s.div(one, longest);
        s.store(s.div(first, longest), &mut self.sx);
        s.store(s.div(second, longest), &mut self.sy);
        s.store(sz, &mut self.sz);
        let padding = s.mul(s.splat(RELATIVE_PADDING * extent), s.abs(sz));
        s.store(padding, &mut self.padding);
        let (mut from, mut until) = (s.splat(0.0), s.load(&self.rays.t));
        for axis in 0..3 {
            let inv = s.div(one, dir[axis]);
            let (lo, hi) = (s.mul(inv, s.splat(1.0 - RELATIVE_PADDING)), s.mul(inv, s.splat(1.0 + RELATIVE_PADDING)));
            s.store(lo, &mut self.inv_lo[axis]);
            s.store(s.sub(s.splat(-0.0), hi), &mut self.minus_inv_hi[axis]);
            let (min, max) = (s.splat(bounds.min[axis]), s.splat(bounds.max[axis]));
            let down = s.negative(dir[axis]);
            let (entry, exit) = (s.select(down, max, min), s.select(down, min, max));
            // NaN, for a ray in a face, leaves the other number.
            from = s.max(s.sub(s.mul(s.sub(entry, origin[axis]), lo), padding), from);
            until = s.min(s.add(s.mul(s.sub(exit, origin[axis]), hi), padding), until);
        }
        s.store(from, &mut self.from);
        s.store(until, &mut self.until);
        self.waiting = s.le(from, until);
    }

    #[inline(always)]
    pub fn descent(&self, lane: usize) -> DescentRay {
        let at = |lanes: &[Lanes; 3]| [lanes[0][lane], lanes[1][lane], lanes[2][lane]];
        DescentRay {
            origin: at(&self.rays.origin),
            padding: self.padding[lane],
            inv_lo: at(&self.inv_lo),
            reversed: 0,
            minus_inv_hi: at(&self.minus_inv_hi),
            end: self.rays.t[lane],
        }
    }

    /// Returns origin and direction in the tree's own space.
    #[inline(always)]
    pub fn ray(&self, lane: usize) -> (Vec3, Vec3) {
        let ([ox, oy, oz], [dx, dy, dz]) = (&self.rays.origin, &self.rays.dir);
        (Vec3::new(ox[lane], oy[lane], oz[lane]), Vec3::new(dx[lane], dy[lane], dz[lane]))
    }

    /// Returns the ray prepared for triangles.
    #[inline(always)]
    pub fn sheared(&self, lane: usize) -> ShearedRay {
        let ([kx, ky, kz], [x, y, z]) = (&self.axes, &self.sheared_origin);
        ShearedRay {
            axes: [kx[lane], ky[lane], kz[lane]],
            origin: [x[lane], y[lane], z[lane]],
            sx: self.sx[lane],
            sy: self.sy[lane],
            sz: self.sz[lane],
        }
    }

    #[inline(always)]
    pub fn nearest(&self, lane: usize) -> Nearest {
        Nearest { prim: self.rays.prim[lane], ..Nearest::before(self.rays.t[lane]) }
    }

    #[inline(always)]
    pub fn id(&self, lane: usize) -> u32 {
        self.rays.id[lane]
    }

    /// Returns the first and the last `t` inside the bounds.
    #[inline(always)]
    pub fn within(&self, lane: usize) -> (f32, f32) {
        (self.from[lane], self.until[lane])
    }
}
