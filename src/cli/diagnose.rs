//! `hybridsim diagnose`.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use clap::Args;

use super::{Common, device, progress::Shown};
use crate::{
    config::Config,
    diagnosis::{self, Diagnosis},
    error::Result,
    verbs::{self, diagnose::Diagnose},
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// A recording folder
    recording: PathBuf,
    /// A simulator trained on such recordings, to compare them with in place of one trained now
    #[arg(long, value_name = "DIR")]
    checkpoint: Option<PathBuf>,
    /// Settings: [diagnosis], [simulator] and [training] of a config file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Folder for report.html, report.json and, where a simulator was trained, its checkpoint with the effects
    #[arg(short, long, value_name = "DIR", default_value = "diagnosis")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let config = match &arguments.config {
        Some(path) => Config::read(path, &common.set)?,
        None => Config::defaults(&common.set)?,
    };
    let device = device(&common.device)?;
    let what = Diagnose {
        recording: &arguments.recording,
        checkpoint: arguments.checkpoint.as_deref(),
        config: &config,
        out: &arguments.out,
    };
    let mut shown = Shown::new(common.quiet);
    let diagnosis = verbs::diagnose::diagnose(&what, &device, common.as_stated, &mut |notice| shown.show(notice))?;
    shown.finish();
    print_result(&diagnosis, &arguments.out);
    Ok(())
}

fn print_result(diagnosis: &Diagnosis, out: &Path) {
    let mut text = format!("{}\n", diagnosis::html::lead(&diagnosis.report));
    for effect in &diagnosis.report.effects {
        let _ = writeln!(text, "  {:<24} {:>4.0} %  {}", effect.id, 100.0 * effect.probability, effect.statement);
    }
    for unexplained in &diagnosis.report.unexplained {
        let _ = writeln!(text, "  {:<24}         {}", "(no name)", unexplained.statement);
    }
    let _ = writeln!(text, "report: {}", out.join("report.html").display());
    super::print(&text);
}
