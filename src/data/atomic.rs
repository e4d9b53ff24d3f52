//! Files and folders that are either whole or absent.
//!
//! Everything is written under a temporary name beside its target, brought to the disk, and only then renamed; then the
//! name, too, is brought to the disk. An error, a drop or a signal removes the temporary. A killed process cannot; it leaves
//! the temporary, never a half-written target, and whoever starts next removes it (`leftovers`).

mod folder;
mod sync;

pub use super::leftovers::{sweep, sweep_all};
pub use folder::{AtomicFolder, recover};

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::leftovers::{PARTIAL, locked, parent_of, prefix, remove_beside};
use super::unfinished::{Undo, publish};
use crate::error::{Error, Result};

/// A file that appears under its name when `finish` is called, and not at all otherwise.
pub struct AtomicFile {
    target: PathBuf,
    file: BufWriter<NamedTempFile>,
    undo: Undo,
}

impl AtomicFile {
    /// Opens a temporary beside the target, and removes what dead processes left there.
    ///
    /// # Errors
    /// A target without a name, or in a folder that cannot be written.
    pub fn create(target: impl AsRef<Path>) -> Result<Self> {
        let target = target.as_ref().to_path_buf();
        let write_error = |source| Error::write(&target, source);
        let no_name = || io::Error::new(io::ErrorKind::InvalidInput, "the path has no name at its end");
        let name = target.file_name().ok_or_else(no_name).map_err(write_error)?;
        remove_beside(&target);
        let prefix = prefix(Some(name), PARTIAL);
        let make = || with_mode(tempfile::Builder::new().prefix(&prefix), 0o666).tempfile_in(parent_of(&target));
        // The lock belongs to what is open, not to the handle: it lasts as long as the file is written.
        let open = |file: &NamedTempFile| file.as_file().try_clone();
        let (file, _) = locked(make, open, |file| file.path().to_path_buf()).map_err(write_error)?;
        let doomed = file.path().to_path_buf();
        let undo = Undo::by(move || drop(fs::remove_file(doomed)));
        Ok(Self { file: BufWriter::with_capacity(1 << 20, file), target, undo })
    }

    /// Brings the content to the disk and gives it its name, replacing what had it before.
    pub fn finish(self) -> Result<()> {
        let Self { target, file, undo } = self;
        let result = file
            .into_inner()
            .map_err(io::IntoInnerError::into_error)
            .and_then(|file| sync::sync_file(file.as_file(), &target).map(|()| file))
            .and_then(|file| publish(|| file.persist(&target)).map_err(|error| error.error));
        drop(undo);
        sync::sync_folder(parent_of(&target));
        result.map(drop).map_err(|source| Error::write(&target, source))
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Writes a whole file through `fill`; when that fails, whatever was at `target` before is still there.
pub fn write_file(target: impl AsRef<Path>, fill: impl FnOnce(&mut AtomicFile) -> io::Result<()>) -> Result<()> {
    let mut file = AtomicFile::create(&target)?;
    fill(&mut file).map_err(|source| Error::write(&target, source))?;
    file.finish()
}

/// Writes a whole text file; when that fails, whatever was at `target` before is still there.
pub fn write_text(target: impl AsRef<Path>, text: &str) -> Result<()> {
    write_file(target, |file| file.write_all(text.as_bytes()))
}

/// Gives a finished folder another name on the same file system, after all that is in it was brought to the disk.
pub fn rename_folder(from: &Path, to: &Path) -> Result<()> {
    let write_error = |source| Error::write(to, source);
    sync::sync_tree(from).map_err(write_error)?;
    publish(|| fs::rename(from, to)).map_err(write_error)?;
    sync::sync_folder(parent_of(to));
    sync::sync_folder(parent_of(from));
    Ok(())
}

/// Temporaries are private by default; results have the permissions of any other file, less the umask.
fn with_mode<'a, 'b, 'c>(builder: &'a mut tempfile::Builder<'b, 'c>, mode: u32) -> &'a mut tempfile::Builder<'b, 'c> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = mode;
    builder
}

#[cfg(test)]
mod tests;
