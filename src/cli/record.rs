//! `hybridsim record`.

use std::path::PathBuf;

use clap::Args;

use super::{Common, Out, progress::Shown};
use crate::{
    config::Config,
    error::Result,
    verbs::{self, Notice},
};

#[derive(Args)]
#[command(mut_arg("out", |out| out.help("The recording folder [default: in runs/recordings, named by the hash of its settings]")))]
pub(crate) struct Arguments {
    /// A config with a [record] section
    config: PathBuf,
    #[command(flatten)]
    out: Out,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let config = Config::read(&arguments.config, &common.set)?;
    let record = config.record(&arguments.config)?;
    let mut shown = Shown::new(common.quiet);
    let mut notify = |notice: Notice<'_>| shown.show(notice);
    let folder = match &arguments.out.out {
        Some(out) => {
            verbs::record::make(record, &arguments.config, out, common.as_stated, &mut notify)?;
            out.clone()
        }
        None => verbs::record::recorded(record, &arguments.config, common.as_stated, &mut notify)?,
    };
    shown.finish();
    say!("recording: {}", folder.display());
    Ok(())
}
