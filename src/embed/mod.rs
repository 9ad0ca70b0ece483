//! High-level library interface: open a scene, render it, save the image.
//!
//! [`Scene`] owns an ECS world that any code may change between two renderings; [`RenderOptions`] sets the size, the
//! light model and the target; [`Image`] is the result, as numbers or as a file. What these do not cover is in
//! [`crate::scene`], [`crate::frame`] and [`crate::render`]; an interactive program uses a
//! [`Session`](crate::frame::Session). Start reading at [`Scene::open`].

mod error;
mod image;
mod options;
mod scene;
mod threads;

pub use error::Error;
pub use image::Image;
pub use options::{Flow, RenderOptions};
pub use scene::Scene;
pub use threads::threads;
