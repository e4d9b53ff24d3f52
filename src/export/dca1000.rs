//! `NAME_Raw_0.bin`, `NAME_Raw_1.bin`, … as a DCA1000 behind a TI radar writes them, with `NAME.mmwave.json` and
//! `NAME.setup.json` of mmWave Studio.
//!
//! The order of the words is that of `import::capture::lanes`; what is written is read back by `import` as the same
//! samples. What the description has no place for is said in the notes.

use std::path::Path;

use super::capture_files::{Files, words};
use super::codes::Codes;
use super::mmwave_json::{self, Described};
use super::wiring::Wiring;
use super::{Source, not_carried};
use crate::data::atomic::write_text;
use crate::error::Result;

pub fn write(source: &mut Source, folder: &Path) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    let radar = &source.recording.radar;
    let wiring = Wiring::of(radar, source.board, false, &mut notes)?;
    let described = Described::of(radar, &wiring, &mut notes);
    notes.extend(not_carried(source.recording, &["which chirps were lost", "room", "body and motion", "labels"]));
    let mut codes = Codes::of(source, &mut notes)?;
    let mut files = Files::new(folder, &source.name, &source.config.capture);
    for frame in 0..source.recording.frames() {
        files.push(&words(source, frame, &wiring, &mut codes)?)?;
        source.done(frame + 1);
    }
    codes.conclude(&mut notes);
    let names = files.finish()?;
    let config = format!("{}.mmwave.json", source.name);
    write_text(folder.join(&config), &described.mmwave_json())?;
    let setup = mmwave_json::setup_json(&wiring.device, &config, &names);
    write_text(folder.join(format!("{}.setup.json", source.name)), &setup)?;
    Ok(notes)
}
