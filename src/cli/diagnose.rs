//! `hybridsim diagnose`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{Common, progress::Progress};
use crate::{
    data::{Recording, atomic},
    diagnosis::{self, select::Thresholds},
    error::{Error, Result},
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// A recording folder
    recording: PathBuf,
    /// Folder for report.json and report.html
    #[arg(short, long, value_name = "DIR", default_value = "diagnosis")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let recording = Recording::open(&arguments.recording)?;
    let progress = Progress::new("diagnosing", Thresholds::default().most, common.quiet);
    let mut rounds = 0;
    let diagnosis = diagnosis::diagnose(&recording, &Thresholds::default(), &mut |text| {
        rounds += 1;
        progress.line(text);
        progress.set(rounds);
    })?;
    let html = diagnosis::html::html(&diagnosis)?;
    progress.finish();
    write(&arguments.out, &diagnosis.report, &html)?;
    println!("{}", diagnosis::html::lead(&diagnosis.report));
    for effect in &diagnosis.report.effects {
        println!("  {:<24} {:>4.0} %  {}", effect.id, 100.0 * effect.probability, effect.statement);
    }
    for unexplained in &diagnosis.report.unexplained {
        println!("  {:<24}         {}", "(no name)", unexplained.statement);
    }
    println!("report: {}", arguments.out.join("report.html").display());
    Ok(())
}

/// The page first: whoever finds report.json finds both.
fn write(out: &Path, report: &diagnosis::report::Report, html: &str) -> Result<()> {
    std::fs::create_dir_all(out).map_err(|error| Error::write(out, error))?;
    atomic::write_text(out.join("report.html"), html)?;
    atomic::write_text(out.join("report.json"), &serde_json::to_string_pretty(report).expect("plain data"))
}
