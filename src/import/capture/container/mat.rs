//! `.mat` of MATLAB 5 to 7.2 (`save -v6`, `-v7`, scipy.io.savemat).
//!
//! Source: MathWorks, "MAT-File Format" (R2019b), chapter 1. Read are numeric arrays, at the top of the file and in structures and cells:
//! `data.adc`, `frames(2).adc`, `parts{1}`, counted as in MATLAB. Objects, sparse and character arrays are passed over. `matrw` 0.1.4
//! reads these files, too, but panics where a compressed variable is damaged, takes a file that is cut off for a shorter one and the
//! numbers of a big-endian one for little-endian ones.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use flate2::read::ZlibDecoder;

use super::{Container, Entry, Laid, Other, Plane, copy_out, opened};
use crate::data::arrays::{Kind, Stored};
use crate::error::{Error, Result};

const HEADER: u64 = 128;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Deflate cannot make data smaller than this; who claims more is lying.
const BEST_COMPRESSION: u64 = 1040;
/// MATLAB's own limit is 63 letters; a file that says more is damaged.
const LONGEST_NAME: u32 = 1 << 10;
const MOST_AXES: u32 = 32;
/// Bytes of the names of a structure's fields.
const LONGEST_FIELDS: u32 = 1 << 20;
/// Arrays of a file; compressed, far more fit into one than memory holds names.
const MOST_ARRAYS: usize = 1 << 16;
/// Structures inside structures that are looked into, as in HDF5.
const DEEPEST: usize = 8;
const CELL: u32 = 1;
const STRUCTURE: u32 = 2;

/// A numeric array: its name, its shape, where its variable's element begins, and how far in that the array itself.
#[derive(Clone)]
struct Variable {
    name: String,
    shape: Vec<usize>,
    is_complex: bool,
    element: u64,
    inside: u64,
}

/// What an element holds: flags, shape and name; no more of what has none.
struct Described {
    class: u32,
    is_complex: bool,
    shape: Vec<usize>,
    name: String,
}

/// What was found in an element.
#[derive(Default)]
struct Found {
    variables: Vec<Variable>,
    others: Vec<Other>,
}

pub(super) struct MatFile {
    path: PathBuf,
    big_endian: bool,
    variables: Vec<Variable>,
    others: Vec<Other>,
}

/// The tag of an element, and its data where they lie in the tag itself.
struct Tag {
    kind: u32,
    bytes: u32,
    small: Option<[u8; 4]>,
}

/// Elements one after the other.
struct Elements<R> {
    reader: R,
    big_endian: bool,
    /// Bytes that were read since the beginning.
    at: u64,
}

type Io<T> = std::io::Result<T>;

fn damaged(what: impl Into<String>) -> std::io::Error {
    std::io::Error::new(std::io::ErrorKind::InvalidData, what.into())
}

impl<R: Read> Elements<R> {
    fn take<const N: usize>(&mut self) -> Io<[u8; N]> {
        let mut bytes = [0; N];
        self.reader.read_exact(&mut bytes)?;
        self.at += N as u64;
        Ok(bytes)
    }

    fn number(&self, bytes: [u8; 4]) -> u32 {
        if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
    }

    fn tag(&mut self) -> Io<Tag> {
        let (first, second) = (self.take()?, self.take()?);
        let kind = self.number(first);
        // A small element has its length in the upper half of the first word, and its data in the second one.
        match kind >> 16 {
            0 => Ok(Tag { kind, bytes: self.number(second), small: None }),
            bytes @ 1..=4 => Ok(Tag { kind: kind & 0xffff, bytes, small: Some(second) }),
            bytes => Err(damaged(format!("a small element of {bytes} bytes"))),
        }
    }

    /// The data of an element of at most so many bytes, and what fills it up to eight.
    fn data(&mut self, most: u32) -> Io<(u32, Vec<u8>)> {
        let Tag { kind, bytes, small } = self.tag()?;
        if bytes > most {
            return Err(damaged(format!("an element of {bytes} bytes where {most} are the most")));
        }
        let mut data = small.map(Vec::from).unwrap_or_default();
        if small.is_none() {
            data.resize(bytes.next_multiple_of(8) as usize, 0);
            self.reader.read_exact(&mut data)?;
            self.at += data.len() as u64;
        }
        data.truncate(bytes as usize);
        Ok((kind, data))
    }

    /// What comes before an array's numbers, cells or fields.
    fn describe(&mut self) -> Io<Described> {
        let (_, flags) = self.data(8)?;
        let flags = flags.first_chunk().map(|flags| self.number(*flags)).ok_or_else(|| damaged("no array flags"))?;
        let (class, is_complex) = (flags & 0xff, flags & 0x0800 != 0);
        // Function handles and objects of a class of its own have neither shape nor name.
        if class > 15 {
            return Ok(Described { class, is_complex, shape: vec![], name: String::new() });
        }
        let (_, dims) = self.data(4 * MOST_AXES)?;
        let shape: Vec<usize> = dims.as_chunks().0.iter().map(|bytes| self.number(*bytes) as usize).collect();
        let (_, name) = self.data(LONGEST_NAME)?;
        Ok(Described { class, is_complex, shape, name: String::from_utf8_lossy(&name).into_owned() })
    }
}

impl<R: Read + Skip> Elements<R> {
    fn skip_to(&mut self, end: u64) -> Io<()> {
        let bytes = end.checked_sub(self.at).ok_or_else(|| damaged("an element longer than the one around it"))?;
        self.reader.skip(bytes)?;
        self.at = end;
        Ok(())
    }

    /// Finds the arrays in the matrix that begins here and ends there; `path` names one inside another.
    fn find(&mut self, path: Option<&str>, end: u64, depth: usize, found: &mut Found) -> Io<()> {
        let inside = self.at;
        if inside == end {
            return Ok(());
        }
        let Described { class, is_complex, shape, name } = self.describe()?;
        let name = path.map_or(name, str::to_string);
        if found.variables.len() + found.others.len() >= MOST_ARRAYS {
            return Err(damaged(format!("more than {MOST_ARRAYS} arrays")));
        }
        match class {
            6..=15 => found.variables.push(Variable { name, shape, is_complex, element: 0, inside }),
            CELL | STRUCTURE if depth > 0 => self.find_below(&name, &shape, class, end, depth - 1, found)?,
            _ if name.is_empty() => {}
            _ => found.others.push(Other { name, kind: kind(class) }),
        }
        Ok(())
    }

    /// The same in the cells of an array of cells, or in the fields of a structure or of an array of structures.
    fn find_below(&mut self, name: &str, shape: &[usize], class: u32, end: u64, depth: usize, found: &mut Found) -> Io<()> {
        let count = shape.iter().try_fold(1usize, |count, &length| count.checked_mul(length)).unwrap_or(usize::MAX);
        let fields = if class == STRUCTURE { Some(self.fields()?) } else { None };
        let of_one = |index: usize| match &fields {
            None => vec![format!("{name}{{{}}}", index + 1)],
            Some(fields) if count == 1 => fields.iter().map(|field| format!("{name}.{field}")).collect(),
            Some(fields) => fields.iter().map(|field| format!("{name}({}).{field}", index + 1)).collect(),
        };
        let is_empty = fields.as_ref().is_some_and(Vec::is_empty);
        for path in (0..if is_empty { 0 } else { count }).flat_map(of_one) {
            let Tag { kind: MATRIX, bytes, small: None } = self.tag()? else {
                return Err(damaged(format!("no array in {path}")));
            };
            let own_end = self.at + u64::from(bytes);
            if own_end > end {
                return Err(damaged(format!("{path} needs {bytes} bytes, {} are there", end.saturating_sub(self.at))));
            }
            self.find(Some(&path), own_end, depth, found)?;
            self.skip_to(own_end)?;
        }
        Ok(())
    }

    /// Names of a structure's fields.
    fn fields(&mut self) -> Io<Vec<String>> {
        let (_, length) = self.data(4)?;
        let length = length.first_chunk().map(|length| self.number(*length) as usize).filter(|length| *length > 0);
        let length = length.ok_or_else(|| damaged("no length of field names"))?;
        let (_, names) = self.data(LONGEST_FIELDS)?;
        let name = |bytes: &[u8]| String::from_utf8_lossy(bytes.split(|byte| *byte == 0).next().unwrap_or_default()).into_owned();
        Ok(names.chunks(length).map(name).collect())
    }
}

/// Going forward without reading, where that is possible.
trait Skip {
    fn skip(&mut self, bytes: u64) -> Io<()>;
}

impl Skip for BufReader<File> {
    fn skip(&mut self, bytes: u64) -> Io<()> {
        self.seek_relative(i64::try_from(bytes).map_err(|_| damaged("an element beyond any file"))?)
    }
}

impl<R: Read> Skip for ZlibDecoder<R> {
    fn skip(&mut self, bytes: u64) -> Io<()> {
        let passed = std::io::copy(&mut self.take(bytes), &mut std::io::sink())?;
        if passed == bytes { Ok(()) } else { Err(std::io::ErrorKind::UnexpectedEof.into()) }
    }
}

/// What people call an array of a class.
fn kind(class: u32) -> &'static str {
    match class {
        CELL | STRUCTURE => "a structure or cells deeper than are looked into",
        4 => "text",
        5 => "a sparse array",
        16 => "a function",
        _ => "an object",
    }
}

/// The numbers of an element's type.
fn stored(kind: u32, big_endian: bool) -> Option<Stored> {
    let (kind, bytes) = match kind {
        1 => (Kind::Int, 1),
        2 => (Kind::Unsigned, 1),
        3 => (Kind::Int, 2),
        4 => (Kind::Unsigned, 2),
        5 => (Kind::Int, 4),
        6 => (Kind::Unsigned, 4),
        7 => (Kind::Float, 4),
        9 => (Kind::Float, 8),
        12 => (Kind::Int, 8),
        13 => (Kind::Unsigned, 8),
        _ => return None,
    };
    Some(Stored { kind, bytes, big_endian })
}

impl MatFile {
    pub fn open(path: &Path) -> Result<Self> {
        let (file, size) = opened(path)?;
        let mut elements = Elements { reader: BufReader::new(file), big_endian: false, at: 0 };
        let not_mat = |found: String| Error::field(path, "header", found, "a MAT-file of MATLAB 5 to 7.3");
        let header: [u8; HEADER as usize] = elements.take().map_err(|_| not_mat(format!("{size} bytes")))?;
        let big_endian = match &header[126..] {
            b"IM" => false,
            b"MI" => true,
            _ => return Err(not_mat("another file, or one of MATLAB 4".into()).with_hint("save it again with MATLAB: save -v7")),
        };
        elements.big_endian = big_endian;
        let mut found = Found::default();
        while elements.at < size {
            let (element, first) = (elements.at, found.variables.len());
            Self::look(&mut elements, size, &mut found).map_err(|error| cut_off(path, element, &error))?;
            found.variables[first..].iter_mut().for_each(|variable| variable.element = element);
        }
        Ok(Self { path: path.into(), big_endian, variables: found.variables, others: found.others })
    }

    /// Looks into the next element and goes to the one after it.
    fn look(elements: &mut Elements<BufReader<File>>, size: u64, found: &mut Found) -> Io<()> {
        let tag = elements.tag()?;
        let end = elements.at + u64::from(tag.bytes);
        if end > size {
            return Err(damaged(format!("it needs {} bytes, {} are there", tag.bytes, size - elements.at)));
        }
        match tag.kind {
            MATRIX => elements.find(None, end, DEEPEST, found)?,
            COMPRESSED => {
                let reader = ZlibDecoder::new((&mut elements.reader).take(tag.bytes.into()));
                let mut inside = Elements { reader, big_endian: elements.big_endian, at: 0 };
                let tag = inside.tag()?;
                if tag.kind == MATRIX {
                    inside.find(None, inside.at + u64::from(tag.bytes), DEEPEST, found)?;
                }
            }
            _ => {}
        }
        elements.reader.seek(SeekFrom::Start(end))?;
        elements.at = end;
        Ok(())
    }

    /// The planes of an array of so many numbers, from where its numbers begin; `own` names a file for one that has to be copied.
    fn planes<R: Read>(
        &self,
        elements: &mut Elements<R>,
        variable: &Variable,
        own: &dyn Fn(usize) -> PathBuf,
        in_place: bool,
        most: u64,
    ) -> Io<Vec<Plane>> {
        let count: u64 =
            variable.shape.iter().try_fold(1u64, |count, &length| count.checked_mul(length as u64)).unwrap_or(u64::MAX);
        let part = |index: usize| {
            let Tag { kind, bytes, small } = elements.tag()?;
            let stored = stored(kind, self.big_endian).ok_or_else(|| damaged(format!("numbers of type {kind}")))?;
            if Some(u64::from(bytes)) != count.checked_mul(stored.bytes as u64) || u64::from(bytes) > most {
                return Err(damaged(format!("{bytes} bytes for {} {:?}", stored.name(), variable.shape)));
            }
            let padded = u64::from(bytes.next_multiple_of(8));
            let mut plane = Plane { file: own(index), start: 0, stored };
            match small {
                Some(data) => copy_out(&mut &data[..bytes as usize], bytes.into(), &plane.file)?,
                None if in_place => {
                    (plane.file, plane.start) = (self.path.clone(), elements.at);
                    let passed = std::io::copy(&mut (&mut elements.reader).take(padded), &mut std::io::sink())?;
                    if passed < u64::from(bytes) {
                        return Err(std::io::ErrorKind::UnexpectedEof.into());
                    }
                    elements.at += padded;
                }
                None => {
                    copy_out(&mut elements.reader, bytes.into(), &plane.file)?;
                    std::io::copy(&mut (&mut elements.reader).take(padded - u64::from(bytes)), &mut std::io::sink())?;
                }
            }
            Ok(plane)
        };
        (0..1 + usize::from(variable.is_complex)).map(part).collect()
    }
}

fn cut_off(path: &Path, element: u64, error: &std::io::Error) -> Error {
    Error::field(path, format!("element at byte {element}"), format!("cut off or damaged ({error})"), "a whole variable")
        .with_hint("copy or download the file again")
}

impl Container for MatFile {
    fn entries(&self) -> Vec<Entry> {
        self.variables.iter().map(|variable| Entry { name: variable.name.clone(), shape: variable.shape.clone() }).collect()
    }

    fn others(&self) -> &[Other] {
        &self.others
    }

    fn lay_out(&mut self, name: &str, scratch: &Path) -> Result<Laid> {
        let index = self.variables.iter().position(|variable| variable.name == name).expect("a name of the entries");
        let variable = self.variables[index].clone();
        let own = |part: usize| scratch.join(format!("{index}-{part}.raw"));
        let read = || -> Io<Vec<Plane>> {
            let mut reader = BufReader::new(crate::data::files::regular(&self.path)?);
            reader.seek(SeekFrom::Start(variable.element))?;
            let mut elements = Elements { reader, big_endian: self.big_endian, at: variable.element };
            let tag = elements.tag()?;
            if tag.kind == MATRIX {
                elements.skip_to(variable.inside)?;
                elements.describe()?;
                return self.planes(&mut elements, &variable, &own, true, tag.bytes.into());
            }
            let reader = ZlibDecoder::new(elements.reader.take(tag.bytes.into()));
            let mut inside = Elements { reader, big_endian: self.big_endian, at: 0 };
            inside.skip_to(variable.inside)?;
            inside.describe()?;
            let planes =
                self.planes(&mut inside, &variable, &own, false, u64::from(tag.bytes).saturating_mul(BEST_COMPRESSION))?;
            // Reading the end compares the checksum.
            std::io::copy(&mut inside.reader, &mut std::io::sink())?;
            Ok(planes)
        };
        let planes = read().map_err(|error| cut_off(&self.path, variable.element, &error))?;
        Ok(Laid { shape: variable.shape, fortran: true, planes })
    }
}
