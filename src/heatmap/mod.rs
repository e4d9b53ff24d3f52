//! Heatmaps: IF samples to range-Doppler, angle and time maps (ℱ_RD of the paper's loss, sec. 3.4).
//!
//! [`RangeDoppler`] works inside the graph: DFT matrices, any length, every backend, gradients. [`Analysis`] works on the
//! host in f64 through rustfft, and adds angles and time. Both fold in the same windows and the same scale, and tests hold
//! one against the other.
//!
//! Scale: a path of amplitude 1 in the middle of a cell peaks at 1 (0 dB), whatever the lengths and windows. A real-sampled
//! signal is doubled, so that its path also peaks at 1. With rectangular windows the paper's plain FFT differs by a constant
//! factor, which cancels in its loss; the default windows are Hann's, whose sidelobes do not cover a person.

mod angle;
mod axes;
pub(crate) mod dft;
mod gate;
mod host;
mod map;
mod over_time;
mod spectrogram;
mod windows;

pub use angle::Scan;
pub use axes::{doppler_turns_per_loop, range_axis, range_bins, velocity_axis};
pub use dft::{RangeDoppler, power_db, remove_loop_mean, split_loop_mean, time_doppler};
pub use gate::Gate;
pub use host::{Analysis, Samples, StaticRemoval, mean_power, remove_static};
pub use map::{Axis, Map};
pub use windows::Window;

use serde::{Deserialize, Serialize};

use crate::radar::{Radar, Sampling};

/// How IF samples become maps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeatmapConfig {
    /// Over the samples of a chirp.
    pub range_window: Window,
    /// Over the loops of a frame.
    pub doppler_window: Window,
    /// Floor of the logarithm, relative to the amplitude of the recording's strongest cell.
    pub floor_db: f64,
}

impl Default for HeatmapConfig {
    /// Hann windows, and a floor that f32 barely resolves: it keeps the logarithm finite and changes no real cell.
    fn default() -> Self {
        Self { range_window: Window::Hann, doppler_window: Window::Hann, floor_db: -120.0 }
    }
}

impl HeatmapConfig {
    /// The floor as an amplitude, for [`power_db`] and [`Map::db`].
    pub fn floor_amplitude(&self, peak_amplitude: f64) -> f64 {
        peak_amplitude * 10f64.powf(self.floor_db / 20.0)
    }

    /// Mean power of a cell for white noise of variance 1 in each component of a sample.
    pub fn noise_gain(&self, radar: &Radar) -> f64 {
        let squares = |weights: Vec<f64>| weights.iter().map(|weight| weight * weight).sum::<f64>();
        let over_range = squares(self.range_window.weights(radar.samples_per_chirp));
        let over_doppler = squares(self.doppler_window.weights(radar.loops_per_frame));
        // Two components; or one, whose amplitude the maps double.
        over_range * over_doppler * if radar.sampling == Sampling::Real { 4.0 } else { 2.0 }
    }
}

#[cfg(test)]
pub(crate) mod synthetic;
