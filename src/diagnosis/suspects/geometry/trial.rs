//! How well the measured powers fit a changed body, whatever its parts' amplitudes.

use rayon::prelude::*;

use super::change::{Change, Moves};
use crate::diagnosis::Evidence;
use crate::diagnosis::power::{PowerModel, Template, fit_weights, part_templates, sum};

/// Degrees of freedom of the heavy tail: the expected power itself is uncertain.
const TAIL: f64 = 2.0;

/// Judges changes on one recording.
pub struct Trial<'a> {
    pub evidence: &'a Evidence,
    pub model: &'a PowerModel,
    pub moves: Moves,
}

/// Log-likelihood of every frame under a change, with the parts' weights fitted on the training frames.
#[derive(Clone, Debug)]
pub struct Score {
    pub change: Change,
    pub by_frame: Vec<f64>,
    /// Frames that the change can still predict.
    pub inside: Vec<bool>,
}

impl Score {
    /// Over some frames, those only that both predict.
    pub fn gain_over(&self, other: &Self, frames: &[usize]) -> f64 {
        frames
            .iter()
            .filter(|&&frame| self.inside[frame] && other.inside[frame])
            .map(|&frame| self.by_frame[frame] - other.by_frame[frame])
            .sum()
    }
}

impl Trial<'_> {
    /// `among`: frames to look at; others stay zero and outside.
    pub fn score(&self, change: Change, among: &[usize]) -> Score {
        let body = self.evidence.body.as_ref().expect("a power model has a body");
        let (maps, size) = (self.evidence.maps(), self.model.size());
        let made: Vec<(usize, Vec<Template>, bool)> = among
            .par_iter()
            .map(|&frame| {
                let (points, inside) = self.moves.points(body, frame, change);
                let templates = part_templates(&self.evidence.radar, &self.model.cells, &points, body.parts.len(), |point| point);
                (frame, templates, inside)
            })
            .collect();
        let measured = |frame: usize| &maps[frame * size..(frame + 1) * size];
        let training: Vec<(&[f32], &[Template])> = made
            .iter()
            .filter(|(frame, _, inside)| *inside && self.evidence.split.training.contains(frame))
            .map(|(frame, templates, _)| (measured(*frame), templates.as_slice()))
            .collect();
        let weights = fit_weights(&training, self.model.usable());
        let frames = self.evidence.cube.dims[0];
        let mut score = Score { change, by_frame: vec![0.0; frames], inside: vec![false; frames] };
        let values: Vec<f64> = made
            .par_iter()
            .map(|(frame, templates, _)| heavy_tailed(measured(*frame), &sum(templates, &weights, size), self.model.usable()))
            .collect();
        for ((frame, _, inside), value) in made.iter().zip(values) {
            score.by_frame[*frame] = value;
            score.inside[*frame] = *inside;
        }
        score
    }
}

/// Exponential powers whose mean is itself uncertain (Lomax law with the same scale): what the model leaves out counts by
/// its logarithm only.
fn heavy_tailed(measured: &[f32], expected: &[f32], usable: &[bool]) -> f64 {
    let of = |power: f32, expected: f32| {
        -f64::from(expected).ln() - (TAIL + 1.0) * (f64::from(power) / (TAIL * f64::from(expected))).ln_1p()
    };
    measured
        .iter()
        .zip(expected)
        .zip(usable)
        .filter(|(_, usable)| **usable)
        .map(|((&power, &expected), _)| of(power, expected))
        .sum()
}
