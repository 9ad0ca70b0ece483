//! Renderer: from a read-only snapshot of the scene to radiance on the film. Knows no entities, files or windows.
//!
//! Start reading at [`Snapshot`] and [`Prepared`] (input), [`advance`] (rendering) and [`Film`] (output). The folders
//! are layers, each of which imports only from those before it.

mod core;
mod denoise;
mod driver;
mod film;
mod integrators;
mod prepare;
pub mod sampling;
mod shading;
#[cfg(test)]
mod test_scene;
#[cfg(test)]
mod test_statistics;

pub use crate::core::camera::{Camera, CameraError};
pub use crate::core::caustic_plan::{CausticChoice, CausticPlan};
pub use crate::core::color::luminance;
pub use crate::core::counts::RayCounts;
pub use crate::core::delta_light::{Cone, DeltaLight, Falloff, LightImage};
pub use crate::core::environment::Environment;
pub use crate::core::filter::PixelFilter;
pub use crate::core::material::{
    ColorInput, Fresnel, InSnapshot, MAX_LOBES, MapParams, Material, MaterialId, MaterialKind, Param, ParamMut,
    ParamRef, Params, ScalarInput,
};
pub use crate::core::material_queries::Emission;
pub use crate::core::property::{Domain, Property, Value, ValueType};
pub use crate::core::settings::{ErrorMetric, Integrator, RenderSettings, SampleAllocation, SettingsError};
pub use crate::core::snapshot::{Geometry, Object, Shading, Snapshot};
pub use crate::core::techniques::Techniques;
pub use crate::core::texture::{
    Channel, Encoding, ImageTexture, Texels, Texture, TextureId, TexturePattern, TexturePoint, Wrap,
};
pub use denoise::{DenoiseInput, Denoised, Guides, MovingFilter, MovingInput, denoise};
pub use driver::caustic_choice::{caustic_choice, known_caustic_choice};
pub use driver::denoised::{DenoiseSource, denoise_film, denoise_source, denoise_source_with};
pub use driver::explain::{Contribution, Explanation, explain, light_traced};
pub use driver::features::{FEATURE_SAMPLES, gather_features, gather_features_and_ids};
pub use driver::guides::{GuideGatherer, SurfaceGuides, gather_guides, guide_samples};
pub use driver::inspect::{
    Inspected, Inspection, Legend, SeenSurface, depths, inspect, relative_errors, scale_color, seen_surface,
    tint_sharp_zone,
};
pub use driver::portals::{known_portal_count, portal_count};
pub use driver::relight::{MovingImage, Relighting, StillImage, relight};
pub use driver::renderer::{advance, advance_region, compute_tables};
pub use driver::report::{BadSample, PassReport};
pub use driver::single::replay_sample;
pub use driver::smooth::smooth_film;
pub use driver::threads::worker_threads;
pub use film::develop::{Display, ToneCurve, decode_srgb, develop, develop_colors, develop_pixel, encode_srgb};
pub use film::error::{MergeError, RecordError};
pub use film::estimate::ErrorEstimate;
pub use film::features::{FeatureBuffers, FeatureIds, FeatureVariances, IdShares};
pub use film::halves::HalfSteps;
pub use film::record::{
    BlockRecord, FilmLayout, FilmRecord, LightTracingRecord, N_CHANGE_PLANES, N_PLANES, RoundRecord, StepsRecord,
    TileRecord,
};
pub use film::region::Region;
pub use film::room::{NoRoom, Purpose, Room};
pub use film::surfaces::PixelSurface;
pub use film::tiles::Film;
pub use firstlight_kdtree::InstructionSet;
pub use integrators::common::record::{Asked, FoundBy, LightSource, PathVertex, Place, TracedPath};
pub use prepare::light::LightTable;
pub use prepare::{Exposed, Features, Moments, Prepared, moment_of_sample};
