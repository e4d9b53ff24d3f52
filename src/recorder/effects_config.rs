//! The table `[effects]`: which effects a recording has.

use serde::{Deserialize, Serialize};

use super::effect_settings::*;
use crate::error::Result;

/// A sub-table per effect id, off where absent.
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
            pub(super) fn check_bounds(&self, key: &str) -> Result<()> {
                $(if let Some(effect) = &self.$field { effect.check(&format!("{key}.{}", stringify!($field)))?; })*
                $(for (index, effect) in self.$list.iter().enumerate() {
                    effect.check(&format!("{key}.{}[{index}]", stringify!($list)))?;
                })*
                Ok(())
            }

            /// Those that are on, as (id, which of its kind, settings).
            pub(super) fn listed(&self) -> Vec<(&'static str, usize, serde_json::Value)> {
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

    /// The first that is on and that a scene without a person cannot have.
    pub(super) fn of_person(&self) -> Option<&'static str> {
        let others = self.without_person().listed();
        self.listed().into_iter().map(|(id, ..)| id).find(|id| others.iter().all(|(other, ..)| other != id))
    }
}
