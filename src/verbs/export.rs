//! Recordings in the layouts of others.

use std::path::{Path, PathBuf};

use super::{Notice, Notify};
use crate::{
    data::atomic::AtomicFolder,
    error::Result,
    export::{Dataset, ExportConfig, Target, write_dataset},
    import::capture::boards::Board,
};

/// What is exported, and how.
pub struct Export<'a> {
    /// Recordings, folders of recordings, or the folder of a site.
    pub sources: &'a [PathBuf],
    pub target: Target,
    /// The board that is imitated.
    pub board: Option<&'a str>,
    /// A label by whose values recordings are divided into train, validation and test.
    pub split_by: Option<String>,
    /// `key=value` of the export's settings.
    pub sets: &'a [String],
    /// Folder for the files; must be new or empty.
    pub out: &'a Path,
}

/// Writes the files; they appear together or not at all. How many recordings and frames there were.
///
/// # Errors
/// Settings, a board or a label that are none; a recording that cannot be read, or that the layout cannot hold; a folder that is not
/// empty or cannot be written.
pub fn export(what: &Export<'_>, notify: &mut Notify<'_>) -> Result<[usize; 2]> {
    let config = ExportConfig::new(what.sets)?;
    let board = what.board.map(Board::named).transpose()?;
    let folder = AtomicFolder::create(what.out)?;
    let dataset = Dataset::open(what.sources, what.target, board, config, what.split_by.clone())?;
    notify(Notice::Begun { what: "exporting", steps: dataset.frames() });
    let notes = write_dataset(&dataset, folder.path(), &mut |done, _| notify(Notice::Done(done)))?;
    folder.finish()?;
    notes.iter().for_each(|note| notify(Notice::Note(note)));
    Ok([dataset.shards.len(), dataset.frames()])
}
