//! The scene as a bevy_ecs world: components, the scene file, importers, built-in scenes, and the flat snapshot
//! that the renderer works on.
//!
//! The stages of a scene: text or model → [`load`] (files, meshes, trees; any thread) → [`LoadedScene::spawn`]
//! (entities) → [`Extraction`] (a [`crate::render::Prepared`] relative to an origin near the camera).

pub mod animation;
mod builtin;
mod default_scene;
mod describe;
mod described;
mod extract;
mod fingerprint;
pub(crate) mod hit_spaces;
pub mod image_metadata;
mod inner_light;
mod known_meshes;
mod library;
mod load;
mod load_meshes;
mod load_model;
mod load_pictures;
mod load_stage;
mod loaded;
mod memory;
mod metadata_draft;
mod model_light;
mod open_shutter;
mod read_files;
mod save;
mod source;
mod spawn;
mod texture_names;
mod thousands;
mod unpacked_files;
mod whole;
pub(crate) mod world;

pub use crate::files::{input_file, whole_file};
pub use crate::format as file;
pub use crate::import as model;
pub use crate::import::{gltf, obj, ply, stl};

pub use crate::files::archive_cache::{archive_cache, unpacked_folder};
pub use crate::files::hash::Fingerprint;
pub use crate::files::input_file::{FileKind, InputFile, ReadError, plain_io};
pub use crate::files::limits::Limits;
pub use crate::files::new_folder::NewFolder;
pub use crate::files::outputs::{Files, FilesError};
pub use crate::files::relative::{absolute, bytes_to_text, path_text, path_to_text, relative_path, text_to_path};
pub use crate::files::stamp::{Stamp, stamp};
pub use crate::files::warnings::{Severity, Warning, Warnings};
pub use crate::files::write_error::WriteError;
pub use crate::format::bad_value::BadValue;
pub use crate::format::bounds::{check_film_size, check_fps, check_max_depth, check_stops};
pub use crate::format::camera::camera_part;
pub use crate::format::choice::{ModelChoice, UpAxis};
pub use crate::format::error::{Problem, SceneError, suggestion};
pub use crate::format::film_size::FilmSize;
pub use crate::format::light::{DirectionalLight, ImageFrame, LightKind, PointLight, SpotLight};
pub use crate::format::material_property::MaterialProperty;
pub use crate::format::paths::each_path;
pub use crate::format::placement::{Linear, Placement};
pub use crate::format::sources::{
    BUILTIN_NAMES as BUILTIN_MESHES, EnvironmentSource, MeshOptions, MeshShading, MeshSource, Seconds,
    TextureCoordinates, TextureSource,
};
pub use crate::format::value::{ColorValue, Rgb, ScalarValue};
pub use crate::format::view::{Lens, Projection, View};
pub use crate::import::meshes::MeshBase;
pub use crate::import::picture::{PictureError, read_picture, read_picture_within};
#[cfg(feature = "cli")]
pub(crate) use crate::import::picture::{decode_picture, picture_reader};
pub(crate) use crate::scene::default_scene::GAP as GAP_TO_GROUND;
pub use crate::scene::default_scene::SKY as GRADIENT;
pub use crate::scene::world::components::{
    Balls, ColorParam, DisplaySettings, GREY, Hidden, InWorld, Material, MaterialSlots, MeshOrigin, Ordinal, Rendering,
    ScalarParam, SceneEnvironment, Shape, SurfaceMaterial, SurfaceTexture, textures_of,
};
pub(crate) use crate::scene::world::extent::lowest_point;
pub use crate::scene::world::extent::{Extent, ExtentCache};
pub use crate::scene::world::inputs::{
    CameraInput, HiddenInputs, LightInput, MaterialInput, ObjectInput, SceneInputs, SceneQueries,
};
pub(crate) use crate::scene::world::inventory::is_emitter;
pub use crate::scene::world::inventory::{Inventory, LightEntry, MaterialEntry, ObjectEntry, users_of};
pub use crate::scene::world::lights::{LightTexture, WithLight, light_of, put_light};
pub use crate::scene::world::material_value::material_value;
pub use crate::scene::world::trees::Trees;
pub use animation::{Animation, Moment, camera_follows, show_moment, show_moment_from_here};
pub use builtin::{BUILTIN_SCENES, SCENES_IMAGE, builtin_text};
pub use describe::Description;
pub(crate) use describe::environment_part;
pub(crate) use extract::origin_of;
pub use extract::{Extraction, SnapshotPart, origin_for};
pub use fingerprint::SceneContent;
pub use image_metadata::{ImageMetadata, ImageSamples, ImageScene, MetadataError};
pub(crate) use library::library_stage;
pub use library::{LIBRARY_IMAGE, library};
pub use load::{LoadOptions, load, load_text};
pub use load_model::load_model;
pub use load_stage::LoadStage;
pub use loaded::LoadedScene;
pub use metadata_draft::MetadataDraft;
pub use read_files::ReadFiles;
pub use save::{SavedScene, save_scene};
pub use source::SceneSource;
pub use spawn::AddedParts;
pub(crate) use spawn::{sky_light, texture_of};
pub use thousands::thousands;
pub use whole::whole_scene;
