//! The verbs without a terminal: what the program and the Python module do alike.
//!
//! A verb asks whether what it is given can be, works, and says what happens through [`Notify`]; it prints nothing. Whoever listens
//! may end the work by unwinding (`std::panic::resume_unwind`): what is unfinished is dropped on the way, so that nothing
//! half-written stays.

pub mod align;
pub mod challenge;
pub mod diagnose;
pub mod export;
pub mod found;
pub mod heatmaps;
pub mod import;
pub mod notes;
pub mod plausible;
pub mod record;
pub mod report;
pub mod reproduce;
pub mod scores;
pub mod simulate;
pub mod simulated;
pub mod site;
pub mod train;

use std::path::Path;

use crate::{
    data::{Claim, atomic},
    error::{Error, Result},
    experiments, training,
};

/// What a verb says while it works.
pub enum Notice<'a> {
    /// What was assumed, or is odd about what was given.
    Note(&'a str),
    /// Work of so many steps begins.
    Begun {
        what: &'a str,
        steps: usize,
    },
    /// So many of its steps are done.
    Done(usize),
    /// What has just been done, or found.
    Line(&'a str),
    /// What is done now.
    At(&'a str),
    /// Nothing new: whoever wants the work to end may say so.
    Still,
    /// Of a reproduction.
    Stage(&'a experiments::Event<'a>),
    /// The folder that a training run is kept in from here on, and how many epochs it is to have.
    Run {
        folder: &'a Path,
        epochs: usize,
    },
    Training(&'a training::Event),
}

/// Who receives it.
pub type Notify<'a> = dyn FnMut(Notice<'_>) + 'a;

/// What a folder holds, by a file that no other verb writes.
const HOLDS: [(&str, &str); 5] = [
    ("recording.toml", "a recording"),
    ("config.toml", "a training run"),
    ("report.json", "a diagnosis"),
    ("align.json", "an alignment"),
    ("metrics.json", "an evaluation"),
];

/// The same for results of which `own` is such a file, which may be replaced by results of their kind alone.
///
/// # Errors
/// A folder that holds something else.
pub fn claimed_for(folder: &Path, own: &str) -> Result<Claim> {
    if let Some((_, what)) = HOLDS.iter().find(|(file, _)| *file != own && folder.join(file).is_file()) {
        return Err(Error::Usage {
            message: format!("{}: holds {what}, which would be mixed with other results", folder.display()),
            hint: Some("choose another folder with --out".into()),
        });
    }
    claimed(folder)
}

/// A folder that results are added to, made and tried before the work; nobody else works there until this is dropped.
pub fn claimed(folder: &Path) -> Result<Claim> {
    let claim = Claim::take(folder)?;
    atomic::sweep(folder);
    Ok(claim)
}
