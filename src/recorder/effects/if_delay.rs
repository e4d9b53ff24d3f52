//! A delay of the intermediate frequency, which opens the window earlier.

use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};
use crate::radar::Radar;

settings! {
    /// The intermediate frequency reaches the ADC late.
    IfDelay { delay_s: f64 [0.0, 2.0e-6] }
}

impl Effect for IfDelay {
    fn check(&self, context: &Context, key: &str) -> Result<()> {
        let start_s = context.radar.adc_start_s;
        if self.delay_s >= start_s {
            let wanted = format!("less than radar.adc_start_s, {start_s}");
            return Err(Error::setting(format!("{key}.delay_s"), self.delay_s, wanted));
        }
        Ok(())
    }

    fn disturb(&self, radar: &mut Radar) {
        radar.adc_start_s -= self.delay_s;
    }
}
