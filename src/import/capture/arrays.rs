//! Samples in a NumPy array of any order of axes.

use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use num_complex::Complex;
use toml::{Table, Value};

use super::boards::Board;
use super::layout::Axis;
use super::{Capture, Layout, Stated};
use crate::data::arrays::{Element, Header, Kind, Problem, field_of, open as open_file};
use crate::data::read_toml;
use crate::data::settings::settings_from_table;
use crate::data::{IfFrame, IfLayout, files};
use crate::error::{Error, Result};
use crate::radar::{Radar, Sampling};

/// Half of an unsigned 16-bit word's range: where a signed word's negative numbers begin.
const WRAP: f32 = 65536.0;

/// An array whose axes are known by name. Its samples stay on the disk until a frame is asked for.
pub struct Cube {
    path: PathBuf,
    header: Header,
    layout: Layout,
    /// Set by `check`: how many transmitters take turns along an axis of chirps.
    transmitters: std::cell::Cell<usize>,
    /// Negative numbers were stored as unsigned words.
    wrapped: bool,
}

impl Cube {
    /// Reads the header, holds the number of axes against the layout, and looks at the first frame's numbers.
    pub fn open(path: &Path, layout: Layout) -> Result<Self> {
        let (mut reader, size) = open_file(path)?;
        let header = Header::read(&mut reader, size)
            .and_then(|header| header.check_size(size).map(|()| header))
            .and_then(|header| {
                if header.shape.len() == layout.0.len() {
                    return Ok(header);
                }
                Err(Problem::new(header.describe(), format!("{} axes: {}", layout.0.len(), layout.describe()))
                    .with_hint("write --layout with one word for every axis of the array"))
            })
            .map_err(|problem| problem.at(path, &field_of(path)))?;
        let pairs = layout.place(Axis::Iq).map(|place| header.shape[place]);
        let complex = header.stored.kind == Kind::Complex;
        if pairs.is_some_and(|pairs| pairs != 2) || pairs.is_some() && complex {
            return Err(Error::field(path, field_of(path), header.describe(), "an axis `iq` of length 2 and real numbers"));
        }
        if header.shape.contains(&0) {
            return Err(Error::field(path, field_of(path), header.describe(), "at least one sample"));
        }
        let mut cube = Self { path: path.into(), header, layout, transmitters: 1.into(), wrapped: false };
        cube.wrapped = cube.looks_wrapped()?;
        Ok(cube)
    }

    /// The length of an axis, 1 where the array has none.
    fn length(&self, axis: Axis) -> usize {
        self.layout.place(axis).map_or(1, |place| self.header.shape[place])
    }

    pub fn frames(&self) -> usize {
        self.length(Axis::Frame)
    }

    pub fn sampling(&self) -> Sampling {
        let complex = self.header.stored.kind == Kind::Complex || self.layout.place(Axis::Iq).is_some();
        if complex { Sampling::Complex } else { Sampling::Real }
    }

    /// How a recording stores these numbers: whole ones of 16 bits as codes.
    pub fn stored_as(&self) -> IfLayout {
        let codes = match self.header.stored.kind {
            Kind::Int => self.header.stored.bytes <= 2,
            // Unsigned words of 16 bits do not fit signed ones: they stay numbers.
            Kind::Unsigned => self.header.stored.bytes == 1 || self.wrapped,
            _ => self.wrapped,
        };
        match (self.sampling(), codes) {
            (Sampling::Complex, true) => IfLayout::Codes,
            (Sampling::Complex, false) => IfLayout::Complex,
            (Sampling::Real, true) => IfLayout::RealCodes,
            (Sampling::Real, false) => IfLayout::Real,
        }
    }

    /// Refuses a radar of other lengths.
    pub fn check(&self, radar: &Radar) -> Result<()> {
        let [frames, tx, rx, loops, samples] = radar.dims();
        let expected = self.layout.0.iter().map(|axis| match axis {
            Axis::Frame => frames,
            Axis::Tx => tx,
            Axis::Rx => rx,
            Axis::Loop => loops,
            Axis::Chirp => loops * tx,
            Axis::Sample => samples,
            Axis::Iq => 2,
        });
        let expected: Vec<usize> = expected.collect();
        let covered = self.length(Axis::Chirp) * self.length(Axis::Tx) * self.length(Axis::Loop) == tx * loops;
        if expected != self.header.shape || !covered || self.length(Axis::Rx) != rx || self.frames() != frames {
            let what =
                format!("{expected:?} for {} of {tx} tx, {rx} rx, {loops} loops, {samples} samples", self.layout.describe());
            return Err(Error::field(&self.path, field_of(&self.path), self.header.describe(), what)
                .with_hint("the radar's settings or --layout do not belong to this array"));
        }
        if radar.sampling != self.sampling() {
            let found = format!("{:?}", radar.sampling).to_lowercase();
            let expected = format!("{:?}, as the array is", self.sampling()).to_lowercase();
            return Err(Error::setting("radar.sampling", found, expected));
        }
        self.transmitters.set(tx);
        Ok(())
    }

    /// The samples of a frame as `[tx, rx, loop, sample]`.
    pub fn frame(&self, index: usize) -> Result<IfFrame> {
        let (re, im) = self.numbers(index)?;
        let (n_tx, n_rx, samples) = (self.transmitters.get(), self.length(Axis::Rx), self.length(Axis::Sample));
        let loops = self.length(Axis::Loop) * self.length(Axis::Chirp) * self.length(Axis::Tx) / n_tx;
        let inner: Vec<Axis> = self.layout.0.iter().copied().filter(|axis| *axis != Axis::Frame).collect();
        let mut strides = vec![1; inner.len()];
        for place in (1..inner.len()).rev() {
            strides[place - 1] = strides[place] * self.length(inner[place]);
        }
        let stride = |axis: Axis| inner.iter().position(|other| *other == axis).map_or(0, |place| strides[place]);
        let [tx_stride, rx_stride, loop_stride, chirp_stride, sample_stride, iq_stride] =
            [Axis::Tx, Axis::Rx, Axis::Loop, Axis::Chirp, Axis::Sample, Axis::Iq].map(stride);
        let count = n_tx * n_rx * loops * samples;
        let (mut real, mut imaginary) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for tx in 0..n_tx {
            for rx in 0..n_rx {
                for index in 0..loops {
                    let start = tx * tx_stride + rx * rx_stride + index * loop_stride + (index * n_tx + tx) * chirp_stride;
                    for sample in 0..samples {
                        let place = start + sample * sample_stride;
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
        Ok(IfFrame::new([n_tx, n_rx, loops, samples], real, quadrature.then_some(imaginary)))
    }

    /// A frame's numbers in the array's order without its axis of frames; the imaginary parts of complex ones apart.
    fn numbers(&self, frame: usize) -> Result<(Vec<f32>, Option<Vec<f32>>)> {
        let mut bytes = self.bytes(frame).map_err(|source| Error::read(&self.path, source))?;
        let stored = self.header.stored;
        let unwrap = |value: f32| if self.wrapped && value >= WRAP / 2.0 { value - WRAP } else { value };
        if stored.kind == Kind::Complex {
            let values = Complex::<f32>::decode(stored, &mut bytes);
            return Ok((
                values.iter().map(|value| unwrap(value.re)).collect(),
                Some(values.iter().map(|value| unwrap(value.im)).collect()),
            ));
        }
        if !f32::accepts(stored) {
            return Err(Error::field(&self.path, field_of(&self.path), self.header.describe(), "real or complex numbers"));
        }
        Ok((f32::decode(stored, &mut bytes).into_iter().map(unwrap).collect(), None))
    }

    /// The bytes of a frame: read as they lie where frames are outermost, else gathered from the whole file.
    fn bytes(&self, frame: usize) -> std::io::Result<Vec<u8>> {
        let (width, shape) = (self.header.stored.bytes, &self.header.shape);
        let place = self.layout.place(Axis::Frame);
        let length: usize = shape.iter().enumerate().filter(|(axis, _)| Some(*axis) != place).map(|(_, length)| length).product();
        let mut file = files::regular(&self.path)?;
        if !self.header.fortran && place.is_none_or(|place| place == 0) {
            file.seek(SeekFrom::Start(self.header.data_start + (frame * length * width) as u64))?;
            let mut bytes = vec![0; length * width];
            file.read_exact(&mut bytes)?;
            return Ok(bytes);
        }
        let mut strides = vec![1; shape.len()];
        if self.header.fortran {
            (1..shape.len()).for_each(|axis| strides[axis] = strides[axis - 1] * shape[axis - 1]);
        } else {
            (1..shape.len()).rev().for_each(|axis| strides[axis - 1] = strides[axis] * shape[axis]);
        }
        file.seek(SeekFrom::Start(self.header.data_start))?;
        let mut whole = Vec::new();
        file.read_to_end(&mut whole)?;
        let mut bytes = Vec::with_capacity(length * width);
        for rank in 0..length {
            let (mut rest, mut from) = (rank, 0);
            for axis in (0..shape.len()).rev().filter(|axis| Some(*axis) != place) {
                from += rest % shape[axis] * strides[axis];
                rest /= shape[axis];
            }
            from += place.map_or(0, |place| frame * strides[place]);
            bytes.extend(&whole[from * width..(from + 1) * width]);
        }
        Ok(bytes)
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
    if cube.header.stored.kind != Kind::Unsigned {
        return Ok(None);
    }
    let (re, _) = cube.numbers(0)?;
    let mean = re.iter().map(|&value| f64::from(value)).sum::<f64>() / re.len() as f64;
    Ok(Some(format!("unsigned codes around {mean:.0} are kept as they are: their mean is a static offset")))
}

/// An array with `--layout`, and the radar of `--config`, `--board` and `--set`.
pub fn open(path: &Path, stated: &Stated) -> Result<Capture> {
    let layout = stated.layout.clone().ok_or_else(|| Error::Usage {
        message: format!("{}: the order of its axes is not known", path.display()),
        hint: Some("write it from the outermost to the innermost, such as --layout \"frame chirp rx sample\"".into()),
    })?;
    let cube = Cube::open(path, layout)?;
    let mut notes = Vec::new();
    let radar = radar(&cube, stated, &mut notes)?;
    cube.check(&radar)?;
    notes.extend(half_scale_note(&cube)?);
    Ok(Capture { layout: cube.stored_as(), radar, notes, frame: Box::new(move |index| cube.frame(index)) })
}

/// What the array itself says fills what the settings leave open.
fn radar(cube: &Cube, stated: &Stated, notes: &mut Vec<String>) -> Result<Radar> {
    #[derive(serde::Deserialize)]
    struct Settings {
        radar: Radar,
    }
    let mut table: Table = stated.configs.first().map(read_toml).transpose()?.unwrap_or_default();
    table.retain(|key, _| key == "radar");
    crate::data::settings::apply_sets(&mut table, &stated.sets)?;
    let radar = table.entry("radar").or_insert_with(|| Value::Table(Table::new()));
    let radar = radar.as_table_mut().ok_or_else(|| Error::setting("radar", "no table", "a table of the radar's settings"))?;
    let board = stated.board.as_deref().map(Board::named).transpose()?;
    let rows = |places: Vec<[f64; 3]>| {
        Value::Array(places.into_iter().map(|place| Value::Array(place.map(Value::Float).to_vec())).collect())
    };
    let antennas = |count: usize, of: &dyn Fn(usize) -> Option<[f64; 3]>| (0..count).map(of).collect::<Option<Vec<_>>>();
    if let Some(board) = board {
        notes.push(format!("antennas of the {} ({})", board.name, board.source));
        if let Some(rx) = antennas(cube.length(Axis::Rx), &|index| board.rx_m(index)) {
            radar.entry("rx_m").or_insert_with(|| rows(rx));
        }
        let count =
            if cube.layout.place(Axis::Chirp).is_some() { board.tx_half_wavelengths.len() } else { cube.length(Axis::Tx) };
        if let Some(tx) = antennas(count, &|index| board.tx_m(index)) {
            radar.entry("tx_m").or_insert_with(|| rows(tx));
        }
    }
    let transmitters = radar.get("tx_m").and_then(Value::as_array).map_or(1, Vec::len).max(1);
    let whole = |number: usize| Value::Integer(number as i64);
    radar.entry("frames").or_insert(whole(cube.frames()));
    radar.entry("samples_per_chirp").or_insert(whole(cube.length(Axis::Sample)));
    let loops = cube.length(Axis::Loop) * cube.length(Axis::Chirp)
        / if cube.layout.place(Axis::Chirp).is_some() { transmitters } else { 1 };
    radar.entry("loops_per_frame").or_insert(whole(loops));
    radar.entry("sampling").or_insert_with(|| Value::String(format!("{:?}", cube.sampling()).to_lowercase()));
    if !radar.contains_key("adc_start_s") {
        radar.insert("adc_start_s".into(), Value::Float(0.0));
        notes.push("adc_start_s is not stated: the first sample is taken to be at the start of the ramp".into());
    }
    let name = stated.configs.first().map_or(Path::new("--set"), |path| path.as_path());
    let settings: Settings = settings_from_table(table, name, &[])?;
    settings.radar.check("radar")?;
    Ok(settings.radar)
}
