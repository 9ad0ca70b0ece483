//! Lens connections: shadow rays from vertices of light paths to the lens.

use crate::shading::paths::{append_vector, get, set};
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{RayBatch, append};
use firstlight_simd::{Float, LANES, Mask, Real, Simd, Vector};
use glam::{Vec2, Vec3};

/// A contribution to one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Splat {
    pub pixel: u32,
    pub light: Vec3,
}

/// A contribution with the data that determines whether searching for it pays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeasuredSplat {
    pub film: Vec2,
    /// Contribution before MIS weighting.
    pub light: Vec3,
    /// Pdf of the light path over that of the same camera path, see [`crate::integrators::common::caustics_weight`].
    pub ratio: f32,
    /// Probability with which the path survived Russian roulette.
    pub kept: f32,
}

/// Shadow rays to the lens, with their film positions and contributions.
#[derive(Default)]
pub(crate) struct LensConnections {
    pub rays: RayBatch,
    film: [Vec<f32>; 2],
    light: [Vec<f32>; 3],
    /// See [`MeasuredSplat`].
    ratio: Vec<f32>,
    kept: Vec<f32>,
    pub occluded: Vec<bool>,
}

impl LensConnections {
    /// Removes all rays and reserves space for `n` new ones.
    pub fn start(&mut self, n: usize) {
        self.rays.clear();
        self.rays.make_room(n);
        let least = n + LANES;
        for array in self.film.iter_mut().chain(&mut self.light).chain([&mut self.ratio, &mut self.kept]) {
            if array.len() < least {
                array.resize(least, 0.0);
            }
        }
    }

    pub fn push(&mut self, ray: &Ray, film: Vec2, light: Vec3, [ratio, kept]: [f32; 2]) {
        let i = self.rays.len();
        self.film.iter_mut().zip(film.to_array()).for_each(|(array, x)| array[i] = x);
        set(&mut self.light, i, light);
        (self.ratio[i], self.kept[i]) = (ratio, kept);
        self.rays.push(ray);
    }

    /// Appends the rays of the lanes in `mask`, which end at the tip of `dir`.
    #[inline(always)]
    pub fn append<S: Simd>(
        &mut self,
        mask: Mask,
        [origin, dir]: [Vector<S>; 2],
        film: [Float<S>; 2],
        light: Vector<S>,
        [ratio, kept]: [Float<S>; 2],
    ) {
        let at = self.rays.len();
        append(&mut self.film[0], at, mask, film[0]);
        append(&mut self.film[1], at, mask, film[1]);
        append_vector(&mut self.light, at, mask, light);
        append(&mut self.ratio, at, mask, ratio);
        append(&mut self.kept, at, mask, kept);
        self.rays.append(mask, origin, dir, light.x.all(1.0));
    }

    /// Returns the film position and the contribution of a ray.
    pub fn get(&self, i: usize) -> (Vec2, Vec3) {
        (Vec2::new(self.film[0][i], self.film[1][i]), get(&self.light, i))
    }

    /// Returns the data of a ray if [`crate::integrators::common::caustics_pass::CausticPass::is_measured`].
    pub fn measured(&self, i: usize) -> MeasuredSplat {
        let (film, light) = self.get(i);
        MeasuredSplat { film, light, ratio: self.ratio[i], kept: self.kept[i] }
    }
}
