//! Frames of a whole part, or a whole multiple, of the loops that are stated.
//!
//! Two frames read as one have a boundary in their middle, k frames k − 1 of them at parts of a k-th. As stated, the largest step is
//! there as often as elsewhere: a binomial law. A receiver that changes there in each frame, and is again what it was when the next one
//! begins, is undone by then; what moves is not, so that more than a tenth of what changed must last: Student's test. The larger one of
//! the two chances stands. Of frames that were read in k parts each, k − 1 of k boundaries change the scene less than the largest step
//! within, and each k-th more: sign tests. Bonferroni over k and the first part.

use super::tails::{log_binomial_tail, student_tail};

/// Fewest loops of a part whose beginning is neither a frame's first steps, which settle, nor its last ones.
const FEWEST: usize = 4;
/// Most parts of a frame that are tried.
const MOST: usize = 8;

/// Share of what changed, in energy, that may last where a receiver is again what it was: somebody moves meanwhile.
const LASTS: f64 = 0.1;

/// The largest step of a frame.
pub(super) struct Step {
    pub frame: usize,
    /// The loop before it.
    pub place: usize,
    pub size: f64,
    pub next: Option<Next>,
}

/// The next frame, where that was seen.
pub(super) struct Next {
    /// The step to it.
    pub size: f64,
    /// Share that is still so of what changed at the largest step of the one before, or at the step to it.
    pub lasting: f64,
}

/// Of how many steps to which the next frame was seen this holds of both sizes, and how many those are.
pub(super) fn counted<'a>(steps: impl Iterator<Item = &'a Step>, holds: impl Fn(f64, f64) -> bool) -> (usize, usize) {
    let held = |step: &Step| step.next.as_ref().map(|next| holds(step.size, next.size));
    steps.filter_map(held).fold((0, 0), |(count, of), holds| (count + usize::from(holds), of + 1))
}

/// Frames of other loops than stated.
pub(super) struct Other {
    pub loops: usize,
    pub text: String,
    pub log_p: f64,
}

/// The least likely as stated.
pub(super) fn other_frames(stated: usize, steps: &[Step]) -> Option<Other> {
    let parts = (2..=MOST).filter(|parts| stated.is_multiple_of(*parts) && stated / parts >= FEWEST);
    let tried = (parts.clone().count() + (2..=MOST).sum::<usize>()) as f64;
    let wholes = (2..=MOST).flat_map(|parts| (0..parts).map(move |first| [parts, first]));
    let all = parts.map(|parts| of_part(stated, parts, steps)).chain(wholes.map(|whole| of_whole(stated, whole, steps)));
    let best = all.min_by(|a, b| a.log_p.total_cmp(&b.log_p))?;
    Some(Other { log_p: (best.log_p + tried.ln()).min(0.0), ..best })
}

/// So many frames read as one.
fn of_part(stated: usize, parts: usize, steps: &[Step]) -> Other {
    let loops = stated / parts;
    let there: Vec<&Step> = steps.iter().filter(|step| (step.place + 1).is_multiple_of(loops)).collect();
    // Beside the ends of a frame there is no step.
    let chance = (parts - 1) as f64 / (stated - 3) as f64;
    let beyond: Vec<f64> = there.iter().filter_map(|step| Some(step.next.as_ref()?.lasting - LASTS)).collect();
    let lasting = LASTS + beyond.iter().sum::<f64>() / beyond.len().max(1) as f64;
    let log_p = log_binomial_tail(there.len(), steps.len(), chance).max(student_tail(&beyond).max(f64::MIN_POSITIVE).ln());
    let text = format!(
        "in {} of {} frames the scene changes most where frames of {loops} loops begin, and {:.0} % of that is still so when the next one \
         begins: {parts} frames were read as one",
        there.len(),
        steps.len(),
        100.0 * lasting
    );
    Other { loops, text, log_p }
}

/// Frames read in so many parts each, of which the frame `first` and each one after so many parts are the last ones.
fn of_whole(stated: usize, [parts, first]: [usize; 2], steps: &[Step]) -> Other {
    let larger =
        |is_last: bool| counted(steps.iter().filter(|step| (step.frame % parts == first) == is_last), |size, next| next > size);
    let ((between, ends), (within, joints)) = (larger(true), larger(false));
    let loops = stated * parts;
    let log_p = log_binomial_tail(between, ends, 0.5).max(log_binomial_tail(joints - within, joints, 0.5));
    let text = format!(
        "the scene changes more to the next frame than within it in {between} of {ends} frames, each {parts} frames, and in {within} of \
         the {joints} others: frames of {loops} loops were read in {parts} parts"
    );
    Other { loops, text, log_p }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support::numbers;

    fn step(frame: usize, place: usize, [size, next]: [f64; 2], lasting: f64) -> Step {
        Step { frame, place, size, next: Some(Next { size: next, lasting }) }
    }

    #[test]
    fn steps_at_drawn_places_are_not_accused() {
        for seed in 0..40 {
            let drawn = numbers(seed, 3 * 60, 0.0, 1.0);
            let steps: Vec<Step> = drawn
                .chunks_exact(3)
                .enumerate()
                .map(|(frame, drawn)| step(frame, 1 + (drawn[0] * 13.0) as usize, [drawn[1], drawn[2]], drawn[1]))
                .collect();
            let found = other_frames(16, &steps).unwrap();
            assert!(found.log_p > 1e-3f64.ln(), "{seed}: {} {}", found.text, found.log_p);
        }
    }

    /// Of 40 frames of 16 loops, all in the middle: the chance of (1/13)^40, and 37 looks, where most lasts.
    #[test]
    fn what_lasts_is_a_boundary_and_what_comes_back_is_none() {
        let drawn = numbers(2, 40, -0.4, 0.4);
        let middle = |lasting: f64| {
            let steps = (0..40).map(|frame| step(frame, 7, [2.0, 1.0], lasting + drawn[frame]));
            other_frames(16, &steps.collect::<Vec<_>>()).unwrap()
        };
        let found = middle(0.7);
        assert!(
            found.loops == 8 && found.log_p < 1e-9f64.ln() && found.text.contains("2 frames were read as one"),
            "{}",
            found.text
        );
        assert!(middle(0.1).log_p > 1e-3f64.ln() && middle(0.0).log_p > 1e-3f64.ln());
        // Nothing but places: two and four parts, and the first of each of two to eight.
        let parts = |steps: &[Step]| of_part(16, 2, steps).log_p;
        let lasting: Vec<Step> = (0..40).map(|frame| step(frame, 7, [2.0, 1.0], 0.7 + 1e-6 * frame as f64)).collect();
        assert!((parts(&lasting) + 40.0 * 13f64.ln()).abs() < 1e-9, "{}", parts(&lasting));
    }
}
