//! An ADC window that opens at another time.

use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};
use crate::radar::Radar;

settings! {
    /// The ADC window opens later than stated.
    AdcStartError { offset_s: f64 [-5.0e-6, 5.0e-6] }
}

impl Effect for AdcStartError {
    fn check(&self, context: &Context, key: &str) -> Result<()> {
        let start_s = context.radar.adc_start_s;
        if start_s + self.offset_s < 0.0 {
            let wanted = format!("no earlier than the ramp, above {}", -start_s);
            return Err(Error::setting(format!("{key}.offset_s"), self.offset_s, wanted));
        }
        Ok(())
    }

    fn disturb(&self, radar: &mut Radar) {
        radar.adc_start_s += self.offset_s;
    }
}
