//! Everything that comes from a file or goes into one.

mod animation;
mod bad_input;
mod bad_values;
mod draco;
mod export;
mod foreign_limits;
mod gltf;
mod gltf_motion;
mod gltf_writer;
mod input_files;
mod layers;
mod mitsuba;
mod model_light;
mod neutral;
mod obj;
mod outputs;
mod pbrt;
mod pictures;
mod ply_programs;
mod ply_stl;
#[path = "../common/program.rs"]
mod program;
mod save;
mod scene;
mod shared_lists;
mod strangers;
mod tungsten;
