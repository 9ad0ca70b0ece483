//! Speed against error: how fast a picture gets right, what each technique is worth, and whether the renderer's own
//! estimate of its error can be believed.
//!
//! [`climb`] renders one scene at 1, 2, 4 … samples per pixel; [`Reference`] is the picture to measure against;
//! [`Ladder`] has the measured steps; [`write_page`] and [`write_csv`] put them on disk.

mod flip;
mod metrics;
mod picture;

pub use flip::flip;
pub use metrics::{Distance, RELATIVE_FLOOR};
pub use picture::LinearPicture;
