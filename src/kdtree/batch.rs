//! Rays and hits as structures of arrays: what a wave of the integrator hands to the kernel and gets back.

use super::Hit;
use crate::geometry::Ray;
use glam::Vec3;

/// Many rays, one array per coordinate.
#[derive(Clone, Debug, Default)]
pub struct RayBatch {
    pub origin_x: Vec<f32>,
    pub origin_y: Vec<f32>,
    pub origin_z: Vec<f32>,
    pub dir_x: Vec<f32>,
    pub dir_y: Vec<f32>,
    pub dir_z: Vec<f32>,
    /// Lengths of `dir`, excluded.
    pub t_max: Vec<f32>,
}

impl RayBatch {
    pub fn len(&self) -> usize {
        self.t_max.len()
    }

    pub fn is_empty(&self) -> bool {
        self.t_max.is_empty()
    }

    /// Forgets the rays and keeps the memory.
    pub fn clear(&mut self) {
        for array in self.arrays() {
            array.clear();
        }
    }

    #[inline]
    pub fn push(&mut self, ray: &Ray) {
        self.origin_x.push(ray.origin.x);
        self.origin_y.push(ray.origin.y);
        self.origin_z.push(ray.origin.z);
        self.dir_x.push(ray.dir.x);
        self.dir_y.push(ray.dir.y);
        self.dir_z.push(ray.dir.z);
        self.t_max.push(ray.t_max);
    }

    #[inline(always)]
    pub fn get(&self, i: usize) -> Ray {
        Ray {
            origin: Vec3::new(self.origin_x[i], self.origin_y[i], self.origin_z[i]),
            dir: Vec3::new(self.dir_x[i], self.dir_y[i], self.dir_z[i]),
            t_max: self.t_max[i],
        }
    }

    fn arrays(&mut self) -> [&mut Vec<f32>; 7] {
        let Self { origin_x, origin_y, origin_z, dir_x, dir_y, dir_z, t_max } = self;
        [origin_x, origin_y, origin_z, dir_x, dir_y, dir_z, t_max]
    }
}

impl<'a> FromIterator<&'a Ray> for RayBatch {
    fn from_iter<I: IntoIterator<Item = &'a Ray>>(rays: I) -> Self {
        let mut batch = Self::default();
        rays.into_iter().for_each(|ray| batch.push(ray));
        batch
    }
}

/// The nearest hit of each ray of a batch, one array per field.
///
/// | shape | `prim` | `u`, `v` |
/// |---|---|---|
/// | mesh, triangle | triangle index, 0 for a lone triangle | barycentric weights of vertices 1 and 2 |
/// | quad | 0 | 0..1 along `edge_u` and `edge_v` |
/// | sphere, spheres | sphere index, 0 for a lone sphere | 0 |
/// | plane | 0 | 0 |
#[derive(Clone, Debug, Default)]
pub struct HitBatch {
    /// Lengths of `dir`; `f32::INFINITY` when the ray met nothing before its `t_max`.
    pub t: Vec<f32>,
    pub u: Vec<f32>,
    pub v: Vec<f32>,
    pub prim: Vec<u32>,
    /// Index of the object in the scene tree, [`HitBatch::MISS`] when there is none.
    pub object: Vec<u32>,
}

impl HitBatch {
    pub const MISS: u32 = u32::MAX;

    pub fn len(&self) -> usize {
        self.t.len()
    }

    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// The answer for ray `i`, `None` for a miss.
    #[inline]
    pub fn get(&self, i: usize) -> Option<Hit> {
        let object = self.object[i];
        let hit = Hit { t: self.t[i], u: self.u[i], v: self.v[i], prim: self.prim[i], object };
        (object != Self::MISS).then_some(hit)
    }

    /// Makes room for `n` answers, which may still be those of an older batch.
    pub(super) fn resize(&mut self, n: usize) {
        self.t.resize(n, f32::INFINITY);
        self.u.resize(n, 0.0);
        self.v.resize(n, 0.0);
        self.prim.resize(n, Self::MISS);
        self.object.resize(n, Self::MISS);
    }

    /// Makes room for `n` answers, all of them misses.
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
