//! The body by a longer way beside the direct one, as far as its power shows it: in a mirror, or after a bounce between its
//! parts. Unlike the search for images where the body is not, this one looks at all cells, so that a second return that
//! lies mostly among the direct one's cells is not taken for a body that stands elsewhere.

use std::sync::Arc;

use super::change::Change;
use super::displaced::{Fitted, refine};
use super::trial::{Score, Trial};
use crate::diagnosis::prediction::Echo;
use crate::diagnosis::suspects::paths::PATH_LIKE;
use crate::diagnosis::{Candidate, Correction, Estimate, Place, Rung};
use crate::room::Boundary;

/// Powers over the direct return's that are tried first.
const POWERS: [f64; 2] = [0.05, 0.3];
/// Longer ways that are tried first, range cells.
const FARTHEST_CELLS: usize = 14;
const NEAREST_CELLS: usize = 2;
/// Power of an echo that errors of the power model make by themselves.
const FLOOR: f64 = 0.02;
/// Bodies return this factor more or less in amplitude to one side than to another (standard deviation of the log).
const SIDE_SPREAD: f64 = 0.3;

fn id(echo: Echo) -> &'static str {
    match echo {
        Echo::Mirror { boundary: Boundary::Floor, .. } => "floor_bounce",
        Echo::Mirror { .. } => "wall_ghost",
        Echo::Delayed { .. } => "body_multibounce",
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

/// The best echo of each id. `null`: the unchanged body.
pub fn best(trial: &Trial, coarse: &[usize], null: &Score) -> Vec<Fitted> {
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
        .filter(|echo| !evidence.accepted.contains(&id(*echo)))
        .map(|echo| {
            let gains = POWERS.map(|power| {
                let score = trial.score(Change::Again(of_power(echo, power)), coarse, true);
                (power, score.gain_over(&none, coarse))
            });
            let (power, gain) = gains.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("some powers");
            (echo, power, gain)
        })
        .collect();
    let mut found: Vec<Fitted> = vec![];
    for name in ["floor_bounce", "wall_ghost", "body_multibounce"] {
        let of_name = tried.iter().filter(|(echo, _, gain)| id(*echo) == name && *gain > 0.0);
        let Some(&(echo, power, gain)) = of_name.max_by(|a, b| a.2.total_cmp(&b.2)) else { continue };
        let fit = refine(trial, name, power, 0.5 * power, FLOOR, |power| Change::Again(of_power(echo, power)));
        if std::env::var("HSDBG").is_ok() {
            match &fit {
                Some(f) => eprintln!(
                    "again {name} {echo:?} coarse {power} {gain:.1} value {:.4} dev {:.4} infl {:.1} gain {:.1}",
                    f.value,
                    f.deviation,
                    f.inflation,
                    f.score.gain_over(null, &evidence.split.training)
                ),
                None => eprintln!("again {name} {echo:?} coarse {power} {gain:.1} none"),
            }
        }
        found.extend(fit);
    }
    found
}

pub fn candidate(trial: &Trial, fit: &Fitted, echo: Echo, deviation: f64) -> Candidate {
    let evidence = trial.evidence;
    let coefficient = fit.value.max(1e-6).sqrt();
    let mut place = Place::at("propagation");
    let (mut low, mut high, mut slow, mut fast) = (f64::INFINITY, 0.0f64, f64::INFINITY, f64::NEG_INFINITY);
    for points in &trial.body.frames {
        for point in echo.points(&evidence.radar, points) {
            let (range, velocity) =
                crate::diagnosis::prediction::range_and_velocity(&evidence.radar, point.position_m, point.velocity_mps);
            (low, high) = (low.min(range), high.max(range));
            (slow, fast) = (slow.min(velocity), fast.max(velocity));
        }
    }
    place.range_m = Some([low, high]);
    place.velocity_mps = Some([slow, fast]);
    let level_db = -20.0 * coefficient.log10();
    let (estimates, statement) = match echo {
        Echo::Mirror { boundary, .. } => {
            place.boundary = Some(boundary.name().into());
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
        Echo::Delayed { extra_m, .. } => {
            place.range_m = None;
            (
                vec![Estimate::normal("extra_m", extra_m, 0.3 / trial.model.cells.bins_per_m)],
                format!(
                    "The body's power comes a second time, {extra_m:.2} m behind itself and {level_db:.0} dB weaker, with the body's own \
                     Doppler: it bounced between parts of the body."
                ),
            )
        }
    };
    let (moves, change) = (super::change::Moves::new(evidence.radar.centre_m()), fit.score.change);
    Candidate {
        id: Some(fit.id),
        behaves_like: PATH_LIKE,
        estimates,
        choice: place.boundary.clone(),
        place,
        p_value: 1.0,
        gain: 0.0,
        rung: Rung::D,
        look_alikes: vec![],
        statement,
        curve: None,
        energy: 0.0,
        correction: Correction::Body(Arc::new(move |body| moves.apply(body, change))),
    }
}
