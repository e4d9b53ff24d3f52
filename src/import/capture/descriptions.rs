//! The files that describe the radar of a capture.

use std::path::{Path, PathBuf};

use super::{Stated, ti_json};
use crate::data::entries::entries;
use crate::error::{Error, Result};

/// The one file that describes the radar, and the set-up where there is one.
pub fn descriptions(source: &Path, stated: &Stated, notes: &mut Vec<String>) -> Result<(PathBuf, ti_json::Setup)> {
    let is = |path: &Path, end: &str| path.to_string_lossy().to_lowercase().ends_with(end);
    let mut given = stated.configs.clone();
    if given.is_empty() {
        let folder = source.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut beside = entries(folder)?;
        beside.retain(|path| is(path, ".mmwave.json") || is(path, ".setup.json") || is(path, ".cfg"));
        given = beside;
        for path in &given {
            notes.push(format!("the radar is that of {}, which lies beside the samples", path.display()));
        }
    }
    let (setups, radars): (Vec<_>, Vec<_>) = given.into_iter().partition(|path| is(path, ".setup.json"));
    let setup = setups.first().map(|path| ti_json::read_setup(path)).transpose()?.unwrap_or_default();
    match &radars[..] {
        [only] => Ok((only.clone(), setup)),
        [] => Err(Error::Usage {
            message: format!("{}: nothing describes the radar", source.display()),
            hint: Some(
                "give --config FILE: the .mmwave.json of mmWave Studio, the .cfg that was sent to the radar, or TOML with [radar]; where \
                 there is none, say how the words of one device lie, such as --layout \"frame loop tx rx sample iq lane\" (two lanes, \
                 I I Q Q), and what the radar is, with --board NAME and --set radar.KEY=VALUE"
                    .into(),
            ),
        }),
        several => Err(Error::Usage {
            message: format!(
                "{} files describe the radar: {}",
                several.len(),
                radars.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
            ),
            hint: Some("name the one of this capture with --config".into()),
        }),
    }
}
