//! Turning a capture of a radar board into a recording.

use std::{collections::BTreeMap, path::PathBuf};

use hybridsim::{
    Error,
    import::capture::{Layout, Preset, Stated},
    verbs::{
        self, Notice, Notify,
        import::{Import, Profiles, Seen},
    },
};
use pyo3::prelude::*;

use crate::{errors::raised, work::run};

/// Imports `sources` into `out`: the name of each recording in `out` (of a single one none), and the notes of its import.
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
    profile: Option<String>,
    subframe: Option<usize>,
    tx: Option<usize>,
    labels: BTreeMap<String, String>,
    sets: Vec<String>,
    as_stated: bool,
    notify: &Bound<'_, PyAny>,
) -> PyResult<Vec<(String, Vec<String>)>> {
    let layout = layout.map(|text| Layout::parse(&text)).transpose().map_err(|error| raised(py, &error))?;
    let preset = preset.map(|name| Preset::named(&name)).transpose().map_err(|error| raised(py, &error))?;
    let wrong = |text: &str| raised(py, &Error::setting("profile", text, Profiles::EXPECTED));
    let profile = profile.map(|text| text.parse::<Profiles>().map_err(|_| wrong(&text))).transpose()?;
    let one = profile.and_then(Profiles::one);
    let stated = Stated { configs, board, layout, variable, preset, profile: one, subframe, tx, sets };
    run(py, notify, move |notify| {
        let what = Import { sources: &sources, stated: &stated, labels, as_stated, out: &out };
        let mut show = |seen: Seen<'_>, notify: &mut Notify<'_>| {
            if let Seen::Looked(_, findings) = seen {
                for finding in findings.iter().filter(|finding| !finding.ok) {
                    notify(Notice::Note(&format!("{}: {}", finding.name(), finding.found)));
                }
            }
        };
        if profile == Some(Profiles::All) {
            return verbs::import::import_profiles(&what, &mut show, notify);
        }
        verbs::import::import(what, &mut show, notify).map(|recording| vec![(String::new(), recording.notes)])
    })
}
