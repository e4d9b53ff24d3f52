//! Named arrays in one `.npz` archive.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use zip::ZipArchive;
use zip::result::ZipError;

use super::header::name_content;
use super::{Array, Axes, Checked, Element, Problem, describe, memory_of, open, read_array};
use crate::error::{Error, Result};

/// Deflate cannot make data smaller than this; who claims more is lying.
const BEST_COMPRESSION: u64 = 1040;

/// What one archive may unpack to: this much, and so many times its own size. The shared CC0 bodies, sparse matrices
/// included, unpack to 15 times theirs (30 times as f64); an array of nothing but zeros to a thousand times.
const FREE_BYTES: u64 = 1 << 26;
const USUAL_COMPRESSION: u64 = 100;

/// An open archive.
pub struct Npz {
    path: PathBuf,
    /// Bytes that may still be unpacked.
    left: u64,
    archive: ZipArchive<BufReader<File>>,
}

impl Npz {
    /// Opens an archive without reading an array.
    ///
    /// # Errors
    /// A file that cannot be read, is empty, is no archive or is damaged.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let (mut file, size) = open(path)?;
        let not_an_archive = |what: String| Error::Parse {
            path: path.into(),
            message: format!("this is {what}, expected a NumPy archive (.npz)"),
        };
        if size == 0 {
            return Err(not_an_archive("an empty file".into()));
        }
        let mut start = Vec::new();
        let read = file.by_ref().take(10).read_to_end(&mut start).and_then(|_| file.seek(SeekFrom::Start(0)));
        read.map_err(|source| Error::read(path, source))?;
        if !start.starts_with(b"PK") {
            let what = name_content(&start);
            let way_out = if what.contains("pickle") { "; convert it with scripts/smpl_to_npz.py" } else { "" };
            return Err(not_an_archive(what + way_out));
        }
        match ZipArchive::new(file) {
            Ok(archive) => {
                let left = size.saturating_mul(USUAL_COMPRESSION).saturating_add(FREE_BYTES);
                Ok(Self { path: path.into(), left, archive })
            }
            Err(ZipError::Io(source)) if source.raw_os_error().is_some() => Err(Error::read(path, source)),
            Err(error) => Err(not_an_archive(format!("a damaged or cut-off archive ({error})"))),
        }
    }

    /// The file that the archive was opened from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names of the arrays, sorted.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<_> = self.members().map(str::to_string).collect();
        names.sort();
        names
    }

    /// Whether the archive has an array of this name.
    pub fn has(&self, name: &str) -> bool {
        self.members().any(|member| member == name)
    }

    fn members(&self) -> impl Iterator<Item = &str> {
        self.archive.file_names_raw().filter_map(|name| std::str::from_utf8(name).ok()?.strip_suffix(".npy"))
    }

    /// Reads an array that must be there. Floating-point values must be finite.
    pub fn read<T: Element>(&mut self, name: &str, axes: Axes) -> Result<Array<T>> {
        let array = self.read_unchecked(name, axes)?;
        array.finite(axes).map_err(|problem| problem.at(&self.path, name))?;
        Ok(array)
    }

    /// Reads lengths in metres, as `read` does; those that no scene has are refused.
    pub fn lengths(&mut self, name: &str, axes: Axes) -> Result<Array<f64>> {
        let array: Array<f64> = self.read(name, axes)?;
        array.lengths(axes).map_err(|problem| problem.at(&self.path, name))?;
        Ok(array)
    }

    /// As `read`, but NaN and infinity pass: for callers who can say better where they are.
    pub fn read_unchecked<T: Element>(&mut self, name: &str, axes: Axes) -> Result<Array<T>> {
        self.member(name, Some(axes))
    }

    /// Reads an array of any shape; NaN and infinity pass.
    pub fn read_any<T: Element>(&mut self, name: &str) -> Result<Array<T>> {
        self.member(name, None)
    }

    /// A single number, stored with any number of axes of length 1.
    pub fn scalar(&mut self, name: &str) -> Result<f64> {
        let array: Array<f64> = self.member(name, None)?;
        match array.values[..] {
            [value] => Ok(value),
            _ => Err(Error::field(&self.path, name, format!("an array {:?}", array.shape), "a single number")),
        }
    }

    fn member<T: Element>(&mut self, name: &str, axes: Option<Axes>) -> Result<Array<T>> {
        if !self.has(name) {
            let expected = axes.map_or("a single number".into(), |axes| format!("{} {}", T::EXPECTED, describe(axes)));
            return Err(self.missing(name, expected));
        }
        let most = self.left;
        let (array, size) = self.with_member(name, |file, size| Ok((read_array::<T>(file, size, axes, most)?, size)))?;
        // An archive may name the same bytes many times.
        self.left = self.left.saturating_sub(memory_of::<T>(array.values.len() as u64).max(size));
        Ok(array)
    }

    fn missing(&self, name: &str, expected: String) -> Error {
        Error::field(&self.path, name, "missing", expected).with_hint(format!("the file holds: {}", self.names().join(", ")))
    }

    /// Hands a member's unpacked bytes, and how many there are said to be, to whoever reads them.
    ///
    /// # Errors
    /// A member that is missing, or claims to grow more than deflating can; what the reader finds.
    pub fn with_member<T>(&mut self, name: &str, read: impl FnOnce(&mut dyn Read, u64) -> Checked<T>) -> Result<T> {
        if !self.has(name) {
            return Err(self.missing(name, "an array".into()));
        }
        let path = &self.path;
        let damaged = |error: ZipError| match error {
            ZipError::Io(source) if source.raw_os_error().is_some() => Error::read(path, source),
            error => Error::field(path, name, format!("damaged ({error})"), "an array stored or deflated, as NumPy writes it"),
        };
        let mut file = self.archive.by_name(&format!("{name}.npy")).map_err(damaged)?;
        let (size, compressed) = (file.size(), file.compressed_size());
        if size > compressed.saturating_mul(BEST_COMPRESSION) {
            let found = format!("said to grow from {compressed} to {size} bytes");
            return Err(Error::field(path, name, found, "a size that deflating can reach").with_hint("the archive is damaged"));
        }
        read(&mut file, size).map_err(|problem: Problem| problem.at(path, name))
    }
}
