//! firstlight as a module of Python: the part that is compiled.
//!
//! The package `firstlight` in Python has arrays, names and documentation; this module has scenes, images and the
//! program. Between them go numbers as bytes and parts of scenes as the text of scene files, so the engine checks every
//! value, and its messages are those of the program.

mod arrays;
mod errors;
mod image;
mod program;
mod render;
mod scene;
mod table;

use pyo3::prelude::*;

#[pymodule]
fn _firstlight(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("HAS_WINDOW", cfg!(feature = "viewer"))?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<image::Image>()?;
    module.add_function(wrap_pyfunction!(scene::check, module)?)?;
    module.add_function(wrap_pyfunction!(table::materials, module)?)?;
    module.add_function(wrap_pyfunction!(table::builtin_scenes, module)?)?;
    module.add_function(wrap_pyfunction!(program::main, module)?)?;
    Ok(())
}
