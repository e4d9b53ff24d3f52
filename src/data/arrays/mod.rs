//! NumPy arrays: `.npy` files and the members of `.npz` archives.
//!
//! A reader says which axes it expects, by name, and gets an array in C order or an error that says what was found,
//! what was expected and what to do. Nothing is allocated on the word of a header: its sizes are held against the
//! file's first.

mod element;
mod header;
mod npz;
mod stream;
mod write;

pub use element::{Element, Kind, Stored};
pub use header::Header;
pub use npz::Npz;
pub use stream::NpzWriter;
pub use write::{Member, Values, header_bytes, write_npy, write_npz};

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use crate::bounds;
use crate::data::files;
use crate::error::{Error, Result};

/// An array in C order: the last axis is the fastest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Array<T> {
    /// Lengths of the axes, the slowest first.
    pub shape: Vec<usize>,
    /// All values, in C order.
    pub values: Vec<T>,
}

/// The axes that a reader expects, outer to inner: name, and length where it is known beforehand.
pub type Axes<'a> = &'a [(&'a str, Option<usize>)];

/// `[pose, joint = 24, xyz = 3]`
pub fn describe(axes: Axes) -> String {
    let names: Vec<_> =
        axes.iter().map(|(name, length)| length.map_or(name.to_string(), |length| format!("{name} = {length}"))).collect();
    format!("[{}]", names.join(", "))
}

/// What is wrong with an array, before it is known which file and field it came from.
#[derive(Debug)]
pub enum Problem {
    Io(io::Error),
    Content { found: String, expected: String, hint: Option<String> },
}

/// A result whose problem does not know its file yet.
pub type Checked<T> = std::result::Result<T, Problem>;

impl Problem {
    /// Content that is `found` in place of `expected`, without a hint.
    pub fn new(found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::Content { found: found.into(), expected: expected.into(), hint: None }
    }

    /// The same problem with a hint; one of reading stays as it is.
    pub fn with_hint(mut self, text: impl Into<String>) -> Self {
        if let Self::Content { hint, .. } = &mut self {
            *hint = Some(text.into());
        }
        self
    }

    /// The error of a file and of one of its fields; a problem of reading names the file alone.
    pub fn at(self, path: &Path, field: &str) -> Error {
        match self {
            Self::Io(source) => Error::read(path, source),
            Self::Content { found, expected, hint } => {
                Error::Field { path: path.into(), field: field.into(), found, expected, hint }
            }
        }
    }
}

/// Reads a whole `.npy` file. Floating-point values must be finite.
pub fn read_npy<T: Element>(path: impl AsRef<Path>, axes: Axes) -> Result<Array<T>> {
    let path = path.as_ref();
    let (mut file, size) = open(path)?;
    read_array(&mut file, size, Some(axes), u64::MAX)
        .and_then(|array: Array<T>| array.finite(axes).map(|()| array))
        .map_err(|problem| problem.at(path, &field_of(path)))
}

/// What to call the array of a `.npy` file in messages: its name without the extension.
pub fn field_of(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Opens a file for buffered reading and says how long it is, bytes.
pub(crate) fn open(path: &Path) -> Result<(BufReader<File>, u64)> {
    let (file, size) = files::open(path)?;
    Ok((BufReader::with_capacity(1 << 16, file), size))
}

/// Bytes that so many numbers need once they are read.
fn memory_of<T>(numbers: u64) -> u64 {
    numbers.saturating_mul(size_of::<T>() as u64)
}

/// Reads the `size` bytes of one array. `axes`: `None` takes any shape. `most`: bytes that it may take in memory.
pub(crate) fn read_array<T: Element>(
    reader: &mut (impl Read + ?Sized),
    size: u64,
    axes: Option<Axes>,
    most: u64,
) -> Checked<Array<T>> {
    let header = Header::read(reader, size)?;
    let expected = || format!("{}{}", T::EXPECTED, axes.map(|axes| format!(" {}", describe(axes))).unwrap_or_default());
    if !T::accepts(header.stored) {
        return Err(Problem::new(header.describe(), expected()));
    }
    if let Some(axes) = axes {
        header.check_shape(axes, expected)?;
    }
    header.check_size(size)?;
    let needed = memory_of::<T>(header.data_bytes() / header.stored.bytes.max(1) as u64).max(header.data_bytes());
    if needed > most {
        return Err(Problem::new(
            format!("{needed} bytes once it is unpacked"),
            format!("at most {most} for so small an archive"),
        )
        .with_hint(
            "the archive is damaged or made to fill the memory; if it is right, save it without compression (numpy.savez)",
        ));
    }
    // `size` may come from an archive's directory, which may lie too: the buffer grows with what really arrives.
    let wanted = header.data_bytes();
    let mut bytes = Vec::new();
    reader.take(wanted).read_to_end(&mut bytes).map_err(damaged)?;
    if (bytes.len() as u64) < wanted {
        return Err(header.wrong_size(bytes.len() as u64));
    }
    // Reading the end makes an archive compare its checksum.
    if reader.read(&mut [0]).map_err(damaged)? > 0 {
        return Err(header.wrong_size(wanted + 1));
    }
    let values = T::decode(header.stored, &mut bytes);
    let values = if header.fortran { to_c_order(values, &header.shape) } else { values };
    Ok(Array { shape: header.shape, values })
}

/// A read that fails inside an archive means bad bytes, not a bad disk.
fn damaged(error: io::Error) -> Problem {
    use io::ErrorKind::{InvalidData, InvalidInput, Other, UnexpectedEof};
    match error.kind() {
        InvalidData | InvalidInput | Other | UnexpectedEof => {
            Problem::new(format!("damaged ({error})"), "data that matches its checksum")
                .with_hint("copy or download the file again")
        }
        _ => Problem::Io(error),
    }
}

/// Reorders values whose first axis is the fastest so that the last one is.
pub(crate) fn to_c_order<T: Copy>(values: Vec<T>, shape: &[usize]) -> Vec<T> {
    if values.is_empty() || shape.len() < 2 {
        return values;
    }
    let mut strides = vec![1; shape.len()];
    for axis in 1..shape.len() {
        strides[axis] = strides[axis - 1] * shape[axis - 1];
    }
    let mut index = vec![0; shape.len()];
    let mut from = 0;
    let mut ordered = Vec::with_capacity(values.len());
    loop {
        ordered.push(values[from]);
        let mut axis = shape.len() - 1;
        loop {
            index[axis] += 1;
            from += strides[axis];
            if index[axis] < shape[axis] {
                break;
            }
            from -= strides[axis] * shape[axis];
            index[axis] = 0;
            if axis == 0 {
                return ordered;
            }
            axis -= 1;
        }
    }
}

impl<T> Array<T> {
    /// ` at pose 3, xyz 1`
    fn place(&self, position: usize, axes: Axes) -> String {
        let place: Vec<_> =
            axes.iter().zip(self.index_of(position)).map(|((name, _), index)| format!("{name} {index}")).collect();
        if place.is_empty() { String::new() } else { format!(" at {}", place.join(", ")) }
    }

    /// The index along every axis of the value at `position` of `values`.
    pub fn index_of(&self, position: usize) -> Vec<usize> {
        let mut rest = position;
        let mut index = vec![0; self.shape.len()];
        for (entry, &length) in index.iter_mut().zip(&self.shape).rev() {
            *entry = rest % length;
            rest /= length;
        }
        index
    }
}

impl<T: Element> Array<T> {
    /// Refuses NaN and infinity, naming where the first one is.
    pub fn finite(&self, axes: Axes) -> Checked<()> {
        let Some(position) = self.values.iter().position(|value| !value.is_finite()) else { return Ok(()) };
        let place = self.place(position, axes);
        Err(Problem::new(format!("{}{place}", self.values[position].name_non_finite()), "finite numbers"))
    }
}

impl Array<f64> {
    /// Refuses lengths that no scene of a radar has, naming where the first one is.
    pub fn lengths(&self, axes: Axes) -> Checked<()> {
        let Some(position) = self.values.iter().position(|value| value.abs() > bounds::LONGEST_M) else { return Ok(()) };
        let found = format!("{:e} m{}", self.values[position], self.place(position, axes));
        Err(Problem::new(found, format!("at most {:e} m", bounds::LONGEST_M))
            .with_hint("lengths are in metres; the file is damaged or in another unit"))
    }

    /// Rows of three, for arrays whose last axis is `xyz`.
    pub fn rows(&self) -> Vec<[f64; 3]> {
        self.values.as_chunks().0.to_vec()
    }
}

#[cfg(test)]
mod tests;
