//! Antennas that stand elsewhere on the board.

use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::{Error, Result};
use crate::radar::Radar;

settings! {
    /// Per receiver, along x.
    AntennaPosition { offset_m: Vec<f64> [-0.1, 0.1] }
}

impl Effect for AntennaPosition {
    fn check(&self, context: &Context, key: &str) -> Result<()> {
        let rx = context.radar.rx_m.len();
        if self.offset_m.len() != rx {
            let found = format!("{} numbers", self.offset_m.len());
            return Err(Error::setting(format!("{key}.offset_m"), found, format!("one per receiver, {rx}")));
        }
        Ok(())
    }

    fn disturb(&self, radar: &mut Radar) {
        for (antenna, offset) in radar.rx_m.iter_mut().zip(&self.offset_m) {
            antenna[0] += offset;
        }
    }
}
