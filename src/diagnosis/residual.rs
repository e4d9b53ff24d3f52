//! Residuals of corrections: the accepted effect itself, where it could not be removed in full, and what a rough correction makes.

use super::detectors::paths;
use super::finding::{self, Candidate, Correction};
use crate::diagnosis::behaviour::Behaviour;
use crate::effects::{self, Stage};
use crate::paths::distance;

/// What has no name is modelled roughly, and these are modelled most roughly of all: what they leave, up to this share of
/// their gain, takes any shape; and they come after whatever gains more than it.
const ROUGH: [Behaviour; 2] = [Behaviour::AdditiveFastTime, Behaviour::Quadratic];
pub const ROUGHLY: f64 = 0.1;

/// What is undone chirp by chirp, each by its own estimate, leaves a little of everything that moves: paths below this share
/// of its gain.
const BY_CHIRP: [&str; 2] = [effects::phase_noise::ID, effects::chirp_start_jitter::ID];
const SLIGHTLY: f64 = 0.01;

/// What a radar that vibrates leaves: turns of static clutter that are not quite undone, and their sidebands, up to this share of
/// its gain (which counts what is left).
const TURNS: [Behaviour; 3] = [Behaviour::SlowTimePhase, Behaviour::DelayProportionalPhase, Behaviour::ChangingAtOneRange];
const SHAKEN: f64 = 0.5;
const FADING: Behaviour = Behaviour::SlowTimeGain;

/// What a path that was taken out roughly leaves below the noise looks like the faintest of these, like noise that receivers share, or
/// like a faint path anywhere.
const FAINT: [&str; 4] =
    [effects::interference::ID, effects::chirp_start_jitter::ID, effects::phase_noise::ID, effects::spur::ID];

/// Products of the signal with itself, of which either is hardly taken out in full: one that was never there makes the other.
const PRODUCTS: [&str; 2] = [effects::object_radar_object::ID, effects::second_harmonic::ID];

/// What never changes and may be a return or added behind the mixer: what turns all returns distinguishes the two, and goes first.
const ADDED: [&str; 3] = [effects::tx_leakage::ID, effects::dc_offset::ID, effects::static_reflector::ID];

/// What explains a little of anything that moves near the body: the residual of a strong path that was subtracted.
const OF_RESIDUAL: [&str; 2] = [effects::body_multibounce::ID, effects::carried_reflector::ID];

/// The body by way of a boundary.
const IMAGES: [&str; 2] = [effects::floor_bounce::ID, effects::wall_ghost::ID];

/// Stage of what differs between receivers. It shows in the little that they do not have in common of the body: so does whatever a
/// path, a turn or a wrong time left there.
const OF_RECEIVERS: Stage = Stage::Antenna;

/// Two instances of an effect closer than this are one.
const NEAR_M: f64 = 0.3;

/// Whether a candidate is what was accepted already and could not be removed in full: a second instance of an effect must
/// lie at another place.
pub fn is_same(accepted: &Candidate, candidate: &Candidate) -> bool {
    let (old, new) = (&accepted.place, &candidate.place);
    accepted.id == candidate.id
        && accepted.behaves_like == candidate.behaves_like
        && old.boundary == new.boundary
        && old.body_part == new.body_part
        && old.rx == new.rx
        && !apart(old.range_m, new.range_m)
        && !apart(old.velocity_mps, new.velocity_mps)
        && old.position_m.is_none_or(|old| new.position_m.is_none_or(|new| distance(old, new) < NEAR_M))
}

/// Whether it may be another fit of what was accepted: of the same name, or, without one, of the same behaviour.
pub fn is_refit(accepted: &Candidate, candidate: &Candidate) -> bool {
    candidate.id == accepted.id
        && (accepted.id.is_some() || candidate.behaves_like == accepted.behaves_like)
        && candidate.choice == accepted.choice
        && has_shape_of(accepted, candidate)
}

/// Whether what shapes an effect, such as a frequency, is the same: another fit of it, and not another thing of its name.
fn has_shape_of(accepted: &Candidate, candidate: &Candidate) -> bool {
    let parameters = accepted.id.and_then(effects::info).map_or(&[][..], |info| info.parameters);
    let shapes = parameters.iter().filter(|parameter| parameter.role == effects::Role::Shape);
    let of = |candidate: &Candidate, name: &str| candidate.estimates.iter().position(|estimate| estimate.name == name);
    shapes
        .filter_map(|shape| of(accepted, shape.name).zip(of(candidate, shape.name)))
        .all(|(old, new)| accepted.estimates[old].agrees(&candidate.estimates[new]))
}

pub fn is_rough(candidate: &Candidate) -> bool {
    candidate.id.is_none() && ROUGH.contains(&candidate.behaves_like)
}

fn is_by_chirp(candidate: &Candidate) -> bool {
    is_one_of(candidate, &BY_CHIRP)
}

/// Whether to undo it leaves something at the chirps' edges: what is delayed chirp by chirp is read beyond them, and what was cut is guessed.
pub fn leaves_edges(candidate: &Candidate) -> bool {
    is_by_chirp(candidate)
        || candidate.behaves_like == Behaviour::DelayProportionalPhase
        || candidate.id == Some(effects::adc_saturation::ID)
}

/// Whether it differs between receivers: what others leave, or leaves what others are, unless those were there before.
pub fn is_of_receivers(candidate: &Candidate) -> bool {
    candidate.place.stage == Some(OF_RECEIVERS)
}

/// Whether it is a law of the noise where nothing returns, which whatever is left of anything bends.
pub fn is_of_noise(candidate: &Candidate) -> bool {
    matches!(candidate.behaves_like, Behaviour::NoiseOverBeatFrequency | Behaviour::NoiseSharedByReceivers)
}

/// Whether it is one of what never changes.
pub fn is_added(candidate: &Candidate) -> bool {
    candidate.id.is_some_and(|id| ADDED.contains(&id))
}

/// Whether it is a return that stands still.
pub fn stands_still(candidate: &Candidate) -> bool {
    is_one_of(candidate, &[effects::tx_leakage::ID, effects::static_reflector::ID])
}

/// Whether to undo it amplifies what other ranges leak into its own.
pub fn is_filter(candidate: &Candidate) -> bool {
    is_one_of(candidate, &paths::FILTERS)
}

/// Whether it explains a little of whatever is near the body.
pub fn is_of_residual(candidate: &Candidate) -> bool {
    is_one_of(candidate, &OF_RESIDUAL)
}

/// Whether it is a product of the signal with itself.
pub fn is_product(candidate: &Candidate) -> bool {
    is_one_of(candidate, &PRODUCTS)
}

fn is_path(candidate: &Candidate) -> bool {
    candidate.behaves_like.is_path() && candidate.id.is_none_or(|id| paths::MANY.contains(&id))
}

fn is_one_of(candidate: &Candidate, ids: &[&str]) -> bool {
    candidate.id.is_some_and(|id| ids.contains(&id))
}

/// Whether a candidate may be no more than what a rough correction left, or what a moving path left around its range.
pub fn is_left_by(accepted: &Candidate, candidate: &Candidate) -> bool {
    let of_residual = is_of_residual(candidate);
    // An image of the body is all over the place: what else is there is something else.
    let beside = is_path(accepted)
        && (is_path(candidate) || of_residual)
        && accepted.place.boundary.is_none()
        && !apart(accepted.place.range_m, candidate.place.range_m)
        && !apart(accepted.place.velocity_mps, candidate.place.velocity_mps);
    let by_chirp = is_by_chirp(accepted) && is_path(candidate);
    let vibrates = is_vibration(accepted);
    let shaken = is_shaken(accepted, candidate);
    let fades = vibrates && candidate.id.is_none() && candidate.behaves_like == FADING;
    // A course from frame to frame that has no name is modelled roughly: what is left of it turns all returns, too; where the strongest
    // seems to move slowly, no other is strong enough to deny it.
    let drifts = accepted.id.is_none() && TURNS[..2].contains(&accepted.behaves_like);
    // At its own frequency, what else all returns do is another part of it: a line that has no name is undone roughly.
    let of_line = accepted.id.is_none() && candidate.is_at_the_line_of(accepted);
    let slow_path = is_path(candidate) && candidate.id.is_none();
    let of_drift = drifts && candidate.behaves_like == accepted.behaves_like;
    let alone = drifts && slow_path;
    // What was taken out of some ranges leaves nothing at others, and what never changes nothing that moves.
    let elsewhere = accepted.correction.empties() && apart(accepted.place.range_m, candidate.place.range_m);
    let excess = candidate.behaves_like == Behaviour::ExcessPower && !elsewhere && !is_added(accepted);
    let roughly = is_rough(accepted) || excess || beside || of_drift;
    // A body that was elsewhere in its motion than it was said is brought to its place by whole frames: what is left is beside it
    // and among its images, and what a part may carry, the last resort, is never sure there.
    let timed = accepted.place.stage == Some(Stage::Timing);
    let image = timed && is_one_of(candidate, &IMAGES);
    let hardly = timed && candidate.id == Some(effects::carried_reflector::ID);
    let products = is_product(accepted) && is_product(candidate);
    // Bursts are cut out where they are plain: what they leave below the noise of single samples is in all receivers at once, and has
    // a spectrum of its own.
    let shared = candidate.behaves_like == Behaviour::NoiseSharedByReceivers;
    let sparse = accepted.behaves_like == Behaviour::SparseAdditive;
    let (bursts, tails) = (sparse && shared, sparse && is_of_noise(candidate));
    let path_like = accepted.behaves_like.is_path() && !elsewhere;
    let faint = path_like && (is_one_of(candidate, &FAINT) || shared || is_path(candidate));
    // What has no name is modelled roughly.
    let bent = accepted.id.is_none() && !is_of_noise(accepted) && is_of_noise(candidate);
    // What moves as no single reflector does was taken out along one track: what else of it moves with the body is left, and a line
    // where it stays longest.
    let no_single = is_path(accepted) && accepted.id.is_none() && !elsewhere;
    let line = no_single && candidate.id == Some(effects::spur::ID);
    let rest = no_single && is_path(candidate);
    let smeared = vibrates || timed || is_by_chirp(accepted) || path_like;
    let uneven = (smeared || is_one_of(accepted, &OF_RESIDUAL)) && is_of_receivers(candidate);
    // Chirps that start at random differ from their neighbours, and go on doing so a little.
    let unlike = is_by_chirp(accepted) && candidate.behaves_like == Behaviour::SparseAdditive;
    // Up to which share of what was gained.
    [
        (roughly || fades || image || unlike || tails, ROUGHLY),
        (bursts || timed && of_residual || line || is_of_cut(accepted, candidate), 1.0),
        (hardly || uneven || bent || products || alone || of_line, f64::INFINITY),
        (is_mixed(accepted, candidate) || is_product_of_cut(accepted, candidate), f64::INFINITY),
        (shaken || rest, SHAKEN),
        (by_chirp || faint, SLIGHTLY),
    ]
    .into_iter()
    .any(|(holds, share)| holds && candidate.nats < share * accepted.nats)
}

fn is_vibration(candidate: &Candidate) -> bool {
    candidate.id == Some(effects::radar_vibration::ID)
}

/// How much the returns of each range turn when the radar moves is known roughly: sidebands are left of them; and large turns change how
/// much is received. So of one return that is modulated, which reaches a little beyond its ranges.
fn is_shaken(accepted: &Candidate, candidate: &Candidate) -> bool {
    let turns = candidate.id.is_none() && TURNS.contains(&candidate.behaves_like);
    let around = accepted.place.range_m.map(|[near, far]| [near - NEAR_M, far + NEAR_M]);
    let modulated = accepted.behaves_like == Behaviour::Modulated && !apart(around, candidate.place.range_m);
    is_vibration(accepted) && (turns || is_path(candidate)) || modulated && is_path(candidate)
}

/// Whether it is in the noise as an accepted correction mixes it: to undo a coupling of receivers mixes their noise, and chirps read
/// between their samples have less of it.
fn is_mixed(accepted: &Candidate, candidate: &Candidate) -> bool {
    is_of_receivers(accepted) && candidate.behaves_like == Behaviour::NoiseSharedByReceivers
        || accepted.id == Some(effects::chirp_nonlinearity::ID) && candidate.behaves_like == Behaviour::NoiseOverBeatFrequency
}

fn is_cut(accepted: &Candidate) -> bool {
    accepted.id == Some(effects::adc_saturation::ID) && matches!(accepted.correction, Correction::None)
}

/// Whether it is in the products of a signal that was cut and cannot be restored: of all returns along every chirp, and other ones in
/// every receiver; and the more is cut, the less of anything is received.
fn is_of_cut(accepted: &Candidate, candidate: &Candidate) -> bool {
    let of_chirps = candidate.place.stage == Some(Stage::Waveform) || candidate.behaves_like == Behaviour::SlowTimeGain;
    is_cut(accepted) && (is_of_receivers(candidate) || of_chirps)
}

/// Whether it may be a product of such a signal: it has less energy than all of them have, which may lie in one line.
fn is_product_of_cut(accepted: &Candidate, candidate: &Candidate) -> bool {
    let additive = [Behaviour::Tone, Behaviour::ExcessPower].contains(&candidate.behaves_like);
    is_cut(accepted) && (additive || is_path(candidate) || is_product(candidate)) && candidate.energy < accepted.energy
}

/// Whether both are known and have nothing in common.
fn apart(a: Option<[f64; 2]>, b: Option<[f64; 2]>) -> bool {
    a.zip(b).is_some_and(|(a, b)| finding::apart(a, b))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::diagnosis::tones::{Region, Tones};
    use crate::diagnosis::{Place, Volume};

    fn of(id: Option<&'static str>, behaves_like: Behaviour, gain: f64) -> Candidate {
        Candidate { id, ..Candidate::new(behaves_like, Place::at(Stage::Scene), 0.0, gain) }
    }

    #[test]
    fn a_path_leaves_faint_tones_and_paths_and_one_without_a_law_leaves_more_of_itself() {
        let path = |id: Option<&'static str>, gain: f64| of(id, Behaviour::PathLike, gain);
        let spur = |gain: f64| of(Some(effects::spur::ID), Behaviour::Tone, gain);
        let image = path(Some(effects::wall_ghost::ID), 1e4);
        assert!(is_left_by(&image, &spur(90.0)) && !is_left_by(&image, &spur(110.0)));
        // At another place: a second path may be there.
        let elsewhere = |id: Option<&'static str>, gain: f64| {
            let mut path = path(id, gain);
            path.place.range_m = Some([3.0, 4.0]);
            path
        };
        let mut mover = path(Some(effects::moving_reflector::ID), 1e4);
        mover.place.range_m = Some([1.0, 2.0]);
        let ghost = |gain: f64| elsewhere(Some(effects::wall_ghost::ID), gain);
        assert!(is_left_by(&mover, &ghost(90.0)) && !is_left_by(&mover, &ghost(110.0)));
        let no_law = Candidate { id: None, ..mover };
        assert!(is_left_by(&no_law, &ghost(4e3)) && !is_left_by(&no_law, &ghost(6e3)));
    }

    #[test]
    fn at_the_frequency_of_a_line_without_a_name_nothing_else_has_one() {
        let line = |id: Option<&'static str>, behaves_like: Behaviour, line_hz: [f64; 2]| Candidate {
            line_hz: Some(line_hz),
            ..of(id, behaves_like, 100.0)
        };
        let unnamed = line(None, Behaviour::DelayProportionalPhase, [26.8, 26.95]);
        let vibration = |line_hz: [f64; 2]| line(Some(effects::radar_vibration::ID), Behaviour::SlowTimePhase, line_hz);
        assert!(is_left_by(&unnamed, &vibration([26.85, 26.9])));
        assert!(!is_left_by(&unnamed, &vibration([27.1, 27.2])));
        assert!(!is_left_by(&vibration([26.8, 26.9]), &vibration([26.8, 26.9])));
    }

    #[test]
    fn what_has_no_name_is_fitted_anew_by_what_behaves_as_it_does() {
        let drift = |behaves_like: Behaviour| of(None, behaves_like, 100.0);
        let of_delay = drift(Behaviour::DelayProportionalPhase);
        assert!(is_refit(&of_delay, &drift(Behaviour::DelayProportionalPhase)));
        assert!(!is_refit(&of_delay, &drift(Behaviour::SlowTimePhase)));
    }

    #[test]
    fn bursts_leave_a_little_noise_of_another_spectrum() {
        let bursts = of(Some(effects::interference::ID), Behaviour::SparseAdditive, 1e4);
        let colour = |gain: f64| of(Some(effects::coloured_noise::ID), Behaviour::NoiseOverBeatFrequency, gain);
        assert!(is_left_by(&bursts, &colour(900.0)) && !is_left_by(&bursts, &colour(1100.0)));
    }

    #[test]
    fn what_has_less_energy_than_the_products_of_a_cut_signal_may_be_one() {
        let saturation = Candidate { energy: 1e3, ..of(Some(effects::adc_saturation::ID), Behaviour::Amplitude, 10.0) };
        let mover = |energy: f64| Candidate { energy, ..of(Some(effects::moving_reflector::ID), Behaviour::PathLike, 1e6) };
        assert!(is_left_by(&saturation, &mover(900.0)) && !is_left_by(&saturation, &mover(1100.0)));
        let restored = Candidate { correction: Correction::inverse(Volume::KEPT, |_| ()), ..saturation };
        assert!(!is_left_by(&restored, &mover(900.0)));
    }

    #[test]
    fn what_was_taken_out_of_some_ranges_leaves_no_power_at_others() {
        let at = |range_m: [f64; 2], behaves_like: Behaviour, gain: f64| {
            let mut candidate = of(None, behaves_like, gain);
            candidate.place.range_m = Some(range_m);
            candidate
        };
        let mover = at([1.0, 2.0], Behaviour::PathLike, 1e4);
        let tones = Tones::new([16, 64], 1, Region { range: [9.0, 12.0], doppler: [2.0, 4.0] }, 1e3);
        let taken = Candidate { correction: Correction::Emptied(Arc::new(tones), Arc::new(|_, _| false)), ..mover.clone() };
        let excess = |range_m: [f64; 2]| at(range_m, Behaviour::ExcessPower, 100.0);
        assert!(is_left_by(&taken, &excess([1.5, 2.5])) && !is_left_by(&taken, &excess([2.5, 3.5])));
        // As a track that was subtracted does.
        assert!(is_left_by(&mover, &excess([2.5, 3.5])));
    }
}
