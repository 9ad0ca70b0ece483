//! The common things in a few lines: open a scene, render it, save the image.
//!
//! [`Scene`] owns an ECS world that any code may change between two renderings; [`RenderOptions`] says how good the image
//! shall be; [`Image`] is the result, as numbers or as a file. What these do not show is in [`crate::scene`],
//! [`crate::frame`] and [`crate::render`], and an interactive program has a [`Session`](crate::frame::Session). Start
//! reading at [`Scene::open`].

mod error;
mod image;
mod options;
mod scene;

pub use error::Error;
pub use image::Image;
pub use options::{Flow, RenderOptions};
pub use scene::Scene;
