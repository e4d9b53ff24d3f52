//! Rounds of suspicion: all look, the best explanation is accepted and taken into account, all look again.
//!
//! A finding must be significant (family-wise over all suspects and places) *and* predict held-out frames better. What
//! was accepted early may only have mimicked what was found later, so at the end each one is asked to stand again with
//! all others taken into account.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::config::DiagnosisConfig;
use super::course::Of;
use super::evidence::Evidence;
use super::finding::{Candidate, Correction};
use super::misfit::Misfit;
use super::remains::{ROUGHLY, is_by_chirp, is_left_by, is_of_receivers, is_of_remains, is_product, is_rough, is_same};
use super::suspects::receiver::harmonic;
use super::suspects::{SUSPECTS, Suspect, by_suspect, excess, paths, strongest_suspicion};

impl DiagnosisConfig {
    /// Limit of one suspect's p-value.
    fn p_value(&self, suspect: usize) -> f64 {
        self.alarm * SUSPECTS[suspect].share / SUSPECTS.iter().map(|suspect| suspect.share).sum::<f64>()
    }

    /// What has no name may be anything, so it must gain more, half as much more where chance cannot have made it. `untouched`:
    /// what was taken out of a recording leaves remains, which chance has not made either.
    pub(super) fn passes(&self, suspect: usize, candidate: &Candidate, untouched: bool) -> bool {
        let sure = untouched && candidate.p_value < NO_CHANCE;
        let least = match candidate.id {
            Some(_) => self.gain,
            None if sure => 0.5 * (self.gain + self.nameless_gain),
            None => self.nameless_gain,
        };
        // What predicts held-out frames better than it must is as much less likely to be chance: the likelihood's ratio on data
        // that were not fitted exceeds e^gain by chance with a probability of e^-gain at most. Not where the body's prediction has
        // a part: what errs in it errs in held-out frames alike; nor where the frames that predict are those of the p-value.
        let surplus = untouched && !candidate.errs_alike && !SUSPECTS[suspect].predicts_all_frames;
        let surplus = if surplus { (candidate.gain - least).exp().clamp(1.0, MOST_SURPLUS) } else { 1.0 };
        candidate.p_value <= self.p_value(suspect) * surplus && candidate.gain >= least && candidate.gain.is_finite()
    }
}

/// By how much a gain beyond the least may raise the limit of a p-value.
const MOST_SURPLUS: f64 = 10.0;

/// p-value below which what has no name needs only half as much more than what has one.
const NO_CHANCE: f64 = 1e-12;

/// What undoing chirp by chirp leaves at the chirps' edges looks like these; a true one was there before.
const LIKE_EDGES: [&str; 4] = ["ramp_edge_transient", "if_highpass", "if_lowpass", "if_delay"];

/// What gains less than this share of what it gained before a vibration was undone is what the vibration leaves; what gains more
/// was there all along.
const NEARLY: f64 = 0.8;

/// What is named even where products of the signal with itself lie everywhere.
const WHATEVER_THE_SIGNAL: [&str; 2] = ["iq_imbalance", "adc_saturation"];

/// What never changes and may be a return or added behind the mixer: what turns all returns distinguishes the two, and goes first.
const ADDED: [&str; 3] = ["tx_leakage", "dc_offset", "static_reflector"];

/// Stages of the signal's chain at which everything that is received is changed.
const UPSTREAM: [&str; 2] = ["waveform", "receiver"];

/// What raises the held-out frames' dB error by this factor as it is undone is not what happened.
const FAR_WORSE: f64 = 1.6;

/// So many paths of one name are reported: a person whom nobody tracked is made of many more, and other effects must have their
/// turn.
const MOST_ALIKE: usize = 6;

/// An accepted candidate with what it changed.
#[derive(Clone, Debug)]
pub struct Accepted {
    pub suspect: usize,
    pub candidate: Candidate,
    /// What else would have explained this as well, as ids.
    pub rivals: Vec<&'static str>,
    /// Share of belief in this name among its rivals.
    pub probability: f64,
    /// Of the held-out frames, without and with it.
    pub before: Misfit,
    pub after: Misfit,
}

/// What the rounds left behind.
pub struct Explanation {
    pub accepted: Vec<Accepted>,
    /// The recording with everything taken into account.
    pub evidence: Evidence,
    /// Smallest p-value of all suspects on the untouched recording, corrected for their number: a bound.
    pub suspicion: f64,
    /// Smallest p-value of each suspect that had something to say of it.
    pub suspects: BTreeMap<String, f64>,
    pub before: Misfit,
    pub after: Misfit,
}

/// Runs the rounds; `progress` receives what was found.
pub fn explain(evidence: Evidence, thresholds: &DiagnosisConfig, progress: &mut dyn FnMut(&str)) -> Explanation {
    let before = Misfit::of(&evidence);
    let original = evidence;
    let mut current: Option<Evidence> = None;
    let mut accepted: Vec<Accepted> = vec![];
    let mut first_suspected = None;
    // Candidates of the round before that could still turn out to be the same thing as what was accepted in it.
    let mut pending: Vec<Candidate> = vec![];
    let mut misfit = before;
    // Names that would make everything far worse.
    let mut refused: Vec<&'static str> = vec![];
    // Names that passed on the untouched recording, and what they gained.
    let mut at_first: Option<Vec<(&'static str, f64)>> = None;
    // What was suspected in a round that only refused a name: nothing has changed since.
    let mut suspected: Option<Vec<(usize, Candidate)>> = None;
    for _ in 0..=thresholds.most {
        let evidence = current.as_ref().unwrap_or(&original);
        let found = suspected.take().unwrap_or_else(|| suspicions(evidence));
        first_suspected.get_or_insert_with(|| (strongest_suspicion(&found), by_suspect(&found)));
        // So they do where products were taken out roughly.
        let bent = |effect: &Accepted| effect.candidate.behaves_like == harmonic::QUADRATIC;
        let mixed = evidence.products().mixed().is_some() || accepted.iter().any(bent);
        let untouched = accepted.is_empty();
        let passes = |(suspect, candidate): &&(usize, Candidate)| thresholds.passes(*suspect, candidate, untouched);
        let named = || found.iter().filter(passes).filter_map(|(_, candidate)| Some((candidate.id?, candidate.gain))).collect();
        let at_first: &Vec<(&'static str, f64)> = at_first.get_or_insert_with(named);
        // What a radar that vibrates leaves, or paths of what differs between receivers, or that of their noise, is less than there
        // was before; and a tone or a product that was there before is no remains.
        let was_there = |effect: &Accepted, candidate: &Candidate| {
            let as_much = |&(id, gain): &(&str, f64)| candidate.id == Some(id) && candidate.gain > NEARLY * gain;
            let vibrates = effect.candidate.id == Some("radar_vibration");
            let of_receivers = is_of_receivers(candidate) || is_of_receivers(&effect.candidate);
            (vibrates || of_receivers || candidate.id == Some("spur") || is_product(candidate)) && at_first.iter().any(as_much)
        };
        let left = |effect: &Accepted, candidate: &Candidate| {
            is_same(&effect.candidate, candidate) || is_left_by(&effect.candidate, candidate) && !was_there(effect, candidate)
        };
        let known = |candidate: &Candidate| accepted.iter().any(|effect| left(effect, candidate));
        let by_chirp = accepted.iter().any(|effect| is_by_chirp(&effect.candidate));
        let may_be_named = |id: &str| {
            (!mixed || WHATEVER_THE_SIGNAL.contains(&id))
                && (!by_chirp || !LIKE_EDGES.contains(&id) || at_first.iter().any(|first| first.0 == id))
                && !refused.contains(&id)
                && accepted.iter().filter(|effect| effect.candidate.id == Some(id)).count() < MOST_ALIKE
        };
        let clocks_were_wrong = accepted.iter().any(|effect| effect.candidate.place.stage == "timing");
        let elsewhere = clocks_were_wrong || found.iter().filter(passes).any(|(_, candidate)| is_displaced(candidate));
        let passing: Vec<&(usize, Candidate)> = found
            .iter()
            .filter(passes)
            .filter(|(suspect, _)| !(elsewhere && SUSPECTS[*suspect].trusts_the_place))
            .filter(|(_, candidate)| !known(candidate) && candidate.id.is_none_or(may_be_named))
            .collect();
        if let Some(last) = accepted.last_mut() {
            settle_rivals(last, &pending, &passing, thresholds);
        }
        // What happened last in the signal's chain is undone first; else the strongest; what has no shape at all last.
        let order = |(suspect, candidate): &&&(usize, Candidate)| {
            let suspect = &SUSPECTS[*suspect];
            let worth = if is_rough(candidate) { ROUGHLY * candidate.gain } else { candidate.gain };
            (suspect.last_in_chain, !suspect.last_resort, worth)
        };
        let strongest = passing.iter().max_by(|a, b| order(a).partial_cmp(&order(b)).expect("gains are finite"));
        let Some(strongest) = strongest.map(|best| upstream(&original, evidence, best, &passing)) else {
            break;
        };
        let (suspect, best) = strongest;
        if accepted.len() == thresholds.most {
            break;
        }
        let mut best = best.clone();
        let mut next = evidence.with(&best);
        let mut after = Misfit::after(&original, &next);
        if let Some(id) = best.id
            && after.db_mse > FAR_WORSE * misfit.db_mse
        {
            if !SUSPECTS[*suspect].last_in_chain {
                refused.push(id);
                suspected = Some(found);
                continue;
            }
            // What the codes themselves show is there, even where it cannot be undone.
            best.correction = Correction::None;
            next = evidence.with(&best);
            after = misfit;
        }
        progress(&best.statement);
        pending = passing.iter().filter(|other| !std::ptr::eq(**other, strongest)).map(|(_, other)| other.clone()).collect();
        accepted.push(Accepted {
            suspect: *suspect,
            rivals: best.look_alikes.clone(),
            candidate: best,
            probability: 1.0,
            before: misfit,
            after,
        });
        misfit = after;
        current = Some(next);
    }
    drop(current);
    let accepted = verified(&original, accepted, thresholds);
    let evidence = accepted.iter().fold(original.clone(), |evidence, effect| evidence.with(&effect.candidate));
    let mut after = Misfit::after(&original, &evidence);
    // What changes neither samples nor prediction, such as a law of the noise, gains what its own test says.
    let held_out = original.split.held_out.len() * original.cube.channels() * original.cube.dims[3] * original.range_bins();
    let unseen = accepted.iter().filter(|effect| matches!(effect.candidate.correction, Correction::None));
    after.loglik_per_sample += unseen.map(|effect| effect.candidate.gain).sum::<f64>() / held_out.max(1) as f64;
    let (suspicion, suspects) = first_suspected.unwrap_or((1.0, BTreeMap::new()));
    Explanation { accepted, evidence, suspicion, suspects, before, after }
}

/// Whether the body is elsewhere, or at another time, than predicted.
fn is_displaced(candidate: &Candidate) -> bool {
    matches!(candidate.correction, Correction::Body(_)) && candidate.place.stage != "propagation"
}

/// Whether it acts on every return, or on all of the body. What has no name does where nobody is tracked: most ranges share it then.
fn is_on_all(candidate: &Candidate, evidence: &Evidence) -> bool {
    let id = candidate.id.unwrap_or_default();
    (!id.is_empty() || evidence.body.is_none())
        && (id == "radar_vibration" || is_displaced(candidate) || UPSTREAM.contains(&candidate.place.stage.as_str()))
}

/// Whether it may be something else's echoes of the body.
fn is_echo(candidate: &Candidate) -> bool {
    candidate.behaves_like.starts_with(paths::PATH_LIKE) || is_rough(candidate)
}

/// What acts on every return makes echoes of the body too, which look like paths of their own, and of the room beyond its ranges; and a
/// body that is elsewhere than predicted looks like another one: where both are suspected, the one is accepted that leaves less.
fn upstream<'a>(
    original: &Evidence,
    evidence: &Evidence,
    best: &'a (usize, Candidate),
    passing: &[&'a (usize, Candidate)],
) -> &'a (usize, Candidate) {
    let turns_all = |(_, candidate): &&&(usize, Candidate)| matches!(&candidate.correction, Correction::Followed(_, course) if course.of == Of::All);
    if ADDED.iter().any(|id| best.1.id == Some(id))
        && let Some(course) = passing.iter().filter(turns_all).max_by(|a, b| a.1.gain.total_cmp(&b.1.gain))
    {
        return course;
    }
    if best.1.id == Some("tx_leakage") {
        // What the chirp makes of the room's returns never changes either, nor does an offset, and a leakage is free in every channel: it
        // is none where nothing is left of it.
        let left = |evidence: &Evidence| (SUSPECTS[best.0].find)(evidence).iter().any(|candidate| candidate.id == best.1.id);
        let simpler = |candidate: &Candidate| candidate.place.stage == "waveform" || candidate.id == Some("dc_offset");
        let mut simpler = passing.iter().filter(|(_, candidate)| simpler(candidate));
        return simpler.find(|(_, candidate)| !left(&evidence.with(candidate))).copied().unwrap_or(best);
    }
    let others = passing.iter().filter(|(_, candidate)| is_on_all(candidate, evidence));
    let Some(other) = others.max_by(|a, b| a.1.gain.total_cmp(&b.1.gain)).filter(|_| is_echo(&best.1)) else {
        return best;
    };
    // Seen from a wrong place, an echo of the body has no name: where the body is elsewhere with and without the echo, it is put right
    // first.
    let stands = |(suspect, other): &(usize, Candidate)| {
        let again = (SUSPECTS[*suspect].find)(&evidence.with(&best.1));
        again.iter().any(|found| found.id == other.id && found.gain > NEARLY * other.gain)
    };
    if best.1.id.is_none() && is_displaced(&other.1) && stands(other) {
        return other;
    }
    if evidence.body.is_none() {
        // Nobody predicts where something moves: it does where it still seems to once what all returns share is undone.
        let again = (SUSPECTS[best.0].find)(&evidence.with(&other.1));
        let stands = again.iter().any(|found| is_same(&best.1, found) && found.gain > NEARLY * best.1.gain);
        return if stands { best } else { other };
    }
    let left = |candidate: &Candidate| Misfit::after(original, &evidence.with(candidate)).loglik_per_sample;
    if left(&other.1) > left(&best.1) { other } else { best }
}

/// What every suspect has to say.
fn suspicions(evidence: &Evidence) -> Vec<(usize, Candidate)> {
    // The shared products first, so that suspects do not wait for one another.
    evidence.maps();
    let ask = |(index, suspect): (usize, &Suspect)| -> Vec<(usize, Candidate)> {
        (suspect.find)(evidence).into_iter().map(|candidate| (index, candidate)).collect()
    };
    SUSPECTS.par_iter().enumerate().flat_map_iter(ask).collect()
}

/// How likely a look-alike is beforehand, against the effect that was accepted.
fn prior(id: &str) -> f64 {
    match id {
        // It must lie beyond the unambiguous range, and be stronger by the fourth power of that to be seen at all. Where it
        // is accepted itself, it was seen beyond the room.
        "range_alias" => 0.1,
        _ => 1.0,
    }
}

/// Rivals of the effect accepted last: they passed beside it and have nothing left to say now that it is in place.
fn settle_rivals(last: &mut Accepted, pending: &[Candidate], passing: &[&(usize, Candidate)], thresholds: &DiagnosisConfig) {
    let mut weight = 1.0 + last.candidate.look_alikes.iter().map(|id| prior(id)).sum::<f64>();
    for rival in pending {
        let Some(id) = rival.id else { continue };
        // Without the body at its place, echoes of it are as strong as the body.
        if is_displaced(&last.candidate) && (is_echo(rival) || is_of_remains(rival)) {
            continue;
        }
        let silent = !passing.iter().any(|(_, candidate)| candidate.id == Some(id));
        if silent && Some(id) != last.candidate.id {
            let behind = last.candidate.gain - rival.gain;
            weight += (-behind).exp().min(1.0);
            if behind <= thresholds.tie && !last.rivals.contains(&id) {
                last.rivals.push(id);
            }
        }
    }
    last.probability = 1.0 / weight;
}

/// Asks everyone accepted to stand again with all others taken into account; the rest keep the parameters of this last
/// fit. Whoever falls only because somebody later is there competes with that one: the one that gains more alone stays.
fn verified(original: &Evidence, mut accepted: Vec<Accepted>, thresholds: &DiagnosisConfig) -> Vec<Accepted> {
    if accepted.len() < 2 {
        return accepted;
    }
    let mut index = accepted.len();
    while index > 0 {
        index -= 1;
        if SUSPECTS[accepted[index].suspect].last_in_chain {
            continue;
        }
        if let Some(candidate) = again(original, &accepted, index, &[], thresholds) {
            accepted[index].candidate = candidate;
            continue;
        }
        // The latest first: what came last is the most likely to be a remainder.
        let rival = (index + 1..accepted.len()).rev().find_map(|other| {
            let alone = again(original, &accepted, index, &[other], thresholds)?;
            let other_alone = again(original, &accepted, other, &[index], thresholds).map_or(0.0, |other| other.gain);
            (alone.gain > other_alone).then_some((other, alone))
        });
        match rival {
            Some((other, alone)) => {
                accepted[index].candidate = alone;
                accepted.remove(other);
            }
            None => {
                accepted.remove(index);
            }
        }
    }
    accepted
}

/// What one of the accepted says once more when all others but some are taken into account.
fn again(
    original: &Evidence,
    accepted: &[Accepted],
    index: usize,
    without: &[usize],
    thresholds: &DiagnosisConfig,
) -> Option<Candidate> {
    let effect = &accepted[index];
    // An image or a product of what the antennas do otherwise is that of the signal with it: what is in the receiver is undone first.
    let before = |other: &Accepted| effect.candidate.place.stage == "receiver" && other.candidate.place.stage == "antenna";
    let stands = |(other, accepted): &(usize, &Accepted)| *other != index && !without.contains(other) && !before(accepted);
    let others = accepted.iter().enumerate().filter(stands);
    let evidence = others.fold(original.clone(), |evidence, (_, effect)| evidence.with(&effect.candidate));
    let same = |candidate: &Candidate| {
        candidate.id == effect.candidate.id
            && candidate.choice == effect.candidate.choice
            && thresholds.passes(effect.suspect, candidate, true)
    };
    let found = (SUSPECTS[effect.suspect].find)(&evidence).into_iter().filter(same);
    found.max_by(|a, b| a.gain.total_cmp(&b.gain))
}

impl Evidence {
    /// The same with one more effect taken into account.
    pub fn with(&self, candidate: &Candidate) -> Self {
        let mut next = self.clone().changed();
        if candidate.behaves_like.starts_with(paths::PATH_LIKE) || candidate.behaves_like == excess::BEHAVES_LIKE {
            // Where paths were cut out there is not even noise left.
            next.noise = self.noise.clone();
        }
        next.correct(&candidate.correction);
        next.accepted.push(candidate.id.unwrap_or(candidate.behaves_like));
        next
    }

    fn correct(&mut self, correction: &Correction) {
        match correction {
            Correction::Samples(undo) => undo(&mut self.cube),
            Correction::Inverse(undo, volume) => {
                undo(&mut self.cube);
                self.inverses.push((undo.clone(), volume.clone()));
            }
            Correction::Followed(correction, course) => {
                self.correct(correction);
                self.courses.push(course.clone());
            }
            Correction::Body(change) => {
                if let Some(body) = &mut self.body {
                    change(body);
                }
            }
            Correction::None => {}
        }
    }
}
