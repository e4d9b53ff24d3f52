//! The header of a `.npy` file, believed only as far as the file's size supports it.

use std::io::Read;

use npyz::{DType, Endianness, NpyHeader, Order, TypeChar};

use super::{Axes, Checked, Kind, Problem, Stored};

/// NumPy itself refuses headers beyond 10 kB.
const LONGEST_HEADER: u64 = 1 << 16;

/// How an array of arrays becomes one of numbers.
const OBJECT: &str = "save its numbers as an array: numpy.save(FILE, numpy.stack(list(ARRAY)))";

/// What a `.npy` file says about itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    pub stored: Stored,
    /// The first axis is the fastest.
    pub fortran: bool,
    /// Lengths of the axes, in the file's order.
    pub shape: Vec<usize>,
    /// Bytes before the first number.
    pub data_start: u64,
}

impl Header {
    /// Reads up to the first number of a file of `size` bytes.
    pub fn read(reader: &mut (impl Read + ?Sized), size: u64) -> Checked<Self> {
        const ARRAY: &str = "a NumPy array (.npy)";
        if size == 0 {
            return Err(Problem::new("an empty file", ARRAY).with_hint("whatever wrote it did not finish; make it again"));
        }
        let mut start = Vec::new();
        reader.take(10).read_to_end(&mut start).map_err(super::damaged)?;
        if !start.starts_with(b"\x93NUMPY") {
            let problem = Problem::new(name_content(&start), ARRAY);
            return Err(if start.starts_with(b"PK") { problem.with_hint("extract the array that is meant") } else { problem });
        }
        if start.len() < 10 {
            return Err(Problem::new(format!("cut off after {} bytes", start.len()), ARRAY));
        }
        let length_bytes = if start[6] == 1 { 2 } else { 4 };
        let mut text = start;
        reader.take(length_bytes - 2).read_to_end(&mut text).map_err(super::damaged)?;
        let length = text[8..].iter().rev().fold(0, |sum, &byte| sum << 8 | u64::from(byte));
        let data_start = text.len() as u64 + length;
        if length > LONGEST_HEADER || data_start > size {
            return Err(Problem::new(format!("an array with a header of {length} bytes in {size} bytes"), "a header that fits")
                .with_hint("the file is cut off or damaged; copy it again"));
        }
        reader.take(length).read_to_end(&mut text).map_err(super::damaged)?;
        Self::parse(&text, data_start)
    }

    /// `bytes`: all before the first number.
    fn parse(bytes: &[u8], data_start: u64) -> Checked<Self> {
        let unreadable = |why: String| {
            Problem::new(
                format!("an array with an unreadable header ({why})"),
                "a header such as {'descr': '<i2', 'fortran_order': False, 'shape': (24, 1, 4, 64, 128, 2), }",
            )
        };
        let text = &bytes[10..];
        // The parser calls itself for every bracket, and the product of the lengths must not overflow.
        if text.iter().filter(|byte| matches!(byte, b'(' | b'[' | b'{')).count() > 64 {
            return Err(unreadable("too many brackets".into()));
        }
        let numbers = text.split(|byte| !byte.is_ascii_digit()).map(|digits| String::from_utf8_lossy(digits));
        let bits = |digits: &str| digits.parse::<u64>().map_or(64, |number| 64 - number.leading_zeros());
        if numbers.filter(|digits| !digits.is_empty()).map(|digits| bits(&digits)).sum::<u32>() > 62 {
            return Err(Problem::new("an array with more numbers than any file can hold", "a header that fits the file"));
        }
        let header = NpyHeader::from_reader(bytes).map_err(|error| unreadable(error.to_string()))?;
        Ok(Self {
            stored: stored(&header.dtype())?,
            fortran: header.order() == Order::Fortran,
            shape: header.shape().iter().map(|&length| length as usize).collect(),
            data_start,
        })
    }

    /// Such as `int16 [24, 1, 4, 64, 128, 2]`.
    pub fn describe(&self) -> String {
        format!("{} {:?}", self.stored.name(), self.shape)
    }

    /// Bytes that the array's numbers take in the file.
    pub fn data_bytes(&self) -> u64 {
        self.shape.iter().map(|&length| length as u64).product::<u64>() * self.stored.bytes as u64
    }

    /// Refuses a file of `size` bytes that holds less or more than the header announces.
    pub fn check_size(&self, size: u64) -> Checked<()> {
        let found = size - self.data_start.min(size);
        if found == self.data_bytes() { Ok(()) } else { Err(self.wrong_size(found)) }
    }

    pub(super) fn wrong_size(&self, found: u64) -> Problem {
        let hint = if found < self.data_bytes() {
            "the file is cut off, or its header is wrong; copy it again"
        } else {
            "the header does not belong to this data"
        };
        Problem::new(
            format!("{found} bytes of data"),
            format!("{} bytes for the {} of its header", self.data_bytes(), self.describe()),
        )
        .with_hint(hint)
    }

    /// Refuses another number of axes or another length, and names the first axis that differs.
    pub fn check_shape(&self, axes: Axes, expected: impl Fn() -> String) -> Checked<()> {
        let hint = if self.shape.len() != axes.len() {
            Some(format!("it has {} axes instead of {}", self.shape.len(), axes.len()))
        } else {
            let differs = |(&found, (name, length)): (&usize, &(&str, Option<usize>))| {
                length.filter(|&length| length != found).map(|length| format!("{name} is {found} instead of {length}"))
            };
            self.shape.iter().zip(axes).find_map(differs)
        };
        hint.map_or(Ok(()), |hint| Err(Problem::new(self.describe(), expected()).with_hint(hint)))
    }
}

fn stored(dtype: &DType) -> Checked<Stored> {
    let unsupported = |what: &str, hint: &str| {
        let problem = Problem::new(format!("{what} (dtype {})", dtype.descr()), "an array of plain numbers");
        Err(if hint.is_empty() { problem } else { problem.with_hint(hint) })
    };
    let DType::Plain(plain) = dtype else { return unsupported("structured", "save each of its fields as an array of its own") };
    let kind = match plain.type_char() {
        TypeChar::Bool => Kind::Bool,
        TypeChar::Int => Kind::Int,
        TypeChar::Uint => Kind::Unsigned,
        TypeChar::Float => Kind::Float,
        TypeChar::Complex => Kind::Complex,
        TypeChar::UnicodeStr | TypeChar::ByteStr => return unsupported("text", ""),
        TypeChar::Object => return unsupported("a Python object", OBJECT),
        _ => return unsupported("not numbers", ""),
    };
    Ok(Stored { kind, bytes: plain.size_field() as usize, big_endian: plain.endianness() == Endianness::Big })
}

/// What a file that is no array seems to be, from its first bytes.
pub(super) fn name_content(start: &[u8]) -> String {
    match start {
        [b'P', b'K', ..] => "a zip archive (.npz?)".into(),
        [0x80, 2..=5, ..] => "a Python pickle".into(),
        [0x93, b'N', b'U', ..] => "a single NumPy array (.npy)".into(),
        _ if start.iter().all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace()) => {
            format!("a text that starts with {:?}", String::from_utf8_lossy(start))
        }
        _ => format!("a file that starts with the bytes {start:02x?}"),
    }
}
