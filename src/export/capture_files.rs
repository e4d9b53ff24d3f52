//! The files of a capture: as many as the tool that captures would have made.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Source;
use super::codes::Codes;
use super::wiring::Wiring;
use crate::data::arrays::Values;
use crate::data::atomic::AtomicFile;
use crate::error::{Error, Result};
use crate::radar::Sampling;

/// A file of mmWave Studio holds whole packets up to 1 GiB (`maxRecFileSize_MB` is 1024 in the DCA1000's CLI): 737,460
/// packets of 1,456 bytes (DCA1000EVM user's guide SPRUIJ4A, section 5.2). Files of such captures have these 536,870,880
/// words (TI E2E, thread 900487).
const FILE_BYTES: usize = 737_460 * 1456;

/// How samples become codes and files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CaptureConfig {
    /// What becomes code 32,767, in the unit of the recording. Absent: codes stay as they are, and of other numbers it is
    /// the largest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub full_scale: Option<f64>,
    /// Bytes of a file, after which the next one begins.
    pub file_bytes: usize,
}

impl Default for CaptureConfig {
    fn default() -> Self {
        Self { full_scale: None, file_bytes: FILE_BYTES }
    }
}

impl CaptureConfig {
    /// Refuses a full scale that is no positive number, and files that hold no whole words.
    pub fn check(&self) -> Result<()> {
        if let Some(full_scale) = self.full_scale.filter(|scale| !(scale.is_finite() && *scale > 0.0)) {
            return Err(Error::setting("capture.full_scale", full_scale, "a positive number"));
        }
        if self.file_bytes < 2 || !self.file_bytes.is_multiple_of(2) {
            return Err(Error::setting("capture.file_bytes", self.file_bytes, "whole words of two bytes, at least one"));
        }
        Ok(())
    }
}

/// The words of a frame as a radar sends them: chirp by chirp, loops outermost, then transmitters in firing order.
pub fn words(source: &mut Source, frame: usize, wiring: &Wiring, codes: &mut Codes) -> Result<Vec<i16>> {
    let samples = source.recording.frame(frame)?;
    let [n_tx, n_rx, loops, length] = samples.dims;
    let chirp = wiring.lanes.words_per_chirp(n_rx, length);
    let mut words = vec![0; chirp * n_tx * loops];
    for (number, words) in words.chunks_exact_mut(chirp).enumerate() {
        let (index, tx) = (number / n_tx, number % n_tx);
        for rx in 0..n_rx {
            for sample in 0..length {
                let (i, q) = wiring.lanes.place(rx, n_rx, sample, length);
                let value = samples.sample(tx, rx, index, sample);
                words[i] = codes.code(value.re, wiring.inverted[rx]);
                if wiring.lanes.sampling == Sampling::Complex {
                    words[q] = codes.code(value.im, wiring.inverted[rx]);
                }
            }
        }
    }
    Ok(words)
}

/// One stream of words that is cut into files.
pub struct Files {
    folder: PathBuf,
    stem: String,
    /// Words of a whole file.
    most: usize,
    written: usize,
    open: Option<AtomicFile>,
    names: Vec<String>,
}

impl Files {
    /// A stream into `NAME_Raw_0.bin`, `NAME_Raw_1.bin` and so on in a folder, with as many bytes in each as the settings say.
    pub fn new(folder: &Path, name: &str, config: &CaptureConfig) -> Self {
        let stem = format!("{name}_Raw_");
        Self { folder: folder.into(), stem, most: config.file_bytes / 2, written: 0, open: None, names: Vec::new() }
    }

    /// Writes words, and begins another file whenever one is full.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn push(&mut self, mut words: &[i16]) -> Result<()> {
        while !words.is_empty() {
            if self.written == self.most {
                self.close()?;
            }
            if self.open.is_none() {
                let name = format!("{}{}.bin", self.stem, self.names.len());
                self.open = Some(AtomicFile::create(self.folder.join(&name))?);
                self.names.push(name);
            }
            let (part, rest) = words.split_at(words.len().min(self.most - self.written));
            let file = self.open.as_mut().expect("just opened");
            let name = self.names.last().expect("it is open");
            Values::I16(part).write_to(file).map_err(|source| Error::write(self.folder.join(name), source))?;
            self.written += part.len();
            words = rest;
        }
        Ok(())
    }

    fn close(&mut self) -> Result<()> {
        self.written = 0;
        self.open.take().map_or(Ok(()), AtomicFile::finish)
    }

    /// The names of the files, in order.
    pub fn finish(mut self) -> Result<Vec<String>> {
        self.close()?;
        Ok(self.names)
    }
}
