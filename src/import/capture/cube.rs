//! An array of samples whose axes are known by name.

use std::path::Path;

use super::container::{self, Source};
use super::layout::{Axis, Layout};
use super::words::WordArray;
use crate::data::arrays::Kind;
use crate::data::{IfFrame, IfLayout};
use crate::error::{Error, Result};
use crate::radar::{Radar, Sampling};

/// Half of an unsigned 16-bit word's range: where a signed word's negative numbers begin.
const WRAP: f32 = 65536.0;

/// Where the numbers are.
enum Numbers {
    Array(Source),
    Words(WordArray),
}

/// An array whose axes are known by name. Its samples stay on the disk until a frame is asked for.
pub struct Cube {
    numbers: Numbers,
    layout: Layout,
    /// Set by `check`: how many transmitters take turns along an axis of chirps, or share one of antennas.
    transmitters: std::cell::Cell<usize>,
    /// Negative numbers were stored as unsigned words.
    pub wrapped: bool,
}

impl Cube {
    /// Finds the array in its file, holds the number of axes against the layout, and looks at the first frame's numbers.
    pub fn open(path: &Path, variable: Option<&str>, layout: Layout) -> Result<Self> {
        Self::of(container::open(path, variable, layout.axes.len())?, layout)
    }

    /// An array that was found.
    pub fn of(source: Source, layout: Layout) -> Result<Self> {
        if source.shape().len() != layout.axes.len() {
            return Err(source
                .wrong(source.describe(), format!("{} axes: {}", layout.axes.len(), layout.describe()))
                .with_hint("write --layout with one word for every axis of the array"));
        }
        let pairs = layout.place(Axis::Iq).map(|place| source.shape()[place]);
        if pairs.is_some_and(|pairs| pairs != 2) || pairs.is_some() && source.is_complex() {
            return Err(source
                .wrong(source.describe(), "an axis `iq` of length 2 and real numbers")
                .with_hint("leave `iq` out of --layout where every number has an imaginary part"));
        }
        if let Some(number) = layout.number.filter(|number| (number.kind, number.bytes) != source.number()) {
            return Err(source
                .wrong(source.describe(), format!("numbers of type {}, as --layout states", number.name()))
                .with_hint("leave the type out: the file states it"));
        }
        let mut cube = Self { numbers: Numbers::Array(source), layout, transmitters: 1.into(), wrapped: false };
        cube.wrapped = cube.looks_wrapped()?;
        Ok(cube)
    }

    /// Files of nothing but little-endian 16-bit words, frame after frame.
    pub fn of_words(words: WordArray, layout: Layout) -> Self {
        Self { numbers: Numbers::Words(words), layout, transmitters: 1.into(), wrapped: false }
    }

    fn shape(&self) -> &[usize] {
        match &self.numbers {
            Numbers::Array(source) => source.shape(),
            Numbers::Words(words) => &words.shape,
        }
    }

    pub fn describe(&self) -> String {
        match &self.numbers {
            Numbers::Array(source) => source.describe(),
            Numbers::Words(words) => format!("int16 {:?}", words.shape),
        }
    }

    /// The error for what is wrong about the array.
    pub fn wrong(&self, found: String, expected: String) -> Error {
        match &self.numbers {
            Numbers::Array(source) => source.wrong(found, expected),
            Numbers::Words(words) => Error::field(words.words.first(), "samples", found, expected),
        }
    }

    /// The length of an axis, 1 where the array has none.
    pub fn length(&self, axis: Axis) -> usize {
        self.layout.place(axis).map_or(1, |place| self.shape()[place])
    }

    pub fn has(&self, axis: Axis) -> bool {
        self.layout.place(axis).is_some()
    }

    pub fn frames(&self) -> usize {
        self.length(Axis::Frame)
    }

    /// Samples of a chirp.
    pub fn samples(&self) -> usize {
        self.length(Axis::Sample) * self.length(Axis::Lane)
    }

    pub fn sampling(&self) -> Sampling {
        let complex = matches!(&self.numbers, Numbers::Array(source) if source.is_complex()) || self.has(Axis::Iq);
        if complex { Sampling::Complex } else { Sampling::Real }
    }

    /// Whether it is words as a capture card leaves them.
    pub fn holds_words(&self) -> bool {
        matches!(&self.numbers, Numbers::Words(_))
    }

    pub fn holds_floats(&self) -> bool {
        matches!(&self.numbers, Numbers::Array(source) if source.number().0 == Kind::Float)
    }

    /// How a recording stores these numbers: whole ones of 16 bits as codes.
    pub fn stored_as(&self) -> IfLayout {
        let codes = match &self.numbers {
            Numbers::Array(source) => source.holds_codes(),
            Numbers::Words(_) => true,
        };
        match (self.sampling(), self.wrapped || codes) {
            (Sampling::Complex, true) => IfLayout::Codes,
            (Sampling::Complex, false) => IfLayout::Complex,
            (Sampling::Real, true) => IfLayout::RealCodes,
            (Sampling::Real, false) => IfLayout::Real,
        }
    }

    /// Refuses a radar of other lengths.
    pub fn check(&self, radar: &Radar) -> Result<()> {
        let [frames, tx, rx, loops, samples] = radar.dims();
        let expected = self.layout.axes.iter().map(|axis| match axis {
            Axis::Frame => frames,
            Axis::Tx => tx,
            Axis::Rx => rx,
            Axis::Loop => loops,
            Axis::Chirp => loops * tx,
            Axis::Antenna => tx * rx,
            Axis::Sample => samples / self.length(Axis::Lane),
            Axis::Lane => self.length(Axis::Lane),
            Axis::Iq => 2,
        });
        let expected: Vec<usize> = expected.collect();
        let chirps: usize =
            [Axis::Chirp, Axis::Tx, Axis::Loop, Axis::Rx, Axis::Antenna].map(|axis| self.length(axis)).iter().product();
        if expected != self.shape() || chirps != tx * rx * loops || self.samples() != samples || self.frames() != frames {
            let what =
                format!("{expected:?} for {} of {tx} tx, {rx} rx, {loops} loops, {samples} samples", self.layout.describe());
            return Err(self
                .wrong(self.describe(), what)
                .with_hint("the radar's settings or --layout do not belong to this array"));
        }
        if radar.sampling != self.sampling() {
            let numbers = if radar.sampling == Sampling::Real { "real numbers" } else { "complex numbers, or an axis `iq`" };
            return Err(self
                .wrong(self.describe(), format!("{numbers}, as radar.sampling states"))
                .with_hint("leave radar.sampling out where the array is right: whether it has imaginary parts says the same"));
        }
        self.transmitters.set(tx);
        Ok(())
    }

    /// The samples of a frame as `[tx, rx, loop, sample]`.
    ///
    /// # Errors
    /// A file that cannot be read; a sample that is not finite.
    pub fn frame(&self, index: usize) -> Result<IfFrame> {
        let (re, im) = self.numbers(index)?;
        let n_tx = self.transmitters.get();
        let n_rx = self.length(Axis::Rx) * self.length(Axis::Antenna) / if self.has(Axis::Antenna) { n_tx } else { 1 };
        let senders = if self.has(Axis::Antenna) { 1 } else { n_tx };
        let loops = self.length(Axis::Loop) * self.length(Axis::Chirp) * self.length(Axis::Tx) / senders;
        let (samples, lanes) = (self.samples(), self.length(Axis::Lane));
        let inner: Vec<Axis> = self.layout.axes.iter().copied().filter(|axis| *axis != Axis::Frame).collect();
        let mut strides = vec![1; inner.len()];
        for place in (1..inner.len()).rev() {
            strides[place - 1] = strides[place] * self.length(inner[place]);
        }
        let stride = |axis: Axis| inner.iter().position(|other| *other == axis).map_or(0, |place| strides[place]);
        let count = n_tx * n_rx * loops * samples;
        let (mut real, mut imaginary) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for tx in 0..n_tx {
            for rx in 0..n_rx {
                for index in 0..loops {
                    let start = tx * stride(Axis::Tx)
                        + rx * stride(Axis::Rx)
                        + (tx * n_rx + rx) * stride(Axis::Antenna)
                        + index * stride(Axis::Loop)
                        + (index * n_tx + tx) * stride(Axis::Chirp);
                    let (sample_stride, lane_stride, iq_stride) = (stride(Axis::Sample), stride(Axis::Lane), stride(Axis::Iq));
                    for sample in 0..samples {
                        let place = start + sample / lanes * sample_stride + sample % lanes * lane_stride;
                        real.push(re[place]);
                        match &im {
                            Some(im) => imaginary.push(im[place]),
                            None if iq_stride > 0 => imaginary.push(re[place + iq_stride]),
                            None => {}
                        }
                    }
                }
            }
        }
        let quadrature = self.sampling() == Sampling::Complex;
        let frame = IfFrame::new([n_tx, n_rx, loops, samples], real, quadrature.then_some(imaginary));
        match frame.first_non_finite() {
            None => Ok(frame),
            Some(place) => Err(self.not_finite(index, &place)),
        }
    }

    /// The error for a sample that is NaN or infinite, also one that is too large for single precision.
    fn not_finite(&self, frame: usize, place: &str) -> Error {
        let frame = if self.has(Axis::Frame) { format!("frame {frame}, ") } else { String::new() };
        self.wrong(format!("NaN or infinite at {frame}{place}"), "finite samples".into())
            .with_hint("no converter writes such a sample: correct what wrote the file, or leave this frame out")
    }

    /// A frame's numbers in the array's order without its axis of frames; the imaginary parts of complex ones apart.
    fn numbers(&self, frame: usize) -> Result<(Vec<f32>, Option<Vec<f32>>)> {
        let (mut re, mut im) = match &self.numbers {
            Numbers::Array(source) => source.numbers(self.layout.place(Axis::Frame), frame)?,
            Numbers::Words(words) => (words.frame(frame)?, None),
        };
        for value in re.iter_mut().chain(im.iter_mut().flatten()).filter(|value| self.wrapped && **value >= WRAP / 2.0) {
            *value -= WRAP;
        }
        Ok((re, im))
    }

    /// Whether signed 16-bit words were stored as unsigned ones.
    ///
    /// Read as unsigned, a signed signal jumps by 65,536 at every change of sign; read as signed, an unsigned one
    /// around half scale does. Whichever reading has the smaller variance is the signal.
    fn looks_wrapped(&self) -> Result<bool> {
        let (re, im) = self.numbers(0)?;
        let values: Vec<f32> = re.into_iter().chain(im.into_iter().flatten()).collect();
        let words = values.iter().all(|value| value.fract() == 0.0 && (0.0..WRAP).contains(value));
        if !words || values.iter().all(|&value| value < WRAP / 2.0) {
            return Ok(false);
        }
        let variance = |signed: bool| {
            let value = |&value: &f32| f64::from(if signed && value >= WRAP / 2.0 { value - WRAP } else { value });
            let mean = values.iter().map(value).sum::<f64>() / values.len() as f64;
            values.iter().map(|entry| (value(entry) - mean).powi(2)).sum::<f64>()
        };
        Ok(variance(true) < variance(false))
    }
}

/// Says what the numbers of unsigned codes mean.
pub fn half_scale_note(cube: &Cube) -> Result<Option<String>> {
    if cube.wrapped {
        return Ok(Some("numbers up to 65535 are signed words that were stored as unsigned ones: 65535 is read as -1".into()));
    }
    if !matches!(&cube.numbers, Numbers::Array(source) if source.number().0 == Kind::Unsigned) {
        return Ok(None);
    }
    let (re, _) = cube.numbers(0)?;
    let mean = re.iter().map(|&value| f64::from(value)).sum::<f64>() / re.len() as f64;
    Ok(Some(format!("unsigned codes around {mean:.0} are kept as they are: their mean is a static offset")))
}
