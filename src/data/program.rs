//! The file that this code was loaded from: what the hash of a program is taken of.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::error::{Error, Result};

static LIBRARY: OnceLock<PathBuf> = OnceLock::new();

/// Says that this code is a library in that file; the program that runs is somebody else's.
pub fn is_library(file: PathBuf) {
    let _ = LIBRARY.set(file);
}

/// The library, if it is one; else the program that runs.
///
/// # Errors
/// A system that does not say.
pub fn file() -> Result<PathBuf> {
    let running = || std::env::current_exe().map_err(|source| Error::read("this program", source));
    LIBRARY.get().map_or_else(running, |file| Ok(Path::to_path_buf(file)))
}
