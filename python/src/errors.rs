//! Errors as exceptions: message, place, what is allowed and what to do (`penetrode/_errors.py`).

use penetrode::cli::{CliError, Exit};
use penetrode::{Advice, SceneError};
use pyo3::intern;
use pyo3::prelude::*;

/// The exception `class` of `penetrode._errors`.
fn exception(
    py: Python<'_>,
    class: &str,
    message: &str,
    help: &str,
    place: Option<(&str, usize, usize)>,
    allowed: &str,
) -> PyErr {
    let make = || {
        let class = py.import(intern!(py, "penetrode._errors"))?.getattr(class)?;
        class.call1((message, help, place, allowed))
    };
    make().map_or_else(|error| error, PyErr::from_value)
}

/// A computation without an answer.
pub fn run_error(py: Python<'_>, message: &str, help: &str) -> PyErr {
    exception(py, "RunError", message, help, None, "")
}

/// An option or an argument at fault.
pub fn option_error(py: Python<'_>, message: &str, help: &str) -> PyErr {
    exception(py, "OptionError", message, help, None, "")
}

/// A table at fault.
pub fn table_error(py: Python<'_>, message: &str, help: &str) -> PyErr {
    exception(py, "TableError", message, help, None, "")
}

/// A scene at fault, with its place in the text.
pub fn scene_error(py: Python<'_>, error: &SceneError) -> PyErr {
    let place = error.place.as_ref().map(|place| (error.file.as_str(), place.line, place.column));
    exception(py, "SceneError", &error.render(false), &error.help, place, &error.allowed)
}

/// An error of the library, by whose fault it is.
pub fn advised(py: Python<'_>, class_of_usage: &str, error: &dyn Advice) -> PyErr {
    let class = if error.is_usage() { class_of_usage } else { "RunError" };
    exception(py, class, &error.to_string(), &error.help(), None, "")
}

/// An error of a command; `class_of_usage` is at fault where the input is.
pub fn command_error(py: Python<'_>, class_of_usage: &str, error: &CliError) -> PyErr {
    match error {
        CliError::Scene(error) => scene_error(py, error),
        CliError::Stated { exit: Exit::Usage, message, help, .. } => {
            exception(py, class_of_usage, message, help, None, "")
        }
        CliError::Stated { message, help, .. } => run_error(py, message, help),
        other => run_error(py, &other.to_string(), ""),
    }
}
