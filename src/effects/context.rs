//! What operators may know of the radar and the moment.

use burn::tensor::Tensor;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{tones::Tones, values::Values};
use crate::radar::Radar;

/// One frame of a radar.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    pub radar: &'a Radar,
    pub frame: usize,
    /// Range of the farthest echo; what lies beyond is not reached by filters and errors of the chirp.
    pub farthest_m: f64,
}

impl Context<'_> {
    /// `[tx, rx]`.
    pub fn channels(&self) -> [usize; 2] {
        [self.radar.tx_m.len(), self.radar.rx_m.len()]
    }

    /// The tones that the scene's echoes are made of.
    pub(super) fn tones(&self, values: &Values) -> Tones {
        let delay_s = 2.0 * self.farthest_m / crate::radar::SPEED_OF_LIGHT;
        let highest = delay_s * self.radar.slope_hz_per_s / self.radar.sample_rate_hz;
        Tones::new(self.radar.samples_per_chirp, highest, &values.device, values.dtype)
    }

    /// Samples that a shift of the ramp by a second's fraction is: f_s · seconds.
    pub(super) fn samples_of(&self, seconds: Tensor<1>) -> Tensor<1> {
        seconds * self.radar.sample_rate_hz
    }

    /// Samples of the warp that an error of the chirp's frequency is: f_s · δf / S.
    pub(super) fn samples_of_frequency(&self, error_hz: Tensor<1>) -> Tensor<1> {
        error_hz * (self.radar.sample_rate_hz / self.radar.slope_hz_per_s)
    }

    /// −1 … 1 over the window, `[sample]`.
    pub(super) fn along_the_chirp(&self) -> Vec<f64> {
        let count = self.radar.samples_per_chirp;
        (0..count).map(|sample| 2.0 * sample as f64 / (count.max(2) - 1) as f64 - 1.0).collect()
    }

    /// Radar times of the ramps' starts, `[tx, loop]`, seconds.
    pub(super) fn ramp_times_s(&self) -> Vec<f64> {
        let [tx, _] = self.channels();
        let loops = self.radar.loops_per_frame;
        (0..tx).flat_map(|tx| (0..loops).map(move |index| self.radar.chirp_time_s(self.frame, tx, index))).collect()
    }

    /// The chirp's count within the frame, `[tx, loop]`.
    pub(super) fn chirp_counts(&self) -> Vec<f64> {
        let [tx, _] = self.channels();
        let loops = self.radar.loops_per_frame;
        (0..tx).flat_map(|first| (0..loops).map(move |index| (index * tx + first) as f64)).collect()
    }

    /// A value for every chirp as `[tx, 1, loop, 1]`.
    pub(super) fn per_chirp(&self, per_chirp: Vec<f64>, values: &Values) -> Tensor<4> {
        let [tx, _] = self.channels();
        values.tensor(per_chirp, [tx, 1, self.radar.loops_per_frame, 1])
    }

    /// Draws of an effect in this frame; the same whenever it is simulated.
    pub(super) fn random(&self, salt: u64) -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(salt.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ self.frame as u64)
    }
}

/// Legendre polynomial of a degree.
pub fn legendre(degree: usize, x: f64) -> f64 {
    let (mut before, mut now) = (1.0, x);
    if degree == 0 {
        return 1.0;
    }
    for l in 1..degree {
        (before, now) = (now, ((2 * l + 1) as f64 * x * now - l as f64 * before) / (l + 1) as f64);
    }
    now
}
