//! A phase, or else a gain, of any course in time that the static returns of most ranges share, where nobody is tracked.
//!
//! Without a body whose returns could be set aside, a mover may be stronger than all static clutter. So no
//! mean over the ranges is taken: each range is predicted by the others, frequency by frequency of slow time, and a range that does
//! not share what they have is left out. Where ranges vary each for itself, the phases of their spectra are independent of one
//! another and uniform, whatever the spectra's magnitudes are. A bet on each phase (von Mises' law about the one that is predicted,
//! over the uniform law) has a mean of one then, and so has the product of bets in which each may depend on those before it: its
//! inverse is a p-value (Ville's inequality; Shafer, Testing by betting, Journal of the Royal Statistical Society A 184, 2021). No
//! course in time, no spectrum of the noise and no threshold is assumed.
//!
//! Phases of neighbouring frequencies hang together where a course jumps from its end to its beginning: what is slow is taken out
//! first, and a sine tapers the rest, under which frequencies two apart are independent. Both halves of the frequencies then bet with
//! half of their winnings' logarithm (Cauchy and Schwarz: the mean of the root of a product is one at most).

mod bets;
mod candidate;
mod course;
mod deviations;

use super::field::Part;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::Candidate;
use crate::diagnosis::statistics::UNDECIDED;

use bets::{Shared, log_likelihood, shared, shares, spectra};
use candidate::candidate;
use course::Course;
use deviations::deviations;

pub fn find(evidence: &Evidence) -> Option<Candidate> {
    let course = Course::of(evidence);
    let [around, own] = deviations(evidence)?;
    let of_part = |part: Part| {
        let spectra = spectra(&around, &course, part);
        let shared = shared(&spectra, part)?;
        let log_likelihood = log_likelihood(&spectra, &shared.members);
        Some((shared, spectra, log_likelihood))
    };
    let (phase, delay) = (of_part(Part::Phase)?, of_part(Part::Delay)?);
    // By how much more likely a phase in proportion to the delay is.
    let more = delay.2 - phase.2;
    // A bet is won by two ranges that hang together; all returns are concerned where most that are informative have it.
    let is_shared = |shared: &Shared| 2 * shared.sharing > shared.informative && shared.log_bets > 0.0;
    let decides = |shared: &Shared| is_shared(shared) && shared.log_bets > UNDECIDED;
    if !decides(&phase.0)
        && !decides(&delay.0)
        && let Some((gain, spectra, _)) = of_part(Part::Gain).filter(|gain| decides(&gain.0))
    {
        return Some(candidate(evidence, &course, &spectra, &gain, false));
    }
    let (best, spectra, _) = match (is_shared(&phase.0), is_shared(&delay.0)) {
        (true, true) if more > UNDECIDED => delay,
        (false, true) => delay,
        (true, _) => phase,
        (false, false) => return None,
    };
    // A radar that moves takes its leakage with it, unless something that moves is as near.
    let leakage: Vec<_> = own.into_iter().filter(|own| evidence.are_whole(own.group.bins.clone())).collect();
    let turns_leakage = || bets::spectra(&leakage, &course, best.part).iter().any(|own| shares(own, &spectra, &best.members));
    let of_radar = best.part == Part::Phase && more < -UNDECIDED && !turns_leakage();
    Some(candidate(evidence, &course, &spectra, &best, of_radar))
}

#[cfg(test)]
mod tests;
