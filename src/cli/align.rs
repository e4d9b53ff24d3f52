//! `hybridsim align`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{Common, plausible, progress::Progress};
use crate::{
    alignment::{self, Alignment, Search, Verdict, tracks::Track},
    data::{Recording, atomic, recording::SETTINGS_FILE, write_placement},
    error::{Error, Result},
    metrics::DbWindow,
    person::Person,
    pictures::{Line, overlay},
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// A recording folder with a body and its motion
    recording: PathBuf,
    /// Folder for align.json, motion.toml and align.png
    #[arg(short, long, value_name = "DIR", default_value = "align")]
    out: PathBuf,
    /// Largest error of motion.start_s that is tried, to either side
    #[arg(long, value_name = "SECONDS", default_value_t = Search::default().lag_s)]
    lag: f64,
    /// Most frames that are looked at, from the beginning
    #[arg(long, value_name = "NUMBER", default_value_t = Search::default().frames)]
    frames: usize,
    /// Write the placement into the recording's recording.toml; only where one placement explains the recording
    #[arg(long)]
    apply: bool,
}

/// Steps that the progress counts.
const STEPS: usize = 4;

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let _claim = super::claimed(&arguments.out)?;
    for earlier in ["align.json", "align.png", "motion.toml"].map(|name| arguments.out.join(name)) {
        if earlier.exists() {
            std::fs::remove_file(&earlier).map_err(|error| Error::write(&earlier, error))?;
        }
    }
    let recording = Recording::open(&arguments.recording)?;
    // Where and when the body is stated to be is in question here: no place is refused.
    plausible::recording(&recording, &Common { as_stated: true, ..common.clone() })?;
    let is_skinned = matches!(recording.person(), Some(Person::Skinned { .. }));
    if arguments.apply && !is_skinned {
        return Err(Error::Usage {
            message: "--apply: the recording has meshes, which have no [motion] to correct".into(),
            hint: Some("align.json says by what to move the vertices and pose times".into()),
        });
    }
    let progress = Progress::new("aligning", STEPS, common.quiet);
    let mut steps = 0;
    let mut tell = |text: &str| {
        steps += 1;
        progress.line(text);
        progress.set(steps);
    };
    let search = Search { lag_s: arguments.lag, frames: arguments.frames };
    let alignment = alignment::align(&recording, &search, &mut tell)?;
    progress.finish();
    write(&arguments.out, &alignment, is_skinned)?;
    say!("{}", alignment.sentence);
    super::tell(&alignment.lines());
    for alternative in &alignment.alternatives {
        let values: Vec<String> = alternative.values.iter().map(|(name, value)| format!("{name} {value:.3}")).collect();
        say!("  or: {} (chance {:.2}, {} frames)", values.join(", "), alternative.p_value, alternative.frames);
    }
    if !alignment.alternatives.is_empty() {
        remark!("note: where the clock is known better, a smaller --lag leaves fewer placements");
    }
    if arguments.apply && alignment.verdict == Verdict::Aligned {
        let settings = recording.folder.join(SETTINGS_FILE);
        write_placement(&settings, &alignment.motion)?;
        say!("written: [motion] of {}", settings.display());
    } else if arguments.apply {
        remark!("note: --apply: nothing was written, as no single placement explains the recording");
    }
    say!("report: {}", arguments.out.join("align.json").display());
    Ok(())
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
