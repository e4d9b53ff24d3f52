//! Turning a capture of a radar board into a recording.

use std::{collections::BTreeMap, path::PathBuf};

use hybridsim::{
    data::atomic::AtomicFolder,
    import::capture::{self, Layout, Preset, Stated},
    verbs::{Told, plausible},
};
use pyo3::prelude::*;

use crate::{errors::raised, work::run};

/// Imports `sources` into `out`; the notes of the import.
#[pyfunction(name = "import_")]
#[allow(clippy::too_many_arguments)]
pub fn import(
    py: Python<'_>,
    sources: Vec<PathBuf>,
    out: PathBuf,
    configs: Vec<PathBuf>,
    board: Option<String>,
    layout: Option<String>,
    variable: Option<String>,
    preset: Option<String>,
    profile: Option<usize>,
    subframe: Option<usize>,
    tx: Option<usize>,
    labels: BTreeMap<String, String>,
    sets: Vec<String>,
    as_stated: bool,
    tell: &Bound<'_, PyAny>,
) -> PyResult<Vec<String>> {
    let layout = layout.map(|text| Layout::parse(&text)).transpose().map_err(|error| raised(py, &error))?;
    let preset = preset.map(|name| Preset::named(&name)).transpose().map_err(|error| raised(py, &error))?;
    let stated = Stated { configs, board, layout, variable, preset, profile, subframe, tx, sets };
    run(py, tell, move |tell| {
        // What cannot be written is said before anything is read.
        AtomicFolder::create(&out).map(drop)?;
        let capture = capture::open(&sources, &stated)?;
        tell(Told::Begun { what: "importing", steps: capture.radar.frames });
        let draft = capture::draft(capture, &out, labels, &mut |done, _| tell(Told::Done(done)))?;
        plausible::recording(draft.recording(), as_stated, tell)?;
        for finding in draft.findings.iter().filter(|finding| !finding.ok) {
            tell(Told::Note(&format!("{}: {}", finding.name(), finding.found)));
        }
        let recording = draft.publish(as_stated)?;
        recording.notes.iter().for_each(|note| tell(Told::Note(note)));
        Ok(recording.notes.clone())
    })
}
