//! Recording a site: several subjects and actions in one room.

use std::path::{Path, PathBuf};

use hybridsim::{
    data::{Claim, Shard, entries},
    site::{SiteConfig, record},
    verbs::{Told, plausible},
};
use pyo3::prelude::*;

use crate::{errors::raised, work::run};

/// Records all sequences of a site's config into `out`; what is there already is kept.
#[pyfunction]
pub fn site(
    py: Python<'_>,
    config: PathBuf,
    out: PathBuf,
    sets: Vec<String>,
    as_stated: bool,
    tell: &Bound<'_, PyAny>,
) -> PyResult<()> {
    run(py, tell, move |tell| {
        let settings = SiteConfig::read(&config, &sets)?;
        let _claim = Claim::part(&out, Shard::ALL)?;
        plausible::sequences(&settings, &config, as_stated, tell)?;
        let folder = config.parent().unwrap_or(Path::new(""));
        let (mut begun, mut at_hand) = (false, String::new());
        let mut hear = |done: usize, of: usize, name: &str| {
            if !std::mem::replace(&mut begun, true) {
                tell(Told::Begun { what: "recording", steps: of });
            }
            if name != at_hand {
                at_hand = name.into();
                tell(Told::Line(name));
            }
            tell(Told::Done(done));
        };
        record(&settings, folder, &out, Shard::ALL, &mut hear).map(drop)
    })
}

/// The recordings in a folder, in the order of their names.
#[pyfunction]
pub fn recordings_in(py: Python<'_>, folder: PathBuf) -> PyResult<Vec<PathBuf>> {
    py.detach(|| entries::recordings_in(&folder)).map_err(|error| raised(py, &error))
}
