//! From a read-only snapshot of the scene to light on the film. Knows no entities, files or windows.
//!
//! Start reading at [`Snapshot`] (what is rendered) and [`Film`] (where it goes).

mod camera;
mod develop;
mod environment;
mod film;
mod material;
mod renderer;
mod snapshot;
mod texture;

pub use camera::Camera;
pub use develop::{Display, ToneCurve, develop, develop_pixel};
pub use environment::Environment;
pub use film::Film;
pub use material::{ColorInput, Fresnel, Material, MaterialId, ScalarInput};
pub use renderer::{BadSample, Integrator, PassReport, RayCounts, RenderSettings, advance};
pub use snapshot::{Geometry, Object, Shading, Snapshot};
pub use texture::{ImageTexture, Texture, TextureId, TexturePattern, Wrap};
