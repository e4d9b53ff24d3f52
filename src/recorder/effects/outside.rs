//! What no id of docs/report.md names, in the receiver and the converter.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rand::RngExt;

use super::decibels::from_db;
use super::resample::Resampler;
use super::signal::{Place, Signal};
use super::timing::Clock;
use super::{EffectsConfig, OUTSIDE, Outside};
use crate::data::IfFrame;
use crate::error::{Error, Result};
use crate::recorder::world::{Draw, World};

/// Every receiver is sampled a little later than the one before it; on whole chirps with guard samples.
pub fn skew(effects: &EffectsConfig, resampler: &Resampler, signal: &mut Signal) {
    for effect in &effects.outside {
        if let Outside::RxMuxSkew { fraction } = effect {
            for (place, chirp) in signal.chirps_mut() {
                if place.rx > 0 {
                    let later = resampler.shifted(chirp, fraction * place.rx as f64);
                    chirp.copy_from_slice(&later);
                }
            }
        }
    }
}

/// Whether a receiver's gain hops in a frame.
pub fn hops(world: &World, entry: usize, frame: usize) -> bool {
    world.random(Draw::Effect { id: OUTSIDE + entry as u64, frame }).random()
}

pub fn gains(world: &World, clock: &Clock, signal: &mut Signal) {
    let frame = signal.frame;
    for (entry, effect) in world.effects.outside.iter().enumerate() {
        match *effect {
            Outside::MainsGainRipple { rate_hz, depth } => {
                let phase = world.phase(OUTSIDE + entry as u64, 0);
                for (Place { tx, index, .. }, chirp) in signal.chirps_mut() {
                    let time_s = clock.ramp_s(&world.radar, frame, tx, index);
                    let gain = 1.0 + depth * (TAU * rate_hz * time_s + phase).cos();
                    chirp.iter_mut().for_each(|value| *value *= gain);
                }
            }
            Outside::GainHop { rx, db } if hops(world, entry, frame) => {
                for (_, chirp) in signal.chirps_mut().filter(|(place, _)| place.rx == rx) {
                    chirp.iter_mut().for_each(|value| *value *= from_db(db));
                }
            }
            _ => {}
        }
    }
}

pub fn pulling(effects: &EffectsConfig, peak: f64, signal: &mut Signal) {
    for effect in &effects.outside {
        if let Outside::LoPulling { peak_rad } = effect
            && peak > 0.0
        {
            signal.values.iter_mut().for_each(|value| *value *= Complex64::cis(peak_rad * value.re / peak));
        }
    }
}

pub fn memory(effects: &EffectsConfig, signal: &mut Signal) {
    for effect in &effects.outside {
        match *effect {
            Outside::ChirpAfterglow { level_db } => {
                let (left, samples) = (from_db(level_db), signal.samples);
                for channel in signal.values.chunks_exact_mut(signal.loops * samples) {
                    // From the last chirp on, so that only what was really there is left over.
                    for at in (samples..channel.len()).rev() {
                        let before = channel[at - samples];
                        channel[at] += left * before;
                    }
                }
            }
            Outside::MuxCrosstalk { level_db } => signal.mix_receivers(|_, _, values| {
                for rx in (1..values.len()).rev() {
                    let before = values[rx - 1];
                    values[rx] += from_db(level_db) * before;
                }
            }),
            _ => {}
        }
    }
}

/// What happens to codes.
pub fn codes(effects: &EffectsConfig, number: usize, frame: &mut IfFrame) {
    let [_, receivers, loops, samples] = frame.dims;
    let channel = loops * samples;
    for effect in &effects.outside {
        match *effect {
            Outside::LsbStuck { rx, bit } => {
                for block in frame.re.chunks_exact_mut(channel).skip(rx).step_by(receivers) {
                    block.iter_mut().for_each(|code| *code = (*code as i32 | 1 << bit) as f32);
                }
            }
            Outside::BufferSlip { frame: at, rx, samples: turn } if at == number => {
                let turn = turn % samples;
                for values in std::iter::once(&mut frame.re).chain(&mut frame.im) {
                    for block in values.chunks_exact_mut(channel).skip(rx).step_by(receivers) {
                        block.chunks_exact_mut(samples).for_each(|chirp| chirp.rotate_right(turn));
                    }
                }
            }
            _ => {}
        }
    }
}

pub fn check(world: &World, key: &str) -> Result<()> {
    let receivers = world.radar.rx_m.len();
    for (index, effect) in world.effects.outside.iter().enumerate() {
        let key = format!("{key}.outside[{index}]");
        effect.check(&key)?;
        match *effect {
            Outside::LsbStuck { rx, .. } | Outside::GainHop { rx, .. } | Outside::BufferSlip { rx, .. } if rx >= receivers => {
                return Err(Error::setting(format!("{key}.rx"), rx, format!("a receiver below {receivers}")));
            }
            Outside::LsbStuck { .. } if !world.receiver.adc => {
                return Err(Error::setting(key, "lsb_stuck", "another kind without receiver.adc"));
            }
            Outside::BufferSlip { frame, .. } if frame >= world.radar.frames => {
                return Err(Error::setting(format!("{key}.frame"), frame, format!("a frame below {}", world.radar.frames)));
            }
            Outside::RxMuxSkew { .. } | Outside::MuxCrosstalk { .. } if receivers < 2 => {
                return Err(Error::setting(key, effect.kind(), "another kind for a single receiver"));
            }
            _ => {}
        }
    }
    Ok(())
}
