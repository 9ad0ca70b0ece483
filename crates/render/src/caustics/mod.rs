//! Caustics: light that comes to a matte surface through glass or off a mirror.
//!
//! A path that starts at the eye finds such light only when a bounce off the matte surface happens to go through the
//! glass and on to the lamp. So paths are traced from the lamps as well, aimed at what is smooth enough to gather
//! light ([`aim`]); from every matte or rough vertex that they come to, they are joined to a point of the lens and
//! their light is added to the pixels that see it ([`trace`], [`lanes`], [`layer`]). Both ways find the same light: all paths whose
//! first vertex from the eye scatters in all directions and whose last before the lamp is perfectly smooth. Each is
//! weighted by the power heuristic ([`weight`]), so the mean of the picture stays as it is. What is seen in a mirror or
//! through glass cannot be joined to the lens: there, paths from the eye are told the way ([`guide`]).
//!
//! Scenes without smooth surfaces or without finite lights have no [`CasterTable`], and pay nothing.
//! Start reading at [`CausticPass`].

mod aim;
mod arrivals;
mod guide;
mod lanes;
mod layer;
mod trace;
mod weight;

pub(super) use aim::{CasterTable, NO_CASTER};
pub(super) use guide::{Guided, Hints, SHARE as HINTED};
use layer::Batches;
pub(super) use layer::LightLayer;
pub(super) use weight::{Bounce, Track};

use super::filter::PixelFilter;
use super::{Camera, Integrator, RenderSettings, Snapshot, Techniques};
use firstlight_simd::InstructionSet;
use glam::{UVec2, Vec2, Vec3};
use guide::Guide;
use rayon::prelude::*;
use trace::LightWave;

/// What tracing from the lamps and weighting against it need to know of a picture.
pub(super) struct CausticPass<'a> {
    scene: &'a Snapshot,
    casters: &'a CasterTable,
    techniques: Techniques,
    max_depth: u32,
    seed: u32,
    /// `None` for one path at a time.
    lanes: Option<InstructionSet>,
    size: Vec2,
    filter: PixelFilter,
    /// The integral of the filter along one axis.
    filter_norm: f64,
    /// Paths from the lamps a sample of the whole picture.
    paths_per_sample: f64,
    /// Of a pixel, on the plane one metre ahead of the eye; square metres.
    pixel_area: f32,
    /// See [`super::medium::Bodies::around`].
    camera_media: Vec<u32>,
}

impl<'a> CausticPass<'a> {
    /// `None` where there is nothing to gain.
    pub fn of(scene: &'a Snapshot, settings: &RenderSettings, size: UVec2, camera_media: &[u32]) -> Option<Self> {
        let casters = scene.shading.casters.as_ref()?;
        // Lamp, mirror, matte, eye: three segments.
        let traces_paths = settings.integrator == Integrator::Path;
        if !traces_paths || !settings.techniques.caustics || settings.max_depth < 3 {
            return None;
        }
        let Camera { tan_half_vfov, .. } = scene.camera;
        let pixel = 2.0 * tan_half_vfov / size.y as f32;
        Some(Self {
            scene,
            casters,
            techniques: settings.techniques,
            max_depth: settings.max_depth,
            seed: settings.seed,
            lanes: settings.lanes,
            size: size.as_vec2(),
            filter: settings.filter,
            filter_norm: settings.filter.integral(),
            paths_per_sample: Batches::of_film((size.x * size.y) as usize).paths_per_sample(),
            pixel_area: pixel * pixel,
            camera_media: camera_media.to_vec(),
        })
    }
}

/// Paths from the lamps that show the others the way.
const SCOUTS: u32 = 1 << 15;

/// Scouts that one worker sends at once.
const SCOUT_BATCH: u32 = 2048;

impl CausticPass<'_> {
    /// Sees to it that hints are there; false if `stop` said so before they were.
    ///
    /// They belong to the lamps and surfaces of the scene, so they outlive cameras, seeds and settings.
    pub fn prepare(&self, stop: &(dyn Fn() -> bool + Sync)) -> bool {
        if self.casters.guide.get().is_some() {
            return true;
        }
        let scouts =
            Self { seed: 0, techniques: Techniques::ALL, max_depth: u32::MAX, camera_media: Vec::new(), ..*self };
        let traces: Vec<Option<Vec<_>>> = (0..SCOUTS / SCOUT_BATCH)
            .into_par_iter()
            .map_init(LightWave::default, |wave, batch| {
                wave.explore(&scouts, u64::from(batch * SCOUT_BATCH), SCOUT_BATCH, stop)
            })
            .collect();
        let Some(traces) = traces.into_iter().collect::<Option<Vec<_>>>() else { return false };
        // Somebody else may have been faster, with the same.
        let _ = self.casters.guide.set(Guide::build(traces.concat()));
        true
    }

    /// `None` while it is not prepared, and where it knows nothing.
    #[inline]
    pub fn guide(&self) -> Option<&Guide> {
        self.casters.guide.get().filter(|guide| !guide.is_empty())
    }

    /// Hints for a vertex, where paths from lamps are of no use to the path so far.
    ///
    /// - `n_vertices`: up to and with this one.
    #[inline]
    pub fn hints(&self, track: &Track, n_vertices: u32, position: Vec3) -> Option<Hints<'_>> {
        let needs_them = n_vertices > 1 && track.is_lost();
        needs_them.then(|| self.guide()?.at(position)).flatten()
    }
}
