//! Image files and films, with their layers and names.

pub(crate) mod cryptomatte;
pub(crate) mod feature_layers;
pub(crate) mod film_file;
pub(crate) mod layered_picture;
pub(crate) mod picture_file;
pub(crate) mod snapshot_names;
