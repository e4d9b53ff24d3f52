//! A phase of any course in time that the static returns of most ranges share, where nobody is tracked.
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
use super::selection::UNDECIDED;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::Candidate;

use bets::{shared, spectra};
use candidate::candidate;
use course::Course;
use deviations::deviations;

pub fn find(evidence: &Evidence) -> Option<Candidate> {
    let course = Course::of(evidence);
    let deviations = deviations(evidence)?;
    let part = |part: Part| shared(&spectra(&deviations, &course, part), part);
    let (phase, delay) = (part(Part::Phase), part(Part::Delay));
    // Where ranges do not distinguish the two, what moves the radar goes before what moves its oscillator: it needs no second
    // cause.
    let best = [Some(phase?), delay]
        .into_iter()
        .flatten()
        .reduce(|phase, delay| if delay.log_bets > phase.log_bets + UNDECIDED { delay } else { phase })?;
    // A bet is won by two ranges that hang together; all returns are concerned where most that are informative have it.
    (2 * best.sharing > best.informative && best.log_bets > 0.0).then(|| candidate(evidence, &course, &deviations, &best))
}

#[cfg(test)]
mod tests;
