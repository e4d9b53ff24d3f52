//! Recordings in which nothing was recorded.

use super::Recording;
use super::samples::IfFrame;
use crate::data::arrays::field_of;
use crate::error::{Error, Result};

impl IfFrame {
    /// Whether the samples of every chirp are all the same: a receiver that works shows noise at least.
    pub fn is_dead(&self) -> bool {
        let constant = |values: &[f32]| values.chunks(self.dims[3]).all(|chirp| chirp.iter().all(|value| *value == chirp[0]));
        constant(&self.re) && self.im.as_deref().is_none_or(constant)
    }
}

impl Recording {
    /// Refuses frames of which not one holds a signal: whatever is said of them would be about nothing.
    ///
    /// Reads up to the first living frame.
    ///
    /// # Errors
    /// Samples that cannot be read, or that do not change along any chirp.
    pub fn refuse_dead(&self, frames: impl IntoIterator<Item = usize>) -> Result<()> {
        let (mut count, mut value) = (0, 0.0);
        for frame in frames {
            let samples = self.frame(frame)?;
            if !samples.is_dead() {
                return Ok(());
            }
            (count, value) = (count + 1, samples.re[0]);
        }
        if count == 0 {
            return Ok(());
        }
        let file = self.samples.path();
        let found = format!("the same along every chirp of {count} frames, such as {value}");
        Err(Error::field(file, field_of(file), found, "an echo, or at least noise")
            .with_hint("nothing was recorded: the receiver was off, or the file was filled in; record again"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_that_holds_one_value_a_chirp_is_dead() {
        let frame = |re: [f32; 4], im: Option<[f32; 4]>| IfFrame::new([1, 2, 1, 2], re.into(), im.map(Vec::from));
        assert!(frame([0.0; 4], None).is_dead());
        // Every receiver with an offset of its own.
        assert!(frame([1.0, 1.0, 3.0, 3.0], Some([2.0; 4])).is_dead());
        assert!(!frame([1.0, 1.0, 3.0, 4.0], None).is_dead());
        assert!(!frame([1.0; 4], Some([0.0, 1.0, 0.0, 0.0])).is_dead());
    }
}
