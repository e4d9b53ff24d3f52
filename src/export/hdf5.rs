//! `NAME.h5`: what `npz` writes, as HDF5. Every data set has the attributes `axes` and `unit`; complex numbers are h5py's
//! (a compound of `r` and `i`). Chunked by frame, shuffled and deflated.
//!
//! A file is built in memory: a recording of more than [`MOST_BYTES`] becomes `NAME_000.h5`, `NAME_001.h5`, ….

use std::io::Write;
use std::path::{Path, PathBuf};

use hdf5_pure::{
    AttrValue, CompoundTypeBuilder, Datatype, EnumTypeBuilder, FileBuilder, make_f32_type, make_f64_type, make_i8_type,
    make_i32_type,
};

use super::sink::{Layout, Sink};
use super::{Source, contents};
use crate::data::arrays::Values;
use crate::data::atomic::write_file;
use crate::error::{Error, Result};
use crate::radar::Sampling;

/// Samples of one file, bytes: it is held in memory two to three times while it is written.
const MOST_BYTES: usize = 256 << 20;

pub fn write(source: &mut Source, folder: &Path) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    let radar = &source.recording.radar;
    let [frames, rest @ ..] = radar.dims();
    let bytes = rest.iter().product::<usize>() * if radar.sampling == Sampling::Complex { 8 } else { 4 };
    let each = (MOST_BYTES / bytes).clamp(1, frames);
    for (part, start) in (0..frames).step_by(each).enumerate() {
        let suffix = if each < frames { format!("_{part:03}") } else { String::new() };
        let sink = Hdf5Sink::create(folder.join(format!("{}{suffix}.h5", source.name)));
        contents::write(source, start..(start + each).min(frames), Box::new(sink), &mut notes)?;
    }
    if each < frames {
        notes.push(format!("one file for every {each} frames"));
    }
    notes.dedup();
    Ok(notes)
}

struct Hdf5Sink {
    path: PathBuf,
    file: FileBuilder,
    /// The data set at hand.
    open: Option<Open>,
}

struct Open {
    name: String,
    axes: String,
    unit: String,
    shape: Vec<u64>,
    kind: Datatype,
    bytes: Vec<u8>,
}

impl Hdf5Sink {
    fn create(path: PathBuf) -> Self {
        Self { path, file: FileBuilder::new(), open: None }
    }

    /// Puts the data set at hand into the file.
    fn close(&mut self) {
        let Some(open) = self.open.take() else { return };
        let count = open.shape.iter().product();
        let set = self.file.create_dataset(&open.name);
        set.with_raw_data(open.kind, open.bytes, count).with_shape(&open.shape);
        set.set_attr("axes", AttrValue::String(open.axes)).set_attr("unit", AttrValue::String(open.unit));
        if let [outer, inner @ ..] = &open.shape[..]
            && *outer > 1
            && !inner.is_empty()
            && count > 0
        {
            let chunk: Vec<u64> = std::iter::once(1).chain(inner.iter().copied()).collect();
            set.with_chunks(&chunk).with_shuffle().with_deflate(4);
        }
    }
}

impl Sink for Hdf5Sink {
    fn begin(&mut self, layout: Layout, kind: Values) -> Result<()> {
        self.close();
        let kind = match kind {
            Values::F32(_) => make_f32_type(),
            Values::F64(_) => make_f64_type(),
            Values::I32(_) => make_i32_type(),
            // h5py's bool: an enumeration of one byte.
            Values::Bool(_) => {
                let truth = EnumTypeBuilder::with_base(make_i8_type()).value("FALSE", 0).value("TRUE", 1);
                truth.build().expect("two values of one byte")
            }
            Values::Complex64(_) => {
                let parts = CompoundTypeBuilder::new().field("r", make_f32_type()).field("i", make_f32_type());
                parts.build().expect("two fields of four bytes")
            }
            other => panic!("{other:?} has no type of HDF5 here"),
        };
        self.open = Some(Open {
            name: layout.name.into(),
            axes: layout.axes.into(),
            unit: layout.unit.into(),
            shape: layout.shape.iter().map(|&length| length as u64).collect(),
            kind,
            bytes: Vec::new(),
        });
        Ok(())
    }

    fn push(&mut self, values: Values) -> Result<()> {
        let open = self.open.as_mut().expect("a data set was begun");
        values.write_to(&mut open.bytes).map_err(|source| Error::write(&self.path, source))
    }

    fn text(&mut self, name: &str, text: &str) -> Result<()> {
        self.close();
        self.file.set_attr(name, AttrValue::String(text.into()));
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        self.close();
        let failed = |error: &dyn std::fmt::Display| Error::write(&self.path, std::io::Error::other(error.to_string()));
        let bytes = self.file.finish().map_err(|error| failed(&error))?;
        write_file(&self.path, |file| file.write_all(&bytes))
    }
}
