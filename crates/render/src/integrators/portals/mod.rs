//! Finds the openings through which the surfaces of a view see the environment, and decides whether they pay.
//!
//! Pilot paths start at the camera and are scattered by each surface as if it were white and diffuse. Where few of their
//! rays leave the scene, those that do pass through windows, doors and skylights: [`fit`] encloses them in rectangles.
//! The result is a function of scene and camera, so that all parts of an image agree. Start reading at
//! [`prepare_portals`].

mod fit;

use crate::core::color::luminance;
use crate::core::environment::Environment;
use crate::core::settings::{Integrator, RenderSettings};
use crate::core::techniques::Techniques;
use crate::integrators::portals::fit::{Line, rectangles};
use crate::prepare::portals::{Portal, Portals};
use crate::prepare::prepared::Prepared;
use crate::sampling::Sampler;
use crate::sampling::warp::cosine_hemisphere;
use crate::shading::environment_sampling::EnvironmentSampling;
use crate::shading::lights::{bounce_weight, light_weight};
use firstlight_kdtree::geometry::{Frame, Ray, robust};
use firstlight_kdtree::{HitBatch, RayBatch, RayClass};
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Seed of the pilot paths, unlikely to be that of an image.
const SEED: u32 = 0x706f_7274;

/// Pilot paths per round, and their largest number.
const PATHS_AT_ONCE: u32 = 512;
const MOST_PATHS: u32 = 4096;

/// Scattered rays of a path.
const BOUNCES: u32 = 3;

/// Where a larger share of scattered rays leaves the scene, BSDF sampling finds the environment well enough.
const MOST_OPEN: f64 = 0.2;

/// Rays through openings that are enough to find them, and those that are too few.
const ENOUGH: usize = 512;
const TOO_FEW: usize = 24;

/// Every n-th scattered ray tells whether portals pay.
const STEP: usize = 8;

/// Factor by which portals must lower the variance of direct light from the environment: they cost shadow rays.
const CLEARLY: f64 = 2.0;

/// A scattered ray of a pilot path.
struct Bounce {
    /// On the surface that scatters it.
    position: Vec3,
    /// Unit, geometric, on the side of the ray.
    normal: Vec3,
    ray: Ray,
    leaves: bool,
}

/// Looks for portals if that has not been done for this view, and the settings may use them.
pub(crate) fn prepare_portals(scene: &Prepared, settings: &RenderSettings) {
    let Techniques { portals, light_sampling, .. } = settings.techniques;
    if portals && light_sampling && settings.integrator == Integrator::Path && settings.max_depth > 1 {
        scene.find_portals(|| find(scene));
    }
}

fn find(scene: &Prepared) -> Option<Portals> {
    if matches!(scene.shading.environment, Environment::Black) || scene.geometry.objects.is_empty() {
        return None;
    }
    let mut bounces = Vec::new();
    let mut lines: Vec<Line> = Vec::new();
    for first in (0..MOST_PATHS).step_by(PATHS_AT_ONCE as usize) {
        let known = bounces.len();
        trace(scene, first, &mut bounces);
        let leaving = bounces[known..].iter().filter(|bounce| bounce.leaves);
        lines.extend(leaving.map(|bounce| Line {
            from: bounce.position.as_dvec3(),
            dir: bounce.ray.dir.as_dvec3(),
            radiance: f64::from(luminance(scene.shading.environment.radiance(bounce.ray.dir))),
        }));
        if lines.len() as f64 > MOST_OPEN * bounces.len() as f64 {
            return None;
        }
        if lines.len() >= ENOUGH {
            break;
        }
    }
    if lines.len() < TOO_FEW {
        return None;
    }
    let surface = |bounce: &Bounce| (bounce.position.as_dvec3(), bounce.normal.as_dvec3());
    let surfaces: Vec<_> = bounces.iter().map(surface).collect();
    let portals = rectangles(&lines, &surfaces).into_iter().filter_map(|found| {
        let [corner, edge_u, edge_v] = [found.corner, found.edge_u, found.edge_v].map(|v| v.as_vec3());
        Portal::new(corner, edge_u, edge_v, (found.radiance as f32).max(f32::MIN_POSITIVE))
    });
    let portals = Portals::new(portals.collect())?;
    let [without, with] = [None, Some(&portals)].map(|portals| variance(scene, &bounces, portals));
    (without > CLEARLY * with).then_some(portals)
}

/// Traces pilot paths from number `first` on, and appends their scattered rays.
fn trace(scene: &Prepared, first: u32, bounces: &mut Vec<Bounce>) {
    let sampler = |path: u32| Sampler::new(SEED, 0, 0, path);
    let mut paths: Vec<u32> = (first..first + PATHS_AT_ONCE).collect();
    let (mut rays, mut hits) = (RayBatch::default(), HitBatch::default());
    for &path in &paths {
        rays.push(&scene.camera.ray(sampler(path).pair(0), Vec2::ONE, Vec2::splat(0.5)));
    }
    for depth in 1..=BOUNCES + 1 {
        let class = if depth == 1 { RayClass::Coherent } else { RayClass::Incoherent };
        scene.closest_hits_behind_panes(&rays, class, &mut hits);
        let (mut next, mut next_paths) = (RayBatch::default(), Vec::new());
        let known = bounces.len() - if depth == 1 { 0 } else { paths.len() };
        for (i, &path) in paths.iter().enumerate() {
            let ray = rays.get(i);
            let Some(hit) = hits.get(i) else { continue };
            if depth > 1 {
                bounces[known + i].leaves = false;
            }
            if depth > BOUNCES {
                continue;
            }
            let point = scene.geometry.tree.surface_point(&ray, &hit);
            let side = if ray.dir.dot(point.geometric_normal) < 0.0 { 1.0 } else { -1.0 };
            let (position, normal) = (point.position, side * point.geometric_normal);
            let local = Vec3::from(cosine_hemisphere(sampler(path).pair(depth).to_array()));
            let dir = Frame::around(normal).to_world(local);
            let ray = Ray::new(robust::offset_ray_origin(position, point.error, normal, normal), dir);
            next.push(&ray);
            next_paths.push(path);
            bounces.push(Bounce { position, normal, ray, leaves: true });
        }
        (rays, paths) = (next, next_paths);
    }
}

/// Sum over some of these places of the variance of what a white, diffuse surface there finds of the light of the
/// environment, with BSDF sampling and one light sample.
fn variance(scene: &Prepared, bounces: &[Bounce], portals: Option<&Portals>) -> f64 {
    let techniques = &Techniques::ALL;
    let environment = &scene.shading.environment;
    let sampling = EnvironmentSampling::with(scene, portals);
    let mut rays = RayBatch::default();
    // What each ray finds, and for which of two estimates of a place.
    let mut parts: Vec<(usize, f64)> = Vec::new();
    for (i, Bounce { position, normal, ray, .. }) in bounces.iter().step_by(STEP).enumerate() {
        for estimate in [2 * i, 2 * i + 1] {
            let sampler = Sampler::independent(SEED, 1, 0, estimate as u32);
            let mut add = |wi: Vec3, weight: f32| {
                rays.push(&Ray::new(ray.origin, wi));
                parts.push((estimate, f64::from(weight * luminance(environment.radiance(wi)))));
            };
            let wi = Frame::around(*normal).to_world(Vec3::from(cosine_hemisphere(sampler.pair(0).to_array())));
            let other = sampling.map_or(0.0, |sampling| sampling.pdf(*position, *normal, wi));
            add(wi, bounce_weight(techniques, FRAC_1_PI * wi.dot(*normal), other));
            let sample = sampling.and_then(|sampling| sampling.sample(*position, *normal, sampler.pair(1)));
            if let Some((wi, pdf)) = sample.filter(|(wi, _)| wi.dot(*normal) > 0.0) {
                let of_bsdf = FRAC_1_PI * wi.dot(*normal);
                add(wi, light_weight(techniques, pdf, of_bsdf) * of_bsdf / pdf);
            }
        }
    }
    let mut occluded = Vec::new();
    for (i, share) in scene.shadows(&rays, RayClass::Incoherent, &mut occluded) {
        parts[i].1 *= f64::from(luminance(share));
    }
    let mut estimates = vec![0.0; 2 * bounces.len().div_ceil(STEP)];
    for ((estimate, part), _) in parts.into_iter().zip(occluded).filter(|(_, occluded)| !occluded) {
        estimates[estimate] += part;
    }
    estimates.chunks(2).map(|pair| 0.5 * (pair[0] - pair[1]).powi(2)).sum()
}
