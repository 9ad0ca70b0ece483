//! Unbiased path tracing, a wave of paths at a time.
//!
//! All paths of a wave have the same depth: one batch of closest-hit queries, shading of the hits, one batch of shadow
//! rays; the surviving paths are the next batch. Direct light is found by light sampling (next-event estimation) and by
//! BSDF sampling, combined with the power heuristic (Veach 1997, chapter 9); smooth environments are left to BSDF
//! sampling, which finds them as well. Paths end by Russian roulette, without a depth limit unless requested. Common
//! materials are shaded sixteen hits at a time (`simd/`), all others one at a time (`path/scalar.rs`).
//! Start reading at [`PathWave::trace`].

mod chains;
pub(crate) mod first_surfaces;
mod scalar;

use crate::core::counts::RayCounts;
use crate::core::material::MaterialKind;
use crate::core::settings::RenderSettings;
use crate::core::techniques::Techniques;
use crate::integrators::common::caustics_pass::CausticPass;
use crate::integrators::common::record::Record;
use crate::integrators::common::survival::Survival;
use crate::integrators::common::work::Work;
use crate::integrators::path::first_surfaces::FirstSurfaces;
use crate::integrators::simd::misses::Misses;
use crate::integrators::simd::shade::KindHits;
use crate::integrators::simd::sort::{KINDS, SortedHits};
use crate::integrators::simd::{emitters, misses, shade};
use crate::prepare::material_table::COATED;
use crate::prepare::prepared::Prepared;
use crate::sampling::Sampler;
use crate::shading::dimensions::first_dimension;
use crate::shading::interface::MediumId;
use crate::shading::lights::environment_light;
use crate::shading::medium::MediumSets;
use crate::shading::mis_state::MisState;
use crate::shading::paths::{Path, PathBatch, ShadowBatch};
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{HitBatch, InstructionSet, RayBatch, RayClass};
use firstlight_simd::LANES;
use glam::Vec3;

impl From<CameraPath> for Path {
    fn from(CameraPath { ray, sampler, slot, weight }: CameraPath) -> Self {
        Self {
            throughput: Vec3::splat(weight),
            pdf: f32::INFINITY,
            position: ray.origin,
            normal: ray.dir,
            sampler,
            slot,
            media: MediumId::OUTSIDE,
            track: MisState::default(),
        }
    }
}

/// A camera ray and its destination.
pub(crate) struct CameraPath {
    pub ray: Ray,
    pub sampler: Sampler,
    pub slot: u32,
    /// Weight of its radiance, see [`crate::core::filter`].
    pub weight: f32,
}

/// Scratch memory of one worker: cleared between waves, never freed.
#[derive(Default)]
pub(crate) struct PathWave {
    paths: PathBatch,
    next: PathBatch,
    hits: HitBatch,
    sorted: SortedHits,
    shadows: ShadowBatch,
    sets: MediumSets,
    camera: MediumId,
    /// Segments of the longest path of the last wave.
    pub depth: u32,
    /// Records the paths if present.
    pub record: Option<Box<Record>>,
    /// Counts the cost if present.
    pub work: Option<Box<Work>>,
    /// Notes what the paths see, likewise.
    pub first_surfaces: Option<Box<FirstSurfaces>>,
    /// Per slot, see [`FilmTile::shadow_thresholds`](crate::film::tile::FilmTile::shadow_thresholds); empty if all
    /// shadow rays are traced.
    pub shadow_thresholds: Vec<f32>,
}

/// Returns whether the shadow rays of the first hits, which start close together, have similar directions.
///
/// Packets of sixteen rays are faster than streams for lights that look small, and slower for large ones.
fn class_of_first_shadows(rays: &RayBatch) -> RayClass {
    /// Mean difference of the directions in a packet, radians: where both take as long.
    const SPREAD: f32 = 0.1;
    /// Every n-th packet is measured.
    const STEP: usize = 16 * LANES;
    let (mut sum, mut n) = (0.0, 0.0);
    for first in (0..rays.len()).step_by(STEP) {
        let dir = |i: usize| rays.get(i).dir.normalize_or_zero();
        for other in [first + 5, first + 10, first + 15].into_iter().filter(|&i| i < rays.len()) {
            sum += dir(first).distance(dir(other));
            n += 1.0;
        }
    }
    if sum < SPREAD * n { RayClass::Coherent } else { RayClass::Incoherent }
}

/// Index of misses in [`SortedHits::of_kind`]; materials have [`Material::kind`](crate::core::material::Material::kind) + 1.
const MISSES: usize = 0;
const EMITTERS: usize = MaterialKind::Emissive as usize + 1;

impl PathWave {
    /// Sets the media in which the paths of an image start, see [`crate::prepare::bodies::Bodies::around`]; must be
    /// called first.
    pub fn begin_in(&mut self, scene: &Prepared, camera_media: &[u32]) {
        self.camera = self.sets.start(scene, camera_media);
    }

    /// Traces the paths that `start` pushes, at most one per slot, and adds their radiance to `radiance`, indexed by
    /// slot.
    ///
    /// `None` if `stop` returned true; `radiance` is meaningless then.
    pub fn trace(
        &mut self,
        scene: &Prepared,
        settings: &RenderSettings,
        caustics: Option<&CausticPass>,
        start: impl FnOnce(&mut PathBatch),
        radiance: &mut [Vec3],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<RayCounts> {
        self.paths.start(radiance.len(), scene.tables.features.glass, caustics.is_some());
        start(&mut self.paths);
        self.paths.begin_in(self.camera);
        if let Some(surfaces) = &mut self.first_surfaces {
            surfaces.start(radiance.len());
        }
        let mut counts = RayCounts { camera: self.paths.len() as u64, ..RayCounts::default() };
        for depth in 1..=settings.max_depth {
            if self.paths.is_empty() {
                break;
            }
            if stop() {
                return None;
            }
            self.depth = depth;
            // Camera rays are coherent, and so are the shadow rays of their hits to small lights.
            let class = if depth == 1 { RayClass::Coherent } else { RayClass::Incoherent };
            scene.closest_hits(&self.paths.rays, class, &mut self.hits);
            scene.settle(&self.paths.rays, &mut self.hits);
            if let Some(record) = &mut self.record {
                record.see_hits(&self.paths, &self.hits);
            }
            if let Some(work) = &mut self.work {
                work.add_rays(&self.hits, &self.paths.slot[..self.paths.len()], class);
                if depth > 1 && caustics.is_some_and(|pass| pass.guide().is_some()) {
                    work.add_told(scene, &self.paths, &self.hits);
                }
            }
            if let Some(pass) = caustics.filter(|pass| depth > 1 && pass.has_chains()) {
                self.add_chains(pass, settings, depth, radiance);
            }
            self.shade(scene, depth, settings, caustics, radiance);
            if let Some(record) = &mut self.record {
                record.see_shaded(&self.paths, radiance);
            }
            let class = if depth == 1 { class_of_first_shadows(&self.shadows.rays) } else { class };
            self.shadows.settle(radiance, |rays, occluded| scene.shadows(rays, class, occluded));
            if let Some(record) = &mut self.record {
                record.see_settled(scene, &self.shadows, radiance);
            }
            counts.shadow += self.shadows.rays.len() as u64;
            if let Some(work) = &mut self.work {
                work.add_shadow_rays(&self.shadows.slot[..self.shadows.rays.len()]);
            }
            counts.bounce += self.next.len() as u64;
            std::mem::swap(&mut self.paths, &mut self.next);
        }
        Some(counts)
    }

    fn shade(
        &mut self,
        scene: &Prepared,
        depth: u32,
        settings: &RenderSettings,
        caustics: Option<&CausticPass>,
        radiance: &mut [Vec3],
    ) {
        self.next.start(self.paths.len(), scene.tables.features.glass, caustics.is_some());
        self.shadows.start(self.paths.len());
        let set = settings.simd.unwrap_or(InstructionSet::Portable);
        let kinds = &scene.tables.materials.kinds;
        self.sorted.sort(set, scene, kinds, &self.hits, self.paths.len());
        if let Some(surfaces) = &mut self.first_surfaces {
            surfaces.see(scene, settings.simd, depth, &self.paths, &self.hits, &self.sorted);
        }
        let is_last = depth == settings.max_depth;
        let emitters_have_lanes = scene.tables.lights.has_lanes() && !scene.tables.materials.textured_emission;
        for kind in 0..KINDS {
            let order = self.sorted.of_kind(kind);
            if order.is_empty() {
                continue;
            }
            let group = KindHits {
                scene,
                techniques: &settings.techniques,
                caustics,
                depth,
                dimension: first_dimension(depth),
                survival: Survival::at(depth, scene, &settings.techniques),
                paths: &self.paths,
                hits: &self.hits,
                materials: &self.sorted.materials,
                order,
                next: &mut self.next,
                shadows: &mut self.shadows,
                shadow_thresholds: if settings.techniques.roulette { &self.shadow_thresholds } else { &[] },
                sets: &mut self.sets,
                radiance: &mut *radiance,
                is_last,
            };
            match (settings.simd, kind) {
                (Some(set), MISSES) => {
                    let KindHits { scene, techniques, caustics, paths, order, sets, radiance, .. } = group;
                    let misses = Misses { scene, techniques, caustics, paths, sets, order, radiance };
                    misses::shade_misses(set, misses);
                }
                (_, MISSES) => self.shade_misses(scene, &settings.techniques, caustics, radiance),
                (Some(set), EMITTERS) if emitters_have_lanes => emitters::shade_emitters(set, group),
                // Hits that do not emit and end their path contribute nothing.
                (Some(_), _) if shade::knows(kind - 1) && is_last && kind - 1 <= COATED => {}
                (Some(set), _) if shade::knows(kind - 1) => shade::shade(set, kind - 1, group),
                _ => self.shade_one_by_one(scene, depth, settings, caustics, kind, radiance),
            }
        }
    }

    fn shade_misses(
        &mut self,
        scene: &Prepared,
        techniques: &Techniques,
        caustics: Option<&CausticPass>,
        radiance: &mut [Vec3],
    ) {
        if !scene.tables.features.environment {
            return;
        }
        for &i in self.sorted.of_kind(MISSES) {
            let i = i as usize;
            let dir = self.paths.rays.get(i).dir;
            let mut throughput = self.paths.throughput_of(i);
            if scene.tables.features.glass {
                throughput *= self.sets.environment_scale(self.paths.media_of(i));
            }
            let path = self.paths.get(i);
            let weight = caustics.and_then(|pass| pass.environment_weight(&path.track, path.media, dir));
            throughput *= weight.unwrap_or(1.0);
            radiance[path.slot as usize] += throughput * environment_light(scene, techniques, &path, dir);
        }
    }
}
