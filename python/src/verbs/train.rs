//! Fitting the simulator to recordings.

use std::path::PathBuf;

use hybridsim::{
    Error,
    cli::devices,
    verbs::train::{Start, train as work},
};
use pyo3::prelude::*;
use serde_json::{Map, Value, json};

use crate::work::run;

/// Trains from a config, or goes on with the run folder `resume`; what became of it, as JSON.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn train(
    py: Python<'_>,
    config: Option<PathBuf>,
    resume: Option<PathBuf>,
    out: Option<PathBuf>,
    sets: Vec<String>,
    go_on: bool,
    diagnose: bool,
    device: String,
    as_stated: bool,
    notify: &Bound<'_, PyAny>,
) -> PyResult<String> {
    run(py, notify, move |notify| {
        let start = match (&config, &resume) {
            (Some(path), None) => Start::Config { path, sets: &sets, out: out.as_deref(), go_on, diagnose },
            (None, Some(run)) if out.is_none() && !go_on && !diagnose => Start::Resume { run, sets: &sets },
            _ => {
                return Err(Error::Usage {
                    message: "what is to be trained: expected a config, or a run to resume alone".into(),
                    hint: None,
                });
            }
        };
        let trained = work(&start, &devices(&device)?, as_stated, notify)?;
        let scores: Map<String, Value> =
            trained.evaluations.iter().map(|(folder, evaluation)| (folder.display().to_string(), json!(evaluation))).collect();
        let about = json!({
            "folder": trained.folder,
            "epochs": trained.progress.epochs_done,
            "best_epoch": trained.progress.best_epoch + 1,
            "history": trained.progress.history,
            "scores": scores,
        });
        Ok(about.to_string())
    })
}
