//! The paper's experiments.

use std::path::PathBuf;

use hybridsim::{
    cli::devices,
    verbs::reproduce::{Planned, Reproduce},
};
use pyo3::prelude::*;

use crate::{verbs::site::part, work::run};

/// What is to be done: `(folder, parents, pieces, seconds)` of each stage, once it is asked whether the sites can be.
#[pyfunction]
#[allow(clippy::type_complexity)]
pub fn stages(
    py: Python<'_>,
    config: PathBuf,
    out: PathBuf,
    sets: Vec<String>,
    device: String,
    as_stated: bool,
    notify: &Bound<'_, PyAny>,
) -> PyResult<Vec<(String, Vec<usize>, usize, Option<f64>)>> {
    run(py, notify, move |notify| {
        let planned = Planned::new(&Reproduce { config: &config, sets: &sets, lpips: None, out: &out })?;
        planned.look(&devices(&device)?, as_stated, notify)?;
        Ok(planned.stages()?.into_iter().map(|stage| (stage.folder, stage.parents, stage.pieces, stage.seconds)).collect())
    })
}

/// Does what is not done yet: all, with the tables, or the stages of these beginnings and what they need.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn reproduce(
    py: Python<'_>,
    config: PathBuf,
    out: PathBuf,
    beginnings: Vec<String>,
    jobs: usize,
    sets: Vec<String>,
    command: String,
    device: String,
    as_stated: bool,
    notify: &Bound<'_, PyAny>,
) -> PyResult<()> {
    run(py, notify, move |notify| {
        let planned = Planned::new(&Reproduce { config: &config, sets: &sets, lpips: None, out: &out })?;
        let devices = devices(&device)?;
        match beginnings.is_empty() {
            true => planned.run(&command, &devices, jobs, as_stated, notify),
            false => planned.run_some(&beginnings, &devices, jobs, as_stated, notify).map(drop),
        }
    })
}

/// Does one stage, or some of its pieces.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn reproduce_stage(
    py: Python<'_>,
    config: PathBuf,
    out: PathBuf,
    folder: String,
    shard: (usize, usize),
    sets: Vec<String>,
    device: String,
    notify: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let shard = part(py, shard)?;
    run(py, notify, move |notify| {
        let planned = Planned::again(&Reproduce { config: &config, sets: &sets, lpips: None, out: &out })?;
        planned.run_one(&folder, shard, &devices(&device)?, notify)
    })
}
