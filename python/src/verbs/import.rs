//! Turning a capture of a radar board into a recording.

use std::{collections::BTreeMap, path::PathBuf};

use hybridsim::{
    import::capture::{Layout, Preset, Stated},
    verbs::{
        self, Tell, Told,
        import::{Import, Seen},
    },
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
        let what = Import { sources: &sources, stated: &stated, labels, as_stated, out: &out };
        let mut show = |seen: Seen<'_>, tell: &mut Tell<'_>| {
            if let Seen::Looked(_, findings) = seen {
                for finding in findings.iter().filter(|finding| !finding.ok) {
                    tell(Told::Note(&format!("{}: {}", finding.name(), finding.found)));
                }
            }
        };
        verbs::import::import(what, &mut show, tell).map(|recording| recording.notes)
    })
}
