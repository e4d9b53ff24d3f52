//! `NAME.npz`: the IF samples with all that is needed to read them without this program.

use std::path::Path;

use super::sink::NpzSink;
use super::{Source, contents};
use crate::error::Result;

pub fn write(source: &mut Source, folder: &Path) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    let sink = NpzSink::create(&folder.join(format!("{}.npz", source.name)))?;
    contents::write(source, 0..source.recording.frames(), Box::new(sink), &mut notes)?;
    Ok(notes)
}
