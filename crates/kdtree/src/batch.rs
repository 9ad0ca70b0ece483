//! Rays and hits as structures of arrays: the input and the output of batch queries.

use super::shape::Hit;
use crate::geometry::Ray;
use firstlight_simd::{Bits, Float, LANES, Mask, Simd, Vector};
use glam::Vec3;

/// Many rays, one array per coordinate. The arrays may be longer than there are rays.
#[derive(Clone, Debug, Default)]
pub struct RayBatch {
    /// x of each ray's origin, metres.
    pub origin_x: Vec<f32>,
    /// y of each ray's origin, metres.
    pub origin_y: Vec<f32>,
    /// z of each ray's origin, metres.
    pub origin_z: Vec<f32>,
    /// x of each ray's direction.
    pub dir_x: Vec<f32>,
    /// y of each ray's direction.
    pub dir_y: Vec<f32>,
    /// z of each ray's direction.
    pub dir_z: Vec<f32>,
    /// End of each ray in lengths of its direction, excluded.
    pub t_max: Vec<f32>,
    len: usize,
}

impl RayBatch {
    /// Number of rays.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are no rays.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Removes all rays and keeps the allocation.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Appends a ray.
    #[inline]
    pub fn push(&mut self, ray: &Ray) {
        if self.len == self.t_max.len() {
            self.make_room(self.len.max(64));
        }
        let i = self.len;
        self.origin_x[i] = ray.origin.x;
        self.origin_y[i] = ray.origin.y;
        self.origin_z[i] = ray.origin.z;
        self.dir_x[i] = ray.dir.x;
        self.dir_y[i] = ray.dir.y;
        self.dir_z[i] = ray.dir.z;
        self.t_max[i] = ray.t_max;
        self.len += 1;
    }

    /// Ray `i`, below [`Self::len`].
    #[inline(always)]
    pub fn get(&self, i: usize) -> Ray {
        Ray {
            origin: Vec3::new(self.origin_x[i], self.origin_y[i], self.origin_z[i]),
            dir: Vec3::new(self.dir_x[i], self.dir_y[i], self.dir_z[i]),
            t_max: self.t_max[i],
        }
    }

    /// Reserves space for `n` more rays.
    pub fn make_room(&mut self, n: usize) {
        let least = self.len + n + LANES;
        if self.t_max.len() < least {
            for array in self.arrays() {
                array.resize(least, 0.0);
            }
        }
    }

    /// Appends the rays of the lanes in `mask`; space must have been reserved.
    #[inline(always)]
    pub fn append<S: Simd>(&mut self, mask: Mask, origin: Vector<S>, dir: Vector<S>, t_max: Float<S>) {
        let at = self.len;
        let [ox, oy, oz, dx, dy, dz, t] = self.arrays();
        append(ox, at, mask, origin.x);
        append(oy, at, mask, origin.y);
        append(oz, at, mask, origin.z);
        append(dx, at, mask, dir.x);
        append(dy, at, mask, dir.y);
        append(dz, at, mask, dir.z);
        append(t, at, mask, t_max);
        self.len += mask.count_ones() as usize;
    }

    #[inline(always)]
    fn arrays(&mut self) -> [&mut Vec<f32>; 7] {
        let Self { origin_x, origin_y, origin_z, dir_x, dir_y, dir_z, t_max, len: _ } = self;
        [origin_x, origin_y, origin_z, dir_x, dir_y, dir_z, t_max]
    }
}

/// Writes the lanes in `mask` to `to[at..]`; the rest of the sixteen numbers there gets unspecified values.
///
/// # Panics
/// If `to` has fewer than sixteen numbers from `at` on.
#[inline(always)]
pub fn append<S: Simd>(to: &mut [f32], at: usize, mask: Mask, lanes: Float<S>) {
    lanes.compress(mask).store(to[at..].first_chunk_mut().expect("room for all lanes"));
}

/// Like [`append`], for integers.
///
/// # Panics
/// If `to` has fewer than sixteen numbers from `at` on.
#[inline(always)]
pub fn append_bits<S: Simd>(to: &mut [u32], at: usize, mask: Mask, lanes: Bits<S>) {
    lanes.compress(mask).store(to[at..].first_chunk_mut().expect("room for all lanes"));
}

impl<'a> FromIterator<&'a Ray> for RayBatch {
    fn from_iter<I: IntoIterator<Item = &'a Ray>>(rays: I) -> Self {
        let mut batch = Self::default();
        rays.into_iter().for_each(|ray| batch.push(ray));
        batch
    }
}

/// The closest hit of each ray of a batch, one array per field.
///
/// | shape | `prim` | `u`, `v` |
/// |---|---|---|
/// | mesh, triangle | triangle index, 0 for a lone triangle | barycentric weights of vertices 1 and 2 |
/// | quad | 0 | 0..1 along `edge_u` and `edge_v` |
/// | sphere, spheres | sphere index, 0 for a lone sphere | 0 |
/// | plane | 0 | 0 |
#[derive(Clone, Debug, Default)]
pub struct HitBatch {
    /// Distance in lengths of the direction; `f32::INFINITY` for a miss.
    pub t: Vec<f32>,
    /// First surface coordinate of each hit; see the table above.
    pub u: Vec<f32>,
    /// Second surface coordinate of each hit; see the table above.
    pub v: Vec<f32>,
    /// Index of the primitive within its object; see the table above.
    pub prim: Vec<u32>,
    /// Index of the object in the scene tree, [`HitBatch::MISS`] for a miss.
    pub object: Vec<u32>,
}

impl HitBatch {
    /// Value of `object` for a ray that hits nothing.
    pub const MISS: u32 = u32::MAX;

    /// Number of results, one per ray.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether there are no results.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// The hit of ray `i`, `None` for a miss.
    #[inline]
    pub fn get(&self, i: usize) -> Option<Hit> {
        let object = self.object[i];
        let hit = Hit { t: self.t[i], u: self.u[i], v: self.v[i], prim: self.prim[i], object };
        (object != Self::MISS).then_some(hit)
    }

    /// Replaces the result of ray `i`.
    pub fn set(&mut self, i: usize, hit: Option<Hit>) {
        let miss = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, prim: Self::MISS, object: Self::MISS };
        let hit = hit.unwrap_or(miss);
        (self.t[i], self.u[i], self.v[i], self.prim[i], self.object[i]) = (hit.t, hit.u, hit.v, hit.prim, hit.object);
    }

    /// Resizes to `n` results, which may still be those of an older batch.
    pub(super) fn resize(&mut self, n: usize) {
        self.t.resize(n, f32::INFINITY);
        self.u.resize(n, 0.0);
        self.v.resize(n, 0.0);
        self.prim.resize(n, Self::MISS);
        self.object.resize(n, Self::MISS);
    }

    /// Resizes to `n` results, all of them misses.
    pub fn reset(&mut self, n: usize) {
        let Self { t, u, v, prim, object } = self;
        for array in [t, u, v] {
            array.clear();
        }
        for array in [&mut *prim, &mut *object] {
            array.clear();
        }
        self.t.resize(n, f32::INFINITY);
        self.u.resize(n, 0.0);
        self.v.resize(n, 0.0);
        self.prim.resize(n, Self::MISS);
        self.object.resize(n, Self::MISS);
    }
}
