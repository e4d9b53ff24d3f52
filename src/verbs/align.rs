//! Where a recording's body is, and when: the estimate, its files, and on request the recording's own settings.

use std::path::Path;

use super::{Notice, Notify, claimed_for, plausible};
use crate::{
    alignment::{self, Alignment, Search, Verdict, tracks::Track},
    data::{Recording, atomic, recording::SETTINGS_FILE, write_placement},
    error::{Error, Result},
    metrics::DbWindow,
    person::Person,
    pictures::{Line, overlay},
};

/// What is aligned, and how.
pub struct Align<'a> {
    pub recording: &'a Path,
    pub search: Search,
    /// Whether the placement is written into the recording's settings, where one explains it.
    pub apply: bool,
    /// Folder for align.json, motion.toml and align.png.
    pub out: &'a Path,
}

/// Steps that the progress counts.
const STEPS: usize = 4;

/// Aligns and writes what was found.
///
/// # Errors
/// A recording without a body, with falling chirps or damaged samples; meshes where the placement is to be written; a folder that cannot
/// be written.
pub fn align(what: &Align<'_>, notify: &mut Notify<'_>) -> Result<Alignment> {
    let _claim = claimed_for(what.out, "align.json")?;
    for earlier in ["align.json", "align.png", "motion.toml"].map(|name| what.out.join(name)) {
        if earlier.exists() {
            std::fs::remove_file(&earlier).map_err(|error| Error::write(&earlier, error))?;
        }
    }
    let recording = Recording::open(what.recording)?;
    // Where and when the body is stated to be is in question here: no place is refused.
    plausible::recording(&recording, true, notify)?;
    let is_skinned = matches!(recording.person(), Some(Person::Skinned { .. }));
    if what.apply && !is_skinned {
        return Err(Error::Usage {
            message: "--apply: the recording has meshes, which have no [motion] to correct".into(),
            hint: Some("align.json says by what to move the vertices and pose times".into()),
        });
    }
    notify(Notice::Begun { what: "aligning", steps: STEPS });
    let mut steps = 0;
    let mut line = |text: &str| {
        steps += 1;
        notify(Notice::Line(text));
        notify(Notice::Done(steps));
    };
    let alignment = alignment::align(&recording, &what.search, &mut line)?;
    write(what.out, &alignment, is_skinned)?;
    if what.apply && alignment.verdict == Verdict::Aligned {
        write_placement(&recording.folder.join(SETTINGS_FILE), &alignment.motion)?;
    } else if what.apply {
        notify(Notice::Note("--apply: nothing was written, as no single placement explains the recording"));
    }
    Ok(alignment)
}

/// The picture first: whoever finds align.json finds all.
fn write(out: &Path, alignment: &Alignment, is_skinned: bool) -> Result<()> {
    picture(&out.join("align.png"), alignment)?;
    if is_skinned && alignment.verdict == Verdict::Aligned {
        let table =
            toml::Table::from_iter([("motion".to_string(), toml::Value::try_from(&alignment.motion).expect("plain data"))]);
        let text = format!("# {}\n{}", alignment.sentence, toml::to_string(&table).expect("plain data"));
        atomic::write_text(out.join("motion.toml"), &text)?;
    }
    atomic::write_text(out.join("align.json"), &serde_json::to_string_pretty(alignment).expect("plain data"))
}

/// Moving power over range and velocity against time, and the body's extent in both as stated and as found.
fn picture(path: &Path, alignment: &Alignment) -> Result<()> {
    let lines = |values: fn(&Track) -> &Vec<[f64; 3]>| -> Vec<Vec<Line>> {
        let of = |track: &Track| {
            (0..3)
                .map(|quantile| track.time_s.iter().copied().zip(values(track).iter().map(|row| row[quantile])).collect())
                .collect()
        };
        alignment.tracks.iter().map(of).collect()
    };
    let rows = [
        (&alignment.range_time_db, lines(|track| &track.range_m)),
        (&alignment.velocity_time_db, lines(|track| &track.velocity_mps)),
    ];
    let high_db = rows.iter().map(|(map, _)| map.max()).fold(10.0, f64::max);
    let title = "what moves, over the noise; lines: 5, 50 and 95 % of what the body returns";
    overlay(path, title, &["as stated", "as found"], &rows, DbWindow { low_db: 0.0, high_db })
}
