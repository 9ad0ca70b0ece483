//! Data of an image for light paths, and for camera paths that are weighted against them.

use crate::core::caustic_plan::CausticPlan;
use crate::core::filter::PixelFilter;
use crate::core::settings::{Integrator, RenderSettings};
use crate::core::techniques::Techniques;
use crate::integrators::common::batches::Batches;
use crate::prepare::casters::CasterTable;
use crate::prepare::guide::{Guide, Hints};
use crate::prepare::prepared::Prepared;
use crate::shading::mis_state::MisState;
use firstlight_simd::InstructionSet;
use glam::{UVec2, Vec2, Vec3};

/// Data of an image for light tracing and its MIS weights.
pub(crate) struct CausticPass<'a> {
    pub scene: &'a Prepared,
    pub casters: &'a CasterTable,
    /// The table whose guiding cache is used: `casters`, or for a scene that moves that of the middle moment.
    pub guide_of: &'a CasterTable,
    pub techniques: Techniques,
    pub max_depth: u32,
    pub seed: u32,
    /// `None` for the scalar code.
    pub simd: Option<InstructionSet>,
    pub size: Vec2,
    pub filter: PixelFilter,
    /// The integral of the filter along one axis.
    pub filter_norm: f64,
    pub plan: CausticPlan,
    /// Number of light paths per sample of the whole image; 0 if there are none.
    pub paths_per_sample: f64,
    /// Light paths return unweighted contributions and pdf ratios: see [`crate::integrators::caustics::plan`].
    pub is_measured: bool,
    /// Area of a pixel on the film, square metres; see [`crate::core::camera::Camera::pixel_size`].
    pub pixel_area: f32,
    /// See [`crate::prepare::bodies::Bodies::around`].
    pub camera_media: Vec<u32>,
}

impl<'a> CausticPass<'a> {
    /// Returns `None` if the scene has no caustics, or no technique for them is used.
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
            guide_of: casters,
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

/// Returns the casters of a scene, if the settings include caustics.
pub(crate) fn casters_of<'a>(scene: &'a Prepared, settings: &RenderSettings) -> Option<&'a CasterTable> {
    // Light, mirror, diffuse, camera: three segments.
    let looks = settings.integrator == Integrator::Path && settings.techniques.caustics && settings.max_depth >= 3;
    scene.tables.casters.as_ref().filter(|_| looks)
}

impl CausticPass<'_> {
    /// Returns the guiding cache; `None` while it is not prepared, if it is empty, or if it is not used.
    #[inline]
    pub fn guide(&self) -> Option<&Guide> {
        if !self.plan.guided {
            return None;
        }
        self.guide_of.guide.get().filter(|guide| !guide.is_empty())
    }

    /// Returns the guiding distributions for a vertex, if no light path can find the path so far.
    ///
    /// - `n_vertices`: number of vertices including this one.
    #[inline]
    pub fn hints(&self, track: &MisState, n_vertices: u32, position: Vec3) -> Option<Hints<'_>> {
        let needs_them = n_vertices > 1 && track.is_lost();
        needs_them.then(|| self.guide()?.at(position)).flatten()
    }
}
