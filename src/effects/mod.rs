//! Physics that recordings hold and the plain simulator leaves out: the library of effects, one file each, in the
//! order in which the signal meets them.
//!
//! In a config, `[[simulator.effects]]` with an id and values, such as
//!
//! ```toml
//! [[simulator.effects]]
//! id = "wall_ghost"
//! choice = "right"
//! parameters = { coefficient = [0.35] }
//! ```
//!
//! Levels (`level_db`, `re`, `im`, `level`) are relative to the parameter `reference`, an amplitude in the recording's unit;
//! without it, to the strongest sample of each simulated frame. Give it, so that a receiver's property does not follow the
//! scene. Lists are for each channel (tx by tx) or each receiver, and are repeated where they are too short. Operators act
//! on the complex signal, also where a receiver without quadrature then keeps the real part alone.
//!
//! An effect is neutral until its parameters leave their neutral values; then it is part of the simulator like any
//! other stage, with gradients to its parameters.

mod chain;
mod context;
mod effect;
mod info;
pub mod mirror;
mod operator;
mod parameter;
mod points;
mod setting;
mod tones;
mod values;

pub mod adc_saturation;
pub mod adc_start_error;
pub mod antenna_pattern;
pub mod antenna_position;
pub mod body_multibounce;
pub mod breathing;
pub mod carried_reflector;
pub mod channel_mismatch;
pub mod chirp_droop;
pub mod chirp_nonlinearity;
pub mod chirp_ripple;
pub mod chirp_settling;
pub mod chirp_start_jitter;
pub mod clock_drift;
pub mod clock_offset;
pub mod clothing_delay;
pub mod coloured_noise;
pub mod compression;
pub mod correlated_noise;
pub mod dc_offset;
pub mod floor_bounce;
pub mod frame_drop;
pub mod gain_drift;
pub mod heartbeat;
pub mod if_delay;
pub mod if_highpass;
pub mod if_lowpass;
pub mod impulsive_noise;
pub mod interference;
pub mod iq_imbalance;
pub mod moving_reflector;
pub mod mutual_coupling;
pub mod object_radar_object;
pub mod part_reflectivity;
pub mod phase_noise;
pub mod pose_offset;
pub mod radar_vibration;
pub mod ramp_edge_transient;
pub mod range_alias;
pub mod range_bias;
pub mod second_harmonic;
pub mod slope_error;
pub mod soft_occlusion;
pub mod spur;
pub mod start_frequency_error;
pub mod static_reflector;
pub mod tdm_phase;
pub mod tx_leakage;
pub mod wall_ghost;
pub use chain::Effects;
pub use context::{Context, legendre};
pub use effect::{Effect, Parameter};
pub use info::{Choice, EffectInfo, Stage};
pub use operator::{Chirps, DirectReturns, Operator, SignalOperator};
pub use parameter::{ParameterInfo, Role};
pub use points::BodyPoints;
pub use setting::EffectSetting;
pub use tones::Tones;
pub use values::Values;

/// All effects, in the order of the signal's way: when a chirp sees the scene, what is there, how it reflects, which
/// ways the waves take, the chirp, the antennas, the receiver, the noise.
static LIBRARY: [&EffectInfo; 49] = [
    &clock_offset::INFO,
    &clock_drift::INFO,
    &frame_drop::INFO,
    &tdm_phase::INFO,
    &pose_offset::INFO,
    &range_bias::INFO,
    &static_reflector::INFO,
    &moving_reflector::INFO,
    &carried_reflector::INFO,
    &radar_vibration::INFO,
    &breathing::INFO,
    &heartbeat::INFO,
    &clothing_delay::INFO,
    &part_reflectivity::INFO,
    &wall_ghost::INFO,
    &floor_bounce::INFO,
    &object_radar_object::INFO,
    &range_alias::INFO,
    &soft_occlusion::INFO,
    &body_multibounce::INFO,
    &start_frequency_error::INFO,
    &adc_start_error::INFO,
    &slope_error::INFO,
    &chirp_nonlinearity::INFO,
    &chirp_ripple::INFO,
    &phase_noise::INFO,
    &chirp_start_jitter::INFO,
    &antenna_pattern::INFO,
    &channel_mismatch::INFO,
    &antenna_position::INFO,
    &mutual_coupling::INFO,
    &tx_leakage::INFO,
    &chirp_droop::INFO,
    &chirp_settling::INFO,
    &gain_drift::INFO,
    &interference::INFO,
    &second_harmonic::INFO,
    &compression::INFO,
    &if_delay::INFO,
    &if_highpass::INFO,
    &if_lowpass::INFO,
    &spur::INFO,
    &ramp_edge_transient::INFO,
    &iq_imbalance::INFO,
    &dc_offset::INFO,
    &adc_saturation::INFO,
    &coloured_noise::INFO,
    &impulsive_noise::INFO,
    &correlated_noise::INFO,
];

/// All effects, in the order of the signal's way.
pub fn library() -> &'static [&'static EffectInfo] {
    &LIBRARY
}

/// The effect of this id.
pub fn info(id: &str) -> Option<&'static EffectInfo> {
    LIBRARY.iter().find(|info| info.id == id).copied()
}

/// Effects that leave nearly the same trace as this one, in the library's order.
pub fn look_alikes(of: &EffectInfo) -> impl Iterator<Item = &'static EffectInfo> {
    library().iter().copied().filter(|other| other.look_alikes.contains(&of.id) || of.look_alikes.contains(&other.id))
}

#[cfg(test)]
mod known_answer_tests;
#[cfg(test)]
pub(crate) mod point_tests;
#[cfg(test)]
mod test_support;
#[cfg(test)]
pub(crate) mod tests;
