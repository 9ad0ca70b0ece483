//! The inputs of an image as plain data: scene, camera, settings.

pub(crate) mod camera;
pub(crate) mod caustic_plan;
pub(crate) mod color;
pub(crate) mod counts;
pub(crate) mod delta_light;
pub(crate) mod environment;
pub(crate) mod filter;
pub(crate) mod fresnel;
pub(crate) mod image_texture;
pub(crate) mod material;
mod material_file;
pub(crate) mod material_params;
pub(crate) mod material_queries;
mod material_simplify;
mod material_table;
pub(crate) mod property;
pub(crate) mod settings;
pub(crate) mod snapshot;
pub(crate) mod techniques;
pub(crate) mod texture;
