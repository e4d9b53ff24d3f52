//! In-phase and quadrature branches that differ.

use super::context::Context;
use super::decibels::from_db;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};
use crate::radar::Sampling;
use crate::recorder::signal::Signal;

settings! {
    /// Q is stronger than I, and not at a right angle to it.
    IqImbalance { gain_db: f64 [-6.0, 6.0], phase_deg: f64 [-30.0, 30.0] }
}

impl Effect for IqImbalance {
    fn check(&self, context: &Context, key: &str) -> Result<()> {
        if context.radar.sampling == Sampling::Real {
            return Err(Error::setting(key, "on", "off for a receiver without quadrature"));
        }
        Ok(())
    }
}

impl IqImbalance {
    /// Changes Q of every sample: its gain, and the part of I in it.
    pub fn apply(&self, signal: &mut Signal) {
        let gain = from_db(self.gain_db);
        let (sin, cos) = self.phase_deg.to_radians().sin_cos();
        signal.values.iter_mut().for_each(|value| value.im = gain * (value.im * cos + value.re * sin));
    }
}
