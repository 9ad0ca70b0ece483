//! Data derived once from a snapshot, so that samples are cheap: tables of lights, materials and surfaces.
//!
//! Tables are built from plain data and do not know their users. [`Prepared`] has them all, and keeps those whose part
//! of the snapshot did not change.

pub(crate) mod ambient;
mod arrays;
pub(crate) mod bodies;
pub(crate) mod bound;
pub(crate) mod casters;
pub(crate) mod classic_table;
pub(crate) mod coat_table;
pub(crate) mod contacts;
pub(crate) mod delta_lines;
pub(crate) mod environment_lines;
pub(crate) mod exposed;
pub(crate) mod guide;
pub(crate) mod instance_table;
pub(crate) mod large_textures;
pub(crate) mod layer_table;
pub(crate) mod light;
pub(crate) mod material_table;
pub(crate) mod occluders;
mod outside;
pub(crate) mod plan_cache;
pub(crate) mod portals;
pub(crate) mod prepared;
mod radiance_unit;
pub(crate) mod surface_table;
mod touching;
pub(crate) mod twins;

pub use exposed::{Exposed, moment_of_sample};
pub use prepared::{Features, Moments, Prepared};
