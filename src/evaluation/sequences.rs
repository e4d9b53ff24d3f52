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
    let first = evaluations.first()?;
    let alike = |other: &Evaluation| other.span_db == first.span_db && other.lpips == first.lpips;
    assert!(evaluations.iter().all(alike), "over_sequences: evaluations with different settings");
    let region = |of: fn(&Evaluation) -> Option<&ScoreSummary>| {
        let summaries: Vec<&ScoreSummary> = evaluations.iter().filter_map(of).collect();
        ScoreSummary::over(&summaries)
    };
    Some(SequenceSummary {
        sequences: evaluations.len(),
        frames: evaluations.iter().map(|evaluation| evaluation.frames).sum(),
        span_db: first.span_db,
        global: region(|evaluation| evaluation.global.as_ref()),
        moving: region(|evaluation| evaluation.moving.as_ref()),
        person: region(|evaluation| evaluation.person.as_ref()),
        lpips: first.lpips,
    })
}

impl ScoreSummary {
    /// Over the means of sequences.
    fn over(sequences: &[&Self]) -> Option<Self> {
        let spread = |of: fn(&Self) -> Spread| Spread::of(sequences.iter().map(|sequence| of(sequence).mean));
        Some(Self {
            psnr_db: spread(|sequence| sequence.psnr_db)?,
            ssim: spread(|sequence| sequence.ssim)?,
            mean_absolute_error_db: spread(|sequence| sequence.mean_absolute_error_db)?,
            lpips: Spread::of(sequences.iter().filter_map(|sequence| sequence.lpips.map(|lpips| lpips.mean))),
        })
    }
}
