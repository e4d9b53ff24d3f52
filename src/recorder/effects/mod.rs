//! What a recording may hold beyond the baseline: every effect id of docs/report.md that has a physical cause, and some
//! that no id names; one file each.
//!
//! A file holds the effect's settings with their bounds, what it asks of the world, what it draws and its law;
//! [`super::stages`] calls the law where the signal meets it. "Relative" means relative to the peak sample of the recording
//! without effects.
//!
//! A new effect is a file here with its line in `effects!`, and the call of its law.

mod body_part;
mod chirp_error;
mod context;
mod decibels;
mod effect;
mod section;
mod settings;

mod adc_saturation;
mod adc_start_error;
mod antenna_pattern;
mod antenna_position;
mod body_multibounce;
mod breathing;
mod carried_reflector;
mod channel_mismatch;
mod chirp_droop;
mod chirp_nonlinearity;
mod chirp_ripple;
mod chirp_settling;
mod chirp_start_jitter;
mod clock_drift;
mod clock_offset;
mod clothing_delay;
mod coloured_noise;
mod compression;
mod correlated_noise;
mod dc_offset;
mod floor_bounce;
mod frame_drop;
mod gain_drift;
mod heartbeat;
mod if_delay;
mod if_highpass;
mod if_lowpass;
mod impulsive_noise;
mod interference;
mod iq_imbalance;
mod moving_reflector;
mod mutual_coupling;
mod object_radar_object;
mod outside;
mod part_reflectivity;
mod phase_noise;
mod pose_offset;
mod radar_vibration;
mod ramp_edge_transient;
mod range_alias;
mod range_bias;
mod second_harmonic;
mod slope_error;
mod soft_occlusion;
mod spur;
mod start_frequency_error;
mod static_reflector;
mod tdm_phase;
mod tx_leakage;
mod wall_ghost;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

pub use chirp_error::{ChirpError, ChirpErrors};
pub use chirp_nonlinearity::curvature;
pub use context::Context;
pub use interference::Burst;
pub use section::Section;
pub use soft_occlusion::Shadow;

use super::draws::Stream;
use crate::error::{Error, Result};
use crate::radar::Radar;
use effect::{AnyEffect, Effect};

/// An effect that is on.
struct Planted<'a> {
    id: &'static str,
    /// Where there may be several of its kind.
    index: Option<usize>,
    effect: &'a dyn AnyEffect,
}

impl Planted<'_> {
    fn key(&self, table: &str) -> String {
        let (id, index) = (self.id, self.index.map_or(String::new(), |index| format!("[{index}]")));
        format!("{table}.{id}{index}")
    }
}

/// Whether no two draw from one stream; those of the entries of `outside` follow all others.
const fn have_own_numbers(streams: &[Option<Stream>]) -> bool {
    let mut i = 0;
    while i < streams.len() {
        let mut j = i + 1;
        while j < streams.len() {
            if let (Some(a), Some(b)) = (streams[i], streams[j])
                && (a.id == b.id || a.id > outside::FIRST.id || b.id > outside::FIRST.id)
            {
                return false;
            }
            j += 1;
        }
        i += 1;
    }
    true
}

/// A sub-table per effect id, off where absent.
macro_rules! effects {
    (once { $($field:ident: $kind:ident,)* } often { $($list:ident: $item:ident,)* }) => {
        $(pub use $field::$kind;)*
        $(pub use $list::$item;)*

        /// Every effect of a recording, each switched by its table. The names are the ids of docs/report.md.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct EffectsConfig {
            $(#[serde(skip_serializing_if = "Option::is_none")] pub $field: Option<$kind>,)*
            $(#[serde(skip_serializing_if = "Vec::is_empty")] pub $list: Vec<$item>,)*
        }

        impl EffectsConfig {
            /// Those that are on.
            fn planted(&self) -> Vec<Planted<'_>> {
                let mut all = vec![];
                $(all.extend(self.$field.iter().map(|effect| Planted { id: stringify!($field), index: None, effect }));)*
                $(all.extend(self.$list.iter().enumerate().map(|(index, effect)| Planted {
                    id: stringify!($list), index: Some(index), effect
                }));)*
                all
            }

            /// Those that a scene without a person can have.
            pub fn without_person(&self) -> Self {
                Self {
                    $($field: self.$field.clone().filter(|_| !$kind::OF_PERSON),)*
                    $($list: if $item::OF_PERSON { vec![] } else { self.$list.clone() },)*
                }
            }
        }

        const _: () = assert!(have_own_numbers(&[$($kind::STREAM,)* $($item::STREAM,)*]), "two effects draw the same numbers");
    };
}

effects! {
    once {
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
        correlated_noise: CorrelatedNoise,
    }
    often {
        static_reflector: StaticReflector,
        moving_reflector: MovingReflector,
        wall_ghost: WallGhost,
        outside: Outside,
    }
}

impl EffectsConfig {
    /// Whether nothing is planted.
    pub fn is_off(&self) -> bool {
        *self == Self::default()
    }

    /// Refuses what cannot work in a world; `key` names the table in messages.
    pub fn check_in(&self, world: &Context, key: &str) -> Result<()> {
        let planted = self.planted();
        planted.iter().try_for_each(|planted| planted.effect.check_bounds(&planted.key(key)))?;
        for planted in &planted {
            let context = Context { effects: self, index: planted.index.unwrap_or(0), ..*world };
            planted.effect.check(&context, &planted.key(key))?;
        }
        match planted.iter().find(|planted| planted.effect.of_person()) {
            Some(planted) if world.person.is_none() => {
                Err(Error::setting(format!("{key}.{}", planted.id), "on", "off without a person"))
            }
            _ => Ok(()),
        }
    }

    /// The radar as it really is.
    pub fn true_radar(&self, radar: &Radar) -> Radar {
        let mut radar = radar.clone();
        self.planted().iter().for_each(|planted| planted.effect.disturb(&mut radar));
        radar
    }

    /// What `truth.json` says of the effects: their settings, what they drew, and in which other terms they can be said.
    pub fn truth(&self, world: &Context, chirps: ChirpErrors) -> Vec<Value> {
        let entry = |Planted { id, index, effect }: Planted| {
            let unnamed = effect.unnamed();
            let name = if unnamed.is_some() { Value::Null } else { json!(id) };
            let mut entry = Map::from_iter([("id".to_string(), json!(unnamed.unwrap_or(id))), ("name".to_string(), name)]);
            if let Value::Object(settings) = effect.settings() {
                entry.extend(settings.into_iter().filter(|(key, _)| key != "kind"));
            }
            let context = Context { effects: self, index: index.unwrap_or(0), ..*world };
            if let Value::Object(drawn) = effect.drawn(&context, chirps) {
                entry.extend(drawn);
            }
            Value::Object(entry)
        };
        self.planted().into_iter().map(entry).collect()
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
    use crate::data::settings::read_text;
    use crate::recorder::World;

    #[test]
    fn the_table_survives_a_round_trip_and_mistakes_are_named() {
        let text = "[if_highpass]\ncorner_hz = 3.5e5\norder = 2\n\n[[moving_reflector]]\nposition_m = [0.0, 3.0, 0.0]\nswing_m = 0.1\n\
                    rate_hz = 0.9\namplitude = 0.02\n\n[[outside]]\nkind = \"mains_gain_ripple\"\nrate_hz = 100.0\ndepth = 0.05\n";
        let config: EffectsConfig = read_text(text).unwrap();
        assert!(config.if_highpass.as_ref().unwrap().settled);
        assert_eq!(read_text::<EffectsConfig>(&toml::to_string(&config).unwrap()).unwrap(), config);
        let unknown = read_text::<EffectsConfig>("[if_highpass]\ncorner = 1.0").unwrap_err().to_string();
        assert!(unknown.contains("unknown field `corner`"), "{unknown}");
        let unknown = read_text::<EffectsConfig>("[[outside]]\nkind = \"gain_hop\"\nrx = 0\ndb = 1.0\nextra = 1").unwrap_err();
        assert!(unknown.to_string().contains("unknown field `extra`"), "{unknown}");
        let wrong = EffectsConfig { slope_error: Some(SlopeError { relative: f64::NAN }), ..EffectsConfig::default() };
        let message = wrong.check(&World::default(), "effects").unwrap_err().to_string();
        assert!(message.contains("`effects.slope_error.relative` is NaN, expected between -0.2 and 0.2"), "{message}");
    }
}
