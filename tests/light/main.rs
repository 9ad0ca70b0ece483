//! What light does: closed forms, furnaces, one way of tracing against another.

#[path = "../common/mod.rs"]
mod common;

mod adaptive;
mod caustic_choice;
mod caustics;
mod chains;
mod delta_lights;
mod denoise;
mod determinism;
mod dispersion;
mod features;
mod few_samples;
mod filters;
mod interfaces;
mod lanes;
mod light_transport;
mod materials;
mod motion_blur;
mod orthographic;
mod panes;
mod phong;
mod portals;
mod principled;
#[path = "../common/program.rs"]
mod program;
mod region;
mod resampling;
mod rough_glass;
mod stability;
mod terminator;
mod textures;
mod unbiased;
