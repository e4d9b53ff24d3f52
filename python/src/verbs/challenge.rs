//! The proof on concealed data.

use std::{ffi::OsString, path::PathBuf, time::Duration};

use hybridsim::{
    challenge::answer::RunConfig,
    data::program,
    verbs::challenge::{Scoring, Seal, begin, cases, commit, run as answer, score, twins},
};
use pyo3::prelude::*;
use serde_json::json;

use crate::{
    errors::{raised, usage},
    verbs::site::part,
    work::run,
};

/// Settles the secret of a challenge: how many cases it will have.
#[pyfunction]
pub fn challenge_begin(
    py: Python<'_>,
    config: PathBuf,
    out: PathBuf,
    seed: Option<String>,
    sets: Vec<String>,
) -> PyResult<usize> {
    let what = Seal { config: &config, sets: &sets, seed: seed.as_deref(), out: &out };
    py.detach(|| begin(&what)).map_err(|error| raised(py, &error))
}

/// Records the cases of a shard; what was committed to, as JSON, unless nothing was.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn challenge_seal(
    py: Python<'_>,
    config: PathBuf,
    out: PathBuf,
    seed: Option<String>,
    shard: (usize, usize),
    committing: bool,
    sets: Vec<String>,
    notify: &Bound<'_, PyAny>,
) -> PyResult<Option<String>> {
    let shard = part(py, shard)?;
    run(py, notify, move |notify| {
        let what = Seal { config: &config, sets: &sets, seed: seed.as_deref(), out: &out };
        match committing {
            true => commit(&what, shard, notify).map(|commitment| Some(json!(commitment).to_string())),
            false => cases(&what, shard, notify).map(|()| None),
        }
    })
}

/// How cases are diagnosed: by a command that answers with this module.
#[derive(FromPyObject)]
pub struct How {
    through: Vec<OsString>,
    arguments: Vec<String>,
    shard: (usize, usize),
    most: Option<usize>,
    limit_s: f64,
}

impl How {
    fn config(self, py: Python<'_>) -> PyResult<RunConfig> {
        let Self { through, arguments, shard, most, limit_s } = self;
        let (shard, program) = (part(py, shard)?, program::file().map_err(|error| raised(py, &error))?);
        let seconds = |reason| usage(py, format!("`limit_s` is {limit_s}: {reason}"), "give seconds");
        let limit = Duration::try_from_secs_f64(limit_s).map_err(seconds)?;
        Ok(RunConfig { program, through, arguments, shard, most, limit })
    }
}

/// Has cases diagnosed; the answers, as JSON.
#[pyfunction]
pub fn challenge_run(py: Python<'_>, challenge: PathBuf, out: PathBuf, how: How, notify: &Bound<'_, PyAny>) -> PyResult<String> {
    let config = how.config(py)?;
    run(py, notify, move |notify| Ok(json!(answer(&challenge, &out, &config, notify)?).to_string()))
}

/// Has the scenes diagnosed without their effects; how many.
#[pyfunction]
pub fn challenge_twins(
    py: Python<'_>,
    challenge: PathBuf,
    answers: PathBuf,
    out: PathBuf,
    how: How,
    notify: &Bound<'_, PyAny>,
) -> PyResult<usize> {
    let config = how.config(py)?;
    run(py, notify, move |notify| twins(&challenge, &answers, &out, &config, notify))
}

/// Opens the truths and scores; the score, as JSON.
#[pyfunction]
pub fn challenge_score(
    py: Python<'_>,
    challenge: PathBuf,
    answers: PathBuf,
    twins: Option<PathBuf>,
    measure: bool,
    out: PathBuf,
    notify: &Bound<'_, PyAny>,
) -> PyResult<String> {
    run(py, notify, move |notify| {
        let what = Scoring { challenge: &challenge, answers: &answers, twins: twins.as_deref(), measure, out: &out };
        Ok(json!(score(&what, notify)?).to_string())
    })
}
