//! Files that hold arrays: one kind, one file. Each says which numeric arrays it has, and makes the numbers of one lie somewhere on the
//! disk as they are, from where a [`Source`] reads them frame by frame.

mod hdf5;
mod mat;
mod npy;
mod npz;
mod source;

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

pub use source::Source;

use crate::data::Scratch;
use crate::data::arrays::Stored;
use crate::data::files;
use crate::error::{Error, Result};

/// The kinds of files, by the end of their names.
pub const EXTENSIONS: [&str; 5] = ["npy", "npz", "mat", "h5", "hdf5"];

/// Arrays that a message lists.
const MOST_LISTED: usize = 32;

/// A numeric array of a file.
#[derive(Clone, Debug, PartialEq)]
struct Entry {
    name: String,
    shape: Vec<usize>,
}

/// What a file holds besides, and is not read: its name and what it is.
#[derive(Clone, Debug, PartialEq)]
struct Other {
    name: String,
    kind: &'static str,
}

/// Where the numbers of an array lie.
#[derive(Clone, Debug)]
struct Laid {
    shape: Vec<usize>,
    /// The first axis is the fastest.
    fortran: bool,
    /// One of real or complex numbers, or two of real ones: real and imaginary parts.
    planes: Vec<Plane>,
}

/// Numbers that lie one after the other.
#[derive(Clone, Debug)]
struct Plane {
    file: PathBuf,
    start: u64,
    stored: Stored,
}

trait Container {
    fn entries(&self) -> Vec<Entry>;
    fn others(&self) -> &[Other] {
        &[]
    }
    /// Brings the numbers of an array to the disk, into `scratch` where they do not lie in the file as they are.
    fn lay_out(&mut self, name: &str, scratch: &Path) -> Result<Laid>;
}

/// Opens the array that `variable` names, or the only one of so many axes. `RE,IM` names two arrays that are the parts of one.
///
/// # Errors
/// A file of another kind, damaged or cut off; no array that fits, or several.
pub fn open(path: &Path, variable: Option<&str>, axes: usize) -> Result<Source> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    let mut container: Box<dyn Container> = match extension.as_deref() {
        Some("npz") => Box::new(npz::Archive::open(path)?),
        Some("mat") if !hdf5::is_hdf5(path)? => Box::new(mat::MatFile::open(path)?),
        Some("mat" | "h5" | "hdf5") => Box::new(hdf5::Hdf5::open(path)?),
        _ => Box::new(npy::Npy::open(path)?),
    };
    let entries = container.entries();
    let names = chosen(path, &entries, container.others(), variable, axes)?;
    let scratch = Scratch::new()?;
    let mut parts = names.iter().map(|name| container.lay_out(name, scratch.path())).collect::<Result<Vec<_>>>()?.into_iter();
    let mut laid = parts.next().expect("a name at least is chosen");
    for part in parts {
        if (&part.shape, part.fortran, part.planes.len(), laid.planes.len()) != (&laid.shape, laid.fortran, 1, 1) {
            let found = format!("parts of {:?} and {:?}", laid.shape, part.shape);
            return Err(Error::field(path, names.join(","), found, "two real arrays of one shape"));
        }
        laid.planes.extend(part.planes);
    }
    Source::new(path, names.join(","), laid, scratch)
}

/// The numbers of a file that holds nothing else, the last axis the fastest.
pub fn plain(path: &Path, stored: Stored, shape: Vec<usize>) -> Result<Source> {
    let planes = vec![Plane { file: path.into(), start: 0, stored }];
    Source::new(path, "samples".into(), Laid { shape, fortran: false, planes }, Scratch::new()?)
}

/// The names of the array, or of its two parts.
fn chosen(path: &Path, entries: &[Entry], others: &[Other], variable: Option<&str>, axes: usize) -> Result<Vec<String>> {
    if let Some(variable) = variable {
        let names: Vec<&str> = variable.split(',').map(str::trim).collect();
        if names.len() > 2 {
            let found = format!("{} names", names.len());
            return Err(Error::field(path, variable, found, "one array, or its real and its imaginary part"));
        }
        return names.into_iter().map(|name| named(path, entries, others, name)).collect();
    }
    // A single number is no capture.
    let fitting: Vec<&Entry> =
        entries.iter().filter(|entry| entry.shape.len() == axes && entry.shape.iter().any(|length| *length != 1)).collect();
    let expected = format!("one with the {axes} axes of --layout");
    match fitting[..] {
        [only] => Ok(vec![only.name.clone()]),
        [] if entries.len() == 1 => Ok(vec![entries[0].name.clone()]),
        [] => Err(Error::field(path, "arrays", list(entries.iter()), expected)
            .with_hint("name the array with --variable NAME, or write --layout with one word for each of its axes")),
        _ => Err(Error::field(path, "arrays", list(fitting.into_iter()), expected)
            .with_hint("name the array with --variable NAME; real and imaginary parts apart with --variable RE,IM")),
    }
}

/// Of HDF5, `a/b`, and of MATLAB, `a.b`, are written either way.
fn named(path: &Path, entries: &[Entry], others: &[Other], name: &str) -> Result<String> {
    let plain = |name: &str| name.trim_matches('/').replace('/', ".");
    let is_above = |above: &str| {
        plain(name).strip_prefix(&plain(above)).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '(', '{']))
    };
    let exact = entries.iter().find(|entry| entry.name == name);
    if let Some(entry) = exact.or_else(|| entries.iter().find(|entry| plain(&entry.name) == plain(name))) {
        return Ok(entry.name.clone());
    }
    let found = match others.iter().find(|other| is_above(&other.name)) {
        Some(other) if plain(&other.name) == plain(name) => other.kind.to_string(),
        Some(other) => format!("below `{}`: {}", other.name, other.kind),
        None => "missing".into(),
    };
    Err(Error::field(path, name, found, "a numeric array").with_hint(format!("the file holds: {}", list(entries.iter()))))
}

/// Names and shapes, of many the first ones.
fn list<'a>(entries: impl Iterator<Item = &'a Entry>) -> String {
    let mut listed: Vec<String> = entries.map(|entry| format!("{} {:?}", entry.name, entry.shape)).collect();
    if listed.is_empty() {
        return "no numeric array".into();
    }
    if let Some(more) = listed.len().checked_sub(MOST_LISTED).filter(|more| *more > 0) {
        listed.truncate(MOST_LISTED);
        listed.push(format!("and {more} more"));
    }
    listed.join(", ")
}

/// Copies exactly so many bytes into a file of its own.
fn copy_out(reader: &mut (impl Read + ?Sized), bytes: u64, to: &Path) -> std::io::Result<()> {
    let mut file = std::io::BufWriter::new(File::create(to)?);
    let copied = std::io::copy(&mut reader.take(bytes), &mut file)?;
    file.flush()?;
    if copied == bytes { Ok(()) } else { Err(std::io::ErrorKind::UnexpectedEof.into()) }
}

/// Opens a file that is there and is one.
fn opened(path: &Path) -> Result<(File, u64)> {
    files::open(path)
}

#[cfg(test)]
mod tests;
