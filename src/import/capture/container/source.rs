//! An array whose numbers lie on the disk: its shape, its type, and a way to read a frame.

use std::cell::OnceCell;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use num_complex::Complex;

use super::{Laid, Plane};
use crate::data::arrays::{Element, Kind};
use crate::data::{Scratch, files};
use crate::error::{Error, Result};

/// One array of a file.
pub struct Source {
    path: PathBuf,
    field: String,
    laid: Laid,
    /// All bytes of a plane, where frames do not lie one after the other.
    whole: Vec<OnceCell<Vec<u8>>>,
    /// Held until the numbers are not needed any more.
    _scratch: Scratch,
}

impl Source {
    /// # Errors
    /// An array without numbers, or of neither real nor complex ones.
    pub(super) fn new(path: &Path, field: String, laid: Laid, scratch: Scratch) -> Result<Self> {
        let whole = laid.planes.iter().map(|_| OnceCell::new()).collect();
        let source = Self { path: path.into(), field, laid, whole, _scratch: scratch };
        let is_number = |plane: &Plane| f32::accepts(plane.stored) || Complex::<f32>::accepts(plane.stored);
        if source.laid.planes.len() == 2 && source.laid.planes.iter().any(|plane| !f32::accepts(plane.stored))
            || !source.laid.planes.iter().all(is_number)
        {
            return Err(source.wrong(source.describe(), "real or complex numbers"));
        }
        if source.laid.shape.contains(&0) {
            return Err(source.wrong(source.describe(), "at least one sample"));
        }
        Ok(source)
    }

    /// Length of each axis, outer to inner as the file's own program counts them.
    pub fn shape(&self) -> &[usize] {
        &self.laid.shape
    }

    /// Whether every number has an imaginary part.
    pub fn is_complex(&self) -> bool {
        self.laid.planes.len() == 2 || self.laid.planes[0].stored.kind == Kind::Complex
    }

    /// Kind and bytes of the widest real number, or of a complex one.
    pub fn number(&self) -> (Kind, usize) {
        let of = |plane: &Plane| (plane.stored.kind, plane.stored.bytes);
        self.laid.planes.iter().map(of).max_by_key(|(_, bytes)| *bytes).expect("a source has a plane")
    }

    /// Whether all numbers are whole, of at most 16 bits.
    pub fn holds_codes(&self) -> bool {
        self.laid.planes.iter().all(|plane| match plane.stored.kind {
            Kind::Int => plane.stored.bytes <= 2,
            // Unsigned words of 16 bits do not fit signed ones.
            Kind::Unsigned => plane.stored.bytes == 1,
            _ => false,
        })
    }

    /// Such as `int16 [24, 1, 4, 64, 128, 2]`.
    pub fn describe(&self) -> String {
        let parts = if self.laid.planes.len() == 2 { " in two parts" } else { "" };
        format!("{}{parts} {:?}", self.laid.planes[0].stored.name(), self.laid.shape)
    }

    /// The error for what is wrong about the array.
    pub fn wrong(&self, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::field(&self.path, &self.field, found, expected)
    }

    /// The numbers at an index of the axis of frames (all of them where there is none), in C order of the other axes; the imaginary
    /// parts of complex ones apart.
    pub fn numbers(&self, axis: Option<usize>, index: usize) -> Result<(Vec<f32>, Option<Vec<f32>>)> {
        let mut planes = (0..self.laid.planes.len()).map(|plane| {
            let mut bytes = self.bytes(plane, axis, index).map_err(|source| Error::read(&self.path, source))?;
            let stored = self.laid.planes[plane].stored;
            if stored.kind == Kind::Complex {
                let values = Complex::<f32>::decode(stored, &mut bytes);
                return Ok((values.iter().map(|value| value.re).collect(), Some(values.iter().map(|value| value.im).collect())));
            }
            Ok((f32::decode(stored, &mut bytes), None))
        });
        let (re, im) = planes.next().expect("a source has a plane")?;
        match planes.next() {
            Some(second) => Ok((re, Some(second?.0))),
            None => Ok((re, im)),
        }
    }

    /// Numbers from one to the next along each axis.
    fn strides(&self) -> Vec<usize> {
        let shape = &self.laid.shape;
        let mut strides = vec![1; shape.len()];
        if self.laid.fortran {
            (1..shape.len()).for_each(|axis| strides[axis] = strides[axis - 1] * shape[axis - 1]);
        } else {
            (1..shape.len()).rev().for_each(|axis| strides[axis - 1] = strides[axis] * shape[axis]);
        }
        strides
    }

    fn bytes(&self, plane: usize, axis: Option<usize>, index: usize) -> std::io::Result<Vec<u8>> {
        let (Plane { file, start, stored }, shape, strides) = (&self.laid.planes[plane], &self.laid.shape, self.strides());
        let others: Vec<usize> = (0..shape.len()).filter(|other| Some(*other) != axis).collect();
        let (length, width) = (others.iter().map(|&other| shape[other]).product::<usize>(), stored.bytes);
        let read = |from: usize, count: usize| {
            let mut opened = files::regular(file)?;
            opened.seek(SeekFrom::Start(start + (from * width) as u64))?;
            let mut bytes = vec![0; count * width];
            opened.read_exact(&mut bytes).map(|()| bytes)
        };
        let own = axis.map_or(0, |axis| index * strides[axis]);
        // Where frames lie one after the other, one is read alone.
        let block = if axis.is_none_or(|axis| strides[axis] == length) {
            let block = read(own, length)?;
            if !self.laid.fortran {
                return Ok(block);
            }
            std::borrow::Cow::Owned(block)
        } else {
            if self.whole[plane].get().is_none() {
                let _ = self.whole[plane].set(read(0, shape.iter().product())?);
            }
            std::borrow::Cow::Borrowed(&self.whole[plane].get().expect("it was read")[own * width..])
        };
        let mut bytes = Vec::with_capacity(length * width);
        for rank in 0..length {
            let (mut rest, mut from) = (rank, 0);
            for &other in others.iter().rev() {
                from += rest % shape[other] * strides[other];
                rest /= shape[other];
            }
            bytes.extend(&block[from * width..(from + 1) * width]);
        }
        Ok(bytes)
    }
}
