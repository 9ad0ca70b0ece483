//! From a read-only snapshot of the scene to light on the film. Knows no entities, files or windows.
//!
//! Start reading at [`Snapshot`] (what is rendered) and [`Film`] (where it goes).

mod camera;
mod environment;
mod material;
mod snapshot;
mod texture;

pub use camera::Camera;
pub use environment::Environment;
pub use material::{ColorInput, Fresnel, Material, MaterialId, ScalarInput};
pub use snapshot::{Geometry, Object, Shading, Snapshot};
pub use texture::{ImageTexture, Texture, TextureId, TexturePattern, Wrap};
