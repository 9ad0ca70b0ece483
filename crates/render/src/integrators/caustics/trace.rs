//! Light paths, a wave at a time, connected to the lens at every scattering vertex.
//!
//! The counterpart of [`crate::integrators::path`], with light and camera exchanged. Where shading normals differ from
//! true ones, scattering depends on the end at which the path started (Veach 1997, section 5.3); the camera's view is
//! the reference, so surfaces are always evaluated from the camera's side here. Hits on surfaces without shading
//! normals are handled sixteen at a time ([`crate::integrators::caustics::simd`]).

use crate::core::counts::RayCounts;
use crate::core::filter::PixelFilter;
use crate::core::material::{Material, MaterialId};
use crate::integrators::caustics::dimensions::{DIM_LENS, DIM_ROULETTE, VERTEX_DIMENSIONS, most_kept};
use crate::integrators::caustics::lens_connections::{LensConnections, MeasuredSplat, Splat};
use crate::integrators::caustics::simd;
use crate::integrators::caustics::simd::LightHits;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::integrators::common::caustics_weight::{MisBounce, etendue_gain_at, etendue_scale, is_reversible};
use crate::integrators::common::work::Work;
use crate::integrators::simd::sort::{KINDS, SortedHits};
use crate::prepare::casters;
use crate::prepare::casters::LINE_DIMENSIONS;
use crate::prepare::guide::Trace;
use crate::sampling::{Sampler, hash_u32};
use crate::shading::bsdf::Lobe;
use crate::shading::dimensions::{DIM_DIRECTION, DIM_LOBE};
use crate::shading::interface::{Interface, MediumId};
use crate::shading::medium::MediumSets;
use crate::shading::mis_state::MisState;
use crate::shading::paths::{Path, PathBatch};
use crate::shading::scatter::{BsdfSample, Scatter};
use crate::shading::sides::Sides;
use crate::shading::surface::blend::Blend;
use crate::shading::surface::{blend_at, lobe_at};
use crate::shading::vertex::{Vertex, material_of};
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{Hit, HitBatch, InstructionSet, RayClass};
use glam::{Vec2, Vec3};

/// Share of pilot paths that glass reflects: more than that of the light, so that faint reflections are covered as
/// well.
const PILOT_REFLECTION: f32 = 0.25;

/// The state of one path between two vertices.
#[derive(Clone, Copy)]
struct LightPath {
    /// Flux over pdf.
    throughput: Vec3,
    /// Pdf over that of the same camera path, up to the next vertex; see [`crate::integrators::common::caustics_weight`].
    ratio: f32,
    sampler: Sampler,
    /// The caster to be hit first; [`NO_CASTER`](crate::prepare::casters::NO_CASTER) afterwards.
    aimed_at: u32,
    media: MediumId,
    /// Probability with which the path survived Russian roulette.
    kept: f32,
    /// On the first segment: whether the light is outside of the scene, see [`casters::LightLine::is_far`].
    is_far: bool,
}

/// Light paths are stored like camera paths, with other meanings of some fields: `pdf` is the ratio, `slot` the caster
/// that they are aimed at, `normal` the survival probability, and `position` at first whether the light is far away.
impl From<LightPath> for Path {
    fn from(LightPath { throughput, ratio, sampler, aimed_at, media, kept, is_far }: LightPath) -> Self {
        let (position, normal) = (Vec3::splat(f32::from(is_far)), Vec3::splat(kept));
        Self { throughput, pdf: ratio, position, normal, sampler, slot: aimed_at, media, track: MisState::default() }
    }
}

impl From<Path> for LightPath {
    fn from(Path { throughput, pdf, sampler, slot, media, position, normal, .. }: Path) -> Self {
        Self { throughput, ratio: pdf, sampler, aimed_at: slot, media, kept: normal.x, is_far: position == Vec3::ONE }
    }
}

/// Scratch memory of one worker.
#[derive(Default)]
pub(crate) struct LightWave {
    paths: PathBatch,
    next: PathBatch,
    hits: HitBatch,
    sorted: SortedHits,
    /// Hits of one kind: those handled in SIMD, and the others.
    together: Vec<u32>,
    apart: Vec<u32>,
    lens_connections: LensConnections,
    sets: MediumSets,
    /// Media of the camera.
    camera: MediumId,
    /// Counts the cost if present.
    pub work: Option<Box<Work>>,
}

/// The BSDF of a surface: a lobe or a blend.
enum LightPathSurface<'a> {
    Lobe(Lobe<'a>),
    Blend(Box<Blend<'a>>),
}

impl LightWave {
    /// Traces paths `first` to `first + n`; `None` if `stop` returned true.
    pub fn trace(
        &mut self,
        pass: &CausticPass,
        first: u64,
        n: u32,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<(Vec<Splat>, RayCounts)> {
        let mut splats = Vec::new();
        let spread = |found: &LensConnections, i| {
            let (film, light) = found.get(i);
            pass.spread(film, light, &mut splats);
        };
        let counts = self.trace_to_lens(pass, first, n, stop, spread)?;
        Some((splats, counts))
    }

    /// Like [`Self::trace`], for a pass whose light paths are measured.
    pub fn trace_measured(
        &mut self,
        pass: &CausticPass,
        first: u64,
        n: u32,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Vec<MeasuredSplat>> {
        let mut splats = Vec::new();
        self.trace_to_lens(pass, first, n, stop, |found, i| splats.push(found.measured(i)))?;
        Some(splats)
    }

    /// Traces paths, and passes all unoccluded lens connections to `take`.
    fn trace_to_lens(
        &mut self,
        pass: &CausticPass,
        first: u64,
        n: u32,
        stop: &(dyn Fn() -> bool + Sync),
        mut take: impl FnMut(&LensConnections, usize),
    ) -> Option<RayCounts> {
        let mut counts = RayCounts::default();
        self.start(pass, first, n, false);
        let mut n_vertices = 0;
        while !self.paths.is_empty() {
            if stop() {
                return None;
            }
            n_vertices += 1;
            counts.bounce += self.paths.len() as u64;
            pass.scene.closest_hits(&self.paths.rays, RayClass::Incoherent, &mut self.hits);
            pass.scene.settle(&self.paths.rays, &mut self.hits);
            if let Some(work) = &mut self.work {
                work.add_rays(&self.hits, &self.paths.slot[..self.paths.len()], RayClass::Incoherent);
            }
            self.scatter(pass, n_vertices);
            let lens_connections = &mut self.lens_connections;
            if let Some(work) = &mut self.work {
                work.add_connections(lens_connections.rays.len());
            }
            pass.scene.any_hits(&lens_connections.rays, RayClass::Incoherent, &mut lens_connections.occluded);
            counts.shadow += lens_connections.rays.len() as u64;
            for i in 0..lens_connections.rays.len() {
                if !lens_connections.occluded[i] {
                    take(lens_connections, i);
                }
            }
            std::mem::swap(&mut self.paths, &mut self.next);
        }
        Some(counts)
    }

    /// Traces paths to their first scattering vertex, for [`crate::prepare::guide`].
    pub fn trace_pilots(
        &mut self,
        pass: &CausticPass,
        first: u64,
        n: u32,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Vec<Trace>> {
        let mut traces = Vec::new();
        self.start(pass, first, n, true);
        let mut n_vertices = 0;
        while !self.paths.is_empty() {
            if stop() {
                return None;
            }
            n_vertices += 1;
            pass.scene.closest_hits(&self.paths.rays, RayClass::Incoherent, &mut self.hits);
            pass.scene.settle(&self.paths.rays, &mut self.hits);
            self.next.start(self.paths.len(), pass.scene.tables.features.glass, false);
            for i in 0..self.paths.len() {
                let mut path = LightPath::from(self.paths.get(i));
                let Some(hit) = self.hits.get(i) else { continue };
                if n_vertices == 1 && pass.casters.of_hit(&hit) != path.aimed_at {
                    continue;
                }
                let ray = self.paths.rays.get(i);
                let found = surface_at(pass, &mut self.sets, &ray, &hit, &mut path);
                let Some((vertex, material, surface)) = found else { continue };
                if n_vertices > 1 && surface.has_non_specular() {
                    traces.push(Trace { at: vertex.position, from: ray.origin });
                }
                let step = LightPathStep {
                    pass,
                    path: &path,
                    vertex: &vertex,
                    hit: &hit,
                    material,
                    n_vertices,
                    is_pilot: true,
                };
                if let Some((ray, path, true)) = step.go_on(&surface) {
                    self.next.push(&ray, &path.into());
                }
            }
            std::mem::swap(&mut self.paths, &mut self.next);
        }
        Some(traces)
    }

    /// - `are_pilots`: only lights that camera paths can find are used.
    fn start(&mut self, pass: &CausticPass, first: u64, n: u32, are_pilots: bool) {
        self.paths.start(n as usize, pass.scene.tables.features.glass, false);
        self.camera = self.sets.start(pass.scene, &pass.camera_media);
        let new_sampler = if pass.techniques.even_samples { Sampler::new } else { Sampler::independent };
        // One sequence for all paths, different from those of all pixels.
        let seed = hash_u32(pass.seed ^ 0x6c61_6d70);
        for i in first..first + u64::from(n) {
            // A sequence has 2³² points.
            let sampler = new_sampler(seed, u32::MAX, u32::MAX - (i >> 32) as u32, i as u32);
            let Some(line) = pass.casters.sample(&pass.scene.tables.lights, &pass.scene.shading.textures, &sampler)
            else {
                continue;
            };
            let throughput = line.radiance / line.density;
            if throughput == Vec3::ZERO || are_pilots && line.is_delta {
                continue;
            }
            let (mut ratio, mut media) = (line.density, MediumId::OUTSIDE);
            if line.is_delta {
                (ratio, media) = (f32::INFINITY, self.sets.within(pass.scene, pass.casters.media_of(line.light)));
            }
            let path =
                LightPath { throughput, ratio, sampler, aimed_at: line.caster, media, kept: 1.0, is_far: line.is_far };
            self.paths.push(&line.ray, &path.into());
        }
    }

    /// - `n_vertices`: number of vertices including the present hits.
    fn scatter(&mut self, pass: &CausticPass, n_vertices: u32) {
        let scene = pass.scene;
        let (surfaces, kinds) = (&scene.surfaces, &scene.tables.materials.kinds);
        self.next.start(self.paths.len(), scene.tables.features.glass, false);
        self.lens_connections.start(self.paths.len());
        let set = pass.simd.unwrap_or(InstructionSet::Portable);
        self.sorted.sort(set, scene, kinds, &self.hits, self.paths.len());
        // All kinds after the misses.
        for kind in 0..KINDS - 1 {
            self.together.clear();
            self.apart.clear();
            for &i in self.sorted.of_kind(kind + 1) {
                let Some(hit) = self.hits.get(i as usize) else { continue };
                if n_vertices == 1 && pass.casters.of_hit(&hit) != self.paths.slot[i as usize] {
                    continue;
                }
                let has_lanes = pass.simd.is_some() && simd::know(kind, surfaces, &hit);
                if has_lanes { &mut self.together } else { &mut self.apart }.push(i);
            }
            if !self.together.is_empty() {
                let group = LightHits {
                    pass,
                    n_vertices,
                    dimension: first_dimension(n_vertices),
                    paths: &self.paths,
                    hits: &self.hits,
                    materials: &self.sorted.materials,
                    order: &self.together,
                    next: &mut self.next,
                    lens_connections: &mut self.lens_connections,
                    sets: &mut self.sets,
                    camera: self.camera,
                };
                simd::scatter(set, kind, group);
            }
            for k in 0..self.apart.len() {
                self.scatter_one(pass, n_vertices, self.apart[k] as usize);
            }
        }
    }

    fn scatter_one(&mut self, pass: &CausticPass, n_vertices: u32, i: usize) {
        let scene = pass.scene;
        let mut path = LightPath::from(self.paths.get(i));
        let Some(hit) = self.hits.get(i) else { return };
        if scene.tables.features.media && !(n_vertices == 1 && path.is_far) {
            path.throughput *= self.sets.transmittance(path.media, hit.t);
        }
        let found = surface_at(pass, &mut self.sets, &self.paths.rays.get(i), &hit, &mut path);
        let Some((vertex, material, surface)) = found else { return };
        let step =
            LightPathStep { pass, path: &path, vertex: &vertex, hit: &hit, material, n_vertices, is_pilot: false };
        if n_vertices > 1
            && surface.has_non_specular()
            && (path.media.of_all_channels() == self.camera || surface.through().is_some())
            && let Some((ray, film, light, ratio)) = step.join(&surface, &self.sets, self.camera)
        {
            self.lens_connections.push(&ray, film, light, [ratio, path.kept]);
        }
        if pass.goes_on(n_vertices)
            && let Some((ray, path, _)) = step.go_on(&surface)
        {
            self.next.push(&ray, &path.into());
        }
    }
}

/// First sample dimension of vertex number `n_vertices`.
fn first_dimension(n_vertices: u32) -> u32 {
    LINE_DIMENSIONS + (n_vertices - 1) * VERTEX_DIMENSIONS
}

/// Returns `None` if the surface is black. Where light is dispersed, the path is limited to one channel.
fn surface_at<'a>(
    pass: &CausticPass<'a>,
    sets: &mut MediumSets,
    ray: &Ray,
    hit: &Hit,
    path: &mut LightPath,
) -> Option<(Vertex, MaterialId, LightPathSurface<'a>)> {
    let scene = pass.scene;
    let material = material_of(scene, hit);
    let vertex = Vertex::new(scene, ray, hit, material);
    let is_blend = matches!(
        scene.shading.materials[material as usize],
        Material::Blend { .. } | Material::Phong { .. } | Material::Principled { .. }
    );
    let glass = scene.tables.features.glass;
    let mut sides = glass.then(|| Sides::new(scene, sets, path.media, ray, hit, material, vertex.front));
    if let Some(sides) = &mut sides
        && let Some(factor) = sides.disperse(scene, material, &path.sampler)
    {
        path.throughput *= factor;
        path.media = sides.here;
    }
    let surface = if is_blend {
        LightPathSurface::Blend(Box::new(blend_at(scene, material, &vertex, sides.as_mut())?))
    } else {
        LightPathSurface::Lobe(lobe_at(scene, material, &vertex, sides.as_mut())?)
    };
    Some((vertex, material, surface))
}

/// One vertex of one path.
struct LightPathStep<'a> {
    pass: &'a CausticPass<'a>,
    path: &'a LightPath,
    /// As seen from the light.
    vertex: &'a Vertex,
    hit: &'a Hit,
    material: MaterialId,
    n_vertices: u32,
    /// Whether the path is one of [`LightWave::trace_pilots`], which carry no throughput.
    is_pilot: bool,
}

impl LightPathStep<'_> {
    fn dimension(&self) -> u32 {
        first_dimension(self.n_vertices)
    }

    /// Connects the vertex to a point of the lens: returns the shadow ray, the film position, the contribution, and the
    /// ratio of its pdf to that of the camera path.
    ///
    /// - `media`: media of the camera.
    fn join(&self, surface: &LightPathSurface, sets: &MediumSets, media: MediumId) -> Option<(Ray, Vec2, Vec3, f32)> {
        let &Self { pass, path, .. } = self;
        let (scene, camera) = (pass.scene, &pass.scene.camera);
        let lens = if camera.lens_radius > 0.0 {
            camera.lens_offset(path.sampler.pair(self.dimension() + DIM_LENS))
        } else {
            Vec2::ZERO
        };
        let found = camera.connection(lens, self.vertex.position, pass.size)?;
        let (origin, film) = (Vec3::from(found.lens), Vec2::from(found.film));
        if !pass.reaches_film(film) {
            return None;
        }
        let to_light = self.vertex.wo;
        let way = origin - self.vertex.position;
        let distance2 = way.length_squared();
        let (to_camera, cos_lens) = (way / distance2.sqrt(), found.depth / distance2.sqrt());
        let through = surface.through().filter(|_| to_camera.dot(self.vertex.geometric_normal) < 0.0);
        let before = path.media;
        let after = through.map_or(before, |interface| interface.beyond);
        if after.of_all_channels() != media || through.is_some() && before == after {
            return None;
        }
        let vertex =
            if through.is_some() { self.vertex.seen_through(to_camera) } else { self.vertex.seen_along(to_camera) };
        // Light and camera must be on the same side of the true surface, unless light passes through it.
        if vertex.wo.dot(vertex.geometric_normal) <= 0.0 || through.is_none() && !vertex.is_reached_from(to_light) {
            return None;
        }
        let normal = if through.is_some() { -vertex.normal } else { vertex.normal };
        let (value, pdf) = surface.eval(vertex.wo, to_light, normal);
        if pdf <= 0.0 {
            return None;
        }
        let (cos_o, cos_i) = (vertex.wo.dot(vertex.geometric_normal), to_light.dot(self.vertex.geometric_normal));
        if cos_o <= 0.0 || cos_i <= 0.0 {
            return None;
        }
        let ratio = path.ratio * etendue_scale(through) * pass.join_ratio(distance2, cos_lens, cos_o, cos_i, pdf);
        let weight = if pass.is_measured { 1.0 } else { pass.light_path_weight(ratio) };
        let importance = cos_o / (camera.spread(distance2, cos_lens) * pass.pixel_area);
        let mut light = path.throughput * value * (weight * importance / cos_i);
        if light == Vec3::ZERO {
            return None;
        }
        if scene.tables.features.media {
            light *= sets.transmittance(after, distance2.sqrt());
        }
        let start = if through.is_some() { vertex.passing(vertex.wo) } else { vertex.leaving(vertex.wo) };
        Some((Ray { origin: start, dir: origin - start, t_max: 1.0 }, film, light, ratio))
    }

    /// Samples the continuation of the path, with Russian roulette; the flag says whether the vertex was specular.
    fn go_on(&self, surface: &LightPathSurface) -> Option<(Ray, LightPath, bool)> {
        let &Self { pass, vertex, material, n_vertices, .. } = self;
        let scene = pass.scene;
        let mut path = *self.path;
        let (sampler, dimension) = (path.sampler, self.dimension());
        let u_lobe = || {
            let u = sampler.single(dimension + DIM_LOBE);
            match scene.shading.materials[material as usize] {
                // Reflects with a fixed probability, whatever the shares of the light.
                Material::Glass { .. } if self.is_pilot => f32::from(u >= PILOT_REFLECTION) * 1.0f32.next_down(),
                _ => u,
            }
        };
        let sample = surface.sample(vertex.wo, vertex.normal, u_lobe, sampler.pair(dimension + DIM_DIRECTION))?;
        let is_specular = sample.pdf.is_infinite();
        // A path that scatters before any specular vertex is left to camera paths.
        if n_vertices == 1 && !is_specular {
            return None;
        }
        let beyond = sample.wi.dot(vertex.geometric_normal) < 0.0;
        if if sample.through.is_some() { !beyond } else { !vertex.is_reached_from(sample.wi) } {
            return None;
        }
        let before = path.media;
        if let Some(through) = sample.through {
            path.media = through.beyond;
        }
        let bounce = MisBounce {
            vertex,
            hit: self.hit,
            eye: None,
            wi: sample.wi,
            pdf: sample.pdf,
            through: sample.through,
            blended: scene.shading.materials[material as usize].is_blended(),
            before,
            after: path.media,
        };
        if !is_reversible(&bounce) {
            return None;
        }
        let factor = if is_specular {
            let gain = etendue_gain_at(vertex, vertex.wo, sample.wi);
            path.ratio /= gain;
            // Radiance scales with n² on entering glass, flux does not.
            let radiance_eta = sample.through.map_or(1.0, |Interface { radiance_eta, .. }| radiance_eta);
            sample.weight * (gain / (radiance_eta * radiance_eta))
        } else {
            let passes = sample.through.is_some();
            let seen = vertex.seen_along(sample.wi);
            let normal = if passes { vertex.normal_from_behind(sample.wi) } else { seen.normal };
            let (value, pdf) = surface.eval(sample.wi, vertex.wo, normal);
            let (cos_o, cos_i) = (sample.wi.dot(vertex.geometric_normal).abs(), vertex.wo.dot(vertex.geometric_normal));
            if pdf <= 0.0 || cos_i <= 0.0 || !passes && !seen.is_reached_from(vertex.wo) {
                return None;
            }
            path.ratio *= sample.pdf * cos_i / (cos_o * pdf) * etendue_scale(sample.through);
            value * (cos_o / (cos_i * sample.pdf))
        };
        let survival =
            most_kept(scene, n_vertices, is_specular).map_or(1.0, |most| factor.abs().max_element().min(most));
        path.throughput *= factor;
        if survival < 1.0 {
            if sampler.single(dimension + DIM_ROULETTE) >= survival {
                return None;
            }
            path.throughput /= survival;
            path.kept *= survival;
        }
        if path.throughput == Vec3::ZERO {
            return None;
        }
        path.aimed_at = casters::NO_CASTER;
        let origin = if sample.through.is_some() { vertex.passing(sample.wi) } else { vertex.leaving(sample.wi) };
        Some((Ray::new(origin, sample.wi), path, is_specular))
    }
}

impl LightPathSurface<'_> {
    fn has_non_specular(&self) -> bool {
        match self {
            Self::Lobe(lobe) => lobe.has_non_specular(),
            Self::Blend(blend) => blend.has_non_specular(),
        }
    }

    fn eval(&self, wo: Vec3, wi: Vec3, normal: Vec3) -> (Vec3, f32) {
        match self {
            Self::Lobe(lobe) => lobe.eval(wo, wi, normal),
            Self::Blend(blend) => blend.eval(wo, wi, normal),
        }
    }

    fn through(&self) -> Option<Interface> {
        match self {
            Self::Lobe(lobe) => lobe.through(),
            Self::Blend(blend) => blend.through(),
        }
    }

    fn sample(&self, wo: Vec3, normal: Vec3, u_lobe: impl FnOnce() -> f32, u: Vec2) -> Option<BsdfSample> {
        match self {
            Self::Lobe(lobe) => lobe.sample(wo, normal, u_lobe, u),
            Self::Blend(blend) => blend.sample(wo, normal, u_lobe, u),
        }
    }
}

impl CausticPass<'_> {
    /// Whether paths may have more vertices: one more, and the lens connection, are two more segments.
    pub(crate) fn goes_on(&self, n_vertices: u32) -> bool {
        n_vertices + 2 <= self.max_depth
    }

    /// Whether the filter of any pixel reaches a film position.
    fn reaches_film(&self, film: Vec2) -> bool {
        let radius = self.filter.radius();
        film.cmpge(Vec2::splat(0.5 - radius)).all() && film.cmplt(self.size + (radius - 0.5)).all()
    }

    /// Distributes a contribution to all pixels whose filter reaches its film position.
    fn spread(&self, film: Vec2, light: Vec3, splats: &mut Vec<Splat>) {
        let radius = self.filter.radius();
        let low = (film - radius + 0.5).floor().max(Vec2::ZERO);
        let high = (film + radius - 0.5).floor().min(self.size - 1.0);
        let (low, high) = (low.as_uvec2(), high.as_ivec2());
        let weight = |pixel: u32, at: f32| match self.filter {
            // Half-open, so that no film position is lost between two pixels.
            PixelFilter::Box => 1.0,
            _ => self.filter.weight(f64::from(at) - f64::from(pixel) - 0.5) / self.filter_norm,
        };
        for y in low.y as i32..=high.y {
            let weight_y = weight(y as u32, film.y);
            for x in low.x as i32..=high.x {
                let weight = (weight(x as u32, film.x) * weight_y) as f32;
                if weight != 0.0 {
                    splats.push(Splat { pixel: y as u32 * self.size.x as u32 + x as u32, light: weight * light });
                }
            }
        }
    }
}
