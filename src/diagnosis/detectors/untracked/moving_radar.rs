//! A radar that moves by a course that is no law: no return is a mover's alone, since hardly any stands.

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::{Evidence, MAY_MOVE};
use crate::diagnosis::finding::{Candidate, Place};
use crate::diagnosis::statistics::{corrected, mean_power_tail};
use crate::effects::{self, Stage};

/// What all returns do that was found: it may be what moves them.
const OF_ALL: [Behaviour; 2] = [Behaviour::SlowTimePhase, Behaviour::DelayProportionalPhase];

pub fn find(evidence: &Evidence) -> Option<Candidate> {
    let is_known = OF_ALL.iter().any(|of_all| evidence.accepted_unnamed.contains(of_all))
        || evidence.accepted.contains(&effects::radar_vibration::ID);
    if is_known || !evidence.may_move() || evidence.is_said_to_move() {
        return None;
    }
    let returns = evidence.moving_returns();
    let largest = returns.iter().map(|of_return| of_return.1).fold(0.0, f64::max);
    let channels = evidence.cube.channels() as f64;
    // Chirps of a frame are hardly independent where all changes slowly.
    let [training, held_out] = [&evidence.split.training, &evidence.split.held_out].map(|frames| frames.len() as f64 * channels);
    let p_value = corrected(mean_power_tail(largest, training), evidence.range_bins() as f64);
    let nats: f64 = returns.iter().map(|of_return| of_return.1.max(1.0)).map(|power| held_out * (power - 1.0 - power.ln())).sum();
    let bin_m = evidence.radar.range_resolution_m();
    let [first, last] = [returns.first()?.0, returns.last()?.0].map(|bin| bin as f64 * bin_m);
    let place = Place { range_m: Some([first, last]), ..Place::at(Stage::Scene) };
    let statement = format!("{MAY_MOVE}; no law of the library holds for the course of their phases.");
    Some(Candidate { statement, ..Candidate::new(Behaviour::PathLike, place, p_value, nats) })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use num_complex::Complex64;

    use super::*;
    use crate::radar::Radar;

    /// Leakage, and three returns that turn by so many radians, one way and back.
    fn evidence(excursion: f64) -> Evidence {
        let radar = Radar { samples_per_chirp: 64, loops_per_frame: 16, ..Radar::small(16) };
        Evidence::in_noise(radar, 3, |[frame, channel, index, n]| {
            let tone = |bin: f64, level: f64| Complex64::from_polar(level, TAU * bin * n as f64 / 64.0 + channel as f64 * bin);
            let time = (frame * 16 + index) as f64 / 256.0;
            let turned = |ahead: f64| Complex64::cis(excursion * ahead * (TAU * 1.3 * time + (TAU * 0.8 * time).sin()).sin());
            tone(1.2, 200.0) + tone(12.0, 20.0) * turned(1.0) + tone(21.0, 15.0) * turned(0.8) + tone(30.5, 10.0) * turned(-0.5)
        })
    }

    #[test]
    fn a_radar_that_moves_without_a_law_is_said_to_move_once() {
        let found = find(&evidence(8.0)).expect("all returns move");
        assert!(found.id.is_none() && found.p_value < 1e-9 && found.nats > 100.0, "{found:?}");
        assert!(found.statement.starts_with(MAY_MOVE), "{}", found.statement);
        assert!(find(&evidence(8.0).with(&found)).is_none());
        assert!(find(&evidence(0.0)).is_none());
    }
}
