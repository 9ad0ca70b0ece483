//! Rays prepared for traversal, and the proof that no tree can lose a hit.
//!
//! Where a ray crosses a split plane is only known to within rounding, and so is the shape of a triangle as the
//! watertight test sees it: each vertex is moved by a few units in the last place of its distance. Both are covered by
//! padding every crossing by [`RELATIVE_PADDING`] of itself plus [`RELATIVE_PADDING`] of the tree's largest extent
//! ([`TreeRay::padding`]):
//!
//! - the test moves a vertex at depth `z` sideways by at most `5u (|sx| z + |x|)`, `x` its distance from the ray;
//! - depth `z` is at most that of the crossing plus the extent of the tree: the first term moves the crossing by `5u
//!   z`, which the padding covers more than three times;
//! - the second concerns clipped references only, and the builder pads those (`reference::clip_padding`);
//! - the `t` of a hit is the depth of a point of the moved triangle within `8u z`.
//!
//! So the cell in which a triangle is hit is visited as long as its padded entry is not beyond the best hit, and every
//! tree gives the same nearest `t` as brute force. Ties at equal `t` go to the lower index.

use crate::geometry::{Aabb, Shear, robust::UNIT_ROUNDOFF};
use glam::Vec3;

/// Relative padding of crossings: 16 units of roundoff.
pub(super) const RELATIVE_PADDING: f32 = 16.0 * UNIT_ROUNDOFF;

/// A ray prepared for one tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct TreeRay {
    pub origin: [f32; 3],
    /// Reciprocals of the direction, shortened and lengthened by [`RELATIVE_PADDING`]; infinite for a component of 0.
    pub inv_lo: [f32; 3],
    pub inv_hi: [f32; 3],
    /// Absolute padding of crossings, in `t`.
    pub padding: f32,
    /// 1 where the direction is negative; -0.0 counts as negative, which matches the sign of its reciprocal.
    pub down: [usize; 3],
}

impl TreeRay {
    /// Prepares a ray.
    ///
    /// - `extent`: the largest side of the tree's bounds.
    #[inline(always)]
    pub fn new(origin: Vec3, dir: Vec3, shear: &Shear, extent: f32) -> Self {
        let inv = dir.to_array().map(|d| 1.0 / d);
        Self {
            origin: origin.to_array(),
            inv_lo: inv.map(|inv| inv * (1.0 - RELATIVE_PADDING)),
            inv_hi: inv.map(|inv| inv * (1.0 + RELATIVE_PADDING)),
            padding: (RELATIVE_PADDING * extent) * shear.sz.abs(),
            down: dir.to_array().map(|d| usize::from(d.is_sign_negative())),
        }
    }

    /// Returns the earliest and the latest crossing of the plane `axis = split`.
    ///
    /// NaN for a ray in the plane. A crossing behind the origin is shifted towards the origin or away from it, but
    /// never changes sides by more than the padding.
    #[inline(always)]
    pub fn crossing(&self, axis: usize, split: f32) -> (f32, f32) {
        let distance = split - self.origin[axis];
        (distance * self.inv_lo[axis] - self.padding, distance * self.inv_hi[axis] + self.padding)
    }

    /// Returns the part of `0..=t_max` inside the box, padded; empty if its start is after its end.
    #[inline(always)]
    pub fn clip(&self, bounds: &Aabb, t_max: f32) -> (f32, f32) {
        let faces = [bounds.min, bounds.max];
        let (mut t0, mut t1) = (0.0, t_max);
        for (axis, &down) in self.down.iter().enumerate() {
            // NaN, for a ray in a face, leaves the other number.
            let (entry, exit) =
                (self.crossing(axis, faces[down][axis]).0, self.crossing(axis, faces[1 - down][axis]).1);
            t0 = if entry > t0 { entry } else { t0 };
            t1 = if exit < t1 { exit } else { t1 };
        }
        (t0, t1)
    }
}

/// The nearest hit so far: `t`, and the primitive index for ties.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    /// At equal `t` the lower index wins.
    pub prim: u32,
    pub found: bool,
}

impl Nearest {
    /// Creates a state without a hit; hits must come before `t_max`.
    pub fn before(t_max: f32) -> Self {
        Self { t: t_max, u: 0.0, v: 0.0, prim: 0, found: false }
    }

    #[inline(always)]
    pub fn offer(&mut self, t: f32, u: f32, v: f32, prim: u32) {
        if t > 0.0 && (t < self.t || (t == self.t && prim < self.prim)) {
            *self = Self { t, u, v, prim, found: true };
        }
    }
}
