//! Rounds: all detectors look, the best explanation is accepted and taken into account, all look again.
//!
//! A finding must be significant (family-wise over all detectors and places) *and* predict held-out frames better. What
//! was accepted early may only have mimicked what was found later, so at the end each one is refit with
//! all others taken into account.

mod precedence;
mod said;
mod taken;

use crate::diagnosis::behaviour::Behaviour;
use crate::effects::{self, Stage};
use std::collections::BTreeMap;

use super::config::DiagnosisConfig;
use super::detectors::{DETECTORS, Detector, by_detector, smallest_bound};
use super::evidence::Evidence;
use super::finding::{Candidate, Correction};
use super::misfit::Misfit;
use super::residual::{
    ROUGHLY, is_added, is_left_by, is_of_noise, is_of_receivers, is_of_residual, is_product, is_refit, is_rough, is_same,
    leaves_edges,
};
use precedence::{is_course_of_all, is_displaced, is_echo, upstream};
use said::{candidates, said_by};

impl DiagnosisConfig {
    /// Limit of one detector's p-value.
    fn p_value(&self, detector: usize) -> f64 {
        self.alarm * DETECTORS[detector].share / DETECTORS.iter().map(|detector| detector.share).sum::<f64>()
    }

    /// What has no name may be anything, so it must gain more, half as much more where chance cannot have made it. `untouched`:
    /// what was subtracted from a recording leaves a residual, which chance has not made either.
    pub(super) fn passes(&self, detector: usize, candidate: &Candidate, untouched: bool) -> bool {
        let sure = untouched && candidate.p_value < NO_CHANCE;
        let least = match candidate.id {
            Some(_) => self.gain,
            None if sure => 0.5 * (self.gain + self.nameless_gain),
            None => self.nameless_gain,
        };
        // What predicts held-out frames better than it must is as much less likely to be chance: the likelihood's ratio on data
        // that were not fitted exceeds e^gain by chance with a probability of e^-gain at most. Not where the body's prediction has
        // a part: what errs in it errs in held-out frames alike; nor where the frames that predict are those of the p-value.
        let surplus = untouched && !candidate.errs_alike && !DETECTORS[detector].predicts_all_frames;
        let surplus = if surplus { (candidate.nats - least).exp().clamp(1.0, MOST_SURPLUS) } else { 1.0 };
        candidate.p_value <= self.p_value(detector) * surplus && candidate.nats >= least && candidate.nats.is_finite()
    }
}

/// By how much a gain beyond the least may raise the limit of a p-value.
const MOST_SURPLUS: f64 = 10.0;

/// p-value below which what has no name needs only half as much more than what has one.
const NO_CHANCE: f64 = 1e-12;

/// What is left at the chirps' edges looks like these; a true one was there before.
const LIKE_EDGES: [&str; 4] =
    [effects::ramp_edge_transient::ID, effects::if_highpass::ID, effects::if_lowpass::ID, effects::if_delay::ID];

/// What gains less than this share of what it gained before a vibration was undone is what the vibration leaves; what gains more
/// was there all along.
const NEARLY: f64 = 0.8;

/// What is named even where products of the signal with itself lie everywhere.
const WHATEVER_THE_SIGNAL: [&str; 2] = [effects::iq_imbalance::ID, effects::adc_saturation::ID];

/// What raises the held-out frames' dB error by this factor as it is undone is not what happened.
const FAR_WORSE: f64 = 1.6;

/// So many paths of one name are reported: a person whom nobody tracked is made of many more, and other effects must have their
/// turn.
const MOST_ALIKE: usize = 6;

/// An accepted candidate with what it changed.
#[derive(Clone, Debug)]
pub struct Accepted {
    pub detector: usize,
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
    /// Smallest p-value of all detectors on the untouched recording, corrected for their number: a bound.
    pub bound: f64,
    /// Smallest p-value of each detector that had something to say of it.
    pub detectors: BTreeMap<String, f64>,
    pub before: Misfit,
    pub after: Misfit,
}

/// Runs the rounds; `progress` receives what was found.
pub fn explain(evidence: Evidence, thresholds: &DiagnosisConfig, progress: &mut dyn FnMut(&str)) -> Explanation {
    let before = Misfit::of(&evidence);
    let original = evidence;
    let mut rounds = Rounds {
        original: &original,
        thresholds,
        current: None,
        misfit: before,
        accepted: vec![],
        pending: vec![],
        first_bounds: None,
        at_first: None,
        refused: vec![],
        unchanged: None,
    };
    while rounds.next(progress) {}
    let Rounds { current, accepted, first_bounds, .. } = rounds;
    drop(current);
    let accepted = verified(&original, accepted, thresholds);
    let evidence = accepted.iter().fold(original.clone(), |evidence, effect| evidence.with(&effect.candidate));
    let mut after = Misfit::after(&original, &evidence);
    // What changes neither samples nor prediction, such as a law of the noise, gains what its own test says.
    let held_out = original.split.held_out.len() * original.cube.channels() * original.cube.dims[3] * original.range_bins();
    let unseen = accepted.iter().filter(|effect| matches!(effect.candidate.correction, Correction::None));
    after.loglik_per_sample += unseen.map(|effect| effect.candidate.nats).sum::<f64>() / held_out.max(1) as f64;
    let (bound, detectors) = first_bounds.unwrap_or((1.0, BTreeMap::new()));
    Explanation { accepted, evidence, bound, detectors, before, after }
}

/// What the rounds have found so far.
struct Rounds<'a> {
    original: &'a Evidence,
    thresholds: &'a DiagnosisConfig,
    /// The recording with everything accepted taken into account; none before anything was.
    current: Option<Evidence>,
    misfit: Misfit,
    accepted: Vec<Accepted>,
    /// Candidates of the round before that could still turn out to be the same thing as what was accepted in it.
    pending: Vec<Candidate>,
    first_bounds: Option<(f64, BTreeMap<String, f64>)>,
    /// Names that passed on the untouched recording, and what they gained.
    at_first: Option<Vec<(&'static str, f64)>>,
    /// Names that would make everything far worse.
    refused: Vec<&'static str>,
    /// What was found in a round that only refused a name: nothing has changed since.
    unchanged: Option<Vec<(usize, Candidate)>>,
}

impl Rounds<'_> {
    /// One round; whether another may follow.
    fn next(&mut self, progress: &mut dyn FnMut(&str)) -> bool {
        let evidence = self.current.as_ref().unwrap_or(self.original);
        let found = self.unchanged.take().unwrap_or_else(|| candidates(evidence));
        self.first_bounds.get_or_insert_with(|| (smallest_bound(&found), by_detector(&found)));
        if self.at_first.is_none() {
            let passing = found.iter().filter(|candidate| self.passes(candidate));
            self.at_first = Some(passing.filter_map(|(_, candidate)| Some((candidate.id?, candidate.nats))).collect());
        }
        let passing = self.passing(evidence, &found);
        if let Some(last) = self.accepted.last_mut() {
            settle_rivals(last, &self.pending, &passing, self.thresholds);
        }
        let strongest = strongest(&passing).map(|best| upstream(self.original, evidence, best, &passing));
        let Some(strongest) = strongest.filter(|_| self.accepted.len() < self.thresholds.most) else {
            return false;
        };
        let (detector, mut best) = strongest.clone();
        let mut next = evidence.with(&best);
        let mut after = Misfit::after(self.original, &next);
        if let Some(id) = best.id
            && after.db_mse > FAR_WORSE * self.misfit.db_mse
        {
            if !DETECTORS[detector].last_in_chain {
                self.refused.push(id);
                self.unchanged = Some(found);
                return true;
            }
            // What the codes themselves show is there, even where it cannot be undone.
            best.correction = Correction::None;
            next = evidence.with(&best);
            after = self.misfit;
        }
        progress(&best.statement);
        let others = passing.iter().filter(|other| !std::ptr::eq(**other, strongest));
        self.pending = others.map(|(_, other)| other.clone()).collect();
        let (before, rivals) = (self.misfit, best.look_alikes.clone());
        self.accepted.push(Accepted { detector, rivals, candidate: best, probability: 1.0, before, after });
        self.misfit = after;
        self.current = Some(next);
        true
    }

    fn passes(&self, (detector, candidate): &(usize, Candidate)) -> bool {
        self.thresholds.passes(*detector, candidate, self.accepted.is_empty())
    }

    /// Of what was found: what is significant, and neither known already nor a name that may not be given.
    fn passing<'b>(&self, evidence: &Evidence, found: &'b [(usize, Candidate)]) -> Vec<&'b (usize, Candidate)> {
        // So they do where products were taken out roughly.
        let bent = |effect: &Accepted| effect.candidate.behaves_like == Behaviour::Quadratic;
        let mixed = evidence.products().mixed().is_some() || self.accepted.iter().any(bent);
        let at_edges = self.accepted.iter().any(|effect| leaves_edges(&effect.candidate));
        let may_be_named = |id: &str| {
            (!mixed || WHATEVER_THE_SIGNAL.contains(&id))
                && (!at_edges || !LIKE_EDGES.contains(&id) || self.at_first.iter().flatten().any(|first| first.0 == id))
                && !self.refused.contains(&id)
                && self.accepted.iter().filter(|effect| effect.candidate.id == Some(id)).count() < MOST_ALIKE
        };
        let passes = || found.iter().filter(|candidate| self.passes(candidate));
        let clocks_were_wrong = self.accepted.iter().any(|effect| effect.candidate.place.stage == Some(Stage::Timing));
        let elsewhere = clocks_were_wrong || passes().any(|(_, candidate)| is_displaced(candidate));
        passes()
            .filter(|(detector, _)| !(elsewhere && DETECTORS[*detector].trusts_the_place))
            .filter(|(_, candidate)| !self.known(candidate) && candidate.id.is_none_or(may_be_named))
            .collect()
    }

    /// Whether it is what was accepted, or what that left.
    fn known(&self, candidate: &Candidate) -> bool {
        let left = |effect: &Accepted| {
            is_same(&effect.candidate, candidate)
                || is_left_by(&effect.candidate, candidate) && !self.was_there(effect, candidate)
        };
        self.accepted.iter().any(left)
    }

    /// What a radar that vibrates leaves, or paths of what differs between receivers, or that of their noise, is less than there
    /// was before; and a tone, a product or a law of the noise that was there before is no residual. What has no name was there before,
    /// too, and bent what differs between receivers as much as what is left of it does.
    fn was_there(&self, effect: &Accepted, candidate: &Candidate) -> bool {
        let as_much = |&(id, gain): &(&str, f64)| candidate.id == Some(id) && candidate.nats > NEARLY * gain;
        let vibrates = effect.candidate.id == Some(effects::radar_vibration::ID);
        let of_receivers = is_of_receivers(candidate) && effect.candidate.id.is_some() || is_of_receivers(&effect.candidate);
        // Bursts are noise with a spectrum of its own until they are cut out.
        let of_noise = is_of_noise(candidate) && effect.candidate.behaves_like != Behaviour::SparseAdditive;
        (vibrates || of_receivers || candidate.id == Some(effects::spur::ID) || is_product(candidate) || of_noise)
            && self.at_first.iter().flatten().any(as_much)
    }
}

/// What happened last in the signal's chain is undone first; else the strongest; what has no shape at all last.
fn strongest<'a>(passing: &[&'a (usize, Candidate)]) -> Option<&'a (usize, Candidate)> {
    let order = |(detector, candidate): &(usize, Candidate)| {
        let detector = &DETECTORS[*detector];
        let worth = if is_rough(candidate) { ROUGHLY * candidate.nats } else { candidate.nats };
        (detector.last_in_chain, !detector.last_resort, worth)
    };
    let strongest_of = |may: fn(&Detector) -> bool| {
        let candidates = passing.iter().copied().filter(|(detector, _)| may(&DETECTORS[*detector]));
        candidates.max_by(|a, b| order(a).partial_cmp(&order(b)).expect("gains are finite"))
    };
    let strongest = strongest_of(|_| true)?;
    if DETECTORS[strongest.0].last_in_chain || matches!(strongest.1.place.stage, Some(Stage::Receiver | Stage::Noise)) {
        return Some(strongest);
    }
    // What the receiver does to everything that it receives lies behind what was done to it before.
    strongest_of(|detector| detector.of_all_received).or(Some(strongest))
}

/// How likely a look-alike is beforehand, against the effect that was accepted.
fn prior(id: &str) -> f64 {
    match id {
        // It must lie beyond the unambiguous range, and be stronger by the fourth power of that to be seen at all. Where it
        // is accepted itself, it was seen beyond the room.
        effects::range_alias::ID => 0.1,
        _ => 1.0,
    }
}

/// Rivals of the effect accepted last: they passed beside it and have nothing left to say now that it is in place.
fn settle_rivals(last: &mut Accepted, pending: &[Candidate], passing: &[&(usize, Candidate)], thresholds: &DiagnosisConfig) {
    let mut weight = 1.0 + last.candidate.look_alikes.iter().map(|id| prior(id)).sum::<f64>();
    for rival in pending {
        let Some(id) = rival.id else { continue };
        // Without the body at its place, echoes of it are as strong as the body.
        if is_displaced(&last.candidate) && (is_echo(rival) || is_of_residual(rival)) {
            continue;
        }
        let silent = !passing.iter().any(|(_, candidate)| candidate.id == Some(id));
        if silent && Some(id) != last.candidate.id {
            let behind = last.candidate.nats - rival.nats;
            weight += (-behind).exp().min(1.0);
            if behind <= thresholds.tie && !last.rivals.contains(&id) {
                last.rivals.push(id);
            }
        }
    }
    last.probability = 1.0 / weight;
}

/// Refits every accepted one with all others taken into account; what is found keeps the parameters of this last
/// fit. Whoever falls only because somebody later is there competes with that one: the one that gains more alone stays.
fn verified(original: &Evidence, mut accepted: Vec<Accepted>, thresholds: &DiagnosisConfig) -> Vec<Accepted> {
    if accepted.len() < 2 {
        return accepted;
    }
    let mut index = accepted.len();
    while index > 0 {
        index -= 1;
        if DETECTORS[accepted[index].detector].last_in_chain {
            continue;
        }
        if let Some(candidate) = refit(original, &accepted, index, &[], thresholds) {
            accepted[index].candidate = candidate;
            continue;
        }
        // The latest first: what came last is the most likely to be a remainder.
        let rival = (index + 1..accepted.len()).rev().find_map(|other| {
            let alone = refit(original, &accepted, index, &[other], thresholds)?;
            let other_alone = refit(original, &accepted, other, &[index], thresholds).map_or(0.0, |other| other.nats);
            (alone.nats > other_alone).then_some((other, alone))
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

/// One of the accepted, refit with all others but some taken into account.
fn refit(
    original: &Evidence,
    accepted: &[Accepted],
    index: usize,
    without: &[usize],
    thresholds: &DiagnosisConfig,
) -> Option<Candidate> {
    let effect = &accepted[index];
    // An image or a product of what the antennas do otherwise is that of the signal with it: what is in the receiver is undone first.
    // What never changes has the course of all that is received, until that is undone: subtracted before, it would leave it.
    let before = |other: &Accepted| {
        effect.candidate.place.stage == Some(Stage::Receiver) && other.candidate.place.stage == Some(Stage::Antenna)
            || is_course_of_all(&effect.candidate) && is_added(&other.candidate)
    };
    let stands = |(other, accepted): &(usize, &Accepted)| *other != index && !without.contains(other) && !before(accepted);
    let others = accepted.iter().enumerate().filter(stands);
    let evidence = others.fold(original.clone(), |evidence, (_, effect)| evidence.with(&effect.candidate));
    let same =
        |candidate: &Candidate| is_refit(&effect.candidate, candidate) && thresholds.passes(effect.detector, candidate, true);
    let found = said_by(effect.detector, &evidence).into_iter().filter(same);
    found.max_by(|a, b| a.nats.total_cmp(&b.nats))
}
