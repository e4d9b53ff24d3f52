//! The antennas and their channels.

use num_complex::Complex64;

use super::signal::Signal;
use super::{EffectsConfig, MUTUAL_COUPLING};
use crate::error::{Error, Result};
use crate::radar::Radar;
use crate::recorder::world::World;

/// `channel_mismatch` and `mutual_coupling`.
#[derive(Clone, Debug)]
pub struct Channels {
    /// `[rx]` or `[tx · rx]`; empty: none.
    factors: Vec<Complex64>,
    coupling: Option<Complex64>,
}

impl Channels {
    pub fn new(world: &World) -> Self {
        let factors = world.effects.channel_mismatch.as_ref().map_or(vec![], |mismatch| {
            let count = mismatch.gain_db.len().max(mismatch.phase_deg.len());
            let at = |list: &[f64], index: usize| list.get(index).copied().unwrap_or(0.0);
            (0..count)
                .map(|i| {
                    let gain = 10f64.powf(at(&mismatch.gain_db, i) / 20.0);
                    Complex64::from_polar(gain, at(&mismatch.phase_deg, i).to_radians())
                })
                .collect()
        });
        let coupling = world
            .effects
            .mutual_coupling
            .as_ref()
            .map(|coupling| Complex64::from_polar(10f64.powf(coupling.level_db / 20.0), world.phase(MUTUAL_COUPLING, 0)));
        Self { factors, coupling }
    }

    /// Each receiver also picks up what its neighbours do; then come the channels' own gains.
    pub fn apply(&self, signal: &mut Signal) {
        if let Some(coupling) = self.coupling {
            signal.mix_receivers(|_, _, values| {
                let own = values.to_vec();
                for (rx, value) in values.iter_mut().enumerate() {
                    let below = if rx > 0 { own[rx - 1] } else { Complex64::ZERO };
                    let above = own.get(rx + 1).copied().unwrap_or(Complex64::ZERO);
                    *value += coupling * (below + above);
                }
            });
        }
        if !self.factors.is_empty() {
            let receivers = signal.rx;
            for (place, chirp) in signal.chirps_mut() {
                let factor = self.factors[(place.tx * receivers + place.rx) % self.factors.len()];
                chirp.iter_mut().for_each(|value| *value *= factor);
            }
        }
    }
}

pub fn check(effects: &EffectsConfig, radar: &Radar, key: &str) -> Result<()> {
    let (rx, all) = (radar.rx_m.len(), radar.rx_m.len() * radar.tx_m.len());
    if let Some(mismatch) = &effects.channel_mismatch {
        for (field, length) in [("gain_db", mismatch.gain_db.len()), ("phase_deg", mismatch.phase_deg.len())] {
            if length != rx && length != all {
                let wanted = format!("one per receiver, {rx}, or per channel, {all}");
                return Err(Error::setting(format!("{key}.channel_mismatch.{field}"), format!("{length} numbers"), wanted));
            }
        }
        if mismatch.gain_db.len() != mismatch.phase_deg.len() {
            let wanted = "as many phases as gains";
            return Err(Error::setting(format!("{key}.channel_mismatch.phase_deg"), mismatch.phase_deg.len(), wanted));
        }
    }
    if let Some(position) = &effects.antenna_position
        && position.offset_m.len() != rx
    {
        let found = format!("{} numbers", position.offset_m.len());
        return Err(Error::setting(format!("{key}.antenna_position.offset_m"), found, format!("one per receiver, {rx}")));
    }
    if effects.mutual_coupling.is_some() && rx < 2 {
        return Err(Error::setting(format!("{key}.mutual_coupling"), "on", "off for a single receiver"));
    }
    Ok(())
}
