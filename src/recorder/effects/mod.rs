//! What a recording may hold beyond the baseline: every effect id of FORMATS.md that has a physical cause, and some
//! that no id names.
//!
//! The signal meets them in this order: scene, paths, oscillator, antennas, IF filter, nonlinearity, what is added,
//! noise, converter.

mod settings;

use serde::{Deserialize, Serialize};

pub use settings::*;

use crate::error::Result;

/// The table `[effects]`: a sub-table per effect id, off where absent.
macro_rules! effects {
    ($($field:ident: $kind:ident),*; $($list:ident: $item:ident),*) => {
        /// Every effect of a recording, each switched by its table. The names are the ids of FORMATS.md.
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
    pub fn check(&self, key: &str) -> Result<()> {
        self.check_bounds(key)
    }
}

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
        let message = wrong.check("effects").unwrap_err().to_string();
        assert!(message.contains("`effects.slope_error.relative` is NaN, expected between -0.2 and 0.2"), "{message}");
    }
}
