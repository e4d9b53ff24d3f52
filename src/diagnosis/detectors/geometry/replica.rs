//! The body by a longer way beside the direct one, as far as its power shows it: in a mirror, or after a bounce between its
//! parts. Unlike the search for images where the body is not, this one looks at all cells, so that a second return that
//! lies mostly among the direct one's cells is not taken for a body that stands elsewhere.

use super::change::Change;
use super::fitted::{Fitted, refine};
use super::trial::Trial;
use crate::diagnosis::prediction::{Echo, SIDE_SPREAD, mirror_id, range_and_velocity};
use crate::diagnosis::{Estimate, Place};
use crate::effects::{self, Stage};
use crate::room::Boundary;

/// Powers over the direct return's that are tried first; the others only where the least of them gains anything.
const POWERS: [f64; 3] = [3e-3, 0.03, 0.3];
/// Longer ways that are tried first, range cells.
const FARTHEST_CELLS: usize = 14;
const NEAREST_CELLS: usize = 2;
/// Power of an echo that errors of the power model make by themselves.
const FLOOR: f64 = 2e-3;
/// How overconfident the likelihood is: cells are not independent, and the power model is rough. On 31 recordings without
/// anything missing the largest log-likelihood gain was 0.5 nats.
pub const INFLATION: f64 = 1.5;
/// Share of an echo's gain that one which comes before its cause may have.
const BEFORE: f64 = 0.3;

fn id(echo: Echo) -> &'static str {
    match echo {
        Echo::Mirror { boundary, .. } => mirror_id(boundary),
        Echo::Delayed { .. } => effects::body_multibounce::ID,
    }
}

/// With a power of its own.
fn of_power(echo: Echo, power: f64) -> Echo {
    let new = power.max(0.0).sqrt();
    match echo {
        Echo::Mirror { boundary, distance_m, .. } => Echo::Mirror { boundary, distance_m, coefficient: new },
        Echo::Delayed { extra_m, .. } => Echo::Delayed { extra_m, coefficient: new },
    }
}

/// The best echo of each id; `coarse`: frames that suffice to choose.
pub fn best(trial: &Trial, coarse: &[usize]) -> Vec<Fitted> {
    let evidence = trial.evidence;
    let cell_m = 1.0 / trial.model.cells.bins_per_m;
    let delayed =
        (NEAREST_CELLS..=FARTHEST_CELLS).map(|cells| Echo::Delayed { extra_m: cells as f64 * cell_m, coefficient: 0.0 });
    let mirrors = evidence.room.iter().flat_map(|room| {
        let of = |boundary: Boundary| Some(Echo::Mirror { boundary, distance_m: room.distance_m(boundary)?, coefficient: 0.0 });
        room.boundaries().into_iter().filter_map(of)
    });
    let none = trial.score(Change::Range(0.0), coarse, true);
    let tried: Vec<(Echo, f64, f64)> = mirrors
        .chain(delayed)
        .filter(|echo| evidence.may_name(id(*echo)))
        .filter_map(|echo| {
            let gain = |power: f64| trial.score(Change::Replica(of_power(echo, power)), coarse, true).gain_over(&none, coarse);
            let least = gain(POWERS[0]);
            let more = POWERS[1..].iter().map(|&power| (echo, power, gain(power)));
            (least > 0.0).then(|| more.fold((echo, POWERS[0], least), |best, tried| if tried.2 > best.2 { tried } else { best }))
        })
        .collect();
    let mut found: Vec<Fitted> = vec![];
    for name in [effects::floor_bounce::ID, effects::wall_ghost::ID, effects::body_multibounce::ID] {
        let of_name = tried.iter().filter(|(echo, _, gain)| id(*echo) == name && *gain > 0.0);
        let Some(&(echo, power, gain)) = of_name.max_by(|a, b| a.2.total_cmp(&b.2)) else { continue };
        if let Echo::Delayed { extra_m, .. } = echo {
            // Longer ways than those that are tried, and what comes before its cause, are something else.
            let before = of_power(Echo::Delayed { extra_m: -extra_m, coefficient: 0.0 }, power);
            let early = trial.score(Change::Replica(before), coarse, true).gain_over(&none, coarse);
            if extra_m > (FARTHEST_CELLS as f64 - 0.5) * cell_m || early > BEFORE * gain {
                continue;
            }
        }
        let fit = refine(trial, name, power, 0.5 * power, FLOOR, |power| Change::Replica(of_power(echo, power)));
        found.extend(fit);
    }
    found
}

/// How many echoes the best is chosen from.
pub fn tried() -> f64 {
    ((Boundary::ALL.len() + FARTHEST_CELLS - NEAREST_CELLS + 1) * POWERS.len()) as f64
}

pub fn place(trial: &Trial, echo: Echo) -> Place {
    let radar = &trial.evidence.radar;
    let points = trial.body.frames.iter().flat_map(|points| echo.points(radar, points));
    let returns = points.map(|point| range_and_velocity(radar, point.position_m, point.velocity_mps));
    let place = Place::spanning(Stage::Propagation, returns);
    match echo {
        Echo::Mirror { boundary, .. } => Place { boundary: Some(boundary.name().into()), ..place },
        Echo::Delayed { .. } => Place { range_m: None, ..place },
    }
}

/// Estimates, and the sentence; `deviation`: of the power.
pub fn described(trial: &Trial, echo: Echo, power: f64, deviation: f64) -> (Vec<Estimate>, String) {
    let coefficient = power.max(1e-6).sqrt();
    match echo {
        Echo::Mirror { boundary, .. } => {
            let rough = (SIDE_SPREAD * coefficient).hypot(0.5 * deviation / coefficient);
            (
                vec![Estimate::normal("coefficient", coefficient, rough)],
                format!(
                    "The body is seen a second time by way of the {} boundary, among and behind its own cells: power as a mirror of \
                     amplitude {coefficient:.2} would send it.",
                    boundary.name()
                ),
            )
        }
        Echo::Delayed { extra_m, .. } => (
            vec![Estimate::normal("extra_m", extra_m, 0.3 / trial.model.cells.bins_per_m)],
            format!(
                "The body's power comes a second time, {extra_m:.2} m behind itself and {:.0} dB weaker, with the body's own Doppler: \
                 it bounced between parts of the body.",
                -20.0 * coefficient.log10()
            ),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{displaced, receding::evidence};
    use super::*;
    use crate::diagnosis::behaviour::Behaviour;
    use crate::diagnosis::{Candidate, Correction, Evidence};

    fn found(evidence: &Evidence) -> Option<Candidate> {
        let trial = Trial::new(evidence, evidence.power().unwrap(), evidence.body.as_ref().unwrap());
        displaced::find(&trial).into_iter().find(|found| found.p_value < 1e-3)
    }

    #[test]
    fn an_echo_among_the_bodys_own_cells_is_distinguished_from_a_body_elsewhere() {
        let alone = found(&evidence(None));
        assert!(alone.is_none(), "{alone:?}");
        for (echo, id) in [
            (Echo::Delayed { extra_m: 0.4, coefficient: 0.5 }, effects::body_multibounce::ID),
            (Echo::Mirror { boundary: Boundary::Floor, distance_m: 1.1, coefficient: 0.5 }, effects::floor_bounce::ID),
        ] {
            let mut evidence = evidence(Some(echo));
            let found_first = found(&evidence).unwrap_or_else(|| panic!("{id} not found"));
            assert_eq!(found_first.id, Some(id), "{found_first:?}");
            let Correction::Body(change) = &found_first.correction else { panic!() };
            change(evidence.body.as_mut().unwrap());
            evidence.accepted.extend(found_first.id);
            let left = found(&evidence.changed());
            assert!(left.is_none(), "after {found_first:?} still {left:?}");
        }
    }

    #[test]
    fn a_body_elsewhere_is_observed_and_named_by_what_the_library_has() {
        let lacking = |ids: &[&str]| {
            let mut evidence = evidence(None).lacking(ids);
            let body = evidence.body.as_mut().unwrap();
            body.frames.iter_mut().flatten().for_each(|point| point.position_m[1] += 0.15);
            found(&evidence.changed()).expect("nothing found")
        };
        assert_eq!(lacking(&[]).id, Some(effects::range_bias::ID));
        let all = [effects::range_bias::ID, effects::slope_error::ID, effects::pose_offset::ID];
        let clocks = [effects::clock_offset::ID, effects::clock_drift::ID, effects::frame_drop::ID];
        let unknown = lacking(&[all, clocks].concat());
        assert!(unknown.id.is_none() && unknown.estimates.is_empty() && unknown.look_alikes.is_empty(), "{unknown:?}");
        assert_eq!(unknown.behaves_like, Behaviour::RangeOffset);
        assert!(unknown.statement.contains("nearer"), "{}", unknown.statement);
    }

    #[test]
    fn a_body_is_not_said_to_be_elsewhere_by_frames_in_which_something_else_is_beside_it() {
        let beside = |others_m: [f64; 2]| {
            let mut evidence = evidence(None);
            let body = evidence.body.as_mut().unwrap();
            body.frames.iter_mut().flatten().for_each(|point| point.position_m[1] += 0.15);
            evidence.others_m.push(others_m);
            found(&evidence.changed())
        };
        let alone = beside([20.0, 21.0]).expect("nothing is near");
        assert_eq!(alone.id, Some(effects::range_bias::ID));
        let crossed = beside([0.0, 20.0]);
        assert!(crossed.is_none(), "{crossed:?}");
    }
}
