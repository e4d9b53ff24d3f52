//! How often a classifier was right, and how sure that is.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::diagnosis::statistics::binomial_interval;

/// What became of one window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judgement {
    pub sequence: usize,
    pub class: usize,
    pub judged: usize,
}

/// A share with its intervals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Accuracy {
    pub value: f64,
    /// Exact (Clopper-Pearson), as if all windows were independent: too narrow where a sequence has several.
    pub interval_windows: [f64; 2],
    /// Percentiles over resampled sequences.
    pub interval_sequences: [f64; 2],
}

/// Mean of the classes' F1, with its interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MacroF1 {
    pub value: f64,
    /// Percentiles over resampled sequences.
    pub interval_sequences: [f64; 2],
}

/// What became of the windows of one action.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClassScores {
    pub action: String,
    pub windows: usize,
    /// Absent where nothing was judged so, or where there was nothing to find.
    pub precision: Option<f64>,
    pub recall: Option<f64>,
    pub f1: Option<f64>,
}

/// Counts `[class][judged]`.
pub fn confusion<'a>(judgements: impl IntoIterator<Item = &'a Judgement>, classes: usize) -> Vec<Vec<usize>> {
    let mut counts = vec![vec![0; classes]; classes];
    for judgement in judgements {
        counts[judgement.class][judgement.judged] += 1;
    }
    counts
}

/// Share of the windows on the diagonal of `[class][judged]`; zero without any.
pub fn accuracy_of(confusion: &[Vec<usize>]) -> f64 {
    let hits: usize = confusion.iter().enumerate().map(|(class, row)| row[class]).sum();
    hits as f64 / confusion.iter().flatten().sum::<usize>().max(1) as f64
}

/// Each class with its precision, recall and F1 = 2 TP / (2 TP + FP + FN).
pub fn class_scores(confusion: &[Vec<usize>], names: &[String]) -> Vec<ClassScores> {
    let of = |(class, name): (usize, &String)| {
        let hits = confusion[class][class];
        let windows: usize = confusion[class].iter().sum();
        let judged: usize = confusion.iter().map(|row| row[class]).sum();
        let share = |part: usize, whole: usize| (whole > 0).then(|| part as f64 / whole as f64);
        ClassScores {
            action: name.clone(),
            windows,
            precision: share(hits, judged),
            recall: share(hits, windows),
            f1: share(2 * hits, windows + judged),
        }
    };
    names.iter().enumerate().map(of).collect()
}

/// Mean F1 over the classes that occur, in truth or as a judgement.
pub fn macro_f1_of(confusion: &[Vec<usize>]) -> f64 {
    let names = vec![String::new(); confusion.len()];
    let scores: Vec<f64> = class_scores(confusion, &names).into_iter().filter_map(|score| score.f1).collect();
    scores.iter().sum::<f64>() / scores.len().max(1) as f64
}

/// Accuracy and macro-F1 over all windows, with intervals. Windows of a sequence are alike, so whole sequences are
/// drawn again with replacement.
pub fn scores(judgements: &[Judgement], classes: usize, confidence: f64, resamplings: usize, seed: u64) -> (Accuracy, MacroF1) {
    let whole = confusion(judgements, classes);
    let sequences = judgements.iter().map(|judgement| judgement.sequence + 1).max().unwrap_or(0);
    let mut parts: Vec<Vec<&Judgement>> = vec![vec![]; sequences];
    judgements.iter().for_each(|judgement| parts[judgement.sequence].push(judgement));
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut drawn: [Vec<f64>; 2] = Default::default();
    for _ in 0..resamplings {
        let chosen = (0..sequences).flat_map(|_| parts[rng.random_range(0..sequences)].iter().copied());
        let counts = confusion(chosen, classes);
        drawn[0].push(accuracy_of(&counts));
        drawn[1].push(macro_f1_of(&counts));
    }
    let [accuracies, f1s] = drawn.map(|values| percentiles(values, confidence));
    let hits = whole.iter().enumerate().map(|(class, row)| row[class]).sum();
    let accuracy = Accuracy {
        value: accuracy_of(&whole),
        interval_windows: binomial_interval(hits, judgements.len(), confidence),
        interval_sequences: accuracies,
    };
    (accuracy, MacroF1 { value: macro_f1_of(&whole), interval_sequences: f1s })
}

fn percentiles(mut values: Vec<f64>, confidence: f64) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
    [at(0.5 * (1.0 - confidence)), at(0.5 * (1.0 + confidence))]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judgements(list: &[(usize, usize, usize)]) -> Vec<Judgement> {
        list.iter().map(|&(sequence, class, judged)| Judgement { sequence, class, judged }).collect()
    }

    #[test]
    fn scores_agree_with_those_by_hand() {
        // class 0: two of three found, one false alarm; class 1: one of two; class 2: never there, never said.
        let found = judgements(&[(0, 0, 0), (0, 0, 0), (1, 0, 1), (2, 1, 1), (2, 1, 0)]);
        let counts = confusion(&found, 3);
        assert_eq!(counts, [[2, 1, 0], [1, 1, 0], [0, 0, 0]]);
        let (accuracy, macro_f1) = scores(&found, 3, 0.95, 500, 1);
        assert_eq!(accuracy.value, 3.0 / 5.0);
        // F1: 2·2/(4+1+1) and 2·1/(2+1+1).
        assert!((macro_f1.value - 0.5 * (4.0 / 6.0 + 2.0 / 4.0)).abs() < 1e-12);
        let classes = class_scores(&counts, &["a", "b", "c"].map(String::from));
        assert_eq!((classes[0].precision, classes[0].recall), (Some(2.0 / 3.0), Some(2.0 / 3.0)));
        assert_eq!((classes[2].f1, classes[2].recall), (None, None));
        // Clopper and Pearson for 3 of 5.
        let [low, high] = accuracy.interval_windows;
        assert!((low - 0.1466).abs() < 1e-3 && (high - 0.9473).abs() < 1e-3, "{low} {high}");
    }

    #[test]
    fn copies_of_a_window_narrow_the_interval_over_windows_but_not_that_over_sequences() {
        let once: Vec<Judgement> =
            (0..20).map(|i| Judgement { sequence: i, class: i % 2, judged: if i < 14 { i % 2 } else { 1 - i % 2 } }).collect();
        let often: Vec<Judgement> = once.iter().flat_map(|&judgement| [judgement; 10]).collect();
        let width = |[low, high]: [f64; 2]| high - low;
        let (a, b) = (scores(&once, 2, 0.95, 1000, 7).0, scores(&often, 2, 0.95, 1000, 7).0);
        assert_eq!(a.value, b.value);
        assert_eq!(a.interval_sequences, b.interval_sequences);
        assert!(width(b.interval_windows) < 0.5 * width(a.interval_windows));
        assert!(width(a.interval_sequences) > 0.2, "{a:?}");
    }

    #[test]
    fn equal_seeds_give_equal_intervals() {
        let found = judgements(&[(0, 0, 0), (1, 0, 1), (2, 1, 1), (3, 1, 0), (4, 0, 0)]);
        assert_eq!(scores(&found, 2, 0.9, 300, 4), scores(&found, 2, 0.9, 300, 4));
    }
}
