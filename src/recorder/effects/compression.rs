//! An amplifier that compresses.

use super::effect::Effect;
use super::settings::settings;
use crate::recorder::signal::Signal;

settings! {
    /// The part of its amplitude that the peak sample loses, by −κ|s|²s.
    Compression { level: f64 [0.0, 0.33] }
}

impl Effect for Compression {}

impl Compression {
    /// `per_peak`: 1 over the peak sample.
    pub fn apply(&self, per_peak: f64, signal: &mut Signal) {
        let cubic = self.level * per_peak * per_peak;
        for value in &mut signal.values {
            // Beyond its maximum the cubic would fold back; a real stage stays there.
            let power = cubic * value.norm_sqr();
            *value *= if power <= 1.0 / 3.0 { 1.0 - power } else { 2.0 / (27.0 * power).sqrt() };
        }
    }
}
