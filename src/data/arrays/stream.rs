//! Archives that grow array by array and block by block: no array is ever held whole.

use std::io::Write;
use std::path::{Path, PathBuf};

use zip::write::{SimpleFileOptions, StreamWriter};
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::{Values, header_bytes};
use crate::data::atomic::AtomicFile;
use crate::error::{Error, Result};

/// Beyond this many bytes an entry of a zip archive needs the fields of 64 bits, less a margin for the header.
const LARGE: u64 = (1 << 32) - (1 << 20);

/// A `.npz` file that is being written; it appears under its name when `finish` is called, and not at all otherwise.
pub struct NpzWriter {
    path: PathBuf,
    archive: ZipWriter<StreamWriter<AtomicFile>>,
    /// Name of the array at hand, and the numbers that it still lacks.
    open: Option<(String, usize)>,
}

impl NpzWriter {
    /// Begins an archive beside its target.
    ///
    /// # Errors
    /// A target without a name, or in a folder that cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref().to_path_buf();
        Ok(Self { archive: ZipWriter::new_stream(AtomicFile::create(&path)?), path, open: None })
    }

    /// Begins an array of numbers of the kind of `kind`, whose values are not looked at; `push` gives the numbers in C order.
    ///
    /// # Panics
    /// When the array before lacks numbers: that is a bug.
    pub fn begin(&mut self, name: &str, shape: &[usize], kind: Values) -> Result<()> {
        self.complete();
        let count: usize = shape.iter().product();
        self.entry(name, &kind.header(shape), (count * kind.width()) as u64)?;
        self.open = Some((name.into(), count));
        Ok(())
    }

    /// The next numbers of the array that was begun.
    ///
    /// # Panics
    /// When there are more of them than its shape holds.
    pub fn push(&mut self, values: Values) -> Result<()> {
        let (name, left) = self.open.as_mut().expect("an array was begun");
        *left = left.checked_sub(values.len()).unwrap_or_else(|| panic!("array `{name}` gets more numbers than its shape holds"));
        values.write_to(&mut self.archive).map_err(|source| Error::write(&self.path, source))
    }

    /// A whole array.
    pub fn array(&mut self, name: &str, shape: &[usize], values: Values) -> Result<()> {
        self.begin(name, shape, values)?;
        self.push(values)
    }

    /// A text, as NumPy's array of one text without axes.
    pub fn text(&mut self, name: &str, text: &str) -> Result<()> {
        self.complete();
        let letters: Vec<u8> = text.chars().flat_map(|letter| (letter as u32).to_le_bytes()).collect();
        let header = header_bytes(&format!("<U{}", (letters.len() / 4).max(1)), &[]);
        self.entry(name, &header, letters.len() as u64)?;
        let letters = if letters.is_empty() { vec![0; 4] } else { letters };
        self.archive.write_all(&letters).map_err(|source| Error::write(&self.path, source))
    }

    /// Brings the archive to the disk and gives it its name.
    ///
    /// # Panics
    /// When the last array lacks numbers.
    pub fn finish(mut self) -> Result<()> {
        self.complete();
        let stream = self.archive.finish().map_err(|error| Error::write(&self.path, error.into()))?;
        stream.into_inner().finish()
    }

    fn complete(&mut self) {
        if let Some((name, left)) = self.open.take() {
            assert_eq!(left, 0, "array `{name}` lacks numbers");
        }
    }

    fn entry(&mut self, name: &str, header: &[u8], bytes: u64) -> Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .last_modified_time(DateTime::default())
            .large_file(bytes > LARGE);
        self.archive.start_file(format!("{name}.npy"), options).map_err(|error| Error::write(&self.path, error.into()))?;
        self.archive.write_all(header).map_err(|source| Error::write(&self.path, source))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::arrays::{Array, Npz};

    #[test]
    fn what_is_written_in_blocks_is_read_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        let mut writer = NpzWriter::create(&path).unwrap();
        writer.begin("samples", &[2, 3], Values::F32(&[])).unwrap();
        writer.push(Values::F32(&[1.0, 2.0])).unwrap();
        writer.push(Values::F32(&[3.0, 4.0, 5.0, 6.0])).unwrap();
        writer.array("frame", &[2], Values::I32(&[7, 8])).unwrap();
        writer.text("radar", "{\"slope\": \"µ\"}").unwrap();
        assert!(!path.exists(), "a file that is not complete has no name");
        writer.finish().unwrap();
        let mut archive = Npz::open(&path).unwrap();
        assert_eq!(archive.names(), ["frame", "radar", "samples"]);
        let samples: Array<f32> = archive.read("samples", &[("row", Some(2)), ("column", Some(3))]).unwrap();
        assert_eq!(samples.values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let frames: Array<i64> = archive.read("frame", &[("frame", Some(2))]).unwrap();
        assert_eq!(frames.values, [7, 8]);
    }

    #[test]
    #[should_panic(expected = "array `a` lacks numbers")]
    fn an_array_that_lacks_numbers_is_a_bug() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = NpzWriter::create(folder.path().join("a.npz")).unwrap();
        writer.begin("a", &[2], Values::F64(&[])).unwrap();
        writer.push(Values::F64(&[1.0])).unwrap();
        let _ = writer.finish();
    }
}
