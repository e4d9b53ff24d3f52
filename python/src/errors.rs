//! Errors as Python's exceptions, in the same words. Their classes are those of `hybridsim/_errors.py`.

use hybridsim::Error;
use pyo3::prelude::*;

/// The exception of an error.
pub fn raised(py: Python<'_>, error: &Error) -> PyErr {
    make(py, error).unwrap_or_else(|failure| failure)
}

fn make(py: Python<'_>, error: &Error) -> PyResult<PyErr> {
    let (path, number) = match error {
        Error::Read { path, source } | Error::Write { path, source } => (Some(path.display().to_string()), source.raw_os_error()),
        _ => (None, None),
    };
    let make = py.import("hybridsim._errors")?.getattr("make")?;
    let busy = matches!(error, Error::Busy { .. });
    Ok(PyErr::from_value(make.call1((error.to_string(), error.hint(), path, number, busy))?))
}

/// Wrong usage, in the class of all others.
pub fn usage(py: Python<'_>, message: impl Into<String>, hint: impl Into<String>) -> PyErr {
    raised(py, &Error::Usage { message: message.into(), hint: Some(hint.into()) })
}

/// JSON of Python's own making; only a user's own dictionary can be wrong.
pub fn parsed<T: serde::de::DeserializeOwned>(py: Python<'_>, text: &str, name: &str) -> PyResult<T> {
    let hint = "its documentation lists what it may hold";
    serde_json::from_str(text).map_err(|error| usage(py, format!("{name}: {error}"), hint))
}
