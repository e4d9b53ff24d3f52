//! Writing arrays, always atomically and always the same bytes for the same values.

use std::io::{self, Write};
use std::path::Path;

use npyz::WriterBuilder;
use num_complex::Complex;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::data::atomic::{AtomicFile, write_file};
use crate::error::{Error, Result};

/// Numbers to write, in C order.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    Bool(&'a [bool]),
    I16(&'a [i16]),
    I32(&'a [i32]),
    I64(&'a [i64]),
    U32(&'a [u32]),
    F32(&'a [f32]),
    F64(&'a [f64]),
    Complex64(&'a [Complex<f32>]),
}

/// One array of an archive.
#[derive(Clone, Debug)]
pub struct Member<'a> {
    pub name: &'a str,
    /// Lengths of the axes, the slowest first.
    pub shape: Vec<usize>,
    pub values: Values<'a>,
}

macro_rules! each_kind {
    ($values:expr, $slice:ident => $result:expr) => {
        match $values {
            Values::Bool($slice) => $result,
            Values::I16($slice) => $result,
            Values::I32($slice) => $result,
            Values::I64($slice) => $result,
            Values::U32($slice) => $result,
            Values::F32($slice) => $result,
            Values::F64($slice) => $result,
            Values::Complex64($slice) => $result,
        }
    };
}

impl Values<'_> {
    pub(super) fn len(&self) -> usize {
        each_kind!(self, slice => slice.len())
    }

    /// Bytes of one number.
    pub(super) fn width(&self) -> usize {
        fn of<T>(_: &[T]) -> usize {
            size_of::<T>()
        }
        each_kind!(self, slice => of(slice))
    }

    /// NumPy's type string.
    fn descr(&self) -> &'static str {
        match self {
            Self::Bool(_) => "|b1",
            Self::I16(_) => "<i2",
            Self::I32(_) => "<i4",
            Self::I64(_) => "<i8",
            Self::U32(_) => "<u4",
            Self::F32(_) => "<f4",
            Self::F64(_) => "<f8",
            Self::Complex64(_) => "<c8",
        }
    }

    /// Writes the numbers little-endian, in blocks, without a header.
    pub fn write_to(&self, writer: &mut impl Write) -> io::Result<()> {
        fn blocks<T: Copy, const N: usize>(
            writer: &mut impl Write,
            values: &[T],
            bytes: impl Fn(T) -> [u8; N],
        ) -> io::Result<()> {
            values.chunks(1 << 14).try_for_each(|block| {
                let encoded: Vec<u8> = block.iter().flat_map(|&value| bytes(value)).collect();
                writer.write_all(&encoded)
            })
        }
        match self {
            Self::Bool(values) => blocks(writer, values, |value| [u8::from(value)]),
            Self::I16(values) => blocks(writer, values, i16::to_le_bytes),
            Self::I32(values) => blocks(writer, values, i32::to_le_bytes),
            Self::I64(values) => blocks(writer, values, i64::to_le_bytes),
            Self::U32(values) => blocks(writer, values, u32::to_le_bytes),
            Self::F32(values) => blocks(writer, values, f32::to_le_bytes),
            Self::F64(values) => blocks(writer, values, f64::to_le_bytes),
            Self::Complex64(values) => blocks(writer, values, |value| {
                let mut bytes = [0; 8];
                bytes[..4].copy_from_slice(&value.re.to_le_bytes());
                bytes[4..].copy_from_slice(&value.im.to_le_bytes());
                bytes
            }),
        }
    }

    /// The header of an array of such numbers, up to the first one. The values themselves are not looked at.
    pub fn header(&self, shape: &[usize]) -> Vec<u8> {
        header_bytes(self.descr(), shape)
    }

    fn write_array(&self, shape: &[usize], writer: &mut impl Write) -> io::Result<()> {
        assert_eq!(shape.iter().product::<usize>(), self.len(), "an array of shape {shape:?} with another number of values");
        writer.write_all(&self.header(shape))?;
        self.write_to(writer)
    }
}

/// The header of a `.npy` file; `descr` is NumPy's type string, such as `<i2`.
pub fn header_bytes(descr: &str, shape: &[usize]) -> Vec<u8> {
    let shape: Vec<u64> = shape.iter().map(|&length| length as u64).collect();
    let dtype = npyz::DType::new_scalar(descr.parse().expect("a type string of NumPy"));
    npyz::WriteOptions::new_header_only()
        .dtype(dtype)
        .shape(&shape)
        .writer(Vec::new())
        .write_header_only()
        .expect("a header of plain numbers in memory")
}

/// Writes one array. Panics when the shape does not hold the values.
pub fn write_npy(path: impl AsRef<Path>, shape: &[usize], values: Values) -> Result<()> {
    write_file(path, |file| values.write_array(shape, file))
}

/// Writes named arrays, deflated. Panics when a shape does not hold its values.
pub fn write_npz(path: impl AsRef<Path>, members: &[Member]) -> Result<()> {
    let path = path.as_ref();
    // Archives can only be written where one can go back; they are small enough for memory.
    let mut archive = ZipWriter::new(io::Cursor::new(Vec::new()));
    let options =
        SimpleFileOptions::default().compression_method(CompressionMethod::Deflated).last_modified_time(DateTime::default());
    let mut write_all = || -> io::Result<()> {
        for member in members {
            let large = member.values.len() > 1 << 28;
            archive.start_file(format!("{}.npy", member.name), options.large_file(large))?;
            member.values.write_array(&member.shape, &mut archive)?;
        }
        Ok(())
    };
    write_all().map_err(|source| Error::write(path, source))?;
    let bytes = archive.finish().map_err(|error| Error::write(path, error.into()))?.into_inner();
    write_file(path, |file: &mut AtomicFile| file.write_all(&bytes))
}
