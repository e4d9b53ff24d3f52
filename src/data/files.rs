//! The one place where files of others are opened.
//!
//! Only regular files are: a named pipe would wait for a writer for ever, a device never ends. What is at the path is
//! looked at before it is opened, since opening a pipe already waits.

use std::ffi::OsStr;
use std::fs::{self, File, FileType};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use crate::error::{Error, Result};

/// Longest text that is read as settings or a report, bytes: larger ones were not written by people, nor for this program.
const LONGEST_TEXT: u64 = 1 << 26;

/// Opens a regular file and says how long it is, bytes.
///
/// # Errors
/// What cannot be opened, and what is no regular file.
pub fn open(path: impl AsRef<Path>) -> Result<(File, u64)> {
    let path = path.as_ref();
    require(path)?;
    let file = File::open(path).map_err(|source| Error::read(path, source))?;
    let metadata = file.metadata().map_err(|source| Error::read(path, source))?;
    Ok((file, metadata.len()))
}

/// Refuses what is no regular file, for readers of other libraries that open by name.
///
/// # Errors
/// As `open`.
pub fn require(path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    let metadata = fs::metadata(path).map_err(|source| Error::read(path, source))?;
    match other_kind(metadata.file_type()) {
        None => Ok(()),
        Some("a folder") => Err(Error::read(path, io::ErrorKind::IsADirectory.into())),
        Some(kind) => Err(Error::Parse { path: path.into(), message: format!("this is {kind}, expected a regular file") }),
    }
}

/// A regular file, for readers whose errors get their path later.
///
/// # Errors
/// As `open`.
pub fn regular(path: impl AsRef<Path>) -> io::Result<File> {
    match other_kind(fs::metadata(&path)?.file_type()) {
        None => File::open(path),
        Some(kind) => Err(io::Error::new(io::ErrorKind::InvalidInput, format!("this is {kind}, expected a regular file"))),
    }
}

/// What else than a regular file something is.
fn other_kind(kind: FileType) -> Option<&'static str> {
    if kind.is_file() {
        return None;
    }
    if kind.is_dir() {
        return Some("a folder");
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return Some("a named pipe");
        }
        if kind.is_socket() {
            return Some("a socket");
        }
        if kind.is_char_device() || kind.is_block_device() {
            return Some("a device");
        }
    }
    Some("something else")
}

/// Reads a whole file.
///
/// # Errors
/// As `open`.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<u8>> {
    let path = path.as_ref();
    let (mut file, size) = open(path)?;
    let mut bytes = Vec::with_capacity(usize::try_from(size).unwrap_or(0).min(1 << 20));
    file.read_to_end(&mut bytes).map_err(|source| Error::read(path, source))?;
    Ok(bytes)
}

/// Reads a whole text: settings, reports.
///
/// # Errors
/// As `open`; a text that is not UTF-8 or longer than any settings are.
pub fn read_text(path: impl AsRef<Path>) -> Result<String> {
    let path = path.as_ref();
    let (mut file, size) = open(path)?;
    if size > LONGEST_TEXT {
        return Err(Error::Parse {
            path: path.into(),
            message: format!("this is a file of {size} bytes, expected a text of at most {LONGEST_TEXT}"),
        });
    }
    let mut text = String::new();
    file.read_to_string(&mut text).map_err(|source| Error::read(path, source))?;
    Ok(text)
}

/// Reads a JSON file.
///
/// # Errors
/// As [`read_text`]; what is no JSON of this kind.
pub fn read_json<T: DeserializeOwned>(path: impl AsRef<Path>) -> Result<T> {
    let path = path.as_ref();
    let text = read_text(path)?;
    serde_json::from_str(&text).map_err(|error| Error::Parse { path: path.into(), message: error.to_string() })
}

/// The whole path of something that exists, for settings that are written down: those are text.
///
/// # Errors
/// A path that does not exist or is not UTF-8.
pub fn absolute(path: impl AsRef<Path>) -> Result<PathBuf> {
    let path = path.as_ref();
    let whole = path.canonicalize().map_err(|source| Error::read(path, source))?;
    utf8(&whole)?;
    Ok(whole)
}

/// Refuses a path that settings and reports, which are text, could not name.
///
/// # Errors
/// With the path as far as it can be shown.
pub fn utf8(path: impl AsRef<OsStr>) -> Result<()> {
    let path = path.as_ref();
    if path.to_str().is_some() {
        return Ok(());
    }
    Err(Error::Usage {
        message: format!("{}: is not UTF-8, expected a name in UTF-8", path.display()),
        hint: Some("rename the file or its folder: settings and reports, which are text, must be able to name it".into()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regular_files_are_read_also_through_links() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        fs::write(&path, "seed = 1").unwrap();
        assert_eq!(read_text(&path).unwrap(), "seed = 1");
        assert_eq!(read(&path).unwrap(), b"seed = 1");
        assert_eq!(open(&path).unwrap().1, 8);
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&path, folder.path().join("link.toml")).unwrap();
            assert_eq!(read_text(folder.path().join("link.toml")).unwrap(), "seed = 1");
        }
    }

    #[test]
    fn folders_and_missing_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let message = read(folder.path()).unwrap_err().to_string();
        assert!(message.contains("cannot be read: is a directory"), "{message}");
        assert!(read(folder.path().join("none")).unwrap_err().hint().unwrap().contains("check the path"));
    }

    #[test]
    #[cfg(unix)]
    fn a_device_and_a_socket_are_refused_before_they_are_opened() {
        let message = read("/dev/zero").unwrap_err().to_string();
        assert_eq!(message, "/dev/zero: this is a device, expected a regular file");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("socket");
        let _socket = std::os::unix::net::UnixListener::bind(&path).unwrap();
        assert!(read_text(&path).unwrap_err().to_string().ends_with("this is a socket, expected a regular file"));
    }

    #[test]
    fn a_text_longer_than_any_settings_is_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        File::create(&path).unwrap().set_len(LONGEST_TEXT + 1).unwrap();
        assert!(read_text(&path).unwrap_err().to_string().contains("expected a text of at most"));
    }

    #[test]
    #[cfg(unix)]
    fn a_path_that_is_no_text_is_refused() {
        use std::os::unix::ffi::OsStrExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(OsStr::from_bytes(b"r\xffx"));
        fs::create_dir(&path).unwrap();
        assert!(absolute(folder.path()).is_ok());
        assert!(absolute(&path).unwrap_err().to_string().ends_with("x: is not UTF-8, expected a name in UTF-8"));
        let link = folder.path().join("plain");
        std::os::unix::fs::symlink(&path, &link).unwrap();
        assert!(absolute(&link).is_err(), "what a link names is written down");
    }
}
