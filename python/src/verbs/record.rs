//! Making a recording in the independent world.

use std::path::PathBuf;

use hybridsim::{config::Config, verbs};
use pyo3::prelude::*;

use crate::work::run;

/// Records the `[record]` section of a config into `out`.
#[pyfunction]
pub fn record(
    py: Python<'_>,
    config: PathBuf,
    out: PathBuf,
    sets: Vec<String>,
    as_stated: bool,
    notify: &Bound<'_, PyAny>,
) -> PyResult<()> {
    run(py, notify, move |notify| {
        let settings = Config::read(&config, &sets)?;
        let record = settings.record(&config)?;
        verbs::record::make(record, &config, &out, as_stated, notify).map(drop)
    })
}
