//! Frames of another number of loops than is stated, by where in each stated frame the scene changes most.
//!
//! Frames of another length begin evenly spaced through the stream, at another loop of each stated frame. As stated, the places of the
//! largest steps come in any order over the F frames, however often each comes (what settles, what stops): of all orders, a share of at
//! most C(n, h) pʰ Fʰ (F − h)! / F! has the places of h of n frames where frames of one other length begin, where p is the mean share of
//! all places that lie there (Markov's inequality for the h-th factorial moment of the matches, Maclaurin's for the product of their
//! shares). Bonferroni over lengths and the loops at which they begin.

use statrs::function::factorial::{ln_binomial, ln_factorial};

/// Loops of a frame that are tried: fewest whose steps can be compared, and most that TI's devices send (mmWave SDK user's guide, `frameCfg`).
const FEWEST: usize = 4;
const MOST: usize = 255;

/// Another length that many of the largest steps have in common.
#[derive(Debug, PartialEq)]
pub(super) struct OtherLength {
    pub loops: usize,
    /// Which frames' largest steps are where frames of so many loops would begin.
    pub at: Vec<usize>,
    /// In how many frames any would.
    pub of: usize,
    /// Of the law above.
    pub log_p: f64,
}

/// The least likely as stated: of frames of so many loops, each with its number and the loop after which its largest step is.
pub(super) fn other_length(stated: usize, steps: &[(usize, usize)]) -> Option<OtherLength> {
    let lengths = || (FEWEST..=MOST).filter(|loops| *loops != stated);
    let tried = lengths().sum::<usize>() as f64;
    let mut often = vec![0; stated];
    steps.iter().for_each(|(_, place)| often[*place] += 1);
    let of = |loops: usize| matched(stated, loops, steps, &often);
    // Parts of a length begin where it does, too: of equals the longest.
    let best = lengths().map(of).min_by(|a, b| a.log_p.total_cmp(&b.log_p).then(b.loops.cmp(&a.loops)))?;
    Some(OtherLength { log_p: (best.log_p + tried.ln()).min(0.0), ..best })
}

/// Frames of so many loops, from the loop on at which most of the largest steps would have them begin; `often`: steps by place.
fn matched(stated: usize, loops: usize, steps: &[(usize, usize)], often: &[usize]) -> OtherLength {
    let phase = |(frame, place): &(usize, usize)| (frame * stated + place) % loops;
    let mut by_phase = vec![0; loops];
    steps.iter().for_each(|step| by_phase[phase(step)] += 1);
    let most = by_phase.iter().copied().max().unwrap_or(0);
    let begins = by_phase.iter().position(|count| *count == most).unwrap_or(0);
    // Beside the ends of a frame as stated there is no step of its own.
    let first = |frame: usize| (begins + loops - frame * stated % loops) % loops;
    let predicted = |frame: usize| (first(frame)..stated.saturating_sub(2)).step_by(loops).filter(|place| *place > 0);
    let shares =
        steps.iter().map(|(frame, _)| (predicted(*frame).count(), predicted(*frame).map(|place| often[place]).sum::<usize>()));
    let (of, share) = shares.filter(|(count, _)| *count > 0).fold((0, 0), |(of, sum), (_, share)| (of + 1, sum + share));
    let at = (0..steps.len()).filter(|&index| phase(&steps[index]) == begins).collect();
    let (hits, frames) = (most as u64, steps.len() as u64);
    // p F of the law.
    let expected = share as f64 / of.max(1) as f64;
    let orders = ln_factorial(frames - hits) - ln_factorial(frames);
    let log_p = if hits == 0 { 0.0 } else { ln_binomial(of as u64, hits) + hits as f64 * expected.ln() + orders };
    OtherLength { loops, at, of, log_p: log_p.min(0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support::numbers;

    /// The first boundary of frames of `sent` loops within each of `frames` stated ones; where there is none, a drawn place.
    fn steps(stated: usize, sent: usize, frames: usize) -> Vec<(usize, usize)> {
        let drawn = numbers(7, frames, 1.0, (stated - 2) as f64);
        let place = |frame: usize| {
            let first = (frame * stated + 1).next_multiple_of(sent) - 1 - frame * stated;
            if (1..stated - 2).contains(&first) { first } else { drawn[frame] as usize }
        };
        (0..frames).map(|frame| (frame, place(frame))).collect()
    }

    #[test]
    fn the_length_that_was_sent_is_named() {
        for (stated, sent, frames) in [(64, 85, 21), (85, 64, 24), (63, 64, 20), (12, 16, 80), (128, 100, 16)] {
            let found = other_length(stated, &steps(stated, sent, frames)).unwrap();
            assert!(found.loops == sent && found.log_p < 1e-3f64.ln(), "{sent} read as {stated}: {found:?}");
        }
    }

    #[test]
    fn places_as_stated_are_not_accused_however_unequal() {
        let drawn = |stated: usize, frames: usize, seed: u64| -> Vec<(usize, usize)> {
            let places = numbers(seed, frames, 1.0, (stated - 2) as f64);
            places.iter().enumerate().map(|(frame, place)| (frame, *place as usize)).collect()
        };
        for (seed, (stated, frames)) in (0..40).flat_map(|seed| [(seed, (64, 30)), (seed, (8, 200)), (seed, (100, 12))]) {
            let found = other_length(stated, &drawn(stated, frames, seed)).unwrap();
            assert!(found.log_p > 1e-3f64.ln(), "{seed}, {stated}: {found:?}");
        }
        // What settles at the beginning of each frame, or of most.
        for every in [100, 5] {
            let settling = drawn(32, 60, 1).into_iter().map(|(frame, place)| (frame, if frame % every == 4 { place } else { 1 }));
            let found = other_length(32, &settling.collect::<Vec<_>>()).unwrap();
            assert!(found.log_p > 1e-3f64.ln(), "{found:?}");
        }
        assert_eq!(other_length(64, &[]).unwrap().log_p, 0.0);
    }

    /// All of F different places in one order of F!.
    #[test]
    fn the_law_is_exact_where_each_place_comes_once() {
        // The first one's is beside its end.
        let steps = &steps(17, 16, 15)[1..];
        let mut often = vec![0; 17];
        steps.iter().for_each(|(_, place)| often[*place] += 1);
        let found = matched(17, 16, steps, &often);
        assert_eq!((found.at.len(), found.of), (14, 14));
        assert!((found.log_p + ln_factorial(14)).abs() < 1e-9, "{found:?}");
    }
}
