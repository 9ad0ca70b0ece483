//! Errors as exceptions of the package, with the messages of the program.

use firstlight::Error;
use firstlight::scene::SceneError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// The exception of this name in `firstlight._errors`.
fn exception(name: &str, message: String) -> PyErr {
    Python::attach(|py| {
        let made = py
            .import("firstlight._errors")
            .and_then(|module| module.getattr(name))
            .and_then(|class| class.call1(PyTuple::new(py, [message])?));
        made.map_or_else(|error| error, PyErr::from_value)
    })
}

/// Wrong input: a scene, a value or an option.
pub fn input(message: impl ToString) -> PyErr {
    exception("InputError", message.to_string())
}

/// An error of the library.
pub fn of_library(error: Error) -> PyErr {
    match error {
        Error::Scene(_)
        | Error::Value(_)
        | Error::Settings(_)
        | Error::Camera(_)
        | Error::Property(_)
        | Error::NoCamera => input(error),
        Error::Memory(_) => exception("MemoryError", error.to_string()),
        _ => exception("Error", error.to_string()),
    }
}

/// An error in a text that the package wrote: without line and column, which only the package knows.
pub fn of_text(error: SceneError) -> PyErr {
    let messages: Vec<String> = error.problems.into_iter().map(|problem| problem.message).collect();
    input(messages.join("\n"))
}
