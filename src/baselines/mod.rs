//! Baselines: how others simulate a person in front of a radar, under the same noise and with one calibrated level.
//!
//! - [`MmGpe`]: every visible vertex reflects with fixed empirical lobes; direct path only.
//! - [`RfGenesis`]: rays through a pixel grid onto the body, one return for each hit; and as its code was released.
//! - [`TwoBounce`]: our learned direct path, with mirror reflections in the walls instead of the learned indirect path.
//!
//! They share this crate's geometry and coherent sum, so that what differs is the model of scattering. Absolute level is
//! arbitrary between a physical model and a recording's units: [`Calibration`] finds one gain for a whole site.

mod calibrate;
mod mmgpe;
mod noise;
mod rf_genesis;
#[cfg(test)]
mod test_support;
mod two_bounce;

pub use calibrate::{Calibration, noise_level};
pub use mmgpe::{MmGpe, MmGpeConfig};
pub use noise::{BaselineNoise, NOISE_RATE, Rendering};
pub use rf_genesis::{RfGenesis, RfGenesisConfig, Schedule, Strength};
pub use two_bounce::{TwoBounce, TwoBounceConfig};

use crate::{
    complex::Complex,
    error::{Error, Result},
    radar::Radar,
};

/// A method that simulates one recording frame by frame.
pub trait Baseline {
    /// The radar that it simulates.
    fn radar(&self) -> &Radar;

    /// The signal before gain and noise.
    ///
    /// # Shapes
    /// - result: `[tx, rx, loop, sample]`, in a unit of the method's own
    ///
    /// # Errors
    /// A frame outside the motion.
    fn clean_signal(&self, frame: usize) -> Result<Complex<4>>;
}

/// A setting that must be a number within limits.
fn check_range(key: &str, value: f64, low: f64, high: f64) -> Result<()> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(Error::setting(key, value, format!("a number from {low} to {high}")))
}
