//! `hybridsim site`.

use std::path::PathBuf;

use clap::Args;

use super::{Common, interrupt, progress::Shown};
use crate::{
    data::Shard,
    error::Result,
    verbs::site::{self, Site},
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// A site's config, such as configs/site_smoke.toml
    config: PathBuf,
    /// Folder of the site; one that was begun is continued
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Only part i of n, such as 2/8
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let shard = arguments.shard.unwrap_or(Shard::ALL);
    let what = Site { config: &arguments.config, sets: &common.set, out: &arguments.out, shard };
    interrupt::kept(|| format!("the recordings that are whole are kept; go on with: {}", interrupt::typed()));
    let mut shown = Shown::new(common.quiet);
    let made = site::record(&what, common.as_stated, &mut |notice| shown.show(notice))?;
    shown.finish();
    say!("site: {}", arguments.out.display());
    say!("{} of {} sequences: {} recorded, {} kept", made.sequences, made.of, made.recorded, made.kept);
    Ok(())
}
