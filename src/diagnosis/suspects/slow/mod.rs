//! What varies from chirp to chirp and from frame to frame in all static returns together.
//!
//! Their complex gain is estimated in every chirp from the range cells without movers ([`field`]), as a gain, a phase
//! that all ranges share, and a phase in proportion to the delay. Each of the three is searched for sinusoids, drifts,
//! functions of the chirp's place in its frame, and randomness.

mod candidates;
pub mod channels;
pub mod drift;
pub mod field;
pub mod lines;
pub mod locked;
pub mod odd_frame;
mod platform_vibration;
pub mod random;
pub mod settling;
mod shared;
pub mod steady;
#[cfg(test)]
mod tests;

use field::{Field, Part};
use num_complex::Complex64;

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::Candidate;
use crate::diagnosis::statistics;

/// Kinds of looks that share one p-value: three parts, each for lines, drifts and randomness, a radar that vibrates, and
/// settling.
const LOOKS: f64 = 11.0;
/// Log-likelihood gain (nats) below which nothing is reported.
const LEAST_GAIN: f64 = 3.0;
/// Share of the log-likelihood gain that what is simpler, or has a name, needs.
const NEARLY: f64 = 0.8;
/// The same for what a sure name explains over the noise, where what has no name leaves more than noise itself.
const HALF: f64 = 0.5;
/// Difference of log-likelihood gains (nats) that decides nothing.
const UNDECIDED: f64 = 4.6;
/// Turns of a line in a frame from which on it is distinguishable from a drift.
const DISTINCT_TURNS: f64 = 0.2;
/// p-value below which a law that a background makes unsure is sure.
const SURE: f64 = 1e-3;
/// p-value below which a candidate is passed on.
const PASSED_ON: f64 = 0.01;

/// A candidate of this family.
struct Found {
    candidate: Candidate,
    /// Of a line on a background that is hardly known: its degrees of freedom, and the p-value that this leaves.
    unsure: Option<(f64, f64)>,
    /// Log-likelihood gain over the noise alone.
    over_noise: f64,
    /// The same where it is sure; else the candidate's own.
    explained: f64,
    /// Of a line with more than noise beside it.
    loud: bool,
    /// Whether a frame sees so much of a line's turn that it cannot be taken for a drift from frame to frame.
    within_frames: bool,
}

impl From<Candidate> for Found {
    fn from(candidate: Candidate) -> Self {
        Self { explained: candidate.gain, over_noise: candidate.gain, candidate, unsure: None, loud: false, within_frames: true }
    }
}

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let known = |candidate: &Candidate| candidate.id.is_some_and(|id| evidence.accepted.contains(&id));
    let reported = |candidate: &Candidate| candidate.p_value < PASSED_ON && candidate.gain > LEAST_GAIN && !known(candidate);
    let of_all = |found: Candidate| Candidate { p_value: statistics::corrected(found.p_value, LOOKS), ..found };
    // Where nobody is tracked and no law in time holds, what most ranges share is reported without one.
    let shared = || evidence.body.is_none().then(|| shared::find(evidence)).flatten().map(of_all).filter(reported);
    let Some(field) = Field::new(evidence) else {
        // No range is static: nothing is, or the phases of returns from many directions oscillate.
        return shared().or_else(|| platform_vibration::find(evidence).map(of_all).filter(reported)).into_iter().collect();
    };
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let frame_s = evidence.radar.frame_duration_s();
    // Of a few parameters, and those that are free in every chirp.
    let (mut found, mut free): (Vec<Found>, Vec<Found>) = (vec![], vec![]);
    for part in [Part::Gain, Part::Phase, Part::Delay, Part::Boresight] {
        if part == Part::Boresight && evidence.room.is_none() {
            continue;
        }
        let series = field.series(part, |_| true);
        // At the farthest group.
        let farthest_s = field.groups.iter().map(|g| g.delay_s).fold(0.0, f64::max);
        let largest = match part {
            Part::Gain => 1.0,
            Part::Phase | Part::Boresight => field.farthest,
            Part::Delay => field.farthest / farthest_s,
        };
        let line = lines::strongest(&field, &series, training, held_out, largest);
        let of_line = |line: &lines::Line| {
            let value = |frame: usize, index: usize| line.value(field.times_s[frame * field.loops + index]);
            field.shared(|frame, index, group| part.deviation(value(frame, index), group))
        };
        if let Some(line) = line.filter(of_line) {
            let p_value = |freedom| (-lines::unsure(line.training_gain, freedom)).exp();
            let unsure = |freedom| (freedom, statistics::corrected(p_value(freedom), line.tried * LOOKS));
            let candidate = candidates::of_line(evidence, &field, part, &line);
            let unsure = line.freedom.map(unsure);
            let sure = unsure.is_none_or(|(_, p_value)| p_value < SURE);
            let within_frames = line.frequency_hz * frame_s > DISTINCT_TURNS;
            let over_noise = line.background * candidate.gain;
            let explained = if sure && within_frames { over_noise } else { candidate.gain };
            found.push(Found { explained, over_noise, candidate, unsure, loud: line.background > lines::LOUD, within_frames });
        }
        if part == Part::Boresight {
            continue;
        }
        let of_drift = |drift: &drift::Drift| field.shared(|frame, _, group| part.deviation(drift.value(frame), group));
        if let Some(drift) = drift::best(&field, part, &series, training, held_out).filter(of_drift) {
            found.push(candidates::of_drift(evidence, &field, part, &drift).into());
        }
        let of_random = |random: &random::Random| {
            let value = |frame, index| random.value(&series, frame, index);
            field.shared_by_others(|frame, index, group| part.deviation(value(frame, index), group))
        };
        if let Some(random) = random::best(&field, part, training, held_out).filter(of_random) {
            free.push(candidates::of_random(evidence, &field, part, &random).into());
        }
    }
    let of_settling = |settling: &settling::Settling| {
        let mean = (0..field.loops).map(|index| settling.value(index)).sum::<Complex64>() / field.loops as f64;
        field.shared(|_, index, _| settling.value(index) - mean)
    };
    if let Some(settling) = settling::best(&field, training, held_out).filter(of_settling) {
        let candidate = candidates::of_settling(evidence, &field, &settling);
        if candidate.id.is_some() { found.push(candidate.into()) } else { free.push(candidate.into()) }
    }
    for list in [&mut found, &mut free] {
        for Found { candidate, .. } in list.iter_mut() {
            candidate.p_value = statistics::corrected(candidate.p_value, LOOKS);
        }
        list.retain(|Found { candidate, .. }| reported(candidate));
    }
    let is_sure = |found: &Found| found.unsure.is_none_or(|(_, p_value)| p_value < SURE);
    let of_phase = [Part::Phase, Part::Delay].map(candidates::behaves_like);
    let holds = |found: &Found| of_phase.contains(&found.candidate.behaves_like) && is_sure(found);
    let shared = if found.iter().chain(&free).any(holds) { None } else { shared() };
    // One cause shows in several looks. A law of few parameters wins where it explains nearly as much as what is free in
    // every chirp (over the noise alone: a background that makes a law unsure is part of what is free in every chirp), and a name
    // where it explains nearly as much as what has none.
    let most = |of: &[Found]| of.iter().map(|found| found.explained).fold(0.0, f64::max);
    if found.is_empty() || most(&found) < NEARLY * most(&free) {
        found.append(&mut free);
    }
    // Of another kind it wins only where the recording cannot decide.
    let named = found.iter().filter(|found| found.candidate.id.is_some());
    let names: Vec<(Behaviour, f64, bool)> =
        named.map(|found| (found.candidate.behaves_like, found.explained, found.loud && found.within_frames)).collect();
    // A law without a name must fit to the noise where one with a name explains nearly as much: how strong static returns turn
    // when the radar itself moves depends on where they are, which is known roughly.
    let explained = names.iter().map(|name| name.1).fold(0.0, f64::max);
    let named_surely = |found: &&Found| found.candidate.id.is_some() && found.unsure.is_none_or(|(_, p_value)| p_value < SURE);
    let over_noise = found.iter().filter(named_surely).map(|found| found.over_noise).fold(0.0, f64::max);
    let fits_better = |found: &Found| explained < NEARLY * found.explained && over_noise < HALF * found.over_noise;
    found.retain(|found| found.candidate.id.is_some() || !found.loud || fits_better(found));
    let taken = |other: &Found| {
        let like_it = |like: Behaviour, gain: f64| like == other.candidate.behaves_like && gain > NEARLY * other.explained;
        // Where it leaves much itself it must explain clearly more.
        let more =
            |gain: f64, loud: bool| if loud { NEARLY * gain > other.explained } else { gain > other.explained - UNDECIDED };
        names.iter().any(|&(like, gain, loud)| like_it(like, gain) || more(gain, loud))
    };
    found.retain(|found| found.candidate.id.is_some() || !taken(found));
    found.sort_by(|a, b| b.candidate.gain.total_cmp(&a.candidate.gain));
    let rivals: Vec<(Option<&'static str>, f64)> = found.iter().map(|found| (found.candidate.id, found.candidate.gain)).collect();
    for Found { candidate, .. } in &mut found {
        for &(id, gain) in &rivals {
            if let Some(id) = id
                && Some(id) != candidate.id
                && (gain - candidate.gain).abs() < UNDECIDED
                && !candidate.look_alikes.contains(&id)
            {
                candidate.look_alikes.push(id);
            }
        }
    }
    // Only now: what a line explains best is no better explained by something else because the line is unsure.
    let judged = |Found { mut candidate, unsure, within_frames, .. }| {
        if let Some((freedom, p_value)) = unsure {
            if p_value > SURE || !within_frames {
                candidate.gain = lines::unsure(candidate.gain, freedom);
            }
            candidate.p_value = p_value;
        }
        candidate
    };
    found.into_iter().map(judged).chain(shared).collect()
}
