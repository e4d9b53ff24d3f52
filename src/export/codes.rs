//! ADC codes of 16 bits from whatever numbers a recording holds.

use super::Source;
use crate::data::IfLayout;
use crate::error::Result;

/// From samples to codes.
pub struct Codes {
    /// Codes per unit of the recording.
    scale: f64,
    clipped: usize,
}

impl Codes {
    /// Codes as they are; other numbers in steps of the full scale over 32,767. The full scale is `capture.full_scale`, or
    /// the largest part of all samples, for which every frame is read once. Notes say what was done.
    pub fn of(source: &mut Source, notes: &mut Vec<String>) -> Result<Self> {
        let stored = source.recording.number_type();
        let codes = matches!(source.recording.layout(), IfLayout::Codes | IfLayout::RealCodes);
        let stated = source.config.capture.full_scale;
        if stated.is_none() && codes && ["int16", "int8", "uint8"].contains(&stored.as_str()) {
            return Ok(Self { scale: 1.0, clipped: 0 });
        }
        let full_scale = match stated {
            Some(full_scale) => full_scale,
            None => peak(source)?,
        };
        let rail = f64::from(i16::MAX);
        if stated.is_none() && codes && full_scale <= rail {
            return Ok(Self { scale: 1.0, clipped: 0 });
        }
        notes.push(format!(
            "{stored} samples were rounded to codes of 16 bits: {full_scale:e} is code {rail}, a step is {:e}; \
             capture.full_scale states another full scale",
            full_scale / rail
        ));
        Ok(Self { scale: rail / full_scale, clipped: 0 })
    }

    /// The code of one part of a sample; `inverted`: of a receiver that is fed from the opposite side.
    pub fn code(&mut self, value: f32, inverted: bool) -> i16 {
        let code = (f64::from(value) * if inverted { -self.scale } else { self.scale }).round();
        self.clipped += usize::from(!(f64::from(i16::MIN)..=f64::from(i16::MAX)).contains(&code));
        // The cast saturates.
        code as i16
    }

    /// What a reader must know once all is written.
    pub fn conclude(self, notes: &mut Vec<String>) {
        if self.clipped > 0 {
            notes.push(format!("{} parts of samples were beyond int16 and brought to its limits", self.clipped));
        }
    }
}

/// The largest part of any sample; 1 of a silent recording.
fn peak(source: &mut Source) -> Result<f64> {
    let mut peak = 0f32;
    for index in 0..source.recording.frames() {
        let frame = source.recording.frame(index)?;
        peak = frame.re.iter().chain(frame.im.iter().flatten()).fold(peak, |peak, value| peak.max(value.abs()));
    }
    Ok(if peak > 0.0 { f64::from(peak) } else { 1.0 })
}
