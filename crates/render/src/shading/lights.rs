//! Direct light at a vertex: light sampling, emission hit by BSDF sampling, and their MIS weights.

use crate::core::techniques::Techniques;
use crate::prepare::light::emitter::LightSample;
use crate::prepare::prepared::Prepared;
use crate::sampling::Sampler;
use crate::sampling::warp::{shifted, shifted_single};
use crate::shading::dimensions::{DIM_LIGHT, DIM_LIGHT_POINT};
use crate::shading::environment_sampling::{EnvironmentSampling, environment_share};
use crate::shading::paths::Path;
use crate::shading::vertex::Vertex;
use firstlight_kdtree::Hit;
use firstlight_simd::{Real, select};
use glam::{Vec2, Vec3};

/// Where a shadow ray ends, `None` for light from outside the scene, and the light that arrives from there.
pub(crate) type LightPoint = (Option<Vec3>, LightSample);

/// Samples a point on a light, or a direction of the environment, which has no target. Uses two pairs of dimensions.
///
/// - `candidate`: number of the sample, if several are taken.
#[inline]
pub(crate) fn choose_light_point(
    scene: &Prepared,
    techniques: &Techniques,
    [position, normal]: [Vec3; 2],
    sampler: &Sampler,
    dimension: u32,
    candidate: u32,
) -> Option<LightPoint> {
    let u = Vec2::from(shifted(sampler.pair(dimension + DIM_LIGHT_POINT).to_array(), candidate));
    let tables = &*scene.tables;
    let share = environment_share(scene, techniques, position.into(), normal.into());
    let mut u_select = None;
    let mut select =
        || *u_select.get_or_insert_with(|| shifted_single(sampler.single(dimension + DIM_LIGHT), candidate));
    if share > 0.0 && (share >= 1.0 || select() < share) {
        let (wi, pdf) = EnvironmentSampling::of(scene, techniques)?.sample(position, normal, u)?;
        let radiance = scene.shading.environment.radiance(wi);
        return Some((None, LightSample { target: wi, wi, pdf: pdf * share, radiance, is_far: true }));
    }
    let u_light = || ((select() - share) / (1.0 - share)).clamp(0.0, 1.0f32.next_down());
    let mut sample = tables.lights.sample(&scene.shading.textures, techniques, position, normal, u_light, u)?;
    sample.pdf *= 1.0 - share;
    Some(((!sample.is_far).then_some(sample.target), sample))
}

/// Radiance of the environment for a path that leaves the scene, with the MIS weight against light sampling.
#[inline]
pub(crate) fn environment_light(scene: &Prepared, techniques: &Techniques, path: &Path, dir: Vec3) -> Vec3 {
    if !scene.tables.features.environment {
        return Vec3::ZERO;
    }
    let radiance = scene.shading.environment.radiance(dir);
    match EnvironmentSampling::of(scene, techniques) {
        Some(sampling) if path.pdf.is_finite() => {
            let share = sampling.share(path.position.into(), path.normal.into());
            let other = share * sampling.pdf(path.position, path.normal, dir);
            radiance * bounce_weight(techniques, path.pdf, other)
        }
        _ => radiance,
    }
}

/// MIS weight of an emitter that a path hits, against light sampling.
#[inline]
pub(crate) fn emitter_weight(
    scene: &Prepared,
    techniques: &Techniques,
    path: &Path,
    hit: &Hit,
    vertex: &Vertex,
) -> f32 {
    let lights = &scene.tables.lights;
    if path.pdf.is_infinite() {
        return 1.0;
    }
    match lights.light_of(hit.object, hit.prim, vertex.front) {
        Some(id) => {
            // Behind a pane, the ray starts closer.
            let distance = if scene.tables.features.panes { path.position.distance(vertex.position) } else { hit.t };
            let pdf = lights.pdf(techniques, id, path.position, path.normal, -vertex.wo, distance);
            let share = environment_share(scene, techniques, path.position.into(), path.normal.into());
            bounce_weight(techniques, path.pdf, (1.0 - share) * pdf)
        }
        None => 1.0,
    }
}

/// MIS weight of a light sample with pdf `own`, for which BSDF sampling has pdf `other`.
#[inline(always)]
pub(crate) fn light_weight<R: Real>(techniques: &Techniques, own: R, other: R) -> R {
    if techniques.mis { power_heuristic(own, other) } else { own.all(1.0) }
}

/// MIS weight of a BSDF sample with pdf `own`, for which light sampling has pdf `other`.
#[inline(always)]
pub(crate) fn bounce_weight<R: Real>(techniques: &Techniques, own: R, other: R) -> R {
    if techniques.mis {
        return power_heuristic(own, other);
    }
    select(other.is_positive(), own.all(0.0), own.all(1.0))
}

/// Power heuristic: weight of a sample with pdf `own` that another technique samples with pdf `other` (Veach 1997, β =
/// 2).
#[inline(always)]
pub(crate) fn power_heuristic<R: Real>(own: R, other: R) -> R {
    // By the ratio: squares of pdfs overflow for lights of a few pixels.
    select(other.is_zero(), own.all(1.0), power_weight(other / own))
}

/// Power heuristic by the ratio of the other pdf to its own.
#[inline(always)]
pub(crate) fn power_weight<R: Real>(ratio: R) -> R {
    ratio.all(1.0) / (ratio * ratio + 1.0)
}
