//! `hybridsim recognize`.

use std::path::PathBuf;

use clap::Args;

use super::{Common, device::device, progress::Progress};
use crate::{
    data::atomic::AtomicFolder,
    error::Result,
    recognition::{self, RecognitionConfig, Stage},
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Recordings to learn from: recording folders, or folders of them
    #[arg(long, value_name = "DIR", num_args = 1.., required = true)]
    train: Vec<PathBuf>,
    /// Recordings to be tested on
    #[arg(long, value_name = "DIR", num_args = 1.., required = true)]
    test: Vec<PathBuf>,
    /// Folder for recognition.json, recognition.md, confusion.png, config.toml and run.json; must be new or empty
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Settings of maps, network and training [default: the built-in ones]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let config = RecognitionConfig::read(arguments.config.as_deref(), &common.set)?;
    let folder = AtomicFolder::create(&arguments.out)?;
    let device = device(&common.device)?;
    let mut shown: Option<(bool, Progress)> = None;
    let mut show = |stage: Stage| {
        let (training, what, done, of) = match stage {
            Stage::Reading { done, of } => (false, "reading", done, of),
            Stage::Training { done, of, .. } => (true, "training", done, of),
        };
        if shown.as_ref().is_none_or(|(before, _)| *before != training) {
            if let Some((_, progress)) = shown.take() {
                progress.finish();
            }
            shown = Some((training, Progress::new(what, of, common.quiet)));
        }
        if let Some((_, progress)) = &shown {
            progress.set(done);
            if let Stage::Training { loss, .. } = stage {
                progress.message(format!("loss {loss:.3}"));
            }
        }
    };
    let result = recognition::run(&config, &arguments.train, &arguments.test, &device, &mut show);
    if let Some((_, progress)) = shown {
        progress.finish();
    }
    let result = result?;
    recognition::write(&result, &config, folder)?;
    super::print(&recognition::text(&result));
    say!("\nresult: {}", arguments.out.display());
    Ok(())
}
