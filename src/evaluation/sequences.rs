//! Means over recordings, with their intervals.

use serde::Serialize;

use super::{Evaluation, ScoreSummary};
use crate::{lpips::Network, metrics::Spread};

/// Means over sequences (recordings) of each one's mean over frames. Sequences are independent where frames are not, so
/// only these means have a 95 % interval; a single sequence has none.
#[derive(Clone, Debug, Serialize)]
pub struct SequenceSummary {
    pub sequences: usize,
    /// Of all sequences together.
    pub frames: usize,
    pub span_db: f64,
    pub global: Option<ScoreSummary>,
    pub moving: Option<ScoreSummary>,
    /// Over those sequences in which a person was tracked; its counts say how many.
    pub person: Option<ScoreSummary>,
    pub lpips: Option<Network>,
}

/// `None` without evaluations.
///
/// # Panics
/// When they were not made with the same decibels and network.
pub fn over_sequences(evaluations: &[Evaluation]) -> Option<SequenceSummary> {
    over_draws(&[evaluations])
}

/// The same where what simulated has been drawn (trained) several times: `draws[draw][sequence]`. Means are over both, and intervals
/// know that both are taken at random ([`Spread::crossed`]); counts are those of one draw.
///
/// # Panics
/// When they were not made with the same decibels and network, or draws differ in their number of sequences.
pub fn over_draws(draws: &[&[Evaluation]]) -> Option<SequenceSummary> {
    let first = draws.first()?.first()?;
    let alike = |other: &Evaluation| other.span_db == first.span_db && other.lpips == first.lpips;
    assert!(draws.iter().copied().flatten().all(alike), "over_draws: evaluations with different settings");
    let region = |of: fn(&Evaluation) -> Option<&ScoreSummary>| ScoreSummary::over(&by_sequence(draws, of));
    Some(SequenceSummary {
        sequences: draws[0].len(),
        frames: draws[0].iter().map(|evaluation| evaluation.frames).sum(),
        span_db: first.span_db,
        global: region(|evaluation| evaluation.global.as_ref()),
        moving: region(|evaluation| evaluation.moving.as_ref()),
        person: region(|evaluation| evaluation.person.as_ref()),
        lpips: first.lpips,
    })
}

/// What every draw has of a sequence, `[sequence][draw]`; sequences of which one draw has nothing are left out.
///
/// # Panics
/// When draws differ in their number of sequences.
fn by_sequence<'a, T>(draws: &[&'a [Evaluation]], of: impl Fn(&'a Evaluation) -> Option<T>) -> Vec<Vec<T>> {
    let sequences = draws.first().map_or(0, |draw| draw.len());
    assert!(draws.iter().all(|draw| draw.len() == sequences), "by_sequence: draws of different recordings");
    (0..sequences).filter_map(|sequence| draws.iter().map(|draw| of(&draw[sequence])).collect()).collect()
}

impl ScoreSummary {
    /// Over the means of sequences, `[sequence][draw]`.
    fn over(sequences: &[Vec<&Self>]) -> Option<Self> {
        let spread = |of: fn(&Self) -> Option<Spread>| {
            let mean = |summary: &&Self| Some(of(summary)?.mean);
            let rows: Vec<Vec<f64>> = sequences.iter().filter_map(|draws| draws.iter().map(mean).collect()).collect();
            Spread::crossed(&rows)
        };
        Some(Self {
            psnr_db: spread(|summary| Some(summary.psnr_db))?,
            ssim: spread(|summary| Some(summary.ssim))?,
            mean_absolute_error_db: spread(|summary| Some(summary.mean_absolute_error_db))?,
            lpips: spread(|summary| summary.lpips),
        })
    }
}
