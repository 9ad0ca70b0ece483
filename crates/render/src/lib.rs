//! From a read-only snapshot of the scene to light on the film. Knows no entities, files or windows.
//!
//! Start reading at [`Snapshot`] (what is rendered), [`advance`] (how) and [`Film`] (where it goes).

mod ambient;
mod bound;
mod bsdf;
mod camera;
mod caustics;
mod color;
mod develop;
mod dielectric;
mod environment;
mod estimate;
mod exact_sum;
mod explain;
mod film;
mod film_record;
mod filter;
mod ggx;
mod inspect;
mod light;
mod material;
mod medium;
mod path;
mod paths;
mod phong;
mod region;
mod renderer;
mod room;
pub mod sampling;
mod snapshot;
mod surface;
mod techniques;
mod texture;
mod wide;

pub use camera::{Camera, CameraError};
pub use develop::{Display, ToneCurve, decode_srgb, develop, develop_pixel, encode_srgb};
pub use environment::Environment;
pub use estimate::ErrorEstimate;
pub use explain::{
    Asked, Contribution, Explanation, FoundBy, LightSource, PathVertex, Place, TracedPath, explain, light_from_lamps,
};
pub use film::Film;
pub use film_record::{FilmLayout, FilmRecord, N_PLANES, TileRecord};
pub use filter::PixelFilter;
pub use inspect::{Inspected, Inspection, Legend, depths, inspect, relative_errors, scale_color, tint_sharp_zone};
pub use light::LightTable;
pub use material::{ColorInput, Emission, Fresnel, Material, MaterialId, ScalarInput};
pub use region::Region;
pub use renderer::{
    BadSample, Integrator, PassReport, RayCounts, RenderSettings, SettingsError, advance, advance_region, replay_sample,
};
pub use room::{NoRoom, Purpose, Room};
pub use snapshot::{Features, Geometry, Object, Shading, Snapshot};
pub use techniques::Techniques;
pub use texture::{ImageTexture, Texture, TextureId, TexturePattern, Wrap};
