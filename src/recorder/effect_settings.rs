//! The settings of `[effects]`: one optional table per effect id of docs/report.md, and `outside` for what no id names.
//!
//! Numbers carry their bounds, so that a mistake is named before anything is recorded. "Relative" means relative to the
//! peak sample of the recording without effects.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::room::Boundary;

/// Something whose numbers can lie between bounds.
pub trait Bounded {
    /// The first number that lies outside.
    fn outside(&self, low: f64, high: f64) -> Option<f64>;
}

impl Bounded for f64 {
    fn outside(&self, low: f64, high: f64) -> Option<f64> {
        (!(low..=high).contains(self)).then_some(*self)
    }
}

impl Bounded for usize {
    fn outside(&self, low: f64, high: f64) -> Option<f64> {
        (*self as f64).outside(low, high)
    }
}

impl<const N: usize> Bounded for [f64; N] {
    fn outside(&self, low: f64, high: f64) -> Option<f64> {
        self.iter().find_map(|value| value.outside(low, high))
    }
}

impl<T: Bounded> Bounded for Vec<T> {
    fn outside(&self, low: f64, high: f64) -> Option<f64> {
        self.iter().find_map(|value| value.outside(low, high))
    }
}

impl<T: Bounded> Bounded for Option<T> {
    fn outside(&self, low: f64, high: f64) -> Option<f64> {
        self.as_ref().and_then(|value| value.outside(low, high))
    }
}

pub(super) fn within(key: &str, field: &str, value: &impl Bounded, low: f64, high: f64) -> Result<()> {
    match value.outside(low, high) {
        Some(found) => Err(Error::setting(format!("{key}.{field}"), found, format!("between {low} and {high}"))),
        None => Ok(()),
    }
}

/// Structs of settings, each with a check of its bounds.
macro_rules! settings {
    ($($(#[$doc:meta])* $name:ident { $($(#[$attribute:meta])* $field:ident: $kind:ty $([$low:literal, $high:literal])?),* $(,)? })*) => { $(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name { $($(#[$attribute])* pub $field: $kind),* }

        impl $name {
            /// Refuses numbers out of bounds; `key` names this table in messages.
            #[allow(unused_variables)]
            pub fn check(&self, key: &str) -> Result<()> {
                $($(within(key, stringify!($field), &self.$field, $low, $high)?;)?)*
                Ok(())
            }
        }
    )* };
}

fn yes() -> bool {
    true
}

fn first_order() -> usize {
    1
}

fn torso() -> Vec<String> {
    ["pelvis", "spine1", "spine2", "spine3"].map(String::from).to_vec()
}

fn along_x() -> [f64; 3] {
    [1.0, 0.0, 0.0]
}

settings! {
    // Waveform

    /// The ramp starts at f₀ (1 + relative).
    StartFrequencyError { relative: f64 [-0.05, 0.05] }
    /// The ADC window opens later than stated.
    AdcStartError { offset_s: f64 [-5.0e-6, 5.0e-6] }
    /// The ramp climbs by S (1 + relative).
    SlopeError { relative: f64 [-0.2, 0.2] }
    /// A smooth quadratic and cubic error of the frequency over the ADC window, with this peak.
    ChirpNonlinearity { peak_hz: f64 [-2.0e7, 2.0e7] }
    /// A periodic error of the frequency, deviation · cos(2π ripple t), alike in all chirps.
    ChirpRipple { deviation_hz: f64 [0.0, 5.0e6], ripple_hz: f64 [1.0e4, 2.0e6] }
    /// A random error of the frequency per chirp, as the phase it causes at 3 m, root mean square.
    PhaseNoise {
        per_chirp_rad: f64 [0.0, 1.0],
        /// Another one per frame.
        #[serde(default)] per_frame_rad: f64 [0.0, 1.0],
    }
    /// Each ramp starts late by either nothing or this.
    ChirpStartJitter { jitter_s: f64 [0.0, 1.0e-7] }

    // Receiver

    /// A short path from transmitters to receivers on the board, `relative` to the peak sample.
    TxLeakage {
        range_m: f64 [0.0, 1.0], relative: f64 [0.0, 100.0],
        /// Standard deviation of its level between channels.
        #[serde(default)] spread_db: f64 [0.0, 20.0],
    }
    /// Relative to the peak sample; every receiver has its own within a third around it.
    DcOffset { i: f64 [-10.0, 10.0], q: f64 [-10.0, 10.0] }
    /// Q is stronger than I, and not at a right angle to it.
    IqImbalance { gain_db: f64 [-6.0, 6.0], phase_deg: f64 [-30.0, 30.0] }
    /// The part of its amplitude that the peak sample loses, by −κ|s|²s.
    Compression { level: f64 [0.0, 0.33] }
    /// The peak sample over the ADC's rail; above 1 it clips.
    AdcSaturation { level: f64 [0.1, 20.0] }
    /// Adds κ s², of the peak sample relative to itself.
    SecondHarmonic { level_db: f64 [-120.0, 0.0] }
    /// `order` equal first-order sections.
    IfHighpass {
        corner_hz: f64 [1.0e3, 5.0e6],
        #[serde(default = "first_order")] order: usize [1.0, 4.0],
        /// Absent or true: in steady state; false: it starts from rest when the ramp does.
        #[serde(default = "yes")] settled: bool,
        /// A multiplication of each chirp's DFT instead of a filter in time.
        #[serde(default)] circular: bool,
    }
    /// One pole.
    IfLowpass { corner_hz: f64 [1.0e5, 1.0e9] }
    /// The intermediate frequency reaches the ADC late.
    IfDelay { delay_s: f64 [0.0, 2.0e-6] }
    /// The power falls by this over the ADC window, linearly in decibels.
    ChirpDroop { db: f64 [-20.0, 20.0] }
    /// A transient, alike in all chirps of a receiver, in the last samples of each, relative to the peak sample.
    RampEdgeTransient { samples: usize [1.0, 64.0], level_db: f64 [-120.0, 40.0] }
    /// The first chirps of each frame are weaker by `depth`, recovering over `chirps`.
    ChirpSettling { depth: f64 [0.0, 1.0], chirps: f64 [0.1, 1000.0] }
    /// The gain changes by this over the recording, linearly in decibels.
    GainDrift { db: f64 [-20.0, 20.0] }
    /// A continuous tone at the intermediate frequency, relative to the peak sample.
    Spur {
        frequency_hz: f64 [-1.0e8, 1.0e8], level_db: f64 [-120.0, 40.0],
        /// It starts each chirp with the same phase.
        #[serde(default)] coherent: bool,
    }
    /// Crossings of another radar's chirps, in so many chirps of the recording.
    Interference {
        bursts: usize [1.0, 100000.0],
        /// To the peak sample.
        #[serde(default = "unit")] relative: f64 [0.0, 1000.0],
        /// Where the other radar stands.
        #[serde(default)] azimuth_deg: f64 [-90.0, 90.0],
    }

    // Antenna

    /// Per receiver, or per channel with the receivers of the first transmitter first.
    ChannelMismatch { gain_db: Vec<f64> [-20.0, 20.0], phase_deg: Vec<f64> [-360.0, 360.0] }
    /// Per receiver, along x.
    AntennaPosition { offset_m: Vec<f64> [-0.1, 0.1] }
    /// Power gain cos^q of every antenna.
    AntennaPattern { exponent: f64 [0.0, 40.0] }
    /// Of each receiver in its neighbours.
    MutualCoupling { level_db: f64 [-120.0, -3.0] }

    // Timing

    /// The body is recorded this much later in its motion than the radar's clock says.
    ClockOffset { offset_s: f64 [-2.0, 2.0] }
    /// The motion's clock runs faster by this.
    ClockDrift { relative: f64 [-0.1, 0.1] }
    /// Before frame `at`, so many frames are lost.
    FrameDrop { at: usize [1.0, 1.0e9], count: usize [1.0, 1000.0] }
    /// Each next transmitter fires this much later than its slot says.
    TdmPhase { slot_s: f64 [-1.0e-2, 1.0e-2] }

    // Scene

    /// The body stands elsewhere: turned about the radar's vertical axis, then moved.
    PoseOffset { offset_m: [f64; 3] [-3.0, 3.0], #[serde(default)] yaw_deg: f64 [-90.0, 90.0] }
    /// A delay in the radar's hardware, as a range.
    RangeBias { offset_m: f64 [-2.0, 2.0] }
    /// Relative to the body's root mean square (without a body: to the peak sample).
    StaticReflector { position_m: [f64; 3] [-100.0, 100.0], amplitude: f64 [0.0, 1.0e3] }
    /// Oscillates about its place; amplitude as for a static reflector.
    MovingReflector {
        position_m: [f64; 3] [-100.0, 100.0],
        /// Direction of the motion; any length.
        #[serde(default = "along_x")] axis: [f64; 3] [-1.0e3, 1.0e3],
        swing_m: f64 [0.0, 5.0], rate_hz: f64 [0.0, 100.0], amplitude: f64 [0.0, 1.0e3],
    }
    /// A thing that moves with a joint of the body; amplitude as for a static reflector.
    CarriedReflector { body_part: String, amplitude: f64 [0.0, 1.0e3] }
    /// Of the radar along its boresight.
    RadarVibration { amplitude_m: f64 [0.0, 1.0e-3], frequency_hz: f64 [0.0, 5.0e3] }

    // Propagation

    /// A wall that mirrors the body; its reflection coefficient.
    WallGhost { boundary: Boundary, coefficient: f64 [-1.0, 1.0], #[serde(default = "first_order")] order: usize [1.0, 2.0] }
    /// Two-ray propagation over the floor, both legs.
    FloorBounce { coefficient: f64 [-1.0, 1.0] }
    /// The board sends the scene's return into the scene again: `coefficient` is the second bounce over the first
    /// where the first has the peak sample's level.
    ObjectRadarObject { coefficient: f64 [0.0, 1.0] }
    /// Something beyond the unambiguous range; amplitude as for a static reflector.
    RangeAlias {
        range_m: f64 [0.0, 200.0], #[serde(default)] azimuth_deg: f64 [-90.0, 90.0], amplitude: f64 [0.0, 1.0e3],
        /// It may oscillate along the line of sight.
        #[serde(default)] swing_m: f64 [0.0, 5.0], #[serde(default)] rate_hz: f64 [0.0, 100.0],
    }
    /// The body shadows the room behind it, with the soft edge of the first Fresnel zone.
    SoftOcclusion {
        /// Width of the edge over that of the first Fresnel zone.
        #[serde(default = "unit")] width: f64 [0.05, 10.0],
    }
    /// The body's return once more, from `extra_m` farther.
    BodyMultibounce { extra_m: f64 [0.0, 5.0], #[serde(default = "third")] coefficient: f64 [-1.0, 1.0] }

    // Body

    /// The trunk's surface swells along its normals, ± amplitude.
    Breathing { rate_hz: f64 [0.0, 5.0], amplitude_m: f64 [0.0, 0.05] }
    /// The chest's front beats, twice per period in quick succession.
    Heartbeat { rate_hz: f64 [0.0, 10.0], amplitude_m: f64 [0.0, 0.01] }
    /// One-way extra path of what a garment covers.
    ClothingDelay { extra_m: f64 [0.0, 0.05], #[serde(default = "torso")] body_parts: Vec<String> }
    /// Of the parts that belong to a joint.
    PartReflectivity { body_part: String, db: f64 [-60.0, 40.0] }

    // Noise

    /// Density 1 + (knee/f)^power.
    ColouredNoise { knee_hz: f64 [0.0, 1.0e8], power: f64 [0.0, 4.0] }
    /// With this probability a sample's noise is `strength` times as strong.
    ImpulsiveNoise { rate: f64 [0.0, 1.0], strength: f64 [1.0, 1.0e4] }
    /// The correlation between receivers.
    CorrelatedNoise { rho: f64 [0.0, 1.0] }
}

fn unit() -> f64 {
    1.0
}

fn third() -> f64 {
    0.3
}

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
    pub const MAINS_GAIN_RIPPLE: &str = "mains_gain_ripple";
    pub const LSB_STUCK: &str = "lsb_stuck";
    pub const RX_MUX_SKEW: &str = "rx_mux_skew";
    pub const LAMP_MODULATION: &str = "lamp_modulation";
    pub const MOVING_CURTAIN: &str = "moving_curtain";
    pub const LO_PULLING: &str = "lo_pulling";
    pub const THERMAL_CURVATURE: &str = "thermal_curvature";
    pub const GAIN_HOP: &str = "gain_hop";
    pub const MUX_CROSSTALK: &str = "mux_crosstalk";
    pub const CHIRP_AFTERGLOW: &str = "chirp_afterglow";
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

    /// Refuses numbers out of bounds; `key` names the list in messages.
    pub fn check(&self, key: &str) -> Result<()> {
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
