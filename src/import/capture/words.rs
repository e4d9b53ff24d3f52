//! Files of nothing but little-endian 16-bit words, whose axes and lengths are stated.

use std::path::PathBuf;

use super::layout::{Axis, Layout};
use super::stream::Words;
use crate::error::{Error, Result};

/// Lanes of a layout with an axis `lane`: two, as boards with one receiver after the other have (SWRA581B).
const LANES: usize = 2;

/// Lengths that are stated.
#[derive(Clone, Copy, Debug)]
pub struct Lengths {
    pub tx: usize,
    pub rx: usize,
    pub loops: usize,
    pub samples: usize,
}

impl Lengths {
    /// Along an axis of one frame.
    fn of(&self, axis: Axis, lanes: usize) -> usize {
        match axis {
            Axis::Frame => 1,
            Axis::Tx => self.tx,
            Axis::Rx => self.rx,
            Axis::Loop => self.loops,
            Axis::Chirp => self.loops.saturating_mul(self.tx),
            Axis::Antenna => self.tx.saturating_mul(self.rx),
            Axis::Sample => self.samples / lanes,
            Axis::Lane => lanes,
            Axis::Iq => 2,
        }
    }

    /// Of every axis, of one frame.
    ///
    /// # Errors
    /// Samples that do not fill an axis of lanes.
    pub fn shape(&self, layout: &Layout) -> Result<Vec<usize>> {
        let lanes = if layout.place(Axis::Lane).is_some() { LANES } else { 1 };
        if !self.samples.is_multiple_of(lanes) {
            let expected = format!("a multiple of {lanes}: one sample for each lane");
            return Err(Error::setting("radar.samples_per_chirp", self.samples, expected));
        }
        Ok(layout.axes.iter().map(|axis| self.of(*axis, lanes)).collect())
    }
}

/// Words as an array, frames outermost.
pub struct WordArray {
    pub words: Words,
    pub shape: Vec<usize>,
    /// Words of one frame.
    block: u64,
}

impl WordArray {
    /// The files end to end. `frame_files`: every file is one frame.
    ///
    /// # Errors
    /// Frames that are not outermost; less than a frame; where files are frames, one of another length.
    pub fn open(
        files: &[PathBuf],
        layout: &Layout,
        lengths: Lengths,
        frame_files: bool,
        notes: &mut Vec<String>,
    ) -> Result<Self> {
        let refuse = |message: &str| Error::Usage {
            message: format!("--layout \"{}\": {message}", layout.describe()),
            hint: Some(
                "files of words alone are read frame by frame: write `frame` first, such as \"frame loop tx rx sample iq\""
                    .into(),
            ),
        };
        if layout.place(Axis::Frame).is_some_and(|place| place > 0) {
            return Err(refuse("frames are not outermost"));
        }
        let mut shape = lengths.shape(layout)?;
        let block = shape.iter().try_fold(1u64, |all, &length| all.checked_mul(length as u64)).unwrap_or(u64::MAX).max(1);
        let words = Words::open(files)?;
        if let Some((file, own)) = words.lengths().find(|(_, own)| frame_files && *own != block.saturating_mul(2)) {
            return Err(Error::field(
                file,
                "samples",
                format!("{own} bytes"),
                format!("{} bytes, one frame", block.saturating_mul(2)),
            )
            .with_hint("the radar's settings belong to another capture, or the file is cut off"));
        }
        let (frames, rest) = (words.len() / block, words.bytes() % block.saturating_mul(2));
        if frames == 0 || layout.place(Axis::Frame).is_none() && words.bytes() != block.saturating_mul(2) {
            let expected = format!("{} bytes, one frame of {shape:?} words", block.saturating_mul(2));
            return Err(Error::field(words.first(), "samples", format!("{} bytes", words.bytes()), expected)
                .with_hint("the radar's settings or --layout belong to another capture, or the file is cut off"));
        }
        if rest > 0 {
            notes.push(format!(
                "{rest} bytes after the last whole frame are left out: {frames} frames of {} bytes each",
                2 * block
            ));
        }
        if layout.place(Axis::Frame).is_some() {
            shape[0] = frames as usize;
        }
        Ok(Self { words, shape, block })
    }

    /// The numbers of a frame.
    pub fn frame(&self, index: usize) -> Result<Vec<f32>> {
        let words = self.words.read(index as u64 * self.block, self.block as usize)?;
        Ok(words.into_iter().map(f32::from).collect())
    }
}
