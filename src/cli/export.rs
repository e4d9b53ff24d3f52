//! `hybridsim export`.

use std::path::PathBuf;

use clap::Args;

use super::{Common, progress::Progress};
use crate::{
    data::atomic::AtomicFolder,
    error::Result,
    export::{Dataset, ExportConfig, Target, write_dataset},
    import::capture::boards::Board,
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Recordings, folders of recordings, or the folder of a site
    #[arg(required = true, value_name = "RECORDING")]
    sources: Vec<PathBuf>,
    /// npz, hdf5, dca1000, rover, maps or points
    #[arg(long, value_name = "TARGET")]
    to: Target,
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
    let config = ExportConfig::new(&common.set)?;
    let board = arguments.board.as_deref().map(Board::named).transpose()?;
    let folder = AtomicFolder::create(&arguments.out)?;
    let dataset = Dataset::open(&arguments.sources, arguments.to, board, config, arguments.split_by.clone())?;
    let progress = Progress::new("exporting", dataset.frames(), common.quiet);
    let written = write_dataset(&dataset, folder.path(), &mut |done, name| {
        progress.set(done);
        progress.message(name.to_string());
    });
    progress.finish();
    let notes = written?;
    folder.finish()?;
    for note in notes {
        remark!("note: {note}");
    }
    let count = match dataset.shards.len() {
        1 => "1 recording".to_string(),
        count => format!("{count} recordings"),
    };
    say!("{count}, {} frames as {}: {}", dataset.frames(), dataset.target.name, arguments.out.display());
    Ok(())
}
