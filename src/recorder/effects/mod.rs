//! What a recording may hold beyond the baseline: every effect id of docs/report.md that has a physical cause, and some
//! that no id names.
//!
//! The signal meets them in this order: scene, paths, oscillator, antennas, IF filter, nonlinearity, what is added,
//! noise, converter.

mod antenna;
mod body;
mod if_filter;
mod noise;
mod onto;
mod outside;
mod propagation;
mod receiver;
mod resample;
mod scene;
mod settings;
mod signal;
mod stage;
mod timing;
mod truth;
mod waveform;

use serde::{Deserialize, Serialize};

pub use body::{Physiology, garment_m, reflectivity_db};
pub use noise::shape as shape_noise;
pub use onto::{Ground, Onto};
pub use propagation::{MirrorPlan, Shadow, twice_bounced};
pub use receiver::Chain;
pub use scene::{Mover, SinusoidalMotion, Stage, movers, static_points, vibration};
pub use settings::*;
pub use signal::Signal;
pub use stage::{Stages, codes};
pub use timing::Clock;
pub use truth::listed;

use super::world::World;
use crate::error::Result;

/// Streams of random numbers, one per effect that draws some.
macro_rules! streams {
    ($($name:ident = $id:literal),*) => { $(pub(super) const $name: u64 = $id;)* };
}

streams! {
    CHIRP_RIPPLE = 1, PHASE_NOISE = 2, CHIRP_START_JITTER = 3, TX_LEAKAGE = 4, DC_OFFSET = 5, RAMP_EDGE_TRANSIENT = 6,
    SPUR = 7, INTERFERENCE = 8, MUTUAL_COUPLING = 9, MOVING_REFLECTOR = 10, RADAR_VIBRATION = 11, RANGE_ALIAS = 12,
    BREATHING = 13, HEARTBEAT = 14, IMPULSIVE_NOISE = 15, CORRELATED_NOISE = 16,
    // The entries of `outside` follow each other.
    OUTSIDE = 100
}

/// Whether the draws of an effect are noise, which is another one in each recording of the same truth.
pub fn is_noise(id: u64) -> bool {
    [PHASE_NOISE, CHIRP_START_JITTER, IMPULSIVE_NOISE, CORRELATED_NOISE].contains(&id)
}

/// The table `[effects]`: a sub-table per effect id, off where absent.
macro_rules! effects {
    ($($field:ident: $kind:ident),*; $($list:ident: $item:ident),*) => {
        /// Every effect of a recording, each switched by its table. The names are the ids of docs/report.md.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct EffectsConfig {
            $(#[serde(skip_serializing_if = "Option::is_none")] pub $field: Option<$kind>,)*
            $(#[serde(skip_serializing_if = "Vec::is_empty")] pub $list: Vec<$item>,)*
        }

        impl EffectsConfig {
            /// Refuses numbers out of bounds, whatever the radar and the room.
            fn check_bounds(&self, key: &str) -> Result<()> {
                $(if let Some(effect) = &self.$field { effect.check(&format!("{key}.{}", stringify!($field)))?; })*
                $(for (index, effect) in self.$list.iter().enumerate() {
                    effect.check(&format!("{key}.{}[{index}]", stringify!($list)))?;
                })*
                Ok(())
            }

            /// Those that are on, as (id, which of its kind, settings).
            fn listed(&self) -> Vec<(&'static str, usize, serde_json::Value)> {
                let mut all = vec![];
                let json = |effect: &dyn Fn() -> serde_json::Result<serde_json::Value>| effect().unwrap_or_default();
                $(if let Some(effect) = &self.$field {
                    all.push((stringify!($field), 0, json(&|| serde_json::to_value(effect))));
                })*
                $(for (index, effect) in self.$list.iter().enumerate() {
                    all.push((stringify!($list), index, json(&|| serde_json::to_value(effect))));
                })*
                all
            }
        }
    };
}

effects! {
    start_frequency_error: StartFrequencyError,
    adc_start_error: AdcStartError,
    slope_error: SlopeError,
    chirp_nonlinearity: ChirpNonlinearity,
    chirp_ripple: ChirpRipple,
    phase_noise: PhaseNoise,
    chirp_start_jitter: ChirpStartJitter,
    tx_leakage: TxLeakage,
    dc_offset: DcOffset,
    iq_imbalance: IqImbalance,
    compression: Compression,
    adc_saturation: AdcSaturation,
    second_harmonic: SecondHarmonic,
    if_highpass: IfHighpass,
    if_lowpass: IfLowpass,
    if_delay: IfDelay,
    chirp_droop: ChirpDroop,
    ramp_edge_transient: RampEdgeTransient,
    chirp_settling: ChirpSettling,
    gain_drift: GainDrift,
    spur: Spur,
    interference: Interference,
    channel_mismatch: ChannelMismatch,
    antenna_position: AntennaPosition,
    antenna_pattern: AntennaPattern,
    mutual_coupling: MutualCoupling,
    clock_offset: ClockOffset,
    clock_drift: ClockDrift,
    frame_drop: FrameDrop,
    tdm_phase: TdmPhase,
    pose_offset: PoseOffset,
    range_bias: RangeBias,
    carried_reflector: CarriedReflector,
    radar_vibration: RadarVibration,
    floor_bounce: FloorBounce,
    object_radar_object: ObjectRadarObject,
    range_alias: RangeAlias,
    soft_occlusion: SoftOcclusion,
    body_multibounce: BodyMultibounce,
    breathing: Breathing,
    heartbeat: Heartbeat,
    clothing_delay: ClothingDelay,
    part_reflectivity: PartReflectivity,
    coloured_noise: ColouredNoise,
    impulsive_noise: ImpulsiveNoise,
    correlated_noise: CorrelatedNoise;
    static_reflector: StaticReflector,
    moving_reflector: MovingReflector,
    wall_ghost: WallGhost,
    outside: Outside
}

impl EffectsConfig {
    /// Whether nothing is planted.
    pub fn is_off(&self) -> bool {
        *self == Self::default()
    }

    /// Those that a scene without a person can have.
    pub fn without_person(&self) -> Self {
        Self {
            soft_occlusion: None,
            body_multibounce: None,
            breathing: None,
            heartbeat: None,
            clothing_delay: None,
            part_reflectivity: None,
            pose_offset: None,
            clock_offset: None,
            clock_drift: None,
            floor_bounce: None,
            carried_reflector: None,
            wall_ghost: vec![],
            ..self.clone()
        }
    }

    /// Refuses what cannot work in this world; `key` names the table in messages.
    pub fn check(&self, world: &World, key: &str) -> Result<()> {
        self.check_bounds(key)?;
        timing::check(self, &world.radar, key)?;
        antenna::check(self, &world.radar, key)?;
        scene::check(world, key)?;
        propagation::check(world, key)?;
        receiver::check(world, key)?;
        noise::check(world, key)?;
        outside::check(world, key)
    }
}

#[cfg(test)]
mod outside_tests;
#[cfg(test)]
mod receiver_tests;
#[cfg(test)]
mod scene_tests;
#[cfg(test)]
mod test_support;
#[cfg(test)]
mod timing_tests;
#[cfg(test)]
mod waveform_tests;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_survives_a_round_trip_and_mistakes_are_named() {
        let text = "[if_highpass]\ncorner_hz = 3.5e5\norder = 2\n\n[[moving_reflector]]\nposition_m = [0.0, 3.0, 0.0]\nswing_m = 0.1\n\
                    rate_hz = 0.9\namplitude = 0.02\n\n[[outside]]\nkind = \"mains_gain_ripple\"\nrate_hz = 100.0\ndepth = 0.05\n";
        let config: EffectsConfig = toml::from_str(text).unwrap();
        assert!(config.if_highpass.as_ref().unwrap().settled);
        assert_eq!(toml::from_str::<EffectsConfig>(&toml::to_string(&config).unwrap()).unwrap(), config);
        let unknown = toml::from_str::<EffectsConfig>("[if_highpass]\ncorner = 1.0").unwrap_err().to_string();
        assert!(unknown.contains("unknown field `corner`"), "{unknown}");
        let unknown =
            toml::from_str::<EffectsConfig>("[[outside]]\nkind = \"gain_hop\"\nrx = 0\ndb = 1.0\nextra = 1").unwrap_err();
        assert!(unknown.to_string().contains("unknown field `extra`"), "{unknown}");
        let wrong = EffectsConfig { slope_error: Some(SlopeError { relative: f64::NAN }), ..EffectsConfig::default() };
        let message = wrong.check(&World::default(), "effects").unwrap_err().to_string();
        assert!(message.contains("`effects.slope_error.relative` is NaN, expected between -0.2 and 0.2"), "{message}");
    }
}
