//! `if.npy`: the samples, one frame at a time.

use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use num_complex::Complex;
use serde::{Deserialize, Serialize};

use crate::data::arrays::{Axes, Element, Header, Kind, Problem, Stored, describe, field_of, open, to_c_order};
use crate::data::files;
use crate::error::{Error, Result};
use crate::radar::{Radar, Sampling};

const AXES: [&str; 5] = ["frame", "tx", "rx", "loop", "sample"];

/// Bytes that are decoded at a time, so that a frame is not held as bytes and as numbers both.
const BLOCK: usize = 1 << 20;

/// What the samples in `if.npy` are; the axes before are always `[frame, tx, rx, loop, sample]`. The types are those that
/// are written; any whole, real or complex NumPy type of the same meaning is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IfLayout {
    /// `int16 [..., iq]`: ADC codes of a quadrature receiver.
    Codes,
    /// `complex64`.
    Complex,
    /// `int16`: ADC codes of a receiver without quadrature.
    RealCodes,
    /// `float32`, without quadrature.
    Real,
}

impl IfLayout {
    /// `Complex` where samples of this layout have a quadrature part, `Real` where they have none.
    pub fn sampling(self) -> Sampling {
        match self {
            Self::Codes | Self::Complex => Sampling::Complex,
            Self::RealCodes | Self::Real => Sampling::Real,
        }
    }

    /// NumPy's type string.
    pub(super) fn descr(self) -> &'static str {
        match self {
            Self::Codes | Self::RealCodes => "<i2",
            Self::Complex => "<c8",
            Self::Real => "<f4",
        }
    }

    /// The shape of a whole file.
    pub(super) fn shape(self, radar: &Radar) -> Vec<usize> {
        let mut shape = radar.dims().to_vec();
        shape.extend((self == Self::Codes).then_some(2));
        shape
    }

    fn of(sampling: Sampling, stored: Stored) -> Option<Self> {
        let is_complex = Complex::<f32>::accepts(stored);
        match (sampling, stored.kind) {
            (Sampling::Complex, _) if is_complex => Some(Self::Complex),
            (Sampling::Complex, Kind::Int | Kind::Unsigned) => Some(Self::Codes),
            (Sampling::Complex, Kind::Float) if f32::accepts(stored) => Some(Self::Complex),
            (Sampling::Real, Kind::Int | Kind::Unsigned) => Some(Self::RealCodes),
            (Sampling::Real, Kind::Float) if f32::accepts(stored) => Some(Self::Real),
            _ => None,
        }
    }
}

/// The axes of a file; `iq`: the two parts of a sample lie side by side as real numbers.
fn axes(dims: [usize; 5], iq: bool) -> Vec<(&'static str, Option<usize>)> {
    let mut axes: Vec<_> = AXES.into_iter().zip(dims.map(Some)).collect();
    axes.extend(iq.then_some(("iq", Some(2))));
    axes
}

/// The IF samples of one frame, in the units of the file: ADC codes, or whatever its floats are.
#[derive(Clone, Debug, PartialEq)]
pub struct IfFrame {
    /// `[tx, rx, loop, sample]`.
    pub dims: [usize; 4],
    /// In-phase part, in C order.
    pub re: Vec<f32>,
    /// Quadrature part; absent where the receiver has none.
    pub im: Option<Vec<f32>>,
}

impl IfFrame {
    /// Panics when the numbers of samples do not fit the axes: that is a bug.
    pub fn new(dims: [usize; 4], re: Vec<f32>, im: Option<Vec<f32>>) -> Self {
        let count: usize = dims.iter().product();
        assert_eq!(re.len(), count, "in-phase samples for [tx, rx, loop, sample] = {dims:?}");
        assert!(im.as_ref().is_none_or(|im| im.len() == count), "quadrature samples for [tx, rx, loop, sample] = {dims:?}");
        Self { dims, re, im }
    }

    /// Where a sample is in `re` and `im`.
    pub fn position(&self, tx: usize, rx: usize, index: usize, sample: usize) -> usize {
        let [_, n_rx, loops, samples] = self.dims;
        ((tx * n_rx + rx) * loops + index) * samples + sample
    }

    /// One sample; without quadrature its imaginary part is zero.
    pub fn sample(&self, tx: usize, rx: usize, index: usize, sample: usize) -> Complex<f32> {
        let position = self.position(tx, rx, index, sample);
        Complex::new(self.re[position], self.im.as_ref().map_or(0.0, |im| im[position]))
    }

    /// All samples in C order; without quadrature their imaginary parts are zero.
    pub fn complex(&self) -> impl Iterator<Item = Complex<f32>> + '_ {
        let im = self.im.iter().flatten().copied().chain(std::iter::repeat(0.0));
        self.re.iter().copied().zip(im).map(|(re, im)| Complex::new(re, im))
    }

    /// The first sample that is not finite, as `tx 0, rx 1, loop 2, sample 3`.
    pub fn first_non_finite(&self) -> Option<String> {
        let bad = |values: &[f32]| values.iter().position(|value| !value.is_finite());
        let position = bad(&self.re).into_iter().chain(self.im.as_deref().and_then(bad)).min()?;
        let [_, n_rx, loops, samples] = self.dims;
        let (chirp, sample) = (position / samples, position % samples);
        let (tx, rx) = (chirp / loops / n_rx, chirp / loops % n_rx);
        Some(format!("tx {tx}, rx {rx}, loop {}, sample {sample}", chirp % loops))
    }
}

/// The error for samples that are NaN or infinite.
pub(super) fn not_finite(path: &Path, frame: usize, place: &str) -> Error {
    Error::field(path, field_of(path), format!("NaN or infinite at frame {frame}, {place}"), "finite samples")
}

/// The samples' file: its header, held against the radar.
#[derive(Clone, Debug)]
pub(super) struct IfFile {
    path: PathBuf,
    header: Header,
    layout: IfLayout,
    dims: [usize; 5],
}

impl IfFile {
    pub fn open(path: PathBuf, radar: &Radar) -> Result<Self> {
        let (mut reader, size) = open(&path)?;
        let dims = radar.dims();
        let checked = Header::read(&mut reader, size).and_then(|header| {
            let layout = IfLayout::of(radar.sampling, header.stored).ok_or_else(|| other_kind(&header, radar))?;
            let iq = layout.sampling() == Sampling::Complex && header.stored.kind != Kind::Complex;
            let axes = axes(dims, iq);
            let expected = || format!("{} {}", header.stored.name(), describe(&axes));
            header.check_shape(&axes, expected).map_err(|problem| match sampling_hint(&header, radar) {
                Some(hint) => problem.with_hint(hint),
                None => problem,
            })?;
            header.check_size(size)?;
            Ok((header, layout))
        });
        let (header, layout) = checked.map_err(|problem| problem.at(&path, &field_of(&path)))?;
        Ok(Self { path, header, layout, dims })
    }

    pub fn layout(&self) -> IfLayout {
        self.layout
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// NumPy's name of the stored numbers, such as `int16`.
    pub fn number_type(&self) -> String {
        self.header.stored.name()
    }

    pub fn frame(&self, index: usize) -> Result<IfFrame> {
        let [frames, tx, rx, loops, samples] = self.dims;
        assert!(index < frames, "frame {index} of a recording of {frames}");
        let count = tx * rx * loops * samples;
        let part = || Vec::with_capacity(count);
        let mut parts = Parts { re: part(), im: (self.layout.sampling() == Sampling::Complex).then(part) };
        let read = if self.header.fortran { self.read_strided(index, &mut parts) } else { self.read_block(index, &mut parts) };
        read.map_err(|source| Error::read(&self.path, source))?;
        let frame = IfFrame::new([tx, rx, loops, samples], parts.re, parts.im);
        match frame.first_non_finite() {
            None => Ok(frame),
            Some(place) => Err(not_finite(&self.path, index, &place)),
        }
    }

    /// Bytes of one frame.
    fn frame_bytes(&self) -> usize {
        self.header.data_bytes() as usize / self.dims[0]
    }

    /// A frame in C order: a piece of the file, decoded block by block.
    fn read_block(&self, index: usize, parts: &mut Parts) -> std::io::Result<()> {
        let (stored, mut left) = (self.header.stored, self.frame_bytes());
        let mut file = files::regular(&self.path)?;
        file.seek(SeekFrom::Start(self.header.data_start + (index * left) as u64))?;
        let mut block = vec![0; left.min(BLOCK)];
        while left > 0 {
            let length = left.min(block.len());
            file.read_exact(&mut block[..length])?;
            match stored.kind {
                Kind::Complex => parts.push_complex(&Complex::decode(stored, &mut block[..length])),
                _ => parts.push(&f32::decode(stored, &mut block[..length])),
            }
            left -= length;
        }
        Ok(())
    }

    /// A frame in Fortran order: the whole file goes by, and every so-manieth number is kept.
    fn read_strided(&self, index: usize, parts: &mut Parts) -> std::io::Result<()> {
        let (frames, stored, length) = (self.dims[0], self.header.stored, self.frame_bytes());
        let (width, shape) = (stored.bytes, &self.header.shape[1..]);
        let mut file = files::regular(&self.path)?;
        file.seek(SeekFrom::Start(self.header.data_start))?;
        let mut bytes = Vec::with_capacity(length);
        let mut block = vec![0; width * frames * BLOCK.div_ceil(width * frames)];
        let mut left = length * frames;
        while left > 0 {
            let part = left.min(block.len());
            file.read_exact(&mut block[..part])?;
            block[..part].chunks(width * frames).for_each(|row| bytes.extend(&row[index * width..(index + 1) * width]));
            left -= part;
        }
        match stored.kind {
            Kind::Complex => parts.push_complex(&to_c_order(Complex::decode(stored, &mut bytes), shape)),
            _ => parts.push(&to_c_order(f32::decode(stored, &mut bytes), shape)),
        }
        Ok(())
    }
}

/// The samples of a frame, as far as they are read.
struct Parts {
    re: Vec<f32>,
    im: Option<Vec<f32>>,
}

impl Parts {
    /// Real numbers: samples, or the two parts of each in turn. A block holds whole pairs: its length is a power of two.
    fn push(&mut self, values: &[f32]) {
        match &mut self.im {
            None => self.re.extend_from_slice(values),
            Some(im) => {
                let pairs: &[[f32; 2]] = values.as_chunks().0;
                self.re.extend(pairs.iter().map(|pair| pair[0]));
                im.extend(pairs.iter().map(|pair| pair[1]));
            }
        }
    }

    fn push_complex(&mut self, values: &[Complex<f32>]) {
        self.re.extend(values.iter().map(|value| value.re));
        self.im.iter_mut().for_each(|im| im.extend(values.iter().map(|value| value.im)));
    }
}

/// Numbers that cannot be samples of this receiver.
fn other_kind(header: &Header, radar: &Radar) -> Problem {
    let of = |iq: bool| describe(&axes(radar.dims(), iq) as Axes);
    let expected = match radar.sampling {
        Sampling::Complex => format!("real numbers {} or complex numbers {}", of(true), of(false)),
        Sampling::Real => format!("real numbers {}", of(false)),
    };
    let problem = Problem::new(header.describe(), expected);
    match sampling_hint(header, radar) {
        Some(hint) => problem.with_hint(hint),
        None => problem,
    }
}

/// When the file looks like the other kind of receiver.
fn sampling_hint(header: &Header, radar: &Radar) -> Option<&'static str> {
    let (axes, kind) = (header.shape.len(), header.stored.kind);
    match radar.sampling {
        Sampling::Complex if axes == 5 && kind != Kind::Complex => {
            Some("a receiver without quadrature needs radar.sampling = \"real\" in recording.toml")
        }
        Sampling::Real if kind == Kind::Complex || axes == 6 && header.shape[5] == 2 => {
            Some("a quadrature receiver needs radar.sampling = \"complex\" in recording.toml")
        }
        _ => None,
    }
}
