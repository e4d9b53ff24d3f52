//! The body elsewhere, or at another time, than predicted: range, scale of range, pose, clock and lost frames.
//!
//! Every change is judged by how well the powers of the body's speckle fit it, with the parts' amplitudes fitted anew each
//! time, so that no reflectivity can be the cause. What remains of a real body's laws of reflection and visibility that the
//! power model does not know shifts the body by up to 4 mm and 1.4 ms (practice recordings without any such effect, which also
//! helped to choose the lobes and these floors): a change must exceed these floors, frame after frame.

use super::change::{Change, Moves, frame_period_s};
use super::fitted::{Fitted, refine};
use super::lost::{is_step, lost_frames, predicted, ratio_p_value, step_p_value};
use super::replica;
use super::trial::{Score, Trial};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::clutter::energy_beyond_noise;
use crate::diagnosis::detectors::description::Description;
use crate::diagnosis::statistics::{UNDECIDED, corrected, student_tail};
use crate::diagnosis::{Candidate, Estimate, Place};
use crate::effects::{Stage, clock_drift, clock_offset, frame_drop, pose_offset, range_bias, slope_error};
use crate::paths::distance;

/// Errors of the prediction that are no finding: metres of range, seconds.
const RANGE_FLOOR_M: f64 = 4e-3;
const CLOCK_FLOOR_S: f64 = 2e-3;
/// Standard deviation over the floor of what the power model does to a value that is no null: offsets of practice recordings and
/// of published sealed sets came out 1 to 11 mm too far, 8 mm in the root mean square.
const SCENE: f64 = 1.9;
/// Standard deviation of a clock's offset between the poses, in frame periods.
const CLOCK_ROUGH: f64 = 0.08;
/// Ranges looked at first.
const RANGE_GRID_M: [f64; 11] = [-0.4, -0.3, -0.2, -0.12, -0.06, 0.0, 0.06, 0.12, 0.2, 0.3, 0.4];
/// Times looked at first, in frame periods: a walking body leaves its cells in half of one.
const CLOCK_GRID: [f64; 19] =
    [-3.0, -2.6, -2.2, -1.8, -1.4, -1.0, -0.6, -0.3, -0.15, 0.0, 0.15, 0.3, 0.6, 1.0, 1.4, 1.8, 2.2, 2.6, 3.0];
/// Rates of clocks looked at first.
const DRIFT_GRID: [f64; 11] = [-0.35, -0.2, -0.1, -0.03, -0.01, 0.0, 0.01, 0.03, 0.1, 0.2, 0.35];
/// Standard deviation of a displacement across the line of sight, which ranges do not show.
const UNSEEN_M: f64 = 0.2;
/// Kinds of change that are distinguishable, for the correction of the p-value.
const KINDS: f64 = 3.0;
/// Errors of clocks.
const TIMING: [&str; 3] = [clock_offset::ID, clock_drift::ID, frame_drop::ID];
/// Displacements along the line of sight.
const ALONG: [&str; 2] = [range_bias::ID, slope_error::ID];

pub fn find(trial: &Trial) -> Vec<Candidate> {
    let evidence = trial.evidence;
    let training = &evidence.split.training;
    if training.len() < 6 || evidence.split.held_out.is_empty() {
        return vec![];
    }
    let every: Vec<usize> = (0..evidence.cube.dims[0]).collect();
    let null = trial.score(Change::Range(0.0), &every, true);
    let fitted = alternatives(trial, &null);
    let Some(best) = best(trial, &fitted, &null) else { return vec![] };
    let p_value = p_value(best, &null, training);
    let held_out = predicted(trial, best, &null) / best.inflation;
    // What may be nothing by its own interval is nothing.
    let nothing = best.value.abs() < 1.645 * deviation(trial, best);
    if p_value > 0.05 || held_out <= 0.0 || nothing {
        return vec![];
    }
    vec![candidate(trial, best, look_alikes(trial, &fitted, best), p_value, held_out)]
}

/// What could be changed to fit better, each fitted, but for what was accepted before.
fn alternatives(trial: &Trial, null: &Score) -> Vec<Fitted> {
    let accepted = &trial.evidence.accepted;
    let training = &trial.evidence.split.training;
    let coarse: Vec<usize> = training.iter().copied().step_by(training.len().div_ceil(10)).collect();
    let mut fitted = displacements(trial, &coarse, null);
    fitted.extend(clocks(trial, &coarse, null));
    fitted.extend(replica::best(trial, &coarse));
    fitted.extend(lost_frames(trial, null));
    // Clocks that were set right leave a motion that is known less well, which looks like another error of the clocks.
    let unnamed = &trial.evidence.accepted_unnamed;
    if TIMING.iter().any(|id| accepted.contains(id)) || unnamed.contains(&Behaviour::TimeOffset) {
        fitted.retain(|fit| !TIMING.contains(&fit.id));
    }
    // A ramp's slope is wrong by no more than the library allows it.
    let most_slope = slope_error::INFO.parameters[0].most;
    fitted.retain(|fit| fit.id != slope_error::ID || fit.value.abs() <= most_slope);
    let is_explained = |stage: Stage| stage != Stage::Propagation && unnamed.contains(&behaves_like(stage));
    fitted.retain(|fit| !accepted.contains(&fit.id) && !is_explained(stage(fit.score.change)));
    fitted
}

/// Worth a closer look.
fn is_interesting(trial: &Trial, fit: Option<&Fitted>, null: &Score) -> bool {
    fit.is_some_and(|fit| p_value(fit, null, &trial.evidence.split.training) < 0.05)
}

/// Along the line of sight: all ranges, their scale, where the body stands.
fn displacements(trial: &Trial, coarse: &[usize], null: &Score) -> Vec<Fitted> {
    let range_m = mean_range_m(trial);
    let at = best_of(trial, coarse, RANGE_GRID_M.into_iter(), Change::Range);
    let range = refine(trial, range_bias::ID, at, 0.03, RANGE_FLOOR_M, Change::Range);
    let Some(range) = range.filter(|range| is_interesting(trial, Some(range), null)) else { return vec![] };
    let offset = range.value;
    let along = |offset: f64| Change::Offset([0.0, offset, 0.0]);
    let scale = refine(trial, slope_error::ID, offset / range_m, 0.03 / range_m, RANGE_FLOOR_M / range_m, Change::Scale);
    let stands = refine(trial, pose_offset::ID, offset, 0.03, RANGE_FLOOR_M, along);
    scale.into_iter().chain([range]).chain(stands).collect()
}

/// The motion's clock: its rate, where that may be the cause, and its offset.
fn clocks(trial: &Trial, coarse: &[usize], null: &Score) -> Vec<Fitted> {
    let body = trial.body;
    let period = frame_period_s(body);
    let at = best_of(trial, coarse, CLOCK_GRID.into_iter().map(|step| step * period), Change::Clock);
    let clock = refine(trial, clock_offset::ID, at, 0.12 * period, CLOCK_FLOOR_S, Change::Clock);
    let duration = (body.middle_s[trial.evidence.cube.dims[0] - 1] - body.middle_s[0]).max(period);
    let rate = best_of(trial, coarse, DRIFT_GRID.into_iter(), Change::Drift);
    let mut fitted = vec![];
    if is_interesting(trial, clock.as_ref(), null) || rate != 0.0 {
        let floor = 2.0 * CLOCK_FLOOR_S / duration;
        fitted.extend(refine(trial, clock_drift::ID, rate, 0.24 * period / duration, floor, Change::Drift));
    }
    fitted.extend(clock);
    fitted
}

/// Of several alternatives, compared where all of them know the motion, where there is such a frame. One without a name only where none
/// with a name is nearly as likely.
fn best<'a>(trial: &Trial, fitted: &'a [Fitted], null: &Score) -> Option<&'a Fitted> {
    let training = &trial.evidence.split.training;
    let known = |frame: &usize| fitted.iter().all(|fit| fit.score.known[*frame]);
    let common: Vec<usize> = training.iter().copied().filter(known).collect();
    let common = if common.is_empty() { training } else { &common };
    // A pose has four parameters of which one is fitted: it must be better by what the others could gain.
    let gain = |fit: &Fitted| {
        let occam = if fit.id == pose_offset::ID { 1.5 * (training.len() as f64).ln() * fit.inflation } else { 0.0 };
        fit.score.gain_over(null, common) - occam
    };
    let mut ordered: Vec<&Fitted> = fitted.iter().collect();
    ordered.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    let leads = |fit: &&&Fitted| is_step(trial, fit);
    let best = *ordered.iter().find(leads)?;
    let close = |other: &&&Fitted| (gain(best) - gain(other)) / best.inflation < UNDECIDED;
    let named = |fit: &&&Fitted| trial.evidence.info(fit.id).is_some();
    let best_named = ordered.iter().take_while(close).filter(named).find(leads);
    Some(best_named.unwrap_or(&best))
}

/// What this recording hardly tells from the best alternative.
fn look_alikes(trial: &Trial, fitted: &[Fitted], best: &Fitted) -> Vec<&'static str> {
    let evidence = trial.evidence;
    let every: Vec<usize> = (0..evidence.cube.dims[0]).collect();
    let close = |fit: &&Fitted| fit.id != best.id && best.score.gain_over(&fit.score, &every) / best.inflation < UNDECIDED;
    let mut look_alikes: Vec<&'static str> = fitted.iter().filter(close).map(|fit| fit.id).collect();
    // A body that stands aside may stand nearer or farther as well.
    if ALONG.contains(&best.id) && evidence.accepted.contains(&pose_offset::ID) && !look_alikes.contains(&pose_offset::ID) {
        look_alikes.push(pose_offset::ID);
    }
    look_alikes
}

/// The best of some values on a few frames, with the parts' weights of each: those of a body in the wrong place are far off.
fn best_of(trial: &Trial, frames: &[usize], values: impl Iterator<Item = f64>, change: impl Fn(f64) -> Change) -> f64 {
    let none = trial.score(change(0.0), frames, true);
    values
        .map(|value| (value, trial.score(change(value), frames, true).gain_over(&none, frames)))
        .fold((0.0, 0.0), |best, tried| if tried.1 > best.1 { tried } else { best })
        .0
}

/// Under the null: a value beyond its floor by so many deviations; for a step, so much gained.
fn p_value(fit: &Fitted, null: &Score, training: &[usize]) -> f64 {
    if let Change::Drop { .. } = fit.score.change {
        return step_p_value(fit.score.gain_over(null, training), fit.score.inside.len());
    }
    if let Change::Replica(_) = fit.score.change {
        let gain = fit.score.gain_over(null, training) / fit.inflation;
        return ratio_p_value(gain, replica::INFLATION, replica::tried());
    }
    let excess = (fit.value.abs() - fit.floor).max(0.0);
    let judged = training.iter().filter(|&&frame| fit.score.inside[frame] && null.inside[frame]).count();
    let (t, freedom) = (excess / fit.deviation.max(1e-12), judged as f64 - 1.0);
    if freedom < 3.0 || !t.is_finite() {
        return 1.0;
    }
    corrected((2.0 * student_tail(t, freedom)).min(1.0), KINDS)
}

fn mean_range_m(trial: &Trial) -> f64 {
    let centre = trial.evidence.radar.centre_m();
    let points = trial.evidence.body.iter().flat_map(|body| body.frames.iter().flatten());
    let (sum, count) = points.fold((0.0, 0usize), |(sum, count), point| (sum + distance(point.position_m, centre), count + 1));
    (sum / count.max(1) as f64).max(0.1)
}

/// Standard deviation of a change's value. Half of the floor is one of what the power model does not know; between poses
/// and frames, motion and visibility are known roughly only.
fn deviation(trial: &Trial, fit: &Fitted) -> f64 {
    let rough_s = CLOCK_ROUGH * frame_period_s(trial.body);
    let rough = match fit.score.change {
        Change::Clock(_) => rough_s,
        Change::Drift(_) => rough_s / trial.body.middle_s.last().map_or(1.0, |end| end.max(1e-3)),
        _ => 0.0,
    };
    fit.deviation.hypot(0.5 * fit.floor).hypot(rough)
}

fn stage(change: Change) -> Stage {
    match change {
        Change::Range(_) | Change::Offset(_) => Stage::Scene,
        Change::Scale(_) => Stage::Waveform,
        Change::Clock(_) | Change::Drift(_) | Change::Drop { .. } => Stage::Timing,
        Change::Replica(_) => Stage::Propagation,
    }
}

fn behaves_like(stage: Stage) -> Behaviour {
    match stage {
        Stage::Timing => Behaviour::TimeOffset,
        Stage::Propagation => Behaviour::PathLike,
        _ => Behaviour::RangeOffset,
    }
}

/// That the body is elsewhere is observed; the library says why. `deviation`: of the change's value.
fn described(trial: &Trial, fit: &Fitted, deviation: f64) -> Description {
    let normal = |name| vec![Estimate::normal(name, fit.value, deviation)];
    let pace = if fit.value > 0.0 { "faster" } else { "slower" };
    let (estimates, observed, cause): (_, _, String) = match fit.score.change {
        Change::Range(_) => (
            normal("offset_m"),
            format!("The body appears {} than it stands", farther(fit.value)),
            "all ranges are wrong by as much".into(),
        ),
        Change::Scale(_) => (
            normal("relative"),
            format!(
                "Ranges are stretched by {:.2} %, {:.1} mm at the body's mean range",
                1e2 * fit.value,
                1e3 * fit.value * mean_range_m(trial)
            ),
            "the ramp climbs by that much faster than stated".into(),
        ),
        Change::Offset(_) => (
            vec![Estimate::list("offset_m", &[0.0, fit.value, 0.0], &[UNSEEN_M, deviation, UNSEEN_M])],
            format!("The body appears {} along boresight", farther(fit.value)),
            "it stands there, not where stated".into(),
        ),
        Change::Clock(_) => (
            normal("offset_s"),
            format!(
                "The body is {:.0} ms {} in its motion than stated, and its error grows with each limb's velocity",
                1e3 * fit.value.abs(),
                if fit.value > 0.0 { "later" } else { "earlier" }
            ),
            "the clocks of the motion and the radar differ".into(),
        ),
        // No clock errs by more than the library allows it: a rate was stated wrongly.
        Change::Drift(_) if fit.value.abs() > clock_drift::INFO.parameters[0].most => {
            return Description::unnamed(format!(
                "The motion runs {:.1} % {pace} than stated, more than a clock is wrong: the rate of the motion's frames or of the radar's \
                 is another.",
                1e2 * fit.value.abs(),
            ));
        }
        Change::Drift(_) => (
            normal("relative"),
            format!("The motion runs {:.2} % {pace} than stated", 1e2 * fit.value.abs()),
            "its clock does, against the radar's".into(),
        ),
        Change::Replica(echo) => {
            let (estimates, statement) = replica::described(trial, echo, fit.value, deviation);
            return Description { id: Some(fit.id), estimates, statement };
        }
        Change::Drop { at, count } => (
            vec![Estimate::normal("at", at as f64, 1.5), Estimate::normal("count", count as f64, 0.0)],
            format!("From frame {at} on the body is {count} frame(s) later in its motion"),
            "frames were lost there".into(),
        ),
    };
    Description::named(trial.evidence, fit.id, estimates, [observed, cause])
}

fn candidate(trial: &Trial, fit: &Fitted, look_alikes: Vec<&'static str>, p_value: f64, nats: f64) -> Candidate {
    let (evidence, change) = (trial.evidence, fit.score.change);
    let description = described(trial, fit, deviation(trial, fit).hypot(SCENE * fit.floor));
    let stage = stage(change);
    let place = match change {
        Change::Drop { at, .. } => Place { frames: Some((at..evidence.cube.dims[0]).collect()), ..Place::at(stage) },
        Change::Replica(echo) => replica::place(trial, echo),
        _ => Place::at(stage),
    };
    let moves = Moves::new(evidence.radar.centre_m());
    Candidate {
        choice: place.boundary.clone(),
        errs_alike: true,
        look_alikes: if description.id.is_some() { look_alikes } else { vec![] },
        // All that moves is misplaced.
        energy: energy_beyond_noise(evidence),
        correction: moves.correction(change),
        ..description.candidate(behaves_like(stage), place, p_value, nats)
    }
}

/// "3.0 mm nearer".
fn farther(metres: f64) -> String {
    format!("{:.1} mm {}", 1e3 * metres.abs(), if metres < 0.0 { "nearer" } else { "farther" })
}
