//! HDF5: `.h5` of h5py and others, and `.mat` of MATLAB 7.3.
//!
//! MATLAB writes its axes in reverse, so that the first one is the fastest; here they count as in MATLAB. Complex numbers are compounds
//! of two parts (MATLAB: `real`, `imag`; h5py: `r`, `i`).

use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hdf5_reader::error::{Error as Hdf5Error, Result as Hdf5Result};
use hdf5_reader::group::Group;
use hdf5_reader::{
    ByteOrder, Dataset, Datatype, FileStorage, H5Type, Hdf5File, OpenOptions, SliceInfo, SliceInfoElem, dtype_element_size,
};

use super::{Container, Entry, Laid, Other, Plane, opened};
use crate::data::arrays::{Kind, Stored};
use crate::error::{Error, Result};

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// MATLAB 7.3 has a block of its own before the file's.
const MATLAB_BLOCK: usize = 512;
/// Groups inside groups that are looked into.
const DEEPEST: usize = 8;
/// Bytes of one number that are kept: a complex128.
const WIDEST: usize = 16;

/// Whether a file is HDF5, from its first bytes.
pub(super) fn is_hdf5(path: &Path) -> Result<bool> {
    let (file, _) = opened(path)?;
    let mut start = Vec::new();
    file.take((MATLAB_BLOCK + SIGNATURE.len()) as u64).read_to_end(&mut start).map_err(|source| Error::read(path, source))?;
    Ok(start.starts_with(SIGNATURE) || start.get(MATLAB_BLOCK..).is_some_and(|rest| rest == SIGNATURE))
}

/// The bytes of one number, as they are stored.
#[derive(Clone)]
struct Cell([u8; WIDEST]);

impl H5Type for Cell {
    fn hdf5_type() -> Datatype {
        Datatype::FixedPoint { size: WIDEST as u8, signed: false, byte_order: ByteOrder::LittleEndian }
    }

    fn from_bytes(bytes: &[u8], dtype: &Datatype) -> Hdf5Result<Self> {
        let width = dtype_element_size(dtype)?;
        match bytes.get(..width).filter(|_| width <= WIDEST) {
            Some(own) => {
                let mut cell = [0; WIDEST];
                cell[..width].copy_from_slice(own);
                Ok(Self(cell))
            }
            None => Err(Hdf5Error::InvalidData(format!("a number of {width} bytes in {}", bytes.len()))),
        }
    }

    fn element_size(dtype: &Datatype) -> usize {
        dtype_element_size(dtype).unwrap_or(WIDEST)
    }
}

/// The parts of a number: where each begins within it, and how it lies there. None of what is no number.
fn parts(dtype: &Datatype) -> Option<Vec<(usize, Stored)>> {
    let stored =
        |kind: Kind, size: u8, order: ByteOrder| Stored { kind, bytes: size.into(), big_endian: order == ByteOrder::BigEndian };
    match dtype {
        Datatype::FixedPoint { size, signed, byte_order } => {
            Some(vec![(0, stored(if *signed { Kind::Int } else { Kind::Unsigned }, *size, *byte_order))])
        }
        Datatype::FloatingPoint { size, byte_order } => Some(vec![(0, stored(Kind::Float, *size, *byte_order))]),
        Datatype::Compound { size, fields } if fields.len() == 2 && *size as usize <= WIDEST => {
            let part = |field: &hdf5_reader::CompoundField| match &parts(&field.datatype)?[..] {
                [(0, stored)] if field.byte_offset as usize + stored.bytes <= *size as usize => {
                    Some((field.byte_offset as usize, *stored))
                }
                _ => None,
            };
            fields.iter().map(part).collect()
        }
        _ => None,
    }
}

pub(super) struct Hdf5 {
    path: PathBuf,
    datasets: Vec<(String, Dataset)>,
    others: Vec<Other>,
    is_matlab: bool,
}

impl Hdf5 {
    pub fn open(path: &Path) -> Result<Self> {
        if !is_hdf5(path)? {
            return Err(Error::field(path, "header", "another file", "HDF5 (.h5, or .mat of MATLAB 7.3)"));
        }
        let (mut file, size) = opened(path)?;
        let mut start = [0; 6];
        let is_matlab = file.read_exact(&mut start).is_ok() && &start == b"MATLAB";
        // What is read at once is a frame: no more than what any honest compression makes of the file.
        let most = usize::try_from(size.saturating_mul(1040)).unwrap_or(usize::MAX);
        let options: OpenOptions = Default::default();
        let options = options.with_max_read_bytes(most).with_max_chunk_bytes(most);
        let (mut datasets, mut others) = (vec![], vec![]);
        FileStorage::from_file(file)
            .and_then(|storage| Hdf5File::from_storage_with_options(Arc::new(storage), options))
            .and_then(|file| collect(&file.root_group()?, "", DEEPEST, &mut datasets, &mut others))
            .map_err(|error| damaged(path, "arrays", &error))?;
        Ok(Self { path: path.into(), datasets, others, is_matlab })
    }
}

fn damaged(path: &Path, field: &str, error: &Hdf5Error) -> Error {
    if let Hdf5Error::UnsupportedFilter(filter) = error {
        return Error::field(
            path,
            field,
            format!("compressed otherwise ({filter})"),
            "deflate, shuffle, scale-offset or Fletcher32",
        )
        .with_hint("write it with one of these: h5repack -f GZIP=4 FILE NEW");
    }
    Error::field(path, field, format!("damaged or cut off ({error})"), "HDF5 that can be read")
        .with_hint("copy or download the file again")
}

/// Every dataset of numbers in a group and below it, by its path, and what else there is.
fn collect(
    group: &Group,
    above: &str,
    depth: usize,
    found: &mut Vec<(String, Dataset)>,
    others: &mut Vec<Other>,
) -> Hdf5Result<()> {
    let (groups, datasets) = group.members()?;
    for dataset in datasets {
        let name = format!("{above}{}", dataset.name().rsplit('/').next().unwrap_or_default());
        match dataset.dtype() {
            kind if parts(kind).is_some() => found.push((name, dataset)),
            Datatype::Reference { .. } => others.push(Other { name, kind: "cells or an array of structures (references)" }),
            _ => others.push(Other { name, kind: "no number, nor a complex one" }),
        }
    }
    for group in groups {
        let own = group.name().rsplit('/').next().unwrap_or_default().to_string();
        // MATLAB keeps what its variables refer to in a group of its own.
        if own.starts_with('#') {
            continue;
        }
        let name = format!("{above}{own}");
        if depth > 0 {
            collect(&group, &format!("{name}/"), depth - 1, found, others)?;
        } else {
            others.push(Other { name, kind: "a group deeper than are looked into" });
        }
    }
    Ok(())
}

impl Container for Hdf5 {
    fn entries(&self) -> Vec<Entry> {
        let shape = |dataset: &Dataset| {
            let mut shape: Vec<usize> = dataset.shape().iter().map(|&length| length as usize).collect();
            if self.is_matlab {
                shape.reverse();
            }
            shape
        };
        self.datasets.iter().map(|(name, dataset)| Entry { name: name.clone(), shape: shape(dataset) }).collect()
    }

    fn others(&self) -> &[Other] {
        &self.others
    }

    fn lay_out(&mut self, name: &str, scratch: &Path) -> Result<Laid> {
        let (_, dataset) = self.datasets.iter().find(|(own, _)| own == name).expect("a name of the entries");
        let parts = parts(dataset.dtype()).expect("it was looked at");
        let file = |index: usize| scratch.join(format!("{}-{index}.raw", name.replace(['/', '\\'], "_")));
        let planes: Vec<Plane> =
            parts.iter().enumerate().map(|(index, (_, stored))| Plane { file: file(index), start: 0, stored: *stored }).collect();
        let create =
            |plane: &Plane| File::create(&plane.file).map(BufWriter::new).map_err(|source| Error::write(&plane.file, source));
        let mut writers = planes.iter().map(create).collect::<Result<Vec<_>>>()?;
        // One index of the outermost axis at a time.
        let outermost = dataset.shape().first().copied().unwrap_or(1);
        for index in 0..outermost {
            let mut selection = SliceInfo::all(dataset.ndim());
            if let Some(first) = selection.selections.first_mut() {
                *first = SliceInfoElem::Index(index);
            }
            let cells = dataset.read_slice::<Cell>(&selection).map_err(|error| damaged(&self.path, name, &error))?;
            for Cell(bytes) in &cells {
                for ((offset, stored), writer) in parts.iter().zip(&mut writers) {
                    writer.write_all(&bytes[*offset..offset + stored.bytes]).map_err(|source| Error::write(scratch, source))?;
                }
            }
        }
        writers.iter_mut().try_for_each(Write::flush).map_err(|source| Error::write(scratch, source))?;
        let shape = self.entries().into_iter().find(|entry| entry.name == name).expect("a name of the entries").shape;
        Ok(Laid { shape, fortran: self.is_matlab, planes })
    }
}
