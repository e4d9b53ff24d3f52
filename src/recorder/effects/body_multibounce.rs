//! A return that bounces at the body once more.

use super::effect::Effect;
use super::settings::settings;
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::recorder::delay::delayed;
use crate::recorder::resample::Resampler;
use crate::recorder::signal::Signal;

settings! {
    /// The body's return once more, from `extra_m` farther.
    BodyMultibounce { extra_m: f64 [0.0, 5.0], #[serde(default = "third")] coefficient: f64 [-1.0, 1.0] }
}

fn third() -> f64 {
    0.3
}

impl Effect for BodyMultibounce {
    const OF_PERSON: bool = true;
}

impl BodyMultibounce {
    /// Adds to every chirp of the body's return its delayed copy; `radar` is the one that `body` was sampled by, guard samples
    /// included.
    pub fn add(&self, resampler: &Resampler, radar: &Radar, body: &mut Signal) {
        let delay_s = 2.0 * self.extra_m / SPEED_OF_LIGHT;
        for (_, chirp) in body.chirps_mut() {
            let again = delayed(chirp, resampler, radar, delay_s);
            chirp.iter_mut().zip(again).for_each(|(value, echo)| *value += self.coefficient * echo);
        }
    }
}
