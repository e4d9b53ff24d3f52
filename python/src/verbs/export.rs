//! Recordings in the layouts of others.

use std::path::PathBuf;

use hybridsim::{
    export::Target,
    verbs::export::{Export, export as work},
};
use pyo3::prelude::*;

use crate::{errors::raised, work::run};

/// Exports `sources` to `target` into `out`: how many recordings and frames.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn export(
    py: Python<'_>,
    sources: Vec<PathBuf>,
    target: &str,
    out: PathBuf,
    board: Option<String>,
    split_by: Option<String>,
    sets: Vec<String>,
    notify: &Bound<'_, PyAny>,
) -> PyResult<(usize, usize)> {
    let target: Target = target.parse().map_err(|error| raised(py, &error))?;
    run(py, notify, move |notify| {
        let what = Export { sources: &sources, target, board: board.as_deref(), split_by, sets: &sets, out: &out };
        let [recordings, frames] = work(&what, notify)?;
        Ok((recordings, frames))
    })
}
