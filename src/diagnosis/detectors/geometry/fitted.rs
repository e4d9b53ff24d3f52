//! An alternative to where and when the body was predicted, fitted by its likelihood.

use super::change::Change;
use super::trial::{Score, Trial};

/// An alternative, fitted.
pub struct Fitted {
    pub id: &'static str,
    pub value: f64,
    /// Of the value, from the scatter between the frames.
    pub deviation: f64,
    pub floor: f64,
    /// Scatter of the frames over what the likelihood's curvature says: how overconfident it is.
    pub inflation: f64,
    pub score: Score,
}

/// Climbs to the likelihood's maximum: steps of equal length as long as they lead up, then parabolas through three values.
pub fn refine(
    trial: &Trial,
    id: &'static str,
    start: f64,
    step: f64,
    floor: f64,
    change: impl Fn(f64) -> Change,
) -> Option<Fitted> {
    const ROUNDS: usize = 8;
    /// Halvings of the step.
    const FINEST: f64 = 0.25;
    let training = &trial.evidence.split.training;
    let every: Vec<usize> = (0..trial.evidence.cube.dims[0]).collect();
    let score = |value: f64| trial.score(change(value), training, true);
    let (mut value, first, mut step) = (start, step, step);
    let mut middle = score(value);
    for _ in 0..ROUNDS {
        let (low, high) = (score(value - step), score(value + step));
        if low.gain_over(&middle, training) > 0.0 || high.gain_over(&middle, training) > 0.0 {
            let up = high.gain_over(&low, training) > 0.0;
            value += if up { step } else { -step };
            middle = if up { high } else { low };
            continue;
        }
        let slope = |frame: usize| (high.by_frame[frame] - low.by_frame[frame]) / (2.0 * step);
        let bend = |frame: usize| (2.0 * middle.by_frame[frame] - high.by_frame[frame] - low.by_frame[frame]) / (step * step);
        let used: Vec<usize> =
            training.iter().copied().filter(|&frame| low.inside[frame] && middle.inside[frame] && high.inside[frame]).collect();
        let (total, information): (f64, f64) =
            (used.iter().map(|&frame| slope(frame)).sum(), used.iter().map(|&frame| bend(frame)).sum());
        if used.len() < 5 || information <= 0.0 {
            return None;
        }
        let move_by = (total / information).clamp(-step, step);
        if step <= FINEST * first {
            let scatter: f64 = used.iter().map(|&frame| (slope(frame) - bend(frame) * move_by).powi(2)).sum();
            let count = used.len() as f64;
            let deviation = (scatter * count / (count - 1.0)).sqrt() / information;
            let inflation = (deviation * deviation * information).max(1.0);
            value += move_by;
            return Some(Fitted { id, value, deviation, floor, inflation, score: trial.score(change(value), &every, true) });
        }
        value += move_by;
        step *= 0.5;
        middle = score(value);
    }
    None
}
