//! Caustics: light that comes to a matte surface through glass or off a mirror.
//!
//! A path that starts at the eye finds such light only when a bounce off the matte surface happens to go through the
//! glass and on to the lamp. So paths are traced from the lamps as well, aimed at what is smooth enough to gather
//! light ([`aim`]); from every matte or rough vertex that they come to, they are joined to a point of the lens and
//! their light is added to the pixels that see it ([`trace`], [`layer`]). Both ways find the same light: all paths whose
//! first vertex from the eye scatters in all directions and whose last before the lamp is perfectly smooth. Each is
//! weighted by the power heuristic ([`weight`]), so the mean of the picture stays as it is. What is seen in a mirror or
//! through glass cannot be joined to the lens, and is left to the paths from the eye.
//!
//! Scenes without smooth surfaces or without finite lights have no [`CasterTable`], and pay nothing.
//! Start reading at [`CausticPass`].

mod aim;
mod layer;
mod trace;
mod weight;

pub(super) use aim::CasterTable;
pub(super) use layer::{LightLayer, joined};
pub(super) use weight::{Bounce, Track};

use super::filter::PixelFilter;
use super::{Camera, Integrator, RenderSettings, Snapshot, Techniques};
use glam::{UVec2, Vec2};

/// Paths from the lamps for each path from the eye. They cost about half as much, and all of them carry light that the
/// others hardly find.
const LIGHT_PATHS_PER_PIXEL: f32 = 0.5;

/// What tracing from the lamps and weighting against it need to know of a picture.
pub(super) struct CausticPass<'a> {
    scene: &'a Snapshot,
    casters: &'a CasterTable,
    techniques: Techniques,
    max_depth: u32,
    seed: u32,
    size: Vec2,
    filter: PixelFilter,
    /// The integral of the filter along one axis.
    filter_norm: f64,
    /// Paths from the lamps a sample of the whole picture.
    paths_per_sample: f64,
    /// Of a pixel, on the plane one metre ahead of the eye; square metres.
    pixel_area: f32,
}

impl<'a> CausticPass<'a> {
    /// `None` where there is nothing to gain.
    pub fn of(scene: &'a Snapshot, settings: &RenderSettings, size: UVec2) -> Option<Self> {
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
            size: size.as_vec2(),
            filter: settings.filter,
            filter_norm: settings.filter.integral(),
            paths_per_sample: f64::from(LIGHT_PATHS_PER_PIXEL) * f64::from(size.x) * f64::from(size.y),
            pixel_area: pixel * pixel,
        })
    }
}
