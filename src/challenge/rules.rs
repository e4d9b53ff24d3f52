//! What counts as what: fixed before any sealed run, and changed only with a new sealed set.

/// A name is confident from this probability on.
pub const CONFIDENT: f64 = 0.8;
/// An effect below this coherent d′ (square root of twice its energy over the noise's variance) cannot be detected by
/// anybody; one whose surviving d′ (rung E) is below it can be all unknown phases and amplitudes.
pub const UNDETECTABLE_D_PRIME: f64 = 2.0;
/// From here on (rung E) an effect is strong enough that missing it is a fault.
pub const OBVIOUS_D_PRIME: f64 = 8.0;
/// A masked effect lies so far below the return that covers it, for nine tenths of its energy.
pub const MASKED_DB: f64 = 20.0;
/// An absorbed effect leaves the usual measures between these quantiles of the nulls.
pub const NULL_BAND: [f64; 2] = [0.05, 0.95];
/// How far a named place may be from the true one.
pub const PLACE_M: f64 = 0.3;
/// And a velocity or range interval may miss it by.
pub const RANGE_SLACK_M: f64 = 0.15;
/// False alarms per recording at which the baselines are calibrated, on the nulls of the set itself.
pub const BASELINE_FALSE_ALARMS: f64 = 0.02;

/// Effects that one recording cannot distinguish (R² ≥ 0.9 between what they do to its samples). Naming one of a set names them
/// all.
pub const LOOK_ALIKES: &[&[&str]] = &[
    &["start_frequency_error", "adc_start_error", "if_delay", "if_lowpass"],
    &["range_bias", "slope_error", "pose_offset"],
    &["clock_offset", "pose_offset"],
    &["phase_noise", "chirp_start_jitter"],
];

/// Effects that are easily taken for one another although a recording can distinguish them; decoys are drawn from these.
pub const DECOYS: &[&[&str]] = &[
    &["second_harmonic", "object_radar_object"],
    &["iq_imbalance", "range_alias"],
    &["chirp_ripple", "wall_ghost", "spur"],
    &["radar_vibration", "breathing", "phase_noise"],
    &["chirp_droop", "chirp_nonlinearity"],
    &["tx_leakage", "dc_offset", "coloured_noise"],
    &["compression", "adc_saturation"],
    &["moving_reflector", "wall_ghost", "body_multibounce"],
    &["gain_drift", "chirp_settling"],
    &["channel_mismatch", "antenna_position", "mutual_coupling"],
];

/// The stage of an effect, as the table of docs/report.md has it.
const STAGES: &[(&str, &[&str])] = &[
    (
        "waveform",
        &[
            "start_frequency_error",
            "adc_start_error",
            "slope_error",
            "chirp_nonlinearity",
            "chirp_ripple",
            "phase_noise",
            "chirp_start_jitter",
        ],
    ),
    (
        "receiver",
        &[
            "tx_leakage",
            "dc_offset",
            "iq_imbalance",
            "compression",
            "adc_saturation",
            "second_harmonic",
            "if_highpass",
            "if_lowpass",
            "if_delay",
            "chirp_droop",
            "ramp_edge_transient",
            "chirp_settling",
            "gain_drift",
            "spur",
            "interference",
        ],
    ),
    ("antenna", &["channel_mismatch", "antenna_position", "antenna_pattern", "mutual_coupling"]),
    ("timing", &["clock_offset", "clock_drift", "frame_drop", "tdm_phase"]),
    ("scene", &["pose_offset", "range_bias", "static_reflector", "moving_reflector", "carried_reflector", "radar_vibration"]),
    ("propagation", &["wall_ghost", "floor_bounce", "object_radar_object", "range_alias", "soft_occlusion", "body_multibounce"]),
    ("body", &["breathing", "heartbeat", "clothing_delay", "part_reflectivity"]),
    ("noise", &["coloured_noise", "impulsive_noise", "correlated_noise"]),
];

/// The stage of an id of docs/report.md; none for what is no such id.
pub fn stage(id: &str) -> Option<&'static str> {
    STAGES.iter().find(|(_, ids)| ids.contains(&id)).map(|(stage, _)| *stage)
}

/// Whether one recording cannot distinguish the two, or they are the same.
pub fn look_alike(a: &str, b: &str) -> bool {
    a == b || LOOK_ALIKES.iter().any(|set| set.contains(&a) && set.contains(&b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::challenge::library;

    #[test]
    fn every_effect_of_the_library_has_a_stage_and_sets_name_only_known_effects() {
        for graded in library::library() {
            assert!(stage(graded.id).is_some(), "{}", graded.id);
        }
        for id in LOOK_ALIKES.iter().chain(DECOYS).flat_map(|set| set.iter()) {
            assert!(library::graded(id).is_some(), "{id}");
        }
        for graded in library::OUTSIDE {
            assert!(stage(graded.id).is_none(), "{}", graded.id);
        }
        assert!(look_alike("if_delay", "adc_start_error") && !look_alike("if_delay", "spur"));
    }
}
