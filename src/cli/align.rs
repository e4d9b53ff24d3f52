//! `hybridsim align`.

use std::path::PathBuf;

use clap::Args;

use super::{Common, progress::Shown};
use crate::{
    alignment::{Search, Verdict},
    data::recording::SETTINGS_FILE,
    error::Result,
    verbs::{self, align::Align},
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

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let search = Search { lag_s: arguments.lag, frames: arguments.frames };
    let what = Align { recording: &arguments.recording, search, apply: arguments.apply, out: &arguments.out };
    let mut shown = Shown::new(common.quiet);
    let alignment = verbs::align::align(&what, &mut |notice| shown.show(notice))?;
    shown.finish();
    say!("{}", alignment.sentence);
    if alignment.verdict == Verdict::CannotTell && !alignment.estimates.is_empty() {
        say!("estimates of the best placement, which was rejected:");
    }
    super::print(&alignment.lines());
    for alternative in &alignment.alternatives {
        let values: Vec<String> = alternative.values.iter().map(|(name, value)| format!("{name} {value:.3}")).collect();
        say!("  or: {} (chance {:.2}, {} frames)", values.join(", "), alternative.p_value, alternative.frames);
    }
    if !alignment.alternatives.is_empty() {
        remark!("note: where the clock is known better, a smaller --lag leaves fewer placements");
    }
    if arguments.apply && alignment.verdict == Verdict::Aligned {
        say!("written: [motion] of {}", arguments.recording.join(SETTINGS_FILE).display());
    }
    say!("report: {}", arguments.out.join("align.json").display());
    Ok(())
}
