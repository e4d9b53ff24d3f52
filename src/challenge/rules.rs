//! What counts as what: fixed before any sealed run, and changed only with a new sealed set.

use crate::diagnosis::behaviour::Behaviour;
use crate::effects;

/// A name is confident from this probability on.
pub const CONFIDENT: f64 = 0.8;
/// An effect below this coherent d′ (square root of twice its energy over the noise's variance) cannot be detected by
/// anybody; one whose surviving d′ (capacity level E) is below it can be all unknown phases and amplitudes.
pub const UNDETECTABLE_D_PRIME: f64 = 2.0;
/// From here on (capacity level E) an effect is strong enough that missing it is a fault.
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
    &[effects::start_frequency_error::ID, effects::adc_start_error::ID, effects::if_delay::ID, effects::if_lowpass::ID],
    &[effects::range_bias::ID, effects::slope_error::ID, effects::pose_offset::ID],
    &[effects::clock_offset::ID, effects::pose_offset::ID],
    &[effects::phase_noise::ID, effects::chirp_start_jitter::ID],
];

/// What an untracked person is, and what a report without a name says of one: where such a person is, these are no false
/// alarms and no wrong names, and they are not planted.
pub const SOMEBODY: [&str; 3] = [effects::moving_reflector::ID, effects::breathing::ID, effects::heartbeat::ID];
/// How a finding without a name behaves that is an untracked person.
pub const LIKE_SOMEBODY: [Behaviour; 4] =
    [Behaviour::PathLike, Behaviour::ChangingAtOneRange, Behaviour::SlowTimePatternOfOneReturn, Behaviour::ExcessPower];

/// Effects that are easily taken for a look-alike although a recording can distinguish the two. What stands here twice is drawn
/// twice as often.
pub const DECOYS: [&str; 25] = [
    effects::second_harmonic::ID,
    effects::object_radar_object::ID,
    effects::iq_imbalance::ID,
    effects::range_alias::ID,
    effects::chirp_ripple::ID,
    effects::wall_ghost::ID,
    effects::spur::ID,
    effects::radar_vibration::ID,
    effects::breathing::ID,
    effects::phase_noise::ID,
    effects::chirp_droop::ID,
    effects::chirp_nonlinearity::ID,
    effects::tx_leakage::ID,
    effects::dc_offset::ID,
    effects::coloured_noise::ID,
    effects::compression::ID,
    effects::adc_saturation::ID,
    effects::moving_reflector::ID,
    effects::wall_ghost::ID,
    effects::body_multibounce::ID,
    effects::gain_drift::ID,
    effects::chirp_settling::ID,
    effects::channel_mismatch::ID,
    effects::antenna_position::ID,
    effects::mutual_coupling::ID,
];

/// The stage of an id of docs/report.md; none for what is no such id.
pub fn stage(id: &str) -> Option<&'static str> {
    effects::info(id).map(|info| info.stage.name())
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
        for id in LOOK_ALIKES.concat().iter().chain(&DECOYS) {
            assert!(library::graded(id).is_some(), "{id}");
        }
        for set in LOOK_ALIKES {
            for (id, other) in set.iter().flat_map(|id| set.iter().map(move |other| (id, other))).filter(|(a, b)| a != b) {
                let known = effects::look_alikes(effects::info(id).unwrap()).any(|known| known.id == *other);
                assert!(known, "{id} and {other}: the library does not say that they are look-alikes");
            }
        }
        assert!(look_alike("if_delay", "adc_start_error") && !look_alike("if_delay", "spur"));
    }
}
