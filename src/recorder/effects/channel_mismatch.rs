//! Channels of different gain and phase.

use num_complex::Complex64;

use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};
use crate::recorder::signal::Signal;

settings! {
    /// Per receiver, or per channel with the receivers of the first transmitter first.
    ChannelMismatch { gain_db: Vec<f64> [-20.0, 20.0], phase_deg: Vec<f64> [-360.0, 360.0] }
}

impl Effect for ChannelMismatch {
    fn check(&self, context: &Context, key: &str) -> Result<()> {
        let (rx, all) = (context.radar.rx_m.len(), context.radar.rx_m.len() * context.radar.tx_m.len());
        for (field, length) in [("gain_db", self.gain_db.len()), ("phase_deg", self.phase_deg.len())] {
            if length != rx && length != all {
                let wanted = format!("one per receiver, {rx}, or per channel, {all}");
                return Err(Error::setting(format!("{key}.{field}"), format!("{length} numbers"), wanted));
            }
        }
        if self.gain_db.len() != self.phase_deg.len() {
            return Err(Error::setting(format!("{key}.phase_deg"), self.phase_deg.len(), "as many phases as gains"));
        }
        Ok(())
    }
}

impl ChannelMismatch {
    /// `[rx]` or `[tx, rx]`.
    pub fn factors(&self) -> Vec<Complex64> {
        let factor =
            |(gain_db, phase_deg): (&f64, &f64)| Complex64::from_polar(10f64.powf(gain_db / 20.0), phase_deg.to_radians());
        self.gain_db.iter().zip(&self.phase_deg).map(factor).collect()
    }

    /// Multiplies every channel by its factor, of `[rx]` or `[tx, rx]` as [`Self::factors`] has them.
    pub fn apply(factors: &[Complex64], signal: &mut Signal) {
        let receivers = signal.rx;
        for (place, chirp) in signal.chirps_mut() {
            let factor = factors[(place.tx * receivers + place.rx) % factors.len()];
            chirp.iter_mut().for_each(|value| *value *= factor);
        }
    }
}
