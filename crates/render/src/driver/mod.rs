//! Passes over a film: rendering, feature buffers, denoising, explanation of a pixel, inspections.

mod block_costs;
pub(crate) mod caustic_choice;
pub(crate) mod denoised;
pub(crate) mod explain;
pub(crate) mod features;
pub(crate) mod guides;
pub(crate) mod inspect;
pub(crate) mod moving;
pub(crate) mod portals;
pub(crate) mod relight;
pub(crate) mod renderer;
pub(crate) mod report;
pub(crate) mod single;
pub(crate) mod smooth;
pub(crate) mod threads;
pub(crate) mod wave;
