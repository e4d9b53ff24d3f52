//! Folders that are either whole or absent.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::sync::{sync_folder, sync_tree};
use super::with_mode;
use crate::data::claim::Claim;
use crate::data::entries::is_hidden;
use crate::data::leftovers::{OLD, PARTIAL, READY, locked, move_out, named, parent_of, prefix, remove_beside, siblings, sweep};
use crate::data::unfinished::{Undo, publish, remove_in_use};
use crate::error::{Error, Result};

/// A folder that is filled under a temporary name and appears under its own when `finish` is called.
pub struct AtomicFolder {
    target: PathBuf,
    /// Dropped before `undo`, which a signal would need until then.
    folder: TempDir,
    /// Held until the folder has its name or is gone.
    _lock: Option<File>,
    how: How,
    _undo: Undo,
    /// Absent for a replacement: who replaces has a claim to the folder around it.
    _claim: Option<Claim>,
}

/// How the folder gets its name.
#[derive(Clone, Copy, PartialEq)]
enum How {
    /// By a rename.
    Rename,
    /// The same, after the older one was taken away.
    Replace,
    /// The target is there and stays, as a mount point must: the entries are moved into it, settings last.
    Fill,
}

impl AtomicFolder {
    /// For a folder that must not exist yet, or hold nothing (hidden names do not count). It may be a link to such a folder,
    /// or a mount point. Creates the folders above it.
    ///
    /// # Errors
    /// A folder that cannot be written, that holds something, or that another process is about to write.
    pub fn create(target: impl AsRef<Path>) -> Result<Self> {
        let target = resolved(target.as_ref())?;
        let exists = || Error::Usage {
            message: format!("{}: exists already and is not an empty folder", target.display()),
            hint: Some("choose another folder, or remove this one first".into()),
        };
        if target.is_file() {
            return Err(exists());
        }
        if !target.is_dir() {
            let parent = parent_of(&target);
            fs::create_dir_all(parent).map_err(|source| Error::write(&target, source))?;
            let claim = target.file_name().map(|_| Claim::beside(&target)).transpose()?;
            return Self::begin(&target, How::Rename, claim);
        }
        let claim = Claim::take(&target)?;
        sweep(&target);
        let mut entries = fs::read_dir(&target).map_err(|source| Error::read(&target, source))?.flatten();
        if entries.any(|entry| !is_hidden(&entry.path())) {
            return Err(exists());
        }
        Self::begin(&target, How::Fill, Some(claim))
    }

    /// For a folder that takes the place of an older one. Between taking the old one away and naming the new one
    /// a killed process leaves neither; `recover` then brings the old one back.
    pub fn replacing(target: impl AsRef<Path>) -> Result<Self> {
        let target = target.as_ref();
        recover(target)?;
        fs::create_dir_all(parent_of(target)).map_err(|source| Error::write(target, source))?;
        Self::begin(target, How::Replace, None)
    }

    fn begin(target: &Path, how: How, claim: Option<Claim>) -> Result<Self> {
        let write_error = |source| Error::write(target, source);
        let (within, prefix) = match how {
            How::Fill => (target, prefix(None, PARTIAL)),
            _ => (parent_of(target), prefix(Some(named(target).map_err(write_error)?), PARTIAL)),
        };
        if how != How::Fill {
            remove_beside(target);
        }
        let make = || with_mode(tempfile::Builder::new().prefix(&prefix), 0o777).tempdir_in(within);
        let path = |folder: &TempDir| folder.path().to_path_buf();
        let (folder, lock) = locked(make, |folder| File::open(folder.path()), path).map_err(write_error)?;
        let doomed = folder.path().to_path_buf();
        let undo = Undo::by(move || remove_in_use(&doomed));
        Ok(Self { target: target.to_path_buf(), folder, _lock: lock, how, _undo: undo, _claim: claim })
    }

    /// Where it will be.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Where to put the files for now.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// From where a path that is relative to the folder leads to what it will lead to.
    pub fn seen_from(&self) -> &Path {
        if self.how == How::Fill { &self.target } else { self.path() }
    }

    /// Brings everything to the disk and gives the folder its name.
    pub fn finish(self) -> Result<()> {
        let Self { target, folder, _lock, how, _undo, _claim } = self;
        let write_error = |source| Error::write(&target, source);
        sync_tree(folder.path()).map_err(write_error)?;
        publish(|| match how {
            How::Fill => fill(folder.path(), &target),
            How::Rename => fs::rename(folder.path(), &target),
            How::Replace => replace(folder.path(), &target),
        })
        .map_err(write_error)?;
        // The temporary name is gone: nothing is left to remove.
        let _ = folder.keep();
        sync_folder(if how == How::Fill { &target } else { parent_of(&target) });
        if how == How::Replace {
            siblings(&target, OLD).iter().for_each(|old| drop(fs::remove_dir_all(old)));
        }
        Ok(())
    }
}

/// Where a link leads.
fn resolved(target: &Path) -> Result<PathBuf> {
    if !target.is_symlink() {
        return Ok(target.to_path_buf());
    }
    target.canonicalize().map_err(|_| Error::Usage {
        message: format!("{}: is a link that leads nowhere", target.display()),
        hint: Some("make the folder that it leads to, or choose another one".into()),
    })
}

fn replace(folder: &Path, target: &Path) -> io::Result<()> {
    let old = take_away(target)?;
    if let Err(source) = fs::rename(folder, target) {
        if let Some(old) = old {
            let _ = fs::rename(old, target);
        }
        return Err(source);
    }
    Ok(())
}

/// Renames what is at `target` to `.NAME.hybridsim-old-…`; `None` where nothing is.
fn take_away(target: &Path) -> io::Result<Option<PathBuf>> {
    let prefix = prefix(Some(named(target)?), OLD);
    // A temporary folder reserves a name that nobody else uses; renaming needs the name free again.
    let reserved = tempfile::Builder::new().prefix(&prefix).tempdir_in(parent_of(target))?.path().to_path_buf();
    match fs::rename(target, &reserved) {
        Ok(()) => Ok(Some(reserved)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Moves the entries of a complete folder into the target around it. Whoever is killed on the way leaves the rest under a
/// name that says so, and the next one who comes moves it.
fn fill(folder: &Path, target: &Path) -> io::Result<()> {
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let ready = target.join(name.replacen(PARTIAL, READY, 1));
    fs::rename(folder, &ready)?;
    move_out(&ready)
}

/// Brings back a folder whose replacement was killed between the two renames; call it before reading one that
/// `AtomicFolder::replacing` writes.
pub fn recover(target: impl AsRef<Path>) -> Result<()> {
    let target = target.as_ref();
    let bring_back = || match siblings(target, OLD).into_iter().next() {
        Some(old) if !target.exists() => fs::rename(old, target),
        _ => Ok(()),
    };
    if target.exists() {
        return Ok(());
    }
    publish(bring_back).map_err(|source| Error::write(target, source))
}
