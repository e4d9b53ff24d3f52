//! When things happen: lost frames, late transmitters, and a motion whose clock is not the radar's.

use crate::radar::Radar;
use crate::recorder::effects::{ClockDrift, ClockOffset, EffectsConfig, FrameDrop, TdmPhase};

/// From the places of a recording to the times at which they were really recorded.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    drop: Option<FrameDrop>,
    tdm: Option<TdmPhase>,
    offset: Option<ClockOffset>,
    drift: Option<ClockDrift>,
}

impl Clock {
    /// The clock of a world with these effects.
    pub fn new(effects: &EffectsConfig) -> Self {
        Self { drop: effects.frame_drop, tdm: effects.tdm_phase, offset: effects.clock_offset, drift: effects.clock_drift }
    }

    /// Radar time at which the ramp of a chirp starts.
    pub fn ramp_s(&self, radar: &Radar, frame: usize, tx: usize, index: usize) -> f64 {
        let lost = self.drop.map_or(0, |drop| drop.lost(frame));
        radar.chirp_time_s(frame + lost, tx, index) + tx as f64 * self.slot_s()
    }

    fn slot_s(&self) -> f64 {
        self.tdm.map_or(0.0, |tdm| tdm.slot_s)
    }

    /// Time of the motion at a radar time.
    pub fn motion_s(&self, time_s: f64) -> f64 {
        time_s * (1.0 + self.drift.map_or(0.0, |clock| clock.relative)) + self.offset.map_or(0.0, |clock| clock.offset_s)
    }

    /// First and last time of the motion that a recording needs, what its own schedule says included.
    pub fn motion_span_s(&self, radar: &Radar) -> (f64, f64) {
        let end = |frame: usize| self.ramp_s(radar, frame, 0, 0) + radar.frame_duration_s();
        let last = end(radar.frames - 1) + radar.tx_m.len() as f64 * self.slot_s().abs();
        let stated = radar.chirp_time_s(radar.frames - 1, 0, 0) + radar.frame_duration_s();
        (self.motion_s(0.0).min(0.0), self.motion_s(last).max(stated))
    }
}
