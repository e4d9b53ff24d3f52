//! Finding where and when a recording's body is.

use std::path::PathBuf;

use hybridsim::{
    alignment::Search,
    verbs::align::{Align, align as work},
};
use pyo3::prelude::*;

use crate::work::run;

/// Aligns `recording` into `out`: the result as JSON.
#[pyfunction]
pub fn align(
    py: Python<'_>,
    recording: PathBuf,
    out: PathBuf,
    lag_s: f64,
    frames: usize,
    apply: bool,
    notify: &Bound<'_, PyAny>,
) -> PyResult<String> {
    run(py, notify, move |notify| {
        let what = Align { recording: &recording, search: Search { lag_s, frames }, apply, out: &out };
        Ok(serde_json::to_string(&work(&what, notify)?).expect("plain data"))
    })
}
