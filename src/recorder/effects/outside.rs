//! What no id of docs/report.md names.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::chirp_error::ChirpErrors;
use super::context::Context;
use super::decibels::from_db;
use super::effect::Effect;
use super::settings::{Bounded, Bounds};
use crate::data::IfFrame;
use crate::error::{Error, Result};
use crate::recorder::draws::{Draws, Stream};
use crate::recorder::resample::Resampler;
use crate::recorder::signal::{Place, Signal};

/// An effect that no id of docs/report.md names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Outside {
    /// The gain follows the mains, 1 + depth · cos.
    MainsGainRipple { rate_hz: f64, depth: f64 },
    /// A bit of one receiver's in-phase codes is stuck at 1.
    LsbStuck { rx: usize, bit: usize },
    /// The converter is shared: receiver r is sampled r · `fraction` of a sample period late.
    RxMuxSkew { fraction: f64 },
    /// What stands within `radius_m` of a place reflects with the light: 1 + depth · cos.
    LampModulation { position_m: [f64; 3], radius_m: f64, rate_hz: f64, depth: f64 },
    /// The part of the walls within `radius_m` of a place oscillates along y.
    MovingCurtain { position_m: [f64; 3], radius_m: f64, rate_hz: f64, swing_m: f64 },
    /// The oscillator follows the signal: its phase turns by up to `peak_rad` with the strongest beat.
    LoPulling { peak_rad: f64 },
    /// The chirp bends more from frame to frame, up to this at the edges of its window in the last frame.
    ThermalCurvature { peak_hz: f64 },
    /// One receiver's gain hops by `db` in a random half of the frames.
    GainHop { rx: usize, db: f64 },
    /// A part of each receiver's last sample is left in the next receiver's.
    MuxCrosstalk { level_db: f64 },
    /// A part of each chirp is left in the next one.
    ChirpAfterglow { level_db: f64 },
    /// In a frame, one receiver's samples come out turned by a few within each chirp.
    BufferSlip { frame: usize, rx: usize, samples: usize },
}

impl Outside {
    /// Word of [`Self::MainsGainRipple`].
    pub const MAINS_GAIN_RIPPLE: &str = "mains_gain_ripple";
    /// Word of [`Self::LsbStuck`].
    pub const LSB_STUCK: &str = "lsb_stuck";
    /// Word of [`Self::RxMuxSkew`].
    pub const RX_MUX_SKEW: &str = "rx_mux_skew";
    /// Word of [`Self::LampModulation`].
    pub const LAMP_MODULATION: &str = "lamp_modulation";
    /// Word of [`Self::MovingCurtain`].
    pub const MOVING_CURTAIN: &str = "moving_curtain";
    /// Word of [`Self::LoPulling`].
    pub const LO_PULLING: &str = "lo_pulling";
    /// Word of [`Self::ThermalCurvature`].
    pub const THERMAL_CURVATURE: &str = "thermal_curvature";
    /// Word of [`Self::GainHop`].
    pub const GAIN_HOP: &str = "gain_hop";
    /// Word of [`Self::MuxCrosstalk`].
    pub const MUX_CROSSTALK: &str = "mux_crosstalk";
    /// Word of [`Self::ChirpAfterglow`].
    pub const CHIRP_AFTERGLOW: &str = "chirp_afterglow";
    /// Word of [`Self::BufferSlip`].
    pub const BUFFER_SLIP: &str = "buffer_slip";

    /// The word of `kind`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::MainsGainRipple { .. } => Self::MAINS_GAIN_RIPPLE,
            Self::LsbStuck { .. } => Self::LSB_STUCK,
            Self::RxMuxSkew { .. } => Self::RX_MUX_SKEW,
            Self::LampModulation { .. } => Self::LAMP_MODULATION,
            Self::MovingCurtain { .. } => Self::MOVING_CURTAIN,
            Self::LoPulling { .. } => Self::LO_PULLING,
            Self::ThermalCurvature { .. } => Self::THERMAL_CURVATURE,
            Self::GainHop { .. } => Self::GAIN_HOP,
            Self::MuxCrosstalk { .. } => Self::MUX_CROSSTALK,
            Self::ChirpAfterglow { .. } => Self::CHIRP_AFTERGLOW,
            Self::BufferSlip { .. } => Self::BUFFER_SLIP,
        }
    }
}

/// Of the first entry; the others follow each other.
pub const FIRST: Stream = Stream::new(100);

fn stream(index: usize) -> Stream {
    Stream::new(FIRST.id + index as u64)
}

impl Bounds for Outside {
    fn check_bounds(&self, key: &str) -> Result<()> {
        let at = |field: &str, value: &dyn Fn() -> Option<f64>, low: f64, high: f64| match value() {
            Some(found) => Err(Error::setting(format!("{key}.{field}"), found, format!("between {low} and {high}"))
                .with_hint(format!("in the entry of kind `{}`", self.kind()))),
            None => Ok(()),
        };
        let all = |fields: &[(&str, f64, f64, f64)]| {
            fields.iter().try_for_each(|&(field, value, low, high)| at(field, &|| value.outside(low, high), low, high))
        };
        match *self {
            Self::MainsGainRipple { rate_hz, depth } => all(&[("rate_hz", rate_hz, 0.0, 1.0e5), ("depth", depth, 0.0, 1.0)]),
            Self::LsbStuck { bit, .. } => all(&[("bit", bit as f64, 0.0, 14.0)]),
            Self::RxMuxSkew { fraction } => all(&[("fraction", fraction, -1.0, 1.0)]),
            Self::LampModulation { position_m, radius_m, rate_hz, depth } => {
                at("position_m", &|| position_m.outside(-100.0, 100.0), -100.0, 100.0)?;
                all(&[("radius_m", radius_m, 0.0, 100.0), ("rate_hz", rate_hz, 0.0, 1.0e5), ("depth", depth, 0.0, 1.0)])
            }
            Self::MovingCurtain { position_m, radius_m, rate_hz, swing_m } => {
                at("position_m", &|| position_m.outside(-100.0, 100.0), -100.0, 100.0)?;
                all(&[("radius_m", radius_m, 0.0, 100.0), ("rate_hz", rate_hz, 0.0, 100.0), ("swing_m", swing_m, 0.0, 0.02)])
            }
            Self::LoPulling { peak_rad } => all(&[("peak_rad", peak_rad, 0.0, 3.0)]),
            Self::ThermalCurvature { peak_hz } => all(&[("peak_hz", peak_hz, -2.0e7, 2.0e7)]),
            Self::GainHop { db, .. } => all(&[("db", db, -20.0, 20.0)]),
            Self::MuxCrosstalk { level_db } | Self::ChirpAfterglow { level_db } => all(&[("level_db", level_db, -120.0, 0.0)]),
            Self::BufferSlip { samples, .. } => all(&[("samples", samples as f64, 1.0, 1.0e6)]),
        }
    }
}

impl Effect for Outside {
    const STREAM: Option<Stream> = Some(FIRST);

    fn check(&self, context: &Context, key: &str) -> Result<()> {
        let (receivers, frames) = (context.radar.rx_m.len(), context.radar.frames);
        match *self {
            Self::LsbStuck { rx, .. } | Self::GainHop { rx, .. } | Self::BufferSlip { rx, .. } if rx >= receivers => {
                Err(Error::setting(format!("{key}.rx"), rx, format!("a receiver below {receivers}")))
            }
            Self::LsbStuck { .. } if !context.receiver.adc => {
                Err(Error::setting(key, "lsb_stuck", "another kind without receiver.adc"))
            }
            Self::BufferSlip { frame, .. } if frame >= frames => {
                Err(Error::setting(format!("{key}.frame"), frame, format!("a frame below {frames}")))
            }
            Self::RxMuxSkew { .. } | Self::MuxCrosstalk { .. } if receivers < 2 => {
                Err(Error::setting(key, self.kind(), "another kind for a single receiver"))
            }
            _ => Ok(()),
        }
    }

    fn drawn(&self, context: &Context, _: ChirpErrors) -> Value {
        match self {
            Self::MainsGainRipple { .. } | Self::LampModulation { .. } | Self::MovingCurtain { .. } => {
                json!({ "phase_rad": Self::phase_rad(&context.draws, context.index) })
            }
            Self::GainHop { .. } => {
                let hops = |frame: &usize| Self::hops(&context.draws, context.index, *frame);
                json!({ "drawn_frames": (0..context.radar.frames).filter(hops).collect::<Vec<_>>() })
            }
            _ => Value::Null,
        }
    }

    fn unnamed(&self) -> Option<&'static str> {
        Some(self.kind())
    }
}

/// The laws; those of the room's returns and of the oscillator are with them.
impl Outside {
    /// Of an entry of the list.
    pub fn phase_rad(draws: &Draws, index: usize) -> f64 {
        draws.phase(stream(index), 0)
    }

    /// Whether a receiver's gain hops in a frame.
    fn hops(draws: &Draws, index: usize, frame: usize) -> bool {
        draws.of_effect(stream(index), frame).random()
    }

    /// Every receiver is sampled a little later than the one before it; on whole chirps with guard samples.
    pub fn skew(&self, resampler: &Resampler, signal: &mut Signal) {
        if let Self::RxMuxSkew { fraction } = self {
            for (place, chirp) in signal.chirps_mut().filter(|(place, _)| place.rx > 0) {
                let later = resampler.shifted(chirp, fraction * place.rx as f64);
                chirp.copy_from_slice(&later);
            }
        }
    }

    /// `ramp_s`: when a chirp's ramp starts.
    pub fn amplify(&self, draws: &Draws, index: usize, ramp_s: impl Fn(Place) -> f64, signal: &mut Signal) {
        match *self {
            Self::MainsGainRipple { rate_hz, depth } => {
                let phase = Self::phase_rad(draws, index);
                for (place, chirp) in signal.chirps_mut() {
                    let gain = 1.0 + depth * (TAU * rate_hz * ramp_s(place) + phase).cos();
                    chirp.iter_mut().for_each(|value| *value *= gain);
                }
            }
            Self::GainHop { rx, db } if Self::hops(draws, index, signal.frame) => {
                for (_, chirp) in signal.chirps_mut().filter(|(place, _)| place.rx == rx) {
                    chirp.iter_mut().for_each(|value| *value *= from_db(db));
                }
            }
            _ => {}
        }
    }

    /// [`Self::LoPulling`]: turns every sample's phase in proportion to its real part over `peak`; other kinds do nothing.
    pub fn pull(&self, peak: f64, signal: &mut Signal) {
        if let Self::LoPulling { peak_rad } = self
            && peak > 0.0
        {
            signal.values.iter_mut().for_each(|value| *value *= Complex64::cis(peak_rad * value.re / peak));
        }
    }

    /// [`Self::ChirpAfterglow`] and [`Self::MuxCrosstalk`]: adds to every sample a part of what came before it; other kinds do
    /// nothing.
    pub fn remember(&self, signal: &mut Signal) {
        match *self {
            Self::ChirpAfterglow { level_db } => {
                let (left, samples) = (from_db(level_db), signal.samples);
                for channel in signal.values.chunks_exact_mut(signal.loops * samples) {
                    // From the last chirp on, so that only what was really there is left over.
                    for at in (samples..channel.len()).rev() {
                        let before = channel[at - samples];
                        channel[at] += left * before;
                    }
                }
            }
            Self::MuxCrosstalk { level_db } => signal.mix_receivers(|_, _, values| {
                for rx in (1..values.len()).rev() {
                    let before = values[rx - 1];
                    values[rx] += from_db(level_db) * before;
                }
            }),
            _ => {}
        }
    }

    /// What happens to the codes of a frame.
    pub fn damage(&self, number: usize, frame: &mut IfFrame) {
        let [_, receivers, loops, samples] = frame.dims;
        let channel = loops * samples;
        match *self {
            Self::LsbStuck { rx, bit } => {
                for block in frame.re.chunks_exact_mut(channel).skip(rx).step_by(receivers) {
                    block.iter_mut().for_each(|code| *code = (*code as i32 | 1 << bit) as f32);
                }
            }
            Self::BufferSlip { frame: at, rx, samples: turn } if at == number => {
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
