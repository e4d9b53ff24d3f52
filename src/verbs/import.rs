//! Turning a capture of a radar board into a recording.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    str::FromStr,
};

use super::{Notice, Notify, plausible};
use crate::{
    data::{Recording, atomic::AtomicFolder},
    error::Result,
    import::capture::{self, Stated},
    integrity::Finding,
};

/// Which chirp profiles of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profiles {
    One(usize),
    All,
}

impl Profiles {
    /// What a profile may be written as, for messages.
    pub const EXPECTED: &str = "the number of a profile, or all";

    /// The one; none where all are taken.
    pub fn one(self) -> Option<usize> {
        match self {
            Self::One(id) => Some(id),
            Self::All => None,
        }
    }
}

impl FromStr for Profiles {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "all" => Ok(Self::All),
            _ => text.parse().map(Self::One).map_err(|_| format!("expected {}", Self::EXPECTED)),
        }
    }
}

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

/// A recording of every chirp profile of a frame: `profile0` and so on in the folder that `what` names. All appear together: one that is
/// refused leaves nothing of the others. The names, and the notes of each.
///
/// # Errors
/// As [`import`]; a capture whose description has no profiles.
pub fn import_profiles(
    what: &Import<'_>,
    seen: &mut dyn FnMut(Seen<'_>, &mut Notify<'_>),
    notify: &mut Notify<'_>,
) -> Result<Vec<(String, Vec<String>)>> {
    let folder = AtomicFolder::create(what.out)?;
    let mut made = vec![];
    for id in capture::profiles(what.sources, what.stated)? {
        let name = format!("profile{id}");
        notify(Notice::Line(&format!("profile {id}:")));
        let stated = Stated { profile: Some(id), ..what.stated.clone() };
        let own = Import { stated: &stated, labels: what.labels.clone(), out: &folder.path().join(&name), ..*what };
        made.push((name, import(own, seen, notify)?.notes));
    }
    folder.finish()?;
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::Profiles;

    #[test]
    fn profiles_are_one_or_all() {
        for (text, wanted) in [("all", Profiles::All), ("0", Profiles::One(0)), ("12", Profiles::One(12))] {
            assert_eq!(text.parse(), Ok(wanted));
        }
        for text in ["both", "", "-1", "All", "None"] {
            assert_eq!(text.parse::<Profiles>(), Err("expected the number of a profile, or all".into()), "{text}");
        }
        assert_eq!([Profiles::All, Profiles::One(3)].map(Profiles::one), [None, Some(3)]);
    }
}
