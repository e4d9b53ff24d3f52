//! Finding out why a recording and the simulator disagree.

use std::path::PathBuf;

use hybridsim::{
    cli::device as device_of,
    config::Config,
    diagnosis::html::lead,
    verbs::diagnose::{Diagnose, diagnose as work},
};
use pyo3::prelude::*;

use crate::work::run;

/// Diagnoses `recording` into `out`: the sentence that the report begins with, and the report as JSON.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn diagnose(
    py: Python<'_>,
    recording: PathBuf,
    out: PathBuf,
    checkpoint: Option<PathBuf>,
    config: Option<PathBuf>,
    sets: Vec<String>,
    device: String,
    as_stated: bool,
    notify: &Bound<'_, PyAny>,
) -> PyResult<(String, String)> {
    run(py, notify, move |notify| {
        let config = match config {
            Some(path) => Config::read(&path, &sets)?,
            None => Config::defaults(&sets)?,
        };
        let what = Diagnose { recording: &recording, checkpoint: checkpoint.as_deref(), config: &config, out: &out };
        let diagnosis = work(&what, &device_of(&device)?, as_stated, notify)?;
        let report = serde_json::to_string(&diagnosis.report).expect("plain data");
        Ok((lead(&diagnosis.report).to_string(), report))
    })
}
