//! How well the measured powers fit a changed body, whatever its parts' amplitudes.

use rayon::prelude::*;

use super::change::{Change, Moves};
use crate::diagnosis::evidence::REACH_M;
use crate::diagnosis::finding::apart;
use crate::diagnosis::power::{PowerModel, Reach, improve, part_templates};
use crate::diagnosis::prediction::{Point, range_and_velocity};
use crate::diagnosis::{BodyPrediction, Evidence, Place};
use crate::effects::Stage;

/// Degrees of freedom of the heavy tail: the expected power itself is uncertain.
const TAIL: f32 = 2.0;

/// Steps from the unchanged body's weights. Far from where it is, other parts are bright: with a few steps only, every change seems
/// smaller than it is.
const STEPS: usize = 120;

/// Judges changes on one recording.
pub struct Trial<'a> {
    pub evidence: &'a Evidence,
    pub model: &'a PowerModel,
    pub body: &'a BodyPrediction,
    pub moves: Moves,
    /// Whether nothing else moves near the body, by frame.
    is_alone: Vec<bool>,
    /// Log-likelihood of every frame without a body.
    empty: Vec<f64>,
}

/// Log-likelihood of every frame under a change, with the parts' weights fitted on the training frames.
#[derive(Clone, Debug)]
pub struct Score {
    pub change: Change,
    pub by_frame: Vec<f64>,
    /// Frames that the change can still predict.
    pub inside: Vec<bool>,
    /// Frames for which nothing was carried on beyond what is known of the motion.
    pub known: Vec<bool>,
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

impl<'a> Trial<'a> {
    pub fn new(evidence: &'a Evidence, model: &'a PowerModel, body: &'a BodyPrediction) -> Self {
        let empty = evidence
            .maps()
            .values()
            .par_chunks_exact(model.size())
            .map(|map| {
                let usable = map.iter().zip(model.usable()).filter(|(_, usable)| **usable);
                usable.map(|(&power, _)| heavy_tailed(power, 1.0)).sum()
            })
            .collect();
        let is_alone = body.frames.iter().map(|points| is_alone(evidence, points)).collect();
        Self { evidence, model, body, moves: Moves::new(evidence.radar.centre_m()), is_alone, empty }
    }

    /// `among`: frames to look at; others stay zero and outside. `refit`: the weights, else those of the unchanged body
    /// are kept.
    pub fn score(&self, change: Change, among: &[usize], refit: bool) -> Score {
        let maps = self.evidence.maps();
        let made: Vec<(usize, Reach, bool)> = among
            .par_iter()
            .map(|&frame| {
                let (points, inside) = self.moves.points(self.body, frame, change);
                let inside = inside && self.is_alone[frame];
                let replica = if let Change::Replica(echo) = change { Some(echo) } else { None };
                let points = self.body.with_echoes(&self.evidence.radar, points, replica);
                let templates = part_templates(&self.evidence.radar, &self.model.cells, &points, self.body.parts.len());
                (frame, Reach::new(maps.below([frame]), &templates, self.model.usable()), inside)
            })
            .collect();
        let mut weights = self.model.weights.clone();
        if refit {
            let fitted_on = |(frame, _, inside): &&(usize, Reach, bool)| *inside && self.evidence.split.training.contains(frame);
            let training: Vec<&Reach> = made.iter().filter(fitted_on).map(|(_, reach, _)| reach).collect();
            improve(&training, &mut weights, STEPS);
        }
        let frames = self.evidence.cube.dims[0];
        let mut score = Score { change, by_frame: vec![0.0; frames], inside: vec![false; frames], known: vec![false; frames] };
        for (frame, reach, inside) in made {
            let expected = reach.expected(&weights);
            let change = expected
                .iter()
                .zip(&reach.measured)
                .map(|(&expected, &power)| heavy_tailed(power, expected) - heavy_tailed(power, 1.0));
            score.by_frame[frame] = self.empty[frame] + change.sum::<f64>();
            score.known[frame] = inside;
            // A step is so long that a body carried straight on shows it all the same, and shows none where there is none.
            score.inside[frame] = inside || matches!(score.change, Change::Drop { .. }) && self.is_alone[frame];
        }
        score
    }
}

/// Whether what moves beside the body stays farther from it than the echoes of one of them reach: what is left of it there looks like a body
/// that is elsewhere.
fn is_alone(evidence: &Evidence, points: &[Point]) -> bool {
    let returns = points.iter().map(|point| range_and_velocity(&evidence.radar, point.position_m, point.velocity_mps));
    let own_m = Place::spanning(Stage::Scene, returns).range_m;
    let reached_m = own_m.map(|[near, far]| [near - REACH_M, far + REACH_M]);
    reached_m.is_none_or(|reached_m| evidence.others_m.iter().all(|other_m| apart(reached_m, *other_m)))
}

/// Logarithm of the density of a power that is exponential about a mean which is itself uncertain (Lomax law): what the
/// model leaves out counts by its logarithm only.
fn heavy_tailed(power: f32, expected: f32) -> f64 {
    f64::from(-expected.ln() - (TAIL + 1.0) * (power / (TAIL * expected)).ln_1p())
}
