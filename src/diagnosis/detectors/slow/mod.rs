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
pub mod corrupted_frame;
mod periodogram;
mod platform_vibration;
pub mod random;
pub mod settling;
mod selection;
mod shared;
pub mod frame_clutter;
#[cfg(test)]
mod tests;

use field::{Field, Group, Part, Series};
use num_complex::Complex64;
use selection::Found;

use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::Candidate;
use crate::diagnosis::statistics;

/// Kinds of looks that share one p-value: three parts, each for lines, drifts and randomness, a radar that vibrates, and
/// settling.
const LOOKS: f64 = 11.0;
/// Log-likelihood gain (nats) below which nothing is reported.
const LEAST_GAIN: f64 = 3.0;
/// Turns of a line in a frame from which on it is distinguishable from a drift.
const DISTINCT_TURNS: f64 = 0.2;
/// p-value below which a candidate is passed on.
const PASSED_ON: f64 = 0.01;

/// The parts of the complex gain that have a series each.
const PARTS: [Part; 4] = [Part::Gain, Part::Phase, Part::Delay, Part::Boresight];

/// Candidates for what static returns do together over slow time, with p-values corrected for all kinds of looks.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let known = |candidate: &Candidate| candidate.id.is_some_and(|id| evidence.accepted.contains(&id));
    let reported = |candidate: &Candidate| candidate.p_value < PASSED_ON && candidate.nats > LEAST_GAIN && !known(candidate);
    let of_all = |found: Candidate| Candidate { p_value: statistics::corrected(found.p_value, LOOKS), ..found };
    // Where nobody is tracked and no law in time holds, what most ranges share is reported without one.
    let shared = || evidence.body.is_none().then(|| shared::find(evidence)).flatten().map(of_all).filter(reported);
    let Some(field) = Field::new(evidence) else {
        // No range is static: nothing is, or the phases of returns from many directions oscillate.
        return shared().or_else(|| platform_vibration::find(evidence).map(of_all).filter(reported)).into_iter().collect();
    };
    let (mut found, mut free) = looks(evidence, &field);
    for list in [&mut found, &mut free] {
        for Found { candidate, .. } in list.iter_mut() {
            candidate.p_value = statistics::corrected(candidate.p_value, LOOKS);
        }
        list.retain(|Found { candidate, .. }| reported(candidate));
    }
    let of_phase = [Part::Phase, Part::Delay].map(candidates::behaves_like);
    let holds = |found: &Found| of_phase.contains(&found.candidate.behaves_like) && found.is_sure();
    let all = || found.iter().chain(&free);
    // A gain of any course is none where a law explains nearly as much of it.
    let is_its_law = |shared: &Candidate, found: &Found| {
        let of_gain = [shared, &found.candidate].iter().all(|of| of.behaves_like == candidates::behaves_like(Part::Gain));
        of_gain && found.explained > selection::NEARLY * shared.nats
    };
    let shared = if all().any(holds) { None } else { shared() };
    let shared = shared.filter(|shared| !all().any(|found| is_its_law(shared, found)));
    selection::selected(found, free).into_iter().map(selection::judged).chain(shared).collect()
}

/// What is found, of few parameters, and what is free in every chirp.
fn looks(evidence: &Evidence, field: &Field) -> (Vec<Found>, Vec<Found>) {
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let (mut found, mut free): (Vec<Found>, Vec<Found>) = (vec![], vec![]);
    for part in PARTS {
        if part == Part::Boresight && field.groups.iter().all(|group| group.ahead == field.groups[0].ahead) {
            continue;
        }
        let series = field.series(part, |_| true);
        found.extend(line(evidence, field, part, &series));
        if part == Part::Boresight {
            continue;
        }
        let of_drift = |drift: &drift::Drift| field.shared(|frame, _, group| part.deviation(drift.value(frame), group));
        if let Some(drift) = drift::best(field, part, &series, training, held_out).filter(of_drift) {
            found.push(candidates::of_drift(evidence, field, part, &drift).into());
        }
        let of_random = |random: &random::Random| {
            let value = |frame, index| random.value(&series, frame, index);
            field.shared_by_others(|frame, index, group| part.deviation(value(frame, index), group))
        };
        if let Some(random) = random::best(field, part, training, held_out).filter(of_random) {
            free.push(candidates::of_random(evidence, field, part, &random).into());
        }
    }
    let of_settling = |settling: &settling::Settling| {
        let mean = (0..field.loops).map(|index| settling.value(index)).sum::<Complex64>() / field.loops as f64;
        field.shared(|_, index, _| settling.value(index) - mean)
    };
    // Blocks of a long frame are no frames: the first chirps of a block follow others.
    let settling = if evidence.split.block_loops.is_none() { settling::best(field, training, held_out) } else { None };
    if let Some(settling) = settling.filter(of_settling) {
        let candidate = candidates::of_settling(evidence, field, &settling);
        if candidate.id.is_some() { found.push(candidate.into()) } else { free.push(candidate.into()) }
    }
    (found, free)
}

/// The strongest sinusoid of a part that the static returns share.
fn line(evidence: &Evidence, field: &Field, part: Part, series: &Series) -> Option<Found> {
    // At the farthest group.
    let farthest_s = field.groups.iter().map(|g| g.delay_s).fold(0.0, f64::max);
    let largest = match part {
        Part::Gain => 1.0,
        Part::Phase | Part::Boresight => field.farthest,
        Part::Delay => field.farthest / farthest_s,
    };
    let line = lines::strongest(field, series, &evidence.split.training, &evidence.split.held_out, largest)?;
    let value = |frame: usize, index: usize| line.value(field.times_s[frame * field.loops + index]);
    if !field.shared(|frame, index, group| part.deviation(value(frame, index), group)) {
        return None;
    }
    let p_value = |freedom| (-lines::unsure(line.training_nats, freedom)).exp();
    let unsure = |freedom| (freedom, statistics::corrected(p_value(freedom), line.tried * LOOKS));
    let of_leakage = || field.is_of_leakage(evidence, |frame, index, group| part.deviation(value(frame, index), group));
    // Nothing beside it shows the radar's motion.
    let is_of_all = part == Part::Phase && (of_leakage() == Some(true) || field.groups.iter().all(Group::is_own));
    let candidate = candidates::of_line(evidence, field, part, &line, is_of_all);
    let unsure = line.freedom.map(unsure);
    let within_frames = line.frequency_hz * evidence.radar.frame_duration_s() > DISTINCT_TURNS;
    let over_noise = line.background * candidate.nats;
    let explained = if selection::is_sure(unsure) && within_frames { over_noise } else { candidate.nats };
    Some(Found { explained, over_noise, candidate, unsure, loud: line.background > lines::LOUD, within_frames })
}
