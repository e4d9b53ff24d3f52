//! HDF5: `.h5` of h5py and others, and `.mat` of MATLAB 7.3.
//!
//! MATLAB writes its axes in reverse, so that the first one is the fastest; here they count as in MATLAB. Complex numbers are compounds
//! of two parts (MATLAB: `real`, `imag`; h5py: `r`, `i`).

use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use hdf5_pure::{CompoundMember, Dataset, Datatype, DatatypeByteOrder, Error as Hdf5Error, Group, ReadSeekSource};

use super::{Container, Entry, Laid, Plane, opened};
use crate::data::arrays::{Kind, Stored};
use crate::error::{Error, Result};

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// MATLAB 7.3 has a block of its own before the file's.
const MATLAB_BLOCK: usize = 512;
/// Groups inside groups that are looked into.
const DEEPEST: usize = 8;
/// Bytes of one number that are kept: a complex128.
const WIDEST: usize = 16;
/// Deflate cannot make data smaller than this; who claims more is lying.
const BEST_COMPRESSION: u64 = 1040;

/// Whether a file is HDF5, from its first bytes.
pub(super) fn is_hdf5(path: &Path) -> Result<bool> {
    let (file, _) = opened(path)?;
    let mut start = Vec::new();
    file.take((MATLAB_BLOCK + SIGNATURE.len()) as u64).read_to_end(&mut start).map_err(|source| Error::read(path, source))?;
    Ok(start.starts_with(SIGNATURE) || start.get(MATLAB_BLOCK..).is_some_and(|rest| rest == SIGNATURE))
}

/// The parts of a number: where each begins within it, and how it lies there. None of what is no number.
fn parts(kind: &Datatype) -> Option<Vec<(usize, Stored)>> {
    let stored = |kind: Kind, size: u32, order: DatatypeByteOrder| match order {
        DatatypeByteOrder::LittleEndian => Some(Stored { kind, bytes: size as usize, big_endian: false }),
        DatatypeByteOrder::BigEndian => Some(Stored { kind, bytes: size as usize, big_endian: true }),
        _ => None,
    };
    match kind {
        Datatype::FixedPoint { size, byte_order, layout } => {
            Some(vec![(0, stored(if layout.signed { Kind::Int } else { Kind::Unsigned }, *size, *byte_order)?)])
        }
        Datatype::FloatingPoint { size, byte_order, .. } => Some(vec![(0, stored(Kind::Float, *size, *byte_order)?)]),
        Datatype::Compound { size, members } if members.len() == 2 && *size as usize <= WIDEST => {
            let part = |member: &CompoundMember| match &parts(&member.datatype)?[..] {
                [(0, stored)] if member.byte_offset as usize + stored.bytes <= *size as usize => {
                    Some((member.byte_offset as usize, *stored))
                }
                _ => None,
            };
            members.iter().map(part).collect()
        }
        _ => None,
    }
}

/// A data set of numbers.
struct Found {
    name: String,
    shape: Vec<u64>,
    /// Bytes of one number, and its parts.
    width: usize,
    parts: Vec<(usize, Stored)>,
    dataset: Dataset,
}

pub(super) struct Hdf5 {
    path: PathBuf,
    datasets: Vec<Found>,
    is_matlab: bool,
    /// Bytes that are read at once at most: what any honest compression makes of the file.
    most: u64,
}

impl Hdf5 {
    pub fn open(path: &Path) -> Result<Self> {
        if !is_hdf5(path)? {
            return Err(Error::field(path, "header", "another file", "HDF5 (.h5, or .mat of MATLAB 7.3)"));
        }
        let (mut file, size) = opened(path)?;
        let mut start = [0; 6];
        let is_matlab = file.read_exact(&mut start).is_ok() && &start == b"MATLAB";
        let mut datasets = vec![];
        let source = ReadSeekSource::new(file).map_err(|error| damaged(path, "header", &error.into()))?;
        hdf5_pure::File::from_source(source)
            .and_then(|file| collect(&file.root(), "", DEEPEST, &mut datasets))
            .map_err(|error| damaged(path, "arrays", &error))?;
        Ok(Self { path: path.into(), datasets, is_matlab, most: size.saturating_mul(BEST_COMPRESSION) })
    }
}

fn damaged(path: &Path, field: &str, error: &Hdf5Error) -> Error {
    Error::field(path, field, format!("damaged or cut off ({error})"), "HDF5 that can be read")
        .with_hint("copy or download the file again")
}

/// Every data set of numbers in a group and below it, by its path.
fn collect(group: &Group, above: &str, depth: usize, found: &mut Vec<Found>) -> std::result::Result<(), Hdf5Error> {
    for name in group.datasets()? {
        let dataset = group.dataset(&name)?;
        let (kind, name) = (dataset.datatype()?, format!("{above}{name}"));
        if let (Some(parts), width) = (parts(&kind), dataset.element_size()? as usize) {
            found.push(Found { name, shape: dataset.shape()?, width, parts, dataset });
        }
    }
    for name in group.groups()?.into_iter().filter(|_| depth > 0) {
        // MATLAB keeps what its variables refer to in a group of its own.
        if !name.starts_with('#') {
            collect(&group.group(&name)?, &format!("{above}{name}/"), depth - 1, found)?;
        }
    }
    Ok(())
}

impl Container for Hdf5 {
    fn entries(&self) -> Vec<Entry> {
        let shape = |found: &Found| {
            let mut shape: Vec<usize> = found.shape.iter().map(|&length| length as usize).collect();
            if self.is_matlab {
                shape.reverse();
            }
            shape
        };
        self.datasets.iter().map(|found| Entry { name: found.name.clone(), shape: shape(found) }).collect()
    }

    fn lay_out(&mut self, name: &str, scratch: &Path) -> Result<Laid> {
        let found = self.datasets.iter().find(|found| found.name == name).expect("a name of the entries");
        let file = |index: usize| scratch.join(format!("{}-{index}.raw", name.replace(['/', '\\'], "_")));
        let planes: Vec<Plane> = found
            .parts
            .iter()
            .enumerate()
            .map(|(index, (_, stored))| Plane { file: file(index), start: 0, stored: *stored })
            .collect();
        let create =
            |plane: &Plane| File::create(&plane.file).map(BufWriter::new).map_err(|source| Error::write(&plane.file, source));
        let mut writers = planes.iter().map(create).collect::<Result<Vec<_>>>()?;
        // One index of the outermost axis at a time.
        let outermost = found.shape.first().copied().unwrap_or(1);
        let row = found.shape.iter().skip(1).try_fold(found.width as u64, |all, &length| all.checked_mul(length));
        let row = row.filter(|row| *row <= self.most).ok_or_else(|| {
            let found = format!("damaged: rows of {:?} numbers in a file of {} bytes", found.shape, self.most / BEST_COMPRESSION);
            Error::field(&self.path, name, found, "HDF5 that can be read").with_hint("copy or download the file again")
        })?;
        for index in 0..outermost {
            let bytes = found.dataset.read_raw_rows(index, 1).map_err(|error| damaged(&self.path, name, &error))?;
            if bytes.len() as u64 != row {
                let found = format!("{} bytes in row {index}", bytes.len());
                return Err(
                    Error::field(&self.path, name, found, format!("{row} bytes")).with_hint("copy or download the file again")
                );
            }
            for number in bytes.chunks_exact(found.width) {
                for ((offset, stored), writer) in found.parts.iter().zip(&mut writers) {
                    writer.write_all(&number[*offset..offset + stored.bytes]).map_err(|source| Error::write(scratch, source))?;
                }
            }
        }
        writers.iter_mut().try_for_each(Write::flush).map_err(|source| Error::write(scratch, source))?;
        let shape = self.entries().into_iter().find(|entry| entry.name == name).expect("a name of the entries").shape;
        Ok(Laid { shape, fortran: self.is_matlab, planes })
    }
}
