//! A delay in the radar's hardware.

use super::effect::Effect;
use super::settings::settings;
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::recorder::delay::delayed;
use crate::recorder::resample::Resampler;
use crate::recorder::signal::Signal;

settings! {
    /// A delay in the radar's hardware, as a range.
    RangeBias { offset_m: f64 [-2.0, 2.0] }
}

impl Effect for RangeBias {}

impl RangeBias {
    /// Delays every chirp; `radar` is the one that `signal` was sampled by, guard samples included.
    pub fn apply(&self, resampler: &Resampler, radar: &Radar, signal: &mut Signal) {
        let delay_s = 2.0 * self.offset_m / SPEED_OF_LIGHT;
        for (_, chirp) in signal.chirps_mut() {
            let later = delayed(chirp, resampler, radar, delay_s);
            chirp.copy_from_slice(&later);
        }
    }
}
