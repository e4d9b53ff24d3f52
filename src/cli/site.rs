//! `hybridsim site`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{Common, interrupt, plausible, progress::Progress};
use crate::{
    data::{Claim, Shard},
    error::Result,
    site::{self, SiteConfig},
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
    let config = SiteConfig::read(&arguments.config, &common.set)?;
    let shard = arguments.shard.unwrap_or(Shard::ALL);
    let _claim = Claim::part(&arguments.out, shard)?;
    interrupt::kept(|| format!("the recordings that are whole are kept; go on with: {}", interrupt::typed()));
    let settings_folder = arguments.config.parent().unwrap_or(Path::new(""));
    plausible::sequences(&config, &arguments.config, common)?;
    let mut shown = None;
    let mut show = |done: usize, of: usize, name: &str| {
        let progress = shown.get_or_insert_with(|| Progress::new("recording", of, common.quiet));
        progress.set(done);
        progress.message(name.to_string());
    };
    let made = site::record(&config, settings_folder, &arguments.out, shard, &mut show);
    if let Some(progress) = shown {
        progress.finish();
    }
    let made = made?;
    say!("site: {}", arguments.out.display());
    say!("{} of {} sequences: {} recorded, {} kept", made.sequences, made.of, made.recorded, made.kept);
    Ok(())
}
