//! Which of the looks at one series keep their candidates: one cause shows in several.

use super::lines;
use crate::diagnosis::statistics::UNDECIDED;
use crate::diagnosis::{behaviour::Behaviour, finding::Candidate};

/// Share of the log-likelihood gain that what is simpler, or has a name, needs.
pub(super) const NEARLY: f64 = 0.8;
/// The same for what a sure name explains over the noise, where what has no name leaves more than noise itself.
const HALF: f64 = 0.5;
/// p-value below which a law that a background makes unsure is sure.
const SURE: f64 = 1e-3;

/// A candidate of this family.
pub(super) struct Found {
    pub candidate: Candidate,
    /// Of a line on a background that is hardly known: its degrees of freedom, and the p-value that this leaves.
    pub unsure: Option<(f64, f64)>,
    /// Log-likelihood gain over the noise alone.
    pub over_noise: f64,
    /// The same where it is sure; else the candidate's own.
    pub explained: f64,
    /// Of a line with more than noise beside it.
    pub loud: bool,
    /// Whether a frame sees so much of a line's turn that it cannot be taken for a drift from frame to frame.
    pub within_frames: bool,
}

impl From<Candidate> for Found {
    fn from(candidate: Candidate) -> Self {
        Self { explained: candidate.nats, over_noise: candidate.nats, candidate, unsure: None, loud: false, within_frames: true }
    }
}

impl Found {
    pub fn is_sure(&self) -> bool {
        is_sure(self.unsure)
    }

    fn is_named(&self) -> bool {
        self.candidate.id.is_some()
    }
}

/// Of the degrees of freedom and the p-value that a background leaves.
pub(super) fn is_sure(unsure: Option<(f64, f64)>) -> bool {
    unsure.is_none_or(|(_, p_value)| p_value < SURE)
}

/// A law of few parameters wins where it explains nearly as much as what is free in every chirp (over the noise alone: a background
/// that makes a law unsure is part of what is free in every chirp), and a name where it explains nearly as much as what has none.
/// The best first.
pub(super) fn selected(mut found: Vec<Found>, mut free: Vec<Found>) -> Vec<Found> {
    let most = |of: &[Found]| of.iter().map(|found| found.explained).fold(0.0, f64::max);
    if found.is_empty() || most(&found) < NEARLY * most(&free) {
        found.append(&mut free);
    }
    found = unnamed_if_undecided(found);
    keep_names(&mut found);
    found.sort_by(|a, b| b.candidate.nats.total_cmp(&a.candidate.nats));
    name_rivals(&mut found);
    found
}

/// A radar that vibrates turns all ranges alike, an oscillator whose frequency is modulated turns them in proportion to their delay: where
/// the ranges hardly tell the two apart, neither is named.
fn unnamed_if_undecided(found: Vec<Found>) -> Vec<Found> {
    let in_proportion = |found: &&Found| found.candidate.behaves_like == Behaviour::DelayProportionalPhase;
    let rivals: Vec<(Candidate, f64)> =
        found.iter().filter(in_proportion).map(|found| (found.candidate.clone(), found.over_noise)).collect();
    let judge = |found: Found| {
        let as_likely =
            |(rival, gain): &(Candidate, f64)| found.candidate.is_at_the_line_of(rival) && *gain > found.over_noise - UNDECIDED;
        let undecided = found.candidate.behaves_like == Behaviour::SlowTimePhase && rivals.iter().any(as_likely);
        if !found.is_named() || !undecided {
            return found;
        }
        let statement = format!(
            "{} Or the phases are in proportion to the delay, as an oscillator's frequency modulation makes them: the ranges do not decide.",
            found.candidate.statement
        );
        Found { candidate: Candidate { id: None, estimates: vec![], look_alikes: vec![], statement, ..found.candidate }, ..found }
    };
    found.into_iter().map(judge).collect()
}

/// What has no name is left out where a name explains as much.
fn keep_names(found: &mut Vec<Found>) {
    let of_name = |found: &Found| (found.candidate.behaves_like, found.explained, found.loud && found.within_frames);
    let names: Vec<(Behaviour, f64, bool)> = found.iter().filter(|found| found.is_named()).map(of_name).collect();
    // A law without a name must fit to the noise where one with a name explains nearly as much: how strong static returns turn
    // when the radar itself moves depends on where they are, which is known roughly.
    let explained = names.iter().map(|name| name.1).fold(0.0, f64::max);
    let sure = found.iter().filter(|found| found.is_named() && found.is_sure());
    let over_noise = sure.map(|found| found.over_noise).fold(0.0, f64::max);
    let fits_better = |found: &Found| explained < NEARLY * found.explained && over_noise < HALF * found.over_noise;
    found.retain(|found| found.is_named() || !found.loud || fits_better(found));
    // Of another kind a name wins only where the recording cannot decide.
    let taken = |other: &Found| {
        let like_it = |like: Behaviour, gain: f64| like == other.candidate.behaves_like && gain > NEARLY * other.explained;
        // Where it leaves much itself it must explain clearly more.
        let more =
            |gain: f64, loud: bool| if loud { NEARLY * gain > other.explained } else { gain > other.explained - UNDECIDED };
        names.iter().any(|&(like, gain, loud)| like_it(like, gain) || more(gain, loud))
    };
    found.retain(|found| found.is_named() || !taken(found));
}

/// Names between which the recording does not decide are each other's look-alikes.
fn name_rivals(found: &mut [Found]) {
    let rivals: Vec<(Option<&'static str>, f64)> = found.iter().map(|found| (found.candidate.id, found.candidate.nats)).collect();
    for Found { candidate, .. } in found {
        for &(id, gain) in &rivals {
            if let Some(id) = id
                && Some(id) != candidate.id
                && (gain - candidate.nats).abs() < UNDECIDED
                && !candidate.look_alikes.contains(&id)
            {
                candidate.look_alikes.push(id);
            }
        }
    }
}

/// With the p-value and the gain that a background leaves. Only after the selection: what a line explains best is no better explained
/// by something else because the line is unsure.
pub(super) fn judged(Found { mut candidate, unsure, within_frames, .. }: Found) -> Candidate {
    if let Some((freedom, p_value)) = unsure {
        if p_value > SURE || !within_frames {
            candidate.nats = lines::unsure(candidate.nats, freedom);
        }
        candidate.p_value = p_value;
    }
    candidate
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::Place;
    use crate::effects::{self, Stage};

    #[test]
    fn a_vibration_that_may_as_well_be_in_proportion_to_the_delay_has_no_name() {
        let line = |id: Option<&'static str>, behaves_like: Behaviour, nats: f64| {
            let candidate = Candidate::new(behaves_like, Place::at(Stage::Scene), 0.0, nats);
            Found::from(Candidate { id, line_hz: Some([9.9, 10.1]), ..candidate })
        };
        let named = |of_delay: f64| {
            let vibration = line(Some(effects::radar_vibration::ID), Behaviour::SlowTimePhase, 100.0);
            let found = unnamed_if_undecided(vec![vibration, line(None, Behaviour::DelayProportionalPhase, of_delay)]);
            found[0].is_named()
        };
        assert!(named(90.0) && !named(97.0) && !named(120.0));
    }
}
