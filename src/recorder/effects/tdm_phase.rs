//! Transmitters that fire outside their slots.

use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};

settings! {
    /// Each next transmitter fires this much later than its slot says.
    #[derive(Copy)]
    TdmPhase { slot_s: f64 [-1.0e-2, 1.0e-2] }
}

impl Effect for TdmPhase {
    fn check(&self, context: &Context, key: &str) -> Result<()> {
        let radar = context.radar;
        if radar.tx_m.len() < 2 {
            return Err(Error::setting(key, "on", "off for a radar with a single transmitter"));
        }
        if self.slot_s <= -radar.chirp_period_s {
            let wanted = format!("above minus the chirp period, {}", -radar.chirp_period_s);
            return Err(Error::setting(format!("{key}.slot_s"), self.slot_s, wanted));
        }
        Ok(())
    }
}
