//! When things happen: lost frames, late transmitters, and a motion whose clock is not the radar's.

use super::EffectsConfig;
use crate::error::{Error, Result};
use crate::radar::Radar;

/// From the places of a recording to the times at which they were really recorded.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    /// (first frame after the gap, frames lost)
    lost: Option<(usize, usize)>,
    slot_s: f64,
    offset_s: f64,
    drift: f64,
}

impl Clock {
    pub fn new(effects: &EffectsConfig) -> Self {
        Self {
            lost: effects.frame_drop.as_ref().map(|drop| (drop.at, drop.count)),
            slot_s: effects.tdm_phase.as_ref().map_or(0.0, |tdm| tdm.slot_s),
            offset_s: effects.clock_offset.as_ref().map_or(0.0, |clock| clock.offset_s),
            drift: effects.clock_drift.as_ref().map_or(0.0, |clock| clock.relative),
        }
    }

    /// Radar time at which the ramp of a chirp starts.
    pub fn ramp_s(&self, radar: &Radar, frame: usize, tx: usize, index: usize) -> f64 {
        let skipped = self.lost.map_or(0, |(at, count)| if frame >= at { count } else { 0 });
        radar.chirp_time_s(frame + skipped, tx, index) + tx as f64 * self.slot_s
    }

    /// Time of the motion at a radar time (`clock_offset`, `clock_drift`).
    pub fn motion_s(&self, time_s: f64) -> f64 {
        time_s * (1.0 + self.drift) + self.offset_s
    }

    /// First and last time of the motion that a recording needs, what its own schedule says included.
    pub fn motion_span_s(&self, radar: &Radar) -> (f64, f64) {
        let end = |frame: usize| self.ramp_s(radar, frame, 0, 0) + radar.frame_duration_s();
        let last = end(radar.frames - 1) + radar.tx_m.len() as f64 * self.slot_s.abs();
        let stated = radar.chirp_time_s(radar.frames - 1, 0, 0) + radar.frame_duration_s();
        (self.motion_s(0.0).min(0.0), self.motion_s(last).max(stated))
    }
}

pub fn check(effects: &EffectsConfig, radar: &Radar, key: &str) -> Result<()> {
    if let Some(drop) = &effects.frame_drop
        && drop.at >= radar.frames
    {
        return Err(Error::setting(format!("{key}.frame_drop.at"), drop.at, format!("a frame below {}", radar.frames)));
    }
    if let Some(tdm) = &effects.tdm_phase {
        if radar.tx_m.len() < 2 {
            return Err(Error::setting(format!("{key}.tdm_phase"), "on", "off for a radar with a single transmitter"));
        }
        if tdm.slot_s <= -radar.chirp_period_s {
            let wanted = format!("above minus the chirp period, {}", -radar.chirp_period_s);
            return Err(Error::setting(format!("{key}.tdm_phase.slot_s"), tdm.slot_s, wanted));
        }
    }
    Ok(())
}
