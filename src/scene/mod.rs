//! The scene as a bevy_ecs world: components, the scene file, importers, built-in scenes, and the flat snapshot
//! that the renderer works on.
//!
//! The stages of a scene: text or model → [`load`] (files, meshes, trees; any thread) → [`LoadedScene::spawn`]
//! (entities) → [`Extraction`] (a [`crate::render::Prepared`] relative to an origin near the camera).

pub mod animation;
mod archive_cache;
mod bad_value;
pub(crate) mod bounds;
mod builtin;
mod camera;
mod choice;
mod components;
mod default_scene;
mod describe;
mod documents;
pub(crate) mod entity_state;
mod error;
mod extent;
mod extract;
pub mod file;
mod fingerprint;
mod framing;
pub mod gltf;
mod gltf_mesh;
mod gltf_motion;
mod gltf_parts;
mod gltf_scene;
pub mod image_metadata;
mod inner_light;
pub mod input_file;
mod inputs;
mod inventory;
mod ktx2;
mod light;
pub(crate) mod limits;
mod load;
mod loaded;
mod material_property;
mod meshes;
mod metadata_draft;
pub mod model;
mod model_light;
mod mtl_material;
mod names;
pub mod obj;
mod open_shutter;
mod orientation;
mod outputs;
mod own_materials;
mod paths;
mod picture;
mod placement;
pub mod ply;
mod read_files;
mod relative;
mod save;
mod source;
mod sources;
mod spawn;
mod stamp;
pub mod stl;
mod trees;
pub(crate) mod units;
mod unpacked_files;
mod up_axis;
mod value;
mod view;
mod warnings;
pub mod whole_file;
mod write_error;

pub use animation::{Animation, Moment, camera_follows, show_moment};
pub use archive_cache::{archive_cache, unpacked_folder};
pub use bad_value::BadValue;
pub use bounds::{check_film_size, check_fps, check_max_depth, check_stops};
pub use builtin::{BUILTIN_SCENES, builtin_text};
pub use camera::camera_part;
pub use choice::ModelChoice;
pub use components::{
    Balls, ColorParam, DirectionalLight, DisplaySettings, FilmSize, GREY, InWorld, Material, MaterialSlots, MeshOrigin,
    Ordinal, PointLight, Rendering, ScalarParam, SceneEnvironment, Shape, SpotLight, SurfaceMaterial, SurfaceTexture,
};
pub use describe::Description;
pub use error::{Problem, SceneError, suggestion};
pub use extent::{Extent, ExtentCache};
pub use extract::{Extraction, SnapshotPart, origin_for};
pub use fingerprint::{Fingerprint, SceneContent};
pub use image_metadata::{ImageMetadata, ImageSamples, ImageScene, MetadataError};
pub use input_file::{FileKind, InputFile, ReadError, plain_io};
pub use inputs::{CameraInput, LightInput, MaterialInput, ObjectInput, SceneInputs, SceneQueries, WithLight};
pub use inventory::{Inventory, LightEntry, MaterialEntry, ObjectEntry, users_of};
pub use light::LightKind;
pub use limits::Limits;
pub use load::{LoadOptions, load};
pub use loaded::LoadedScene;
pub use material_property::MaterialProperty;
pub use meshes::{BUILTIN_NAMES as BUILTIN_MESHES, MeshBase};
pub use metadata_draft::MetadataDraft;
pub use outputs::{Files, FilesError};
pub use paths::each_path;
pub use picture::{PictureError, read_picture, read_picture_within};
#[cfg(feature = "cli")]
pub(crate) use picture::{decode_picture, picture_reader};
pub use placement::{Linear, Placement};
pub use read_files::ReadFiles;
pub use relative::{absolute, bytes_to_text, path_text, path_to_text, relative_path, text_to_path};
pub use save::{SavedScene, save_scene};
pub use source::{SceneSource, UpAxis};
pub use sources::{EnvironmentSource, MeshShading, MeshSource, Seconds, TextureSource};
pub(crate) use spawn::texture_of;
pub use stamp::{Stamp, stamp};
pub use trees::Trees;
pub use value::{ColorValue, Rgb, ScalarValue};
pub use view::{Lens, Projection, View, ViewError};
pub use warnings::{Severity, Warning, Warnings};
pub use write_error::WriteError;
