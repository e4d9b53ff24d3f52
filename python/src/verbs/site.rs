//! Recording a site: several subjects and actions in one room.

use std::path::PathBuf;

use hybridsim::{
    data::{Shard, entries},
    verbs::site::{Site, look, record, recordings},
};
use pyo3::prelude::*;

use crate::{
    errors::{raised, usage},
    work::run,
};

/// Records the sequences of a shard (number and count, from 1) of a site's config into `out`; what is there already is kept. The
/// shard's recordings.
#[pyfunction]
pub fn site(
    py: Python<'_>,
    config: PathBuf,
    out: PathBuf,
    shard: (usize, usize),
    sets: Vec<String>,
    as_stated: bool,
    notify: &Bound<'_, PyAny>,
) -> PyResult<Vec<PathBuf>> {
    let shard = part(py, shard)?;
    run(py, notify, move |notify| {
        let what = Site { config: &config, sets: &sets, out: &out, shard };
        record(&what, as_stated, notify)?;
        recordings(&what)
    })
}

/// Looks at all sequences of a site and records nothing: their recordings, in the order of the shards.
#[pyfunction]
pub fn site_look(
    py: Python<'_>,
    config: PathBuf,
    out: PathBuf,
    sets: Vec<String>,
    as_stated: bool,
    notify: &Bound<'_, PyAny>,
) -> PyResult<Vec<PathBuf>> {
    run(py, notify, move |notify| look(&Site { config: &config, sets: &sets, out: &out, shard: Shard::ALL }, as_stated, notify))
}

/// A part of some work.
pub fn part(py: Python<'_>, (number, of): (usize, usize)) -> PyResult<Shard> {
    format!("{number}/{of}")
        .parse()
        .map_err(|reason| usage(py, format!("`shard` is ({number}, {of}): {reason}"), "write (i, n), such as (2, 8)"))
}

/// The recordings in a folder, in the order of their names.
#[pyfunction]
pub fn recordings_in(py: Python<'_>, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
    py.detach(|| entries::recordings_in(&folder)).map_err(|error| raised(py, &error))
}
