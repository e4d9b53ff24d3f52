//! The radar: its chirp, its schedule and its antennas, and what follows from them.
//!
//! Frame: origin at the radar's reference point, x right, y boresight, z up, metres. With the chosen sign,
//! exp(+j 2π (f_c τ + S t τ)), a farther point has a higher beat frequency and a receding one a positive Doppler.

mod checks;
mod presets;

pub use checks::{Check, checks, fastest};

use serde::{Deserialize, Serialize};

/// Speed of light, m/s.
pub const SPEED_OF_LIGHT: f64 = 299_792_458.0;

/// Whether the chip has a quadrature receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    #[default]
    Complex,
    Real,
}

/// An FMCW radar with time-division transmitters. Keys carry their units; one struct serves configs and recordings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Radar {
    /// Frequency at the start of the ramp (f₀).
    pub start_frequency_hz: f64,
    /// Chirp slope (S); negative for a falling chirp.
    pub slope_hz_per_s: f64,
    pub sample_rate_hz: f64,
    #[serde(default)]
    pub sampling: Sampling,
    pub samples_per_chirp: usize,
    /// Chirps per transmitter in a frame.
    pub loops_per_frame: usize,
    /// From the start of the ramp to the first sample.
    pub adc_start_s: f64,
    /// From ramp start to ramp start.
    pub chirp_period_s: f64,
    pub frame_period_s: f64,
    pub frames: usize,
    /// The antennas' reference in the radar frame; all antennas are offset from it.
    #[serde(default)]
    pub position_m: [f64; 3],
    /// In firing order.
    pub tx_m: Vec<[f64; 3]>,
    /// `[rx]`, offset from `position_m`.
    pub rx_m: Vec<[f64; 3]>,
    /// The ADC's rail.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_scale_codes: Option<f64>,
}

impl Radar {
    /// Frequency at the first sample (f_c of docs/conventions.md: f₀ + S · `adc_start_s`).
    pub fn carrier_hz(&self) -> f64 {
        self.start_frequency_hz + self.slope_hz_per_s * self.adc_start_s
    }

    /// Wavelength at the middle of the sampled ramp.
    pub fn wavelength_m(&self) -> f64 {
        SPEED_OF_LIGHT / (self.carrier_hz() + 0.5 * self.bandwidth_hz())
    }

    /// Swept while sampling; negative for a falling chirp.
    pub fn bandwidth_hz(&self) -> f64 {
        self.slope_hz_per_s * self.samples_per_chirp as f64 / self.sample_rate_hz
    }

    /// Width of a range bin: c over twice the swept bandwidth.
    pub fn range_resolution_m(&self) -> f64 {
        SPEED_OF_LIGHT / (2.0 * self.bandwidth_hz().abs())
    }

    /// Farthest range without ambiguity: all of ±f_s/2 belongs to positive ranges only with a quadrature receiver.
    pub fn max_range_m(&self) -> f64 {
        let highest_beat_hz = match self.sampling {
            Sampling::Complex => self.sample_rate_hz,
            Sampling::Real => 0.5 * self.sample_rate_hz,
        };
        highest_beat_hz * SPEED_OF_LIGHT / (2.0 * self.slope_hz_per_s.abs())
    }

    /// Whether two recordings are of one radar with the same settings: the number of frames and the rail may differ.
    pub fn is_same_board(&self, other: &Self) -> bool {
        (Self { frames: other.frames, full_scale_codes: other.full_scale_codes, ..self.clone() }) == *other
    }

    /// From one chirp of a transmitter to its next.
    pub fn loop_period_s(&self) -> f64 {
        self.chirp_period_s * self.tx_m.len() as f64
    }

    /// Width of a Doppler bin of one frame, as a radial velocity.
    pub fn velocity_resolution_mps(&self) -> f64 {
        self.wavelength_m() / (2.0 * self.loop_period_s() * self.loops_per_frame as f64)
    }

    /// Fastest radial velocity without ambiguity, either way.
    pub fn max_velocity_mps(&self) -> f64 {
        self.wavelength_m() / (4.0 * self.loop_period_s())
    }

    /// Fastest radial velocity without ambiguity over all chirps, either way. Chirps that are alone in their frame follow
    /// each other at the frame period.
    pub fn max_tracked_velocity_mps(&self) -> f64 {
        if self.loops_per_frame > 1 { self.max_velocity_mps() } else { self.wavelength_m() / (4.0 * self.frame_period_s) }
    }

    /// Ramp start of a chirp: frame k, loop i, transmitter j starts at k·T_frame + (i·n_tx + j)·T_chirp.
    pub fn chirp_time_s(&self, frame: usize, tx: usize, index: usize) -> f64 {
        frame as f64 * self.frame_period_s + (index * self.tx_m.len() + tx) as f64 * self.chirp_period_s
    }

    /// Of the ADC window's sample, after the ramp's start.
    pub fn sample_time_s(&self, sample: usize) -> f64 {
        self.adc_start_s + sample as f64 / self.sample_rate_hz
    }

    /// From the first ramp's start to the end of the last ADC window.
    pub fn frame_duration_s(&self) -> f64 {
        let chirps = (self.loops_per_frame * self.tx_m.len()) as f64;
        (chirps - 1.0) * self.chirp_period_s + self.sample_time_s(self.samples_per_chirp)
    }

    /// Where a transmitter is in the radar frame.
    ///
    /// # Panics
    /// For a number that no transmitter has.
    pub fn tx_position_m(&self, tx: usize) -> [f64; 3] {
        std::array::from_fn(|axis| self.position_m[axis] + self.tx_m[tx][axis])
    }

    /// Where a receiver is in the radar frame.
    ///
    /// # Panics
    /// For a number that no receiver has.
    pub fn rx_position_m(&self, rx: usize) -> [f64; 3] {
        std::array::from_fn(|axis| self.position_m[axis] + self.rx_m[rx][axis])
    }

    /// Mean positions of the transmitters and of the receivers.
    pub fn antenna_centres_m(&self) -> [[f64; 3]; 2] {
        [&self.tx_m, &self.rx_m].map(|antennas| {
            std::array::from_fn(|axis| {
                self.position_m[axis] + antennas.iter().map(|antenna| antenna[axis]).sum::<f64>() / antennas.len() as f64
            })
        })
    }

    /// Mean position of all antennas: the viewpoint of the direct path.
    pub fn centre_m(&self) -> [f64; 3] {
        let count = (self.tx_m.len() + self.rx_m.len()) as f64;
        std::array::from_fn(|axis| {
            let sum: f64 = self.tx_m.iter().chain(&self.rx_m).map(|antenna| antenna[axis]).sum();
            self.position_m[axis] + sum / count
        })
    }

    /// Shape of a recording: `[frame, tx, rx, loop, sample]`.
    pub fn dims(&self) -> [usize; 5] {
        [self.frames, self.tx_m.len(), self.rx_m.len(), self.loops_per_frame, self.samples_per_chirp]
    }
}
