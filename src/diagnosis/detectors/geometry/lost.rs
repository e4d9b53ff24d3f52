//! Frames that were lost: from one frame on, the body is later in its motion by whole frames.

use super::change::Change;
use super::fitted::Fitted;
use super::trial::{Score, Trial};
use crate::diagnosis::prediction::BEYOND;
use crate::diagnosis::statistics::{UNDECIDED, corrected};
use crate::effects::frame_drop;

/// Frames that a step must be followed by: one alone may have been bad.
const FEWEST_AFTER: usize = 2;
/// How overconfident the likelihood of a step is: cells are not independent, and the power model is rough.
const STEP_INFLATION: f64 = 3.0;

/// The step in time that explains most: from one frame on, a few frames later.
pub fn lost_frames(trial: &Trial, null: &Score) -> Option<Fitted> {
    let frames: Vec<usize> = (0..trial.evidence.cube.dims[0]).collect();
    let training = &trial.evidence.split.training;
    let mut best: Option<(f64, Change)> = None;
    let most_lost = most_lost(frames.len());
    for count in 1..=most_lost {
        // All frames later by so many: what follows the step, whenever it is.
        let later = trial.score(Change::Drop { at: 0, count }, training, false);
        for at in 2..frames.len().saturating_sub(FEWEST_AFTER - 1) {
            let after: Vec<usize> = training.iter().copied().filter(|&frame| frame >= at).collect();
            let gain = later.gain_over(null, &after);
            if best.is_none_or(|(most, _)| gain > most) {
                best = Some((gain, Change::Drop { at, count }));
            }
        }
    }
    let (_, change) = best?;
    let Change::Drop { at, count } = change else { return None };
    // The weights were those of the unchanged body: with their own, other places and counts may be better.
    let interesting = step_p_value(trial.score(change, training, true).gain_over(null, training), frames.len()) < 0.05;
    let (reach, counts) = if interesting { (4, 1..=most_lost) } else { (0, count..=count) };
    let near = counts.flat_map(|count| (at.saturating_sub(reach).max(1)..=at + reach).map(move |at| Change::Drop { at, count }));
    let change = near
        .filter(|change| matches!(change, Change::Drop { at, .. } if *at < frames.len()))
        .map(|change| (trial.score(change, training, true).gain_over(null, training), change))
        .max_by(|a, b| a.0.total_cmp(&b.0))?
        .1;
    let Change::Drop { at, count } = change else { return None };
    // Held-out frames beside the date say themselves whether they came before or after it.
    let held_out = |frame: &usize| !training.contains(frame);
    let earlier = (1..at).rev().take_while(held_out);
    let later = (at..frames.len() - 1).take_while(held_out).map(|frame| frame + 1);
    let scores = earlier.chain(later).chain([at]).map(|at| trial.score(Change::Drop { at, count }, &frames, true));
    let score = scores.max_by(|a, b| a.gain_over(null, &frames).total_cmp(&b.gain_over(null, &frames)))?;
    Some(Fitted { id: frame_drop::ID, value: count as f64, deviation: 0.0, floor: 0.0, inflation: STEP_INFLATION, score })
}

/// Of lost frames, whether the frames before them say that they were lost there and not before the first one; true of all else.
pub fn is_step(trial: &Trial, fit: &Fitted) -> bool {
    let Change::Drop { count, .. } = fit.score.change else { return true };
    let every: Vec<usize> = (0..trial.evidence.cube.dims[0]).collect();
    let later = trial.score(Change::Drop { at: 0, count }, &every, true);
    fit.score.gain_over(&later, &every) / fit.inflation >= UNDECIDED
}

/// Log-likelihood gain of frames from which the change was not estimated: the held-out ones. Where the motion is known in none of
/// these after a step, the training frames with the weights of the body as it was.
pub fn predicted(trial: &Trial, fit: &Fitted, null: &Score) -> f64 {
    let held_out = &trial.evidence.split.held_out;
    let Change::Drop { at, .. } = fit.score.change else { return fit.score.gain_over(null, held_out) };
    let known = |frames: &[usize]| -> Vec<usize> {
        frames.iter().copied().filter(|&frame| frame < at || fit.score.known[frame]).collect()
    };
    let after = |frames: &[usize]| frames.iter().any(|&frame| frame >= at);
    let unseen = known(held_out);
    if after(&unseen) || !after(held_out) {
        return fit.score.gain_over(null, &unseen);
    }
    let training = known(&trial.evidence.split.training);
    trial.score(fit.score.change, &training, false).gain_over(null, &training)
}

/// Most frames lost at once that are looked for among so many.
fn most_lost(frames: usize) -> usize {
    BEYOND.min(frames / 2)
}

/// A rule of thumb: a ratio of likelihoods of fixed laws would exceed e^x by chance with probability e^-x at most, and the
/// weights that are fitted here are the same in number with and without the step. On 150 recordings without anything
/// missing (two sealed sets that had been opened) the largest log-likelihood gain was 1.2 nats; from 30 on this is below 0.01.
pub fn step_p_value(gain: f64, frames: usize) -> f64 {
    ratio_p_value(gain, STEP_INFLATION, (most_lost(frames) * frames).max(1) as f64)
}

/// Of the best of several ratios of likelihoods (nats), which are overconfident by a factor.
pub fn ratio_p_value(gain: f64, inflation: f64, tried: f64) -> f64 {
    corrected((-gain / inflation).exp().min(1.0), tried)
}

#[cfg(test)]
mod tests {
    use super::super::receding;
    use super::*;
    use crate::diagnosis::Evidence;
    use crate::diagnosis::prediction::Track;

    const COUNT: usize = 4;

    /// Frames that are shown `COUNT` frames later than predicted from frame `lost_at` on.
    fn evidence(lost_at: usize) -> Evidence {
        let mut evidence = receding::evidence(None);
        let body = evidence.body.as_mut().unwrap();
        let shown = body.frames.clone();
        let of = |frame: usize| if frame < lost_at { frame } else { lost_at.max(frame.saturating_sub(COUNT)) };
        body.frames = (0..shown.len()).map(|frame| shown[of(frame)].clone()).collect();
        // What is shown so much later is known where a frame was seen then.
        let still = |points: usize| vec![vec![[0.0; 3]; points]; 3];
        let track = |(points, time): (usize, &f64)| Track::new(*time, vec![-0.01, 0.0, 0.01], still(points));
        body.tracks = body.frames.iter().map(Vec::len).zip(&body.middle_s).map(track).collect();
        evidence.changed()
    }

    /// Whether lost frames from frame `at` on are a step.
    fn says_step(evidence: &Evidence, change: Change) -> bool {
        let trial = Trial::new(evidence, evidence.power().unwrap(), evidence.body.as_ref().unwrap());
        let every: Vec<usize> = (0..evidence.cube.dims[0]).collect();
        let score = trial.score(change, &every, true);
        let fit =
            Fitted { id: frame_drop::ID, value: COUNT as f64, deviation: 0.0, floor: 0.0, inflation: STEP_INFLATION, score };
        is_step(&trial, &fit)
    }

    #[test]
    fn lost_frames_are_a_step_where_frames_before_them_are_not_late_too() {
        let drop = |at: usize| Change::Drop { at, count: COUNT };
        // Lost within the recording.
        assert!(says_step(&evidence(8), drop(8)));
        // Lost before its first frame: all is late, and a step within it, or after its first frame, says less or as much.
        let late = evidence(0);
        for at in [1, 8] {
            assert!(!says_step(&late, drop(at)), "{at}");
        }
        // What is no step is not asked.
        assert!(says_step(&late, Change::Range(0.0)));
    }
}
