//! Light on its way from a vertex to the lens.

use crate::shading::paths::{append_vector, get, set};
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{RayBatch, append};
use firstlight_simd::{Float, LANES, Mask, Real, Simd, Vector};
use glam::{Vec2, Vec3};

/// Light that arrives in one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Splat {
    pub pixel: u32,
    pub light: Vec3,
}

/// Shadow rays to the lens, where in the film each leads, and with how much light.
#[derive(Default)]
pub(crate) struct LensConnections {
    pub rays: RayBatch,
    film: [Vec<f32>; 2],
    light: [Vec<f32>; 3],
    pub occluded: Vec<bool>,
}

impl LensConnections {
    /// Forgets all rays; there is room for `n` new ones afterwards.
    pub fn start(&mut self, n: usize) {
        self.rays.clear();
        self.rays.make_room(n);
        let least = n + LANES;
        for array in self.film.iter_mut().chain(&mut self.light) {
            if array.len() < least {
                array.resize(least, 0.0);
            }
        }
    }

    pub fn push(&mut self, ray: &Ray, film: Vec2, light: Vec3) {
        let i = self.rays.len();
        self.film.iter_mut().zip(film.to_array()).for_each(|(array, x)| array[i] = x);
        set(&mut self.light, i, light);
        self.rays.push(ray);
    }

    /// The same of the lanes of `mask`, whose rays end where `dir` does.
    #[inline(always)]
    pub fn append<S: Simd>(
        &mut self,
        mask: Mask,
        [origin, dir]: [Vector<S>; 2],
        film: [Float<S>; 2],
        light: Vector<S>,
    ) {
        let at = self.rays.len();
        append(&mut self.film[0], at, mask, film[0]);
        append(&mut self.film[1], at, mask, film[1]);
        append_vector(&mut self.light, at, mask, light);
        self.rays.append(mask, origin, dir, light.x.all(1.0));
    }

    /// Where in the film a ray leads, and its light.
    pub fn get(&self, i: usize) -> (Vec2, Vec3) {
        (Vec2::new(self.film[0][i], self.film[1][i]), get(&self.light, i))
    }
}
