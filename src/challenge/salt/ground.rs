//! What effects need to know of somebody's samples: their peak, their noise, their zero and their full scale.

use num_complex::Complex64;

use crate::data::{IfFrame, Recording};
use crate::diagnosis::Evidence;
use crate::diagnosis::cube::Loaded;
use crate::diagnosis::cube::most_frames;
use crate::error::Result;
use crate::radar::Sampling;
use crate::recorder::stages::Ground;

/// Means and extremes of the two components over a recording.
struct Extent {
    low: [f64; 2],
    high: [f64; 2],
    sum: [f64; 2],
    count: f64,
}

impl Extent {
    fn add(&mut self, frame: &IfFrame) {
        for (part, values) in std::iter::once(&frame.re).chain(&frame.im).enumerate() {
            for value in values.iter().map(|&value| f64::from(value)) {
                self.low[part] = self.low[part].min(value);
                self.high[part] = self.high[part].max(value);
                self.sum[part] += value;
            }
        }
        self.count += frame.re.len() as f64;
    }

    /// Codes that never change their sign are offset binary: they swing about their mean.
    fn zero(&self) -> [f64; 2] {
        [0, 1].map(|part| if self.low[part] >= 0.0 { self.sum[part] / self.count } else { 0.0 })
    }
}

/// Reads all samples.
///
/// # Errors
/// Samples that cannot be read, or too few to separate noise from signal.
pub fn ground(recording: &Recording) -> Result<Ground> {
    let mut extent = Extent { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2], sum: [0.0; 2], count: 0.0 };
    for frame in 0..recording.frames() {
        extent.add(&recording.frame(frame)?);
    }
    let real = recording.radar.sampling == Sampling::Real;
    let [re, im] = extent.zero();
    let zero = Complex64::new(re, if real { 0.0 } else { im });
    let (mut peak, mut largest) = (0.0f64, 0.0f64);
    for frame in 0..recording.frames() {
        let frame = recording.frame(frame)?;
        for (index, &re) in frame.re.iter().enumerate() {
            let im = frame.im.as_ref().map_or(0.0, |im| f64::from(im[index]));
            let value = Complex64::new(re.into(), im) - zero;
            peak = peak.max(value.norm());
            largest = largest.max(value.re.abs()).max(value.im.abs());
        }
    }
    Ok(Ground { peak, largest_component: largest, sigma: sigma(recording)?, zero, rail: full_scale(recording, &extent) })
}

/// The noise as a diagnosis estimates it, per component.
fn sigma(recording: &Recording) -> Result<f64> {
    let evidence = Evidence::new(Loaded::read(recording, most_frames(&recording.radar))?, recording.room.clone(), None);
    let noise = evidence.noise();
    let variance = noise.iter().sum::<f64>() / noise.len().max(1) as f64;
    // A complex sample holds two components; one that was made analytic has half of its band, doubled.
    Ok((variance / if evidence.is_real() { 4.0 } else { 2.0 }).sqrt())
}

/// Smallest and largest code: as the radar states it, or those of 16 bits. Codes without a sign begin at zero.
fn full_scale(recording: &Recording, extent: &Extent) -> Option<[f64; 2]> {
    if !recording.holds_codes() {
        return None;
    }
    let unsigned = extent.low.iter().filter(|low| low.is_finite()).all(|low| *low >= 0.0);
    let largest =
        recording.radar.full_scale_codes.unwrap_or(f64::from(if unsigned { i32::from(u16::MAX) } else { i16::MAX.into() }));
    // What was recorded was within the full scale, whatever is stated.
    let high = extent.high.into_iter().filter(|high| high.is_finite()).fold(largest, f64::max);
    Some([if unsigned { 0.0 } else { extent.low.into_iter().fold(-largest - 1.0, f64::min) }, high])
}
