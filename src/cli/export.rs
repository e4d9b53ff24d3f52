//! `hybridsim export`.

use std::path::PathBuf;

use clap::Args;

use super::{Common, progress::Shown};
use crate::{
    error::Result,
    export::Target,
    verbs::{self, export::Export},
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Recordings, folders of recordings, or the folder of a site
    #[arg(required = true, value_name = "RECORDING")]
    sources: Vec<PathBuf>,
    /// npz, hdf5, dca1000, rover, maps, points or body
    #[arg(long, value_name = "TARGET")]
    to: String,
    /// The board that is imitated, such as IWR6843ISK: its lanes, and its numbers of the transmitters
    #[arg(long, value_name = "NAME")]
    board: Option<String>,
    /// A label, such as subject, by whose values recordings are divided into train, validation and test
    #[arg(long, value_name = "LABEL")]
    split_by: Option<String>,
    /// Folder for the files; must be new or empty
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    // Not parsed by clap, which leaves hints out.
    let target: Target = arguments.to.parse()?;
    let what = Export {
        sources: &arguments.sources,
        target,
        board: arguments.board.as_deref(),
        split_by: arguments.split_by.clone(),
        sets: &common.set,
        out: &arguments.out,
    };
    let mut shown = Shown::new(common.quiet);
    let [recordings, frames] = verbs::export::export(&what, &mut |notice| shown.show(notice))?;
    shown.finish();
    let recordings = if recordings == 1 { "1 recording".to_string() } else { format!("{recordings} recordings") };
    say!("{recordings}, {frames} frames as {}: {}", target.name, arguments.out.display());
    Ok(())
}
