//! Shading of hits one at a time: of all materials without SIMD code, and of all others as the reference of tests.

use crate::core::material::{Material, MaterialId};
use crate::core::settings::RenderSettings;
use crate::core::techniques::Techniques;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::integrators::common::caustics_weight::MisBounce;
use crate::integrators::common::emission::emitted_light;
use crate::integrators::common::resampling::{CANDIDATES, is_resampled, worth};
use crate::integrators::common::survival::{ROULETTE_GRACE, Survival};
use crate::integrators::path::PathWave;
use crate::integrators::path::chains::{self, FoundChain, Lit};
use crate::prepare::prepared::Prepared;
use crate::shading::bsdf::Lobe;
use crate::shading::dimensions::{
    DIM_DIRECTION, DIM_LOBE, DIM_ROULETTE, first_dimension, resampling_dimension, shadow_roulette_dimension,
};
use crate::shading::environment_sampling::samples_lights;
use crate::shading::guided::Guided;
use crate::shading::lights::{LightPoint, choose_light_point, light_weight};
use crate::shading::paths::Path;
use crate::shading::principled::at::principled_at;
use crate::shading::principled::layers::Principled;
use crate::shading::scatter::Scatter;
use crate::shading::sides::Sides;
use crate::shading::simd::lights::choose_light_points;
use crate::shading::surface::blend::Blend;
use crate::shading::surface::{blend_at, lobe_at};
use crate::shading::vertex::{Vertex, material_of, mesh_texture_point};
use firstlight_kdtree::Hit;
use firstlight_kdtree::geometry::Ray;
use firstlight_simd::LANES;
use glam::Vec3;

impl PathWave {
    /// Shades the hits on materials of a kind: emission, a light sample and a bounce.
    ///
    /// Lights are sampled for sixteen of them together, where there is SIMD code for it.
    pub(super) fn shade_one_by_one(
        &mut self,
        scene: &Prepared,
        depth: u32,
        settings: &RenderSettings,
        caustics: Option<&CausticPass>,
        kind: usize,
        radiance: &mut [Vec3],
    ) {
        let techniques = &settings.techniques;
        // Misses are sorted before all materials.
        let n_candidates = if is_resampled(techniques, kind - 1) { CANDIDATES } else { 1 };
        let n = self.sorted.of_kind(kind).len();
        let mut surfaces = Vec::with_capacity(n.min(LANES));
        for first in (0..n).step_by(LANES) {
            surfaces.clear();
            self.touch_textures(scene, &self.sorted.of_kind(kind)[first..n.min(first + LANES)]);
            for k in first..n.min(first + LANES) {
                let i = self.sorted.of_kind(kind)[k] as usize;
                surfaces.extend(self.surface_at(scene, depth, settings, caustics, i, radiance));
            }
            let lights = light_points(scene, settings, first_dimension(depth), n_candidates, &surfaces);
            for (lane, surface) in surfaces.iter().enumerate() {
                let lights = lights.each_ref().map(|candidates| candidates[lane]);
                let lights = &lights[..n_candidates as usize];
                let PathSurface { path, vertex, hit, material, bsdf } = surface;
                let step = PathStep {
                    scene,
                    techniques,
                    path,
                    vertex,
                    hit,
                    material: *material,
                    depth,
                    caustics,
                    n_candidates,
                    is_told: false,
                };
                match bsdf {
                    Bsdf::Lobe(lobe) => self.scatter_told(step, lobe, lights),
                    Bsdf::Blend(blend) => self.scatter_told(step, blend, lights),
                    Bsdf::Layers(layers) => {
                        self.scatter_told(step, &layers.seen_along(vertex.wo, vertex.normal), lights)
                    }
                }
            }
        }
    }

    /// Reads texels of several hits at once, which waits for memory once, and not again and again while they are shaded.
    ///
    /// - `order`: at most [`LANES`] hits.
    fn touch_textures(&self, scene: &Prepared, order: &[u32]) {
        let large = &scene.tables.large_textures;
        if large.is_empty() {
            return;
        }
        let mut points = [None; LANES];
        for (point, &i) in points.iter_mut().zip(order) {
            let textures = large.of(self.sorted.materials[i as usize]);
            if !textures.is_empty()
                && let Some(hit) = self.hits.get(i as usize)
                && let Some(mesh) = &scene.geometry.objects[hit.object as usize].mesh
            {
                *point = Some((textures, mesh_texture_point(mesh, &hit)));
            }
        }
        let mut bits = 0;
        for (textures, point) in points.iter().flatten() {
            for &id in *textures {
                bits ^= scene.shading.textures[id as usize].touch(point);
            }
        }
        std::hint::black_box(bits);
    }

    /// Adds the emission of a hit; returns how it scatters, unless the path ends there.
    fn surface_at<'a>(
        &mut self,
        scene: &'a Prepared,
        depth: u32,
        settings: &RenderSettings,
        caustics: Option<&CausticPass>,
        i: usize,
        radiance: &mut [Vec3],
    ) -> Option<PathSurface<'a>> {
        let techniques = &settings.techniques;
        let hit = self.hits.get(i)?;
        let material = self.sorted.materials[i];
        let (mut path, ray, vertex) = self.vertex_at(scene, &hit, material, i);
        if let Some(emission) = &scene.tables.emission[material as usize] {
            radiance[path.slot as usize] += emitted_light(scene, techniques, caustics, &path, &hit, &vertex, emission);
        }
        if depth == settings.max_depth {
            return None;
        }
        let bsdf = self.bsdf_at(scene, &mut path, &ray, &vertex, &hit, material)?;
        Some(PathSurface { path, vertex, hit, material, bsdf })
    }

    /// Returns a path with its throughput at a hit, its ray, and the vertex.
    fn vertex_at(&self, scene: &Prepared, hit: &Hit, material: MaterialId, i: usize) -> (Path, Ray, Vertex) {
        let (mut path, ray) = (self.paths.get(i), self.paths.rays.get(i));
        if scene.tables.features.media {
            path.throughput *= self.sets.transmittance(path.media, hit.t);
        }
        (path, ray, Vertex::new(scene, &ray, hit, material))
    }

    /// Returns how a hit scatters, `None` if it does not. A path that is dispersed there is limited to a channel.
    fn bsdf_at<'a>(
        &mut self,
        scene: &'a Prepared,
        path: &mut Path,
        ray: &Ray,
        vertex: &Vertex,
        hit: &Hit,
        material: MaterialId,
    ) -> Option<Bsdf<'a>> {
        let mut sides = (scene.tables.features.glass)
            .then(|| Sides::new(scene, &mut self.sets, path.media, ray, hit, material, vertex.front));
        if let Some(sides) = &mut sides
            && let Some(factor) = sides.disperse(scene, material, &path.sampler)
        {
            path.throughput *= factor;
            path.media = sides.here;
        }
        Some(match &scene.shading.materials[material as usize] {
            Material::Principled { .. } => {
                Bsdf::Layers(principled_at(scene, material, vertex, &mut sides.as_mut(), 0, true)?)
            }
            Material::Blend { .. } | Material::Phong { .. } => {
                Bsdf::Blend(blend_at(scene, material, vertex, sides.as_mut())?)
            }
            _ => Bsdf::Lobe(lobe_at(scene, material, vertex, sides.as_mut())?),
        })
    }

    /// Adds the light of delta lights that chains of specular surfaces bring to the hits; see [`chains`].
    pub(super) fn add_chains(
        &mut self,
        pass: &CausticPass,
        settings: &RenderSettings,
        depth: u32,
        radiance: &mut [Vec3],
    ) {
        let scene = pass.scene;
        for i in 0..self.paths.len() {
            let Some(hit) = self.hits.get(i) else { continue };
            if !chains::is_chosen(&self.paths.get(i), depth) {
                continue;
            }
            let material = material_of(scene, &hit);
            let (mut path, ray, vertex) = self.vertex_at(scene, &hit, material, i);
            let Some(bsdf) = self.bsdf_at(scene, &mut path, &ray, &vertex, &hit, material) else { continue };
            let lit = Lit { pass, settings, path: &path, vertex: &vertex, depth };
            let found = match &bsdf {
                Bsdf::Lobe(lobe) => lit.find(lobe, &mut self.sets),
                Bsdf::Blend(blend) => lit.find(blend, &mut self.sets),
                Bsdf::Layers(layers) => lit.find(&layers.seen_along(vertex.wo, vertex.normal), &mut self.sets),
            };
            if let Some(FoundChain { light, ray, n_surfaces }) = found {
                radiance[path.slot as usize] += light;
                if let Some(record) = &mut self.record {
                    record.see_chain(scene, path.slot, (&ray, n_surfaces), radiance);
                }
            }
        }
    }

    /// Scatters with guiding distributions, if there are any.
    #[inline]
    fn scatter_told(&mut self, step: PathStep, bsdf: &impl Scatter, lights: &[Option<LightPoint>]) {
        let PathStep { path, vertex, depth, .. } = step;
        let hints = step.caustics.filter(|_| bsdf.has_non_specular());
        match hints.and_then(|pass| pass.hints(&path.track, depth, vertex.position)) {
            Some(hints) => self.scatter(PathStep { is_told: true, ..step }, &Guided { surface: bsdf, hints }, lights),
            None => self.scatter(step, bsdf, lights),
        }
    }

    #[inline]
    fn scatter(&mut self, step: PathStep, bsdf: &impl Scatter, lights: &[Option<LightPoint>]) {
        if let Some((point, light)) = step.chosen_light(bsdf, lights) {
            self.add_light(&step, bsdf, point, light);
        }
        self.bounce(&step, bsdf);
    }

    /// Adds a shadow ray to a point on a light, with its unoccluded contribution.
    #[inline]
    fn add_light(&mut self, step: &PathStep, bsdf: &impl Scatter, (target, sample): LightPoint, mut light: Vec3) {
        let &PathStep { scene, path, vertex, .. } = step;
        let tables = &*scene.tables;
        if let Some(&threshold) = self.shadow_thresholds.get(path.slot as usize)
            && step.techniques.roulette
        {
            let kept = worth(light.into()) / threshold;
            if kept < 1.0 {
                if path.sampler.single(shadow_roulette_dimension(step.depth)) >= kept {
                    return;
                }
                light /= kept;
            }
        }
        let through = bsdf.through().filter(|_| sample.wi.dot(vertex.normal) < 0.0);
        let media = through.map_or(path.media, |interface| interface.beyond);
        if tables.features.glass && target.is_none() {
            light *= self.sets.environment_scale(media);
        }
        if tables.features.media
            && let Some(target) = target
        {
            light *= self.sets.transmittance(media, vertex.position.distance(target));
        }
        let origin = if through.is_some() { vertex.passing(sample.wi) } else { vertex.leaving(sample.wi) };
        let shadow_ray = match target {
            // `dir` leads to the light's own bounded point, where the ray ends: t = 1, excluded.
            Some(target) => Ray { origin, dir: target - origin, t_max: 1.0 },
            None => Ray::new(origin, sample.wi),
        };
        self.shadows.push(&shadow_ray, path.slot, light);
    }

    /// Samples the continuation of the path, with Russian roulette.
    #[inline]
    fn bounce(&mut self, step: &PathStep, bsdf: &impl Scatter) {
        let &PathStep { scene, techniques, vertex, material, depth, .. } = step;
        let mut path = *step.path;
        let (sampler, dimension) = (path.sampler, step.dimension());
        let u = sampler.pair(dimension + DIM_DIRECTION);
        let u_lobe = || sampler.single(dimension + DIM_LOBE);
        let Some(sample) = bsdf.sample(vertex.wo, vertex.normal, u_lobe, u) else { return };
        if !vertex.leads_on(sample.wi, sample.through.is_some()) {
            return;
        }
        path.throughput *= sample.weight;
        if let Some(through) = sample.through {
            path.media = through.beyond;
        }
        if let Some(pass) = step.caustics {
            let bounce = MisBounce {
                vertex,
                hit: step.hit,
                eye: (depth == 1).then_some(path.position),
                wi: sample.wi,
                pdf: sample.pdf,
                through: sample.through,
                blended: scene.shading.materials[material as usize].is_blended(),
                before: step.path.media,
                after: path.media,
            };
            let track = if step.is_told { path.track.guided(sample.weight) } else { path.track };
            path.track = pass.follow(track, &bounce, || {
                let normal =
                    if sample.through.is_some() { vertex.normal_from_behind(sample.wi) } else { vertex.normal };
                bsdf.eval(sample.wi, vertex.wo, normal).1
            });
        }
        if let Some(most_kept) = Survival::at(depth, scene, techniques).share {
            // Throughput inside glass contains 1/n², which is restored on leaving: it must not count as a loss.
            let ior = if scene.tables.features.glass { self.sets.ior(path.media) } else { 1.0 };
            let most = ROULETTE_GRACE * path.throughput.abs().max_element() * ior * ior * path.track.gain;
            let survival = most.min(most_kept);
            if survival < 1.0 {
                if sampler.single(dimension + DIM_ROULETTE) >= survival {
                    return;
                }
                path.throughput /= survival;
            }
        }
        if path.throughput == Vec3::ZERO {
            return;
        }
        // Behind a pane, light is still that of the vertex before: light sampling finds it from there.
        let is_straight = scene.tables.panes[material as usize] && sample.pdf.is_infinite() && sample.wi == -vertex.wo;
        if !is_straight {
            path.pdf = if techniques.light_sampling { sample.pdf } else { f32::INFINITY };
            path.pdf /= step.n_candidates as f32;
            path.position = vertex.position;
            path.normal = lit_side(vertex, bsdf);
        }
        let origin = if sample.through.is_some() { vertex.passing(sample.wi) } else { vertex.leaving(sample.wi) };
        self.next.push(&Ray::new(origin, sample.wi), &path);
    }
}

/// The side for light sampling: the normal, or zero for both sides.
#[inline]
fn lit_side(vertex: &Vertex, bsdf: &impl Scatter) -> Vec3 {
    if bsdf.through().is_some() { Vec3::ZERO } else { vertex.normal }
}

/// One vertex of one path.
struct PathStep<'a> {
    scene: &'a Prepared,
    techniques: &'a Techniques,
    path: &'a Path,
    vertex: &'a Vertex,
    hit: &'a Hit,
    material: MaterialId,
    /// Number of segments so far.
    depth: u32,
    caustics: Option<&'a CausticPass<'a>>,
    /// Number of light samples of which one is chosen, see [`crate::integrators::common::resampling`].
    n_candidates: u32,
    /// Whether directions are sampled with guiding.
    is_told: bool,
}

impl PathStep<'_> {
    /// First sample dimension of this vertex.
    fn dimension(&self) -> u32 {
        first_dimension(self.depth)
    }

    /// Returns one of the light samples and its contribution, if it is unoccluded.
    #[inline]
    fn chosen_light(&self, bsdf: &impl Scatter, candidates: &[Option<LightPoint>]) -> Option<(LightPoint, Vec3)> {
        if let [candidate] = candidates {
            let point = (*candidate)?;
            return Some((point, self.light_of(bsdf, &point, 1.0)?));
        }
        let n = candidates.len() as f32;
        let mut u = self.path.sampler.single(resampling_dimension(self.depth));
        let mut chosen = None;
        let mut sum = 0.0;
        for point in candidates.iter().flatten() {
            let Some(light) = self.light_of(bsdf, point, n) else { continue };
            let own = worth(light.into());
            sum += own;
            let share = own / sum;
            let takes = chosen.is_none() || u < share;
            if chosen.is_some() {
                u = if takes { u / share } else { (u - share) / (1.0 - share) }.min(1.0f32.next_down());
            }
            if takes {
                chosen = Some((*point, light));
            }
        }
        let (point, light) = chosen?;
        Some((point, light * (sum / (n * worth(light.into())))))
    }

    /// Contribution of a light sample, if it is unoccluded; `None` if it is nothing.
    ///
    /// - `n`: number of light samples per sample of the BSDF, for the MIS weight.
    #[inline]
    fn light_of(&self, bsdf: &impl Scatter, (_, sample): &LightPoint, n: f32) -> Option<Vec3> {
        let &Self { techniques, path, vertex, .. } = self;
        let (value, pdf) = bsdf.eval(vertex.wo, sample.wi, vertex.normal);
        let passes = bsdf.through().is_some() && sample.wi.dot(vertex.normal) < 0.0;
        if pdf <= 0.0 || !vertex.leads_on(sample.wi, passes) {
            return None;
        }
        let weight = light_weight(techniques, n * sample.pdf, pdf) / sample.pdf;
        let light = path.throughput * value * sample.radiance * weight;
        (light != Vec3::ZERO).then_some(light)
    }
}

/// A hit that scatters.
struct PathSurface<'a> {
    path: Path,
    vertex: Vertex,
    hit: Hit,
    material: MaterialId,
    bsdf: Bsdf<'a>,
}

/// How a surface scatters.
#[expect(clippy::large_enum_variant, reason = "nothing is allocated per sample")]
enum Bsdf<'a> {
    Lobe(Lobe<'a>),
    Blend(Blend<'a>),
    Layers(Principled),
}

impl PathSurface<'_> {
    /// The side for light sampling, see [`lit_side`]; `None` where all scattering is specular.
    fn lit_side(&self) -> Option<Vec3> {
        fn side(vertex: &Vertex, bsdf: &impl Scatter) -> Option<Vec3> {
            bsdf.has_non_specular().then(|| lit_side(vertex, bsdf))
        }
        match &self.bsdf {
            Bsdf::Lobe(lobe) => side(&self.vertex, lobe),
            Bsdf::Blend(blend) => side(&self.vertex, blend),
            Bsdf::Layers(layers) => side(&self.vertex, layers),
        }
    }
}

/// Points on lights for each surface that light sampling can light.
///
/// - `n_candidates`: number of points per surface; `surfaces`: at most [`LANES`].
fn light_points(
    scene: &Prepared,
    settings: &RenderSettings,
    dimension: u32,
    n_candidates: u32,
    surfaces: &[PathSurface],
) -> [[Option<LightPoint>; LANES]; CANDIDATES as usize] {
    let techniques = &settings.techniques;
    let mut places = [None; LANES];
    if samples_lights(scene, techniques) {
        for (place, surface) in places.iter_mut().zip(surfaces) {
            let normal = surface.lit_side();
            *place = normal.map(|normal| (surface.vertex.position, normal, surface.path.sampler));
        }
    }
    std::array::from_fn(|candidate| match (candidate as u32, settings.simd) {
        (candidate, _) if candidate >= n_candidates => [None; LANES],
        (candidate, Some(set)) => choose_light_points(set, scene, techniques, dimension, candidate, &places),
        (candidate, None) => places.map(|place| {
            let (position, normal, sampler) = place?;
            choose_light_point(scene, techniques, [position, normal], &sampler, dimension, candidate)
        }),
    })
}
