//! What of a picture light paths, and paths that are weighed against them, need to know.

use crate::core::caustic_plan::CausticPlan;
use crate::core::filter::PixelFilter;
use crate::core::settings::{Integrator, RenderSettings};
use crate::core::techniques::Techniques;
use crate::integrators::caustics::batches::Batches;
use crate::prepare::casters::CasterTable;
use crate::prepare::guide::{Guide, Hints};
use crate::prepare::prepared::Prepared;
use crate::shading::mis_state::MisState;
use firstlight_simd::InstructionSet;
use glam::{UVec2, Vec2, Vec3};

/// What tracing from the lights and weighting against it need to know of a picture.
pub(crate) struct CausticPass<'a> {
    pub scene: &'a Prepared,
    pub casters: &'a CasterTable,
    pub techniques: Techniques,
    pub max_depth: u32,
    pub seed: u32,
    /// `None` for one path at a time.
    pub simd: Option<InstructionSet>,
    pub size: Vec2,
    pub filter: PixelFilter,
    /// The integral of the filter along one axis.
    pub filter_norm: f64,
    pub plan: CausticPlan,
    /// Light paths a sample of the whole picture; 0 if there are none.
    pub paths_per_sample: f64,
    /// Light paths tell what they bring before it is weighted, and its ratio: see [`super::plan`].
    pub is_measured: bool,
    /// Of a pixel on the film; see [`crate::core::camera::Camera::pixel_size`]; square metres.
    pub pixel_area: f32,
    /// See [`crate::prepare::bodies::Bodies::around`].
    pub camera_media: Vec<u32>,
}

impl<'a> CausticPass<'a> {
    /// `None` where there is nothing to gain, or nothing is to be used.
    pub fn of(
        scene: &'a Prepared,
        settings: &RenderSettings,
        size: UVec2,
        camera_media: &[u32],
        plan: CausticPlan,
    ) -> Option<Self> {
        let casters = casters_of(scene, settings)?;
        if plan.is_none() {
            return None;
        }
        let paths_per_sample = match plan.light_path_stride {
            0 => 0.0,
            stride => Batches::of_film((size.x * size.y) as usize, stride).paths_per_sample(),
        };
        let pixel = scene.camera.pixel_size(size.as_vec2());
        Some(Self {
            scene,
            casters,
            techniques: settings.techniques,
            max_depth: settings.max_depth,
            seed: settings.seed,
            simd: settings.simd,
            size: size.as_vec2(),
            filter: settings.filter,
            filter_norm: settings.filter.integral(),
            plan,
            paths_per_sample,
            is_measured: false,
            pixel_area: pixel * pixel,
            camera_media: camera_media.to_vec(),
        })
    }
}

/// What caustics come from, where they are looked for at all.
pub(crate) fn casters_of<'a>(scene: &'a Prepared, settings: &RenderSettings) -> Option<&'a CasterTable> {
    // Light, mirror, diffuse, camera: three segments.
    let looks = settings.integrator == Integrator::Path && settings.techniques.caustics && settings.max_depth >= 3;
    scene.tables.casters.as_ref().filter(|_| looks)
}

impl CausticPass<'_> {
    /// `None` while it is not prepared, where it knows nothing, and where it is not used.
    #[inline]
    pub fn guide(&self) -> Option<&Guide> {
        if !self.plan.guided {
            return None;
        }
        self.casters.guide.get().filter(|guide| !guide.is_empty())
    }

    /// Hints for a vertex, where light paths are of no use to the path so far.
    ///
    /// - `n_vertices`: up to and with this one.
    #[inline]
    pub fn hints(&self, track: &MisState, n_vertices: u32, position: Vec3) -> Option<Hints<'_>> {
        let needs_them = n_vertices > 1 && track.is_lost();
        needs_them.then(|| self.guide()?.at(position)).flatten()
    }
}
