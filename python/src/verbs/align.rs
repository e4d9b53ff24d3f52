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
    tell: &Bound<'_, PyAny>,
) -> PyResult<String> {
    run(py, tell, move |tell| {
        let what = Align { recording: &recording, search: Search { lag_s, frames }, apply, out: &out };
        Ok(serde_json::to_string(&work(&what, tell)?).expect("plain data"))
    })
}
