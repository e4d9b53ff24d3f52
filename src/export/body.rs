//! `NAME_body.npz`: where the body is in every frame, and the room, without the samples.

use std::path::Path;

use super::sink::{NpzSink, Sink};
use super::{Source, contents};
use crate::error::Result;

pub fn write(source: &mut Source, folder: &Path) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    let frames = source.recording.frames();
    let mut sink: Box<dyn Sink> = Box::new(NpzSink::create(&folder.join(format!("{}_body.npz", source.name)))?);
    contents::describe(source.recording, 0..frames, &mut *sink)?;
    contents::body(source.recording, 0..frames, &mut *sink, &mut notes)?;
    sink.finish()?;
    source.done(frames);
    if source.recording.person().is_none() {
        notes.push("the recording knows no body".into());
    }
    Ok(notes)
}
