//! Shadow rays of the classic model: opaque objects block them, glass attenuates them without refraction.
//!
//! Straight light through glass is an approximation that keeps shadows of glass from being black without caustics. A
//! scene without glass uses any-hit queries.

use crate::core::material::{Material, MaterialId};
use crate::integrators::phong::finish::straight_through;
use crate::prepare::prepared::Prepared;
use crate::shading::interface::MediumId;
use crate::shading::medium::MediumSets;
use crate::shading::paths::{Path, ShadowBatch};
use crate::shading::sides::Sides;
use crate::shading::simd::lanes::lanes_of;
use crate::shading::vertex::{Vertex, material_of};
use firstlight_kdtree::geometry::{Ray, robust};
use firstlight_kdtree::{Hit, HitBatch, RayBatch, RayClass, append};
use firstlight_simd::{Bits, Float, LANES, Mask, Simd, Vector};
use glam::Vec3;

/// A contribution that arrives unless it is occluded.
#[derive(Clone, Copy, Debug)]
struct Arriving {
    slot: u32,
    light: Vec3,
    /// End point of the ray; `None` for light from outside of the scene.
    target: Option<Vec3>,
    /// Media at the origin of the ray, and at its present position.
    start: MediumId,
    media: MediumId,
}

/// Shadow rays of one wave by light, and scratch memory to trace them.
///
/// Rays to one light are stored together, since they are fairly coherent. Contributions are added light by light, and
/// for each light in the order of the rays.
#[derive(Default)]
pub(crate) struct Shadows {
    /// Rays per light, and then those of the environment; entries after the first `n` are unused.
    asked: Vec<LightRays>,
    n: usize,
    with_targets: bool,
    rays: RayBatch,
    lights: Vec<Arriving>,
    next_rays: RayBatch,
    next_lights: Vec<Arriving>,
    hits: HitBatch,
}

#[derive(Default)]
struct LightRays {
    batch: ShadowBatch,
    /// End points of the rays, for those that continue behind glass.
    targets: [Vec<f32>; 3],
    /// Media at the origin of each ray; only if it may continue.
    media: Vec<MediumId>,
}

/// Maximum number of glass surfaces that a shadow ray may cross before it counts as blocked.
const MAX_CROSSINGS: usize = 32;

impl Shadows {
    /// Removes all rays and reserves space for `n_hits` rays to each of `n` lights.
    pub fn start(&mut self, scene: &Prepared, n: usize, n_hits: usize) {
        self.n = n;
        self.with_targets = scene.tables.features.glass;
        if self.asked.len() < n {
            self.asked.resize_with(n, LightRays::default);
        }
        for asked in &mut self.asked[..n] {
            asked.batch.start(n_hits);
            asked.media.clear();
            let least = n_hits + LANES;
            if self.with_targets && asked.targets[0].len() < least {
                asked.targets.iter_mut().for_each(|array| array.resize(least, 0.0));
            }
        }
    }

    /// Adds a shadow ray for a path from `origin` to `target` on light `k`, or along `wi` to a light outside of the
    /// scene.
    #[inline]
    pub fn push(&mut self, k: usize, path: &Path, light: Vec3, origin: Vec3, wi: Vec3, target: Option<Vec3>) {
        let LightRays { batch, targets, media } = &mut self.asked[k];
        if self.with_targets {
            media.push(path.media);
            let target = target.unwrap_or(wi);
            targets.iter_mut().zip(target.to_array()).for_each(|(array, x)| array[batch.rays.len()] = x);
        }
        batch.push(&shadow_ray(origin, wi, target), path.slot, light);
    }

    /// Like [`Self::push`], for the lanes of `mask`; rays that end at `target` have a `t_max` of 1, the others
    /// infinity.
    #[allow(clippy::too_many_arguments)]
    #[inline(always)]
    pub fn append<S: Simd>(
        &mut self,
        k: usize,
        mask: Mask,
        rays: [Vector<S>; 2],
        t_max: Float<S>,
        slot: Bits<S>,
        light: Vector<S>,
        target: Vector<S>,
        path_media: &[MediumId; LANES],
    ) {
        let LightRays { batch, targets, media } = &mut self.asked[k];
        if self.with_targets {
            media.extend(lanes_of(mask).map(|lane| path_media[lane]));
            let at = batch.rays.len();
            append(&mut targets[0], at, mask, target.x);
            append(&mut targets[1], at, mask, target.y);
            append(&mut targets[2], at, mask, target.z);
        }
        batch.append(mask, rays, t_max, slot, light);
    }

    /// Traces all rays and adds unoccluded contributions to `radiance`; returns the number of rays.
    pub fn cast(&mut self, scene: &Prepared, sets: &mut MediumSets, class: RayClass, radiance: &mut [Vec3]) -> u64 {
        let mut n_rays = 0;
        for k in 0..self.n {
            if self.with_targets {
                n_rays += self.cast_through(k, scene, sets, class, radiance);
                continue;
            }
            let batch = &mut self.asked[k].batch;
            if !batch.rays.is_empty() {
                n_rays += batch.rays.len() as u64;
                batch.settle(radiance, |rays, occluded| {
                    scene.any_hits(rays, class, occluded);
                    Vec::new()
                });
            }
        }
        n_rays
    }

    /// Like [`Self::cast`], for one light whose rays may continue behind their hits.
    fn cast_through(
        &mut self,
        k: usize,
        scene: &Prepared,
        sets: &mut MediumSets,
        class: RayClass,
        radiance: &mut [Vec3],
    ) -> u64 {
        let LightRays { batch, targets, media } = &mut self.asked[k];
        std::mem::swap(&mut self.rays, &mut batch.rays);
        self.lights.clear();
        self.lights.extend((0..self.rays.len()).map(|i| Arriving {
            slot: batch.slot[i],
            light: batch.light_of(i),
            target: (self.rays.t_max[i] == 1.0).then(|| Vec3::new(targets[0][i], targets[1][i], targets[2][i])),
            start: media[i],
            media: media[i],
        }));
        let mut n_rays = 0;
        for _ in 0..MAX_CROSSINGS {
            if self.rays.is_empty() {
                break;
            }
            n_rays += self.rays.len() as u64;
            scene.closest_hits(&self.rays, class, &mut self.hits);
            scene.settle(&self.rays, &mut self.hits);
            self.next_rays.clear();
            self.next_lights.clear();
            for (i, &arriving) in self.lights.iter().enumerate() {
                let Some(hit) = self.hits.get(i) else {
                    // Interfaces scale radiance as on a path; see `medium`.
                    let (here, there) = (sets.ior(arriving.start), sets.ior(arriving.media));
                    let ratio = if arriving.target.is_some() { here / there } else { here };
                    radiance[arriving.slot as usize] += arriving.light * (ratio * ratio);
                    continue;
                };
                let id = material_of(scene, &hit);
                if !may_be_clear(scene, id) {
                    continue;
                }
                let ray = self.rays.get(i);
                let distance = hit.t * ray.dir.length();
                let unit = Ray { dir: ray.dir.normalize(), ..ray };
                let vertex = Vertex::new(scene, &unit, &Hit { t: distance, ..hit }, id);
                let mut sides = Sides::new(scene, sets, arriving.media, &ray, &hit, id, vertex.front);
                let Some((share, interface)) = straight_through(scene, id, &vertex, &mut sides) else { continue };
                let mut light = arriving.light * share;
                if !vertex.front {
                    light *= inside(scene, id, distance);
                }
                if light == Vec3::ZERO {
                    continue;
                }
                let origin =
                    robust::offset_ray_origin(vertex.position, vertex.error, vertex.geometric_normal, unit.dir);
                self.next_rays.push(&shadow_ray(origin, unit.dir, arriving.target));
                self.next_lights.push(Arriving { light, media: interface.beyond, ..arriving });
            }
            std::mem::swap(&mut self.rays, &mut self.next_rays);
            std::mem::swap(&mut self.lights, &mut self.next_lights);
        }
        n_rays
    }
}

#[inline]
fn shadow_ray(origin: Vec3, wi: Vec3, target: Option<Vec3>) -> Ray {
    match target {
        // `dir` leads to the light's own bounded point, where the ray ends: t = 1, excluded.
        Some(target) => Ray { origin, dir: target - origin, t_max: 1.0 },
        None => Ray::new(origin, wi),
    }
}

fn may_be_clear(scene: &Prepared, id: MaterialId) -> bool {
    match &scene.shading.materials[id as usize] {
        Material::Glass { .. } | Material::RoughGlass { .. } | Material::Blend { .. } => true,
        material => material.is_clear(),
    }
}

/// Transmittance of glass (Beer–Lambert).
fn inside(scene: &Prepared, id: MaterialId, distance: f32) -> Vec3 {
    match &scene.shading.materials[id as usize] {
        Material::Glass { absorption, .. }
        | Material::RoughGlass { absorption, .. }
        | Material::Phong { absorption, .. }
        | Material::Principled { absorption, .. } => (-*absorption * distance).exp(),
        _ => Vec3::ONE,
    }
}
