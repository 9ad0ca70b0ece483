//! Plain data and pure functions of a session: settings, status, what a change resets, what is rendered next.

pub(crate) mod denoising;
pub(crate) mod exposure;
pub(crate) mod latency;
pub(crate) mod offline;
#[cfg(feature = "cli")]
pub mod oidn;
pub(crate) mod reset;
pub(crate) mod rig;
pub(crate) mod scheduler;
pub(crate) mod status;
