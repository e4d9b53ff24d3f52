//! Turning a capture of a radar board into a recording.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{Notice, Notify, plausible};
use crate::{
    data::{Recording, atomic::AtomicFolder},
    error::Result,
    import::capture::{self, Stated},
    integrity::Finding,
};

/// What is imported, and how.
pub struct Import<'a> {
    pub sources: &'a [PathBuf],
    pub stated: &'a Stated,
    pub labels: BTreeMap<String, String>,
    /// Keep what is stated against the data.
    pub as_stated: bool,
    /// Folder of the recording, which appears when it is complete.
    pub out: &'a Path,
}

/// What there is to see before the recording appears.
pub enum Seen<'a> {
    /// It is written, under another name.
    Written(&'a Recording),
    /// It can be; what its samples say of what is stated.
    Looked(&'a Recording, &'a [Finding]),
}

/// Writes the recording, shows what its samples say of what is stated, and lets it appear.
///
/// # Errors
/// A capture that is not understood, cannot be, or contradicts what is stated of it; a folder that cannot be written. Nothing is left then.
pub fn import(what: Import<'_>, seen: &mut dyn FnMut(Seen<'_>, &mut Notify<'_>), notify: &mut Notify<'_>) -> Result<Recording> {
    // What cannot be written is said before anything is read.
    AtomicFolder::create(what.out).map(drop)?;
    let capture = capture::open(what.sources, what.stated)?;
    notify(Notice::Begun { what: "importing", steps: capture.radar.frames });
    let draft = capture::draft(capture, what.out, what.labels, &mut |done, _| notify(Notice::Done(done)))?;
    seen(Seen::Written(draft.recording()), notify);
    let known = draft.recording().notes.clone();
    known.iter().for_each(|note| notify(Notice::Note(note)));
    plausible::recording(draft.recording(), what.as_stated, notify)?;
    seen(Seen::Looked(draft.recording(), &draft.findings), notify);
    let recording = draft.publish(what.as_stated)?;
    recording.notes.iter().filter(|note| !known.contains(note)).for_each(|note| notify(Notice::Note(note)));
    Ok(recording)
}
