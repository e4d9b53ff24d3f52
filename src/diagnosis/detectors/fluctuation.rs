//! Static returns that change while others are constant: one that is modulated at one frequency (`modulation`), one behind the body
//! that changes from frame to frame because the body's shadow falls on it, and whatever moves itself (`fluctuating`).
//!
//! Of the latter two: what all static returns do together (gain, phase, a phase in proportion to the delay) is somebody else's
//! affair and is taken from the other returns, frame by frame. Only ranges beyond the body's reach are looked at, where nothing
//! moves within a frame; a shadow must keep the pattern that the return has across the receivers.

mod course;
mod fluctuating;
mod modulation;
mod returns;
mod silhouette;
mod sinusoid;

use num_complex::Complex64;

use crate::diagnosis::BodyPrediction;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::filter::Filter;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction, Curve, Place};
use crate::diagnosis::statistics::{DECIBEL, bounds, corrected};
use crate::effects::{self, Stage};
use crate::paths::distance;

use course::Frames;
use returns::{Returns, Series};

/// Metres around the body's surface that its own slow returns may reach.
const MARGIN_M: f64 = 0.4;
/// Fewest training frames.
const FEWEST: usize = 6;
/// Strong returns beyond the body's reach that suffice to compare with.
const FEWEST_STRONG: usize = 5;
/// What either finds at most by chance.
const LEAST_LIKELY: f64 = 0.01;
const ID: &str = effects::soft_occlusion::ID;

/// Static clutter where the body never is, if anybody is tracked.
struct Free {
    returns: Returns,
    /// The strong returns, which all do the same unless something happens to them.
    strong: Vec<usize>,
    /// Of all ranges where nothing moves.
    quiet: Vec<usize>,
    /// From here on the body may hide what is there: nowhere without one.
    behind_m: f64,
    bin_m: f64,
}

impl Free {
    /// None where too little is known.
    fn new(evidence: &Evidence) -> Option<Self> {
        let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
        if training.len() < FEWEST || held_out.is_empty() {
            return None;
        }
        let returns = Returns::new(evidence)?;
        let bin_m = evidence.radar.range_resolution_m();
        let reach = match &evidence.body {
            Some(body) => Some(reach(body, evidence.radar.centre_m())?),
            None => None,
        };
        let is_free =
            |bin: &usize| reach.is_none_or(|[before_m, behind_m]| !(before_m..=behind_m).contains(&(*bin as f64 * bin_m)));
        let quiet: Vec<usize> = returns.quiet().filter(is_free).collect();
        let mut strong = returns.strong(&quiet, training);
        if strong.len() < FEWEST_STRONG {
            // Little of a body is in the mean of a frame where nothing seems to move.
            strong = returns.strong(&returns.quiet().collect::<Vec<_>>(), training);
        }
        Some(Self { returns, strong, quiet, behind_m: reach.map_or(f64::INFINITY, |[_, behind_m]| behind_m), bin_m })
    }
}

/// Ranges that a body's own slow returns may reach. None where it has no points.
fn reach(body: &BodyPrediction, centre_m: [f64; 3]) -> Option<[f64; 2]> {
    let [near_m, far_m] = bounds(body.frames.iter().flatten().map(|point| distance(point.position_m, centre_m)));
    (far_m > 0.0).then_some([near_m - MARGIN_M, far_m + MARGIN_M])
}

/// Candidates for a return that changes from frame to frame and for one that is modulated; one of either at most.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let known = evidence.accepted.contains(&ID)
        || evidence.accepted_unnamed.contains(&Behaviour::ChangingAtOneRange)
        || evidence.may_move();
    let by_frame = if known {
        None
    } else {
        Free::new(evidence).and_then(|free| shadow(evidence, &free).or_else(|| fluctuating::find(evidence, &free)))
    };
    by_frame.into_iter().chain(modulation::find(evidence)).collect()
}

fn frames(evidence: &Evidence) -> Frames<'_> {
    Frames { times_s: &evidence.starts_s, training: &evidence.split.training, held_out: &evidence.split.held_out }
}

/// None where the body's silhouette does not explain what changes behind it.
fn shadow(evidence: &Evidence, free: &Free) -> Option<Candidate> {
    let Free { returns, strong, behind_m, bin_m, .. } = free;
    let frames = frames(evidence);
    let behind: Vec<usize> = strong.iter().copied().filter(|&bin| bin as f64 * bin_m > *behind_m).collect();
    let best = behind
        .iter()
        .filter_map(|&bin| {
            let series = returns.relative(bin, strong)?;
            let p_value = corrected(series.p_value(frames.training), behind.len() as f64);
            let nats = evidence.split.held_out_share() * series.nats(frames);
            let keeps = p_value < LEAST_LIKELY && nats > 0.0 && returns.same_pattern(bin, &series, frames.training);
            keeps.then_some((bin, series, p_value, nats))
        })
        .max_by(|a, b| a.3.total_cmp(&b.3))?;
    let (bin, series, p_value, nats) = best;
    let seen = silhouette::seen(evidence, evidence.body.as_ref()?, bin as f64 * bin_m, 1.5 * bin_m)?;
    series.follows(&seen, frames).then(|| candidate(evidence, bin, &series, p_value, nats))
}

fn candidate(evidence: &Evidence, bin: usize, series: &Series, p_value: f64, nats: f64) -> Candidate {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let bin_m = evidence.radar.range_resolution_m();
    let range_m = bin as f64 * bin_m;
    let echo = around(evidence.clutter().to_vec(), samples, bin..=bin);
    let own: f64 = echo.iter().map(|value| value.norm_sqr()).sum();
    let square: f64 = series.change.iter().map(|value| value.norm_sqr()).sum();
    let rms = (square / series.change.len() as f64).sqrt();
    let change = series.change.clone();
    let decibel: Vec<f64> = change.iter().map(|v| DECIBEL * (1.0 + v).norm().max(1e-3).ln()).collect();
    let [low, high] = bounds(decibel.iter().copied());
    let place = Place {
        range_m: Some([range_m - 1.5 * bin_m, range_m + 1.5 * bin_m]),
        velocity_mps: Some([0.0, 0.0]),
        ..Place::at(Stage::Propagation)
    };
    Candidate {
        id: Some(ID),
        statement: format!(
            "The static return {range_m:.2} m away changes from frame to frame by {:.0} % (over {:.1} dB) while the other static \
             returns stay, when the body's silhouette covers it: the body casts a shadow on the room.",
            100.0 * rms,
            high - low
        ),
        curve: Some(Curve::new(
            format!("Static return {range_m:.2} m away, relative to the others"),
            ["time, s", "level, dB"],
            [("measured", evidence.starts_s.clone(), decibel)],
        )),
        energy: own * square * loops as f64,
        correction: Correction::samples(move |cube| {
            cube.each_chirp(|[frame, channel, _], chirp| {
                let echo = &echo[channel * samples..][..samples];
                chirp.iter_mut().zip(echo).for_each(|(value, echo)| *value -= change[frame] * echo);
            });
        }),
        ..Candidate::new(Behaviour::FadingBehindTheBody, place, p_value.max(f64::MIN_POSITIVE), nats)
    }
}

/// The part of chirps that lies within two bins of some, `[channel · sample]`.
fn around(mut chirps: Vec<Complex64>, samples: usize, bins: std::ops::RangeInclusive<usize>) -> Vec<Complex64> {
    const REACH: usize = 2;
    let reached = bins.start().saturating_sub(REACH)..=bins.end() + REACH;
    Filter::pass(samples, |bin| reached.contains(&bin)).apply(&mut chirps);
    chirps
}

#[cfg(test)]
mod tests;
