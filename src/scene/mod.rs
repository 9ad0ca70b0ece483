//! placeholder

mod view;

pub use view::{Lens, Projection, View, ViewError};
