//! What a picture is a function of, as plain data: scene, camera, settings.

pub(crate) mod camera;
pub(crate) mod color;
pub(crate) mod counts;
pub(crate) mod delta_light;
pub(crate) mod environment;
pub(crate) mod filter;
pub(crate) mod material;
pub(crate) mod settings;
pub(crate) mod snapshot;
pub(crate) mod techniques;
pub(crate) mod texture;
