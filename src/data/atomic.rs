//! Files and folders that are either whole or absent.
//!
//! Everything is written under a temporary name beside its target, `.NAME.partial-XXXX`, brought to the disk, and
//! only then renamed. An error or a drop removes the temporary. A killed process cannot; it leaves the temporary,
//! never a half-written target, and the next writer of the same target removes it: a writer holds a lock on its
//! temporary, which the system releases with the process, so an unlocked one belongs to nobody.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use tempfile::{NamedTempFile, TempDir};

use crate::error::{Error, Result};

/// A file that appears under its name when `finish` is called, and not at all otherwise.
pub struct AtomicFile {
    target: PathBuf,
    file: BufWriter<NamedTempFile>,
}

impl AtomicFile {
    pub fn create(target: impl AsRef<Path>) -> Result<Self> {
        let target = target.as_ref().to_path_buf();
        let write_error = |source| Error::write(&target, source);
        let parent = parent_of(&target);
        remove_leftovers(&target);
        let prefix = temporary_prefix(&target, "partial").map_err(write_error)?;
        let file = builder(&prefix, 0o666).tempfile_in(parent).map_err(write_error)?;
        // Without a lock (a file system that has none) leftovers of a killed process merely stay.
        let _ = file.as_file().try_lock();
        Ok(Self { file: BufWriter::with_capacity(1 << 20, file), target })
    }

    /// Brings the content to the disk and gives it its name, replacing what had it before.
    pub fn finish(self) -> Result<()> {
        let Self { target, file } = self;
        let result = file
            .into_inner()
            .map_err(io::IntoInnerError::into_error)
            .and_then(|file| file.as_file().sync_all().map(|()| file))
            .and_then(|file| file.persist(&target).map_err(|error| error.error));
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

pub fn write_text(target: impl AsRef<Path>, text: &str) -> Result<()> {
    write_file(target, |file| file.write_all(text.as_bytes()))
}

/// A folder that is filled under a temporary name and appears under its own when `finish` is called.
pub struct AtomicFolder {
    target: PathBuf,
    folder: TempDir,
    /// Held until the folder has its name or is gone; absent where folders cannot be locked.
    _lock: Option<File>,
    replace: bool,
}

impl AtomicFolder {
    /// For a folder that must not exist yet, or be empty. Creates the folders above it.
    pub fn create(target: impl AsRef<Path>) -> Result<Self> {
        let target = target.as_ref();
        if fs::read_dir(target).is_ok_and(|mut entries| entries.next().is_some()) || target.is_file() {
            return Err(Error::Usage {
                message: format!("{}: exists already and is not an empty folder", target.display()),
                hint: Some("choose another folder, or remove this one first".into()),
            });
        }
        Self::begin(target, false)
    }

    /// For a folder that takes the place of an older one. Between taking the old one away and naming the new one
    /// a killed process leaves neither; `recover` then brings the old one back.
    pub fn replacing(target: impl AsRef<Path>) -> Result<Self> {
        recover(&target)?;
        Self::begin(target.as_ref(), true)
    }

    fn begin(target: &Path, replace: bool) -> Result<Self> {
        let write_error = |source| Error::write(target, source);
        let parent = parent_of(target);
        fs::create_dir_all(parent).map_err(write_error)?;
        remove_leftovers(target);
        let prefix = temporary_prefix(target, "partial").map_err(write_error)?;
        let folder = builder(&prefix, 0o777).tempdir_in(parent).map_err(write_error)?;
        let lock = File::open(folder.path()).ok().filter(|handle| handle.try_lock().is_ok());
        Ok(Self { target: target.to_path_buf(), folder, _lock: lock, replace })
    }

    /// Where to put the files for now.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Gives the folder its name.
    pub fn finish(self) -> Result<()> {
        let Self { target, folder, _lock, replace } = self;
        let write_error = |source| Error::write(&target, source);
        let old = replace.then(|| take_away(&target)).transpose().map_err(write_error)?.flatten();
        // An empty folder may stand at the target; some systems rename over it, some do not.
        let _ = fs::remove_dir(&target);
        if let Err(source) = fs::rename(folder.path(), &target) {
            if let Some(old) = old {
                let _ = fs::rename(old, &target);
            }
            return Err(write_error(source));
        }
        // The temporary name is gone: nothing is left to remove.
        let _ = folder.keep();
        if let Some(old) = old {
            let _ = fs::remove_dir_all(old);
        }
        Ok(())
    }
}

/// Brings back a folder whose replacement was killed between the two renames; call it before reading one that
/// `AtomicFolder::replacing` writes.
pub fn recover(target: impl AsRef<Path>) -> Result<()> {
    let target = target.as_ref();
    if target.exists() {
        return Ok(());
    }
    match siblings(target, "old").into_iter().next() {
        Some(old) => fs::rename(old, target).map_err(|source| Error::write(target, source)),
        None => Ok(()),
    }
}

/// Renames what is at `target` to `.NAME.old-…`; `None` where nothing is.
fn take_away(target: &Path) -> io::Result<Option<PathBuf>> {
    let prefix = temporary_prefix(target, "old")?;
    // A temporary folder reserves a name that nobody else uses; renaming needs the name free again.
    let reserved = builder(&prefix, 0o777).tempdir_in(parent_of(target))?.path().to_path_buf();
    match fs::rename(target, &reserved) {
        Ok(()) => Ok(Some(reserved)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Removes what killed writers of `target` left: temporaries that are not new and that nobody holds a lock on.
fn remove_leftovers(target: &Path) {
    let forgotten = |path: &Path| {
        let modified = path.metadata().and_then(|metadata| metadata.modified()).unwrap_or_else(|_| SystemTime::now());
        // Between making a temporary and locking it lies an instant in which it looks forgotten.
        let settled = modified.elapsed().is_ok_and(|age| age > Duration::from_secs(60));
        settled && File::open(path).is_ok_and(|handle| handle.try_lock().is_ok())
    };
    for path in siblings(target, "partial").into_iter().filter(|path| forgotten(path)) {
        let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    }
    if target.exists() {
        siblings(target, "old").into_iter().for_each(|path| drop(fs::remove_dir_all(path)));
    }
}

/// Everything beside `target` that is named `.NAME.<what>-…`.
fn siblings(target: &Path, what: &str) -> Vec<PathBuf> {
    let Ok(prefix) = temporary_prefix(target, what) else { return vec![] };
    let Ok(entries) = fs::read_dir(parent_of(target)) else { return vec![] };
    let named = |entry: &fs::DirEntry| entry.file_name().as_encoded_bytes().starts_with(prefix.as_encoded_bytes());
    entries.flatten().filter(named).map(|entry| entry.path()).collect()
}

fn temporary_prefix(target: &Path, what: &str) -> io::Result<OsString> {
    let name =
        target.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path has no name at its end"))?;
    let mut prefix = OsString::from(".");
    prefix.push(name);
    prefix.push(format!(".{what}-"));
    Ok(prefix)
}

fn parent_of(target: &Path) -> &Path {
    target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Temporaries are private by default; results have the permissions of any other file, less the umask.
fn builder(prefix: &OsString, mode: u32) -> tempfile::Builder<'_, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix);
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
