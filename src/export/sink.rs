//! Files of named arrays, whatever their format.

use std::path::Path;

use serde_json::{Map, json};

use crate::data::arrays::{NpzWriter, Values};
use crate::error::Result;

/// An array as its reader must understand it.
#[derive(Clone, Copy, Debug)]
pub struct Layout<'a> {
    pub name: &'a str,
    /// Outer to inner, separated by blanks, such as `frame tx rx loop sample`.
    pub axes: &'a str,
    /// Empty where the numbers have none.
    pub unit: &'a str,
    pub shape: &'a [usize],
}

/// A file that takes arrays one after the other.
pub trait Sink {
    /// Begins an array of numbers of the kind of `kind`, whose values are not looked at.
    fn begin(&mut self, layout: Layout, kind: Values) -> Result<()>;

    /// The next numbers of the array that was begun, in C order.
    fn push(&mut self, values: Values) -> Result<()>;

    fn text(&mut self, name: &str, text: &str) -> Result<()>;

    /// Gives the file its name.
    fn finish(self: Box<Self>) -> Result<()>;

    /// A whole array.
    fn array(&mut self, layout: Layout, values: Values) -> Result<()> {
        self.begin(layout, values)?;
        self.push(values)
    }
}

/// NumPy's archive, with the text `axes`: JSON that names the axes and the unit of every array.
pub struct NpzSink {
    writer: NpzWriter,
    axes: Map<String, serde_json::Value>,
}

impl NpzSink {
    pub fn create(path: &Path) -> Result<Self> {
        Ok(Self { writer: NpzWriter::create(path)?, axes: Map::new() })
    }
}

impl Sink for NpzSink {
    fn begin(&mut self, layout: Layout, kind: Values) -> Result<()> {
        let axes: Vec<&str> = layout.axes.split_whitespace().collect();
        assert_eq!(axes.len(), layout.shape.len(), "axes {axes:?} of array `{}` of shape {:?}", layout.name, layout.shape);
        self.axes.insert(layout.name.into(), json!({ "axes": axes, "unit": layout.unit }));
        self.writer.begin(layout.name, layout.shape, kind)
    }

    fn push(&mut self, values: Values) -> Result<()> {
        self.writer.push(values)
    }

    fn text(&mut self, name: &str, text: &str) -> Result<()> {
        self.writer.text(name, text)
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        let axes = serde_json::Value::Object(self.axes).to_string();
        self.writer.text("axes", &axes)?;
        self.writer.finish()
    }
}
