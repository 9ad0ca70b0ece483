//! Shadow rays of the classic model: opaque things block them, glass dims them and leaves them straight.
//!
//! Straight light through glass is an approximation that keeps shadows of glass from being black where nothing
//! gathers caustics. A scene without glass asks for any hit and is done.

use super::super::surface::{Vertex, material_of};
use super::super::{Material, MaterialId, Snapshot};
use super::finish::straight_through;
use crate::geometry::{Ray, robust};
use crate::kdtree::{HitBatch, RayBatch, RayClass};
use glam::Vec3;

/// Light that arrives unless something is in its way.
#[derive(Clone, Copy, Debug)]
struct Arriving {
    slot: u32,
    light: Vec3,
    /// Where the ray ends; `None` for light from outside the scene.
    target: Option<Vec3>,
}

/// Shadow rays of one wave, and scratch memory to trace them.
#[derive(Default)]
pub(super) struct Shadows {
    rays: RayBatch,
    lights: Vec<Arriving>,
    next_rays: RayBatch,
    next_lights: Vec<Arriving>,
    occluded: Vec<bool>,
    hits: HitBatch,
}

/// Glass surfaces in the way of one shadow ray before it counts as blocked.
const MAX_CROSSINGS: usize = 32;

impl Shadows {
    pub fn clear(&mut self) {
        self.rays.clear();
        self.lights.clear();
    }

    /// Light for `slot` that comes from `target`, or from outside along `wi`, to `origin`.
    #[inline]
    pub fn push(&mut self, slot: u32, light: Vec3, origin: Vec3, wi: Vec3, target: Option<Vec3>) {
        self.rays.push(&shadow_ray(origin, wi, target));
        self.lights.push(Arriving { slot, light, target });
    }

    /// Adds what arrives to `radiance`; returns how many rays it took.
    pub fn cast(&mut self, scene: &Snapshot, class: RayClass, radiance: &mut [Vec3]) -> u64 {
        if !scene.shading.features.glass {
            scene.geometry.tree.any_hits(&self.rays, class, &mut self.occluded);
            for (arriving, &occluded) in self.lights.iter().zip(&self.occluded) {
                if !occluded {
                    radiance[arriving.slot as usize] += arriving.light;
                }
            }
            return self.rays.len() as u64;
        }
        let mut n_rays = 0;
        for _ in 0..MAX_CROSSINGS {
            if self.rays.is_empty() {
                break;
            }
            n_rays += self.rays.len() as u64;
            scene.geometry.tree.closest_hits(&self.rays, class, &mut self.hits);
            self.next_rays.clear();
            self.next_lights.clear();
            for (i, &arriving) in self.lights.iter().enumerate() {
                let Some(hit) = self.hits.get(i) else {
                    radiance[arriving.slot as usize] += arriving.light;
                    continue;
                };
                let id = material_of(scene, &hit);
                if !may_be_clear(scene, id) {
                    continue;
                }
                let ray = self.rays.get(i);
                let distance = hit.t * ray.dir.length();
                let unit = Ray { dir: ray.dir.normalize(), ..ray };
                let vertex = Vertex::new(scene, &unit, &crate::kdtree::Hit { t: distance, ..hit });
                let mut light = arriving.light * straight_through(scene, id, &vertex);
                if !vertex.front {
                    light *= inside(scene, id, distance);
                }
                if light == Vec3::ZERO {
                    continue;
                }
                let origin =
                    robust::offset_ray_origin(vertex.position, vertex.error, vertex.geometric_normal, unit.dir);
                self.next_rays.push(&shadow_ray(origin, unit.dir, arriving.target));
                self.next_lights.push(Arriving { light, ..arriving });
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
        // The direction spans the way to the light's own bounded point, where the ray ends: t = 1, excluded.
        Some(target) => Ray { origin, dir: target - origin, t_max: 1.0 },
        None => Ray::new(origin, wi),
    }
}

fn may_be_clear(scene: &Snapshot, id: MaterialId) -> bool {
    match &scene.shading.materials[id as usize] {
        Material::Glass { .. } | Material::Blend { .. } => true,
        Material::Phong { transparency, .. } => *transparency > 0.0,
        _ => false,
    }
}

/// What glass leaves of light on its way through (Beer–Lambert).
fn inside(scene: &Snapshot, id: MaterialId, distance: f32) -> Vec3 {
    match &scene.shading.materials[id as usize] {
        Material::Glass { absorption, .. } | Material::Phong { absorption, .. } => (-*absorption * distance).exp(),
        _ => Vec3::ONE,
    }
}
