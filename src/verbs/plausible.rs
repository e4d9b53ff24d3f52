//! The plausibility of what a verb is given, reported before anything is computed.
//!
//! `as_stated`: the user keeps his word, and what cannot be is noted in place of being refused.

use std::path::{Path, PathBuf};

use super::{Notice, Notify};
use crate::{
    data::{Recording, Shard, entries::recordings_in},
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
/// A first frame that cannot be read; what cannot be, unless it is taken as stated.
pub fn recording(recording: &Recording, as_stated: bool, notify: &mut Notify<'_>) -> Result<()> {
    let (facts, sources) = of_recording(recording)?;
    judge(facts, &sources, as_stated, notify)
}

/// What the checks look at in a recording, and the files it was read from.
///
/// # Errors
/// A person who cannot be posed; a first frame that cannot be read.
pub fn of_recording(recording: &Recording) -> Result<(Facts, Sources)> {
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
    Ok((facts, sources))
}

/// Opens a recording folder for its plausibility alone, before the verb opens it for its work.
///
/// # Errors
/// A recording that cannot be read; as [`recording`].
pub fn folder(folder: &Path, as_stated: bool, notify: &mut Notify<'_>) -> Result<()> {
    recording(&Recording::open(folder)?, as_stated, notify)
}

/// The same of a scene that is not recorded yet.
///
/// # Errors
/// A person who cannot be posed; as [`recording`].
pub fn scene(
    radar: Option<&Radar>,
    room: Option<&Room>,
    person: Option<&Person>,
    sources: &Sources,
    as_stated: bool,
    notify: &mut Notify<'_>,
) -> Result<()> {
    judge(facts(radar, room, person)?, sources, as_stated, notify)
}

/// The same of a site: of its config file, or of its folder of recordings.
///
/// # Errors
/// As [`sequences`] and [`recording`].
pub fn site(path: &Path, as_stated: bool, notify: &mut Notify<'_>) -> Result<()> {
    match path.is_dir() {
        true => recordings_in(path)?.iter().try_for_each(|recording| folder(recording, as_stated, notify)),
        false => sequences(&SiteConfig::read(path, &[])?, path, as_stated, Shard::ALL, notify),
    }
}

/// The same of the sequences of a shard of a site's config, which was read from `path`.
///
/// # Errors
/// Settings that cannot be a site; as [`recording`].
pub fn sequences(config: &SiteConfig, path: &Path, as_stated: bool, shard: Shard, notify: &mut Notify<'_>) -> Result<()> {
    for (name, findings) in site::implausible(config, path.parent().unwrap_or(Path::new("")), as_stated, shard)? {
        let sources = Sources::one(format!("{} ({name})", path.display()));
        notify_verdict(Verdict::new(findings, &sources, as_stated), notify)?;
    }
    Ok(())
}

/// What the checks look at.
pub fn facts(radar: Option<&Radar>, room: Option<&Room>, person: Option<&Person>) -> Result<Facts> {
    let body = person.map(|person| MovingBody::new(person, Interpolation::Linear)).transpose()?;
    Ok(Facts::new(radar, room, person, &|pose| body.as_ref().map_or_else(Vec::new, |body| body.pose(pose))))
}

/// Tells what is to be noted; the first refusal is the error.
pub fn judge(mut facts: Facts, sources: &Sources, as_stated: bool, notify: &mut Notify<'_>) -> Result<()> {
    facts.as_stated = as_stated;
    notify_verdict(Verdict::new(findings(&facts), sources, as_stated), notify)
}

fn notify_verdict(verdict: Verdict, notify: &mut Notify<'_>) -> Result<()> {
    verdict.notes.iter().for_each(|note| notify(Notice::Note(note)));
    verdict.into_result()
}
