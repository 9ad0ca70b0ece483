//! The scene as a bevy_ecs world: components, the scene file, importers, built-in scenes, and the flat snapshot
//! that the renderer works on.
//!
//! The way of a scene: text or OBJ → [`load`] (files, meshes, trees; any thread) → [`LoadedScene::spawn`] (entities)
//! → [`Extraction`] (a [`crate::render::Snapshot`] about an origin near the camera).

mod builtin;
mod components;
mod error;
mod extent;
mod extract;
pub mod file;
mod fingerprint;
mod inputs;
mod load;
mod meshes;
pub mod obj;
mod picture;
mod placement;
mod showcase;
mod spawn;
mod upright;
mod view;

pub use builtin::{BUILTIN_SCENES, builtin_text};
pub use components::{
    Amount, Balls, Developing, FilmSize, Material, MaterialSlots, MeshOrigin, Ordinal, Paint, PointLight, Rendering,
    SceneEnvironment, Shape, SurfaceTexture,
};
pub use error::{Problem, SceneError, suggestion};
pub use extent::{Extent, ExtentCache};
pub use extract::{Extraction, Part, Trees, origin_for};
pub use fingerprint::Fingerprint;
pub use inputs::{CameraInput, LightInput, MaterialInput, ObjectInput, SceneInputs, SceneQueries};
pub use load::{LoadOptions, LoadedScene, SceneSource, UpAxis, load};
pub use meshes::{BUILTIN_NAMES as BUILTIN_MESHES, MeshBase};
pub use placement::{Linear, Placement};
pub use view::{Lens, Projection, View, ViewError};
