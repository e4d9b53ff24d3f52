//! The plausibility of what a verb is given, told before anything is computed.

use std::path::{Path, PathBuf};

use super::Common;
use crate::{
    data::{Recording, entries::recordings_in},
    error::Result,
    person::Person,
    plausibility::{CodeFacts, Facts, Sources, Verdict, findings},
    radar::Radar,
    recorder::{Interpolation, body::MovingBody},
    room::Room,
    site::{self, SiteConfig},
};

/// Notes what is odd about a recording, and refuses what cannot be.
///
/// # Errors
/// A first frame that cannot be read; what cannot be, unless the user keeps his word with `--as-stated`.
pub(super) fn recording(recording: &Recording, common: &Common) -> Result<()> {
    let mut facts = facts(Some(&recording.radar), recording.room.as_ref(), recording.person())?;
    let number_type = recording.number_type();
    if number_type.starts_with("uint") {
        let frame = recording.frame(0)?;
        facts.codes = CodeFacts::new(&number_type, frame.re.iter().chain(frame.im.iter().flatten()));
    }
    let file = |file: &Option<PathBuf>| recording.folder.join(file.as_deref().unwrap_or(Path::new("recording.toml")));
    let files = &recording.files;
    let sources = Sources {
        settings: recording.folder.join("recording.toml"),
        samples: recording.folder.join(&files.samples),
        body: file(files.body.as_ref().map_or(&files.vertices, |_| &files.body)),
        motion: file(&files.motion),
    };
    tell(facts, &sources, common)
}

/// Opens a recording folder for its plausibility alone, before the verb opens it for its work.
///
/// # Errors
/// A recording that cannot be read; as [`recording`].
pub(super) fn folder(folder: &Path, common: &Common) -> Result<()> {
    recording(&Recording::open(folder)?, common)
}

/// The same of a scene that is not recorded yet.
///
/// # Errors
/// A person who cannot be posed; as [`recording`].
pub(super) fn scene(
    radar: Option<&Radar>,
    room: Option<&Room>,
    person: Option<&Person>,
    sources: &Sources,
    common: &Common,
) -> Result<()> {
    tell(facts(radar, room, person)?, sources, common)
}

/// The same of a site: of its config file, or of its folder of recordings.
///
/// # Errors
/// As [`sequences`] and [`recording`].
pub(super) fn site(path: &Path, common: &Common) -> Result<()> {
    match path.is_dir() {
        true => recordings_in(path)?.iter().try_for_each(|recording| folder(recording, common)),
        false => sequences(&SiteConfig::read(path, &[])?, path, common),
    }
}

/// The same of all sequences of a site's config, which was read from `path`.
///
/// # Errors
/// Settings that cannot be a site; as [`recording`].
pub(super) fn sequences(config: &SiteConfig, path: &Path, common: &Common) -> Result<()> {
    for (name, findings) in site::implausible(config, path.parent().unwrap_or(Path::new("")), common.as_stated)? {
        let sources = Sources::one(format!("{} ({name})", path.display()));
        tell_findings(Verdict::new(findings, &sources, common.as_stated))?;
    }
    Ok(())
}

/// What the checks look at.
pub(super) fn facts(radar: Option<&Radar>, room: Option<&Room>, person: Option<&Person>) -> Result<Facts> {
    let body = person.map(|person| MovingBody::new(person, Interpolation::Linear)).transpose()?;
    Ok(Facts::new(radar, room, person, &|pose| body.as_ref().map_or_else(Vec::new, |body| body.pose(pose))))
}

/// Notes on standard error, the first refusal as the error.
pub(super) fn tell(mut facts: Facts, sources: &Sources, common: &Common) -> Result<()> {
    facts.as_stated = common.as_stated;
    tell_findings(Verdict::new(findings(&facts), sources, common.as_stated))
}

fn tell_findings(verdict: Verdict) -> Result<()> {
    verdict.notes.iter().for_each(|note| remark!("note: {note}"));
    verdict.into_result()
}
