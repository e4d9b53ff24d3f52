//! The likelihood of a place over all frames, with the body's reflectivities fitted anew.

use rayon::prelude::*;

use super::likelihood::{Compared, Predicted, WEIGHTS, first_weights, improve, most_power_gain};
use super::place::{Pivot, Place};
use super::poses::{Pose, Poses};
use super::readings::Readings;
use crate::scatterers::visibility::{DEFAULT_FLIP_EXPONENT, visible};

/// From nothing, and from the weights of a place nearby: more steps change nothing that matters.
const STEPS: usize = 60;
const MORE_STEPS: usize = 25;
/// Shares of a cell's power that come from its mean direction. The rest: errors of the array, longer ways, a body that is none of its
/// vertices.
const COHERENCES: [f64; 6] = [0.3, 0.6, 0.8, 0.9, 0.95, 0.98];

/// Share of power that comes from a cell's mean direction, before it is fitted.
pub const COHERENCE: f64 = 0.8;

/// How places are judged.
#[derive(Clone, Copy)]
pub struct Fitter<'a> {
    pub readings: &'a Readings,
    pub poses: &'a Poses,
    pub pivot: Pivot,
    pub coherence: f64,
}

/// Vertices that the radar sees, `[frame]`; none where the motion has no pose. It is held while a place varies a little, so that the
/// likelihood stays smooth.
pub type Sight = Vec<Option<Vec<u32>>>;

/// What a place gains over a recording without the body.
#[derive(Clone, Debug)]
pub struct Score {
    /// `[frame]`, nats; nothing where the motion has no pose.
    pub by_frame: Vec<f64>,
    /// By group and lobe, of the training frames.
    pub weights: [f64; WEIGHTS],
}

impl Score {
    pub fn over(&self, frames: &[usize]) -> f64 {
        frames.iter().map(|&frame| self.by_frame[frame]).sum()
    }
}

impl<'a> Fitter<'a> {
    pub(super) fn pose(&self, place: &Place, frame: usize) -> Option<Pose> {
        Some(self.poses.at(self.readings.middle_s[frame] - place.clock_s)?.placed(&self.pivot, place))
    }

    /// What is seen at a place, in the frames that a clock so much earlier and later has, too.
    pub fn sight(&self, place: &Place, margin_s: f64) -> Sight {
        let centre = self.readings.radar.centre_m();
        let of = |frame: usize| {
            let time = self.readings.middle_s[frame] - place.clock_s;
            if !self.poses.knows(time - margin_s) || !self.poses.knows(time + margin_s) {
                return None;
            }
            let seen = visible(&self.pose(place, frame)?.position_m, centre, DEFAULT_FLIP_EXPONENT);
            Some((0..seen.len() as u32).filter(|&vertex| seen[vertex as usize]).collect())
        };
        (0..self.readings.frames()).into_par_iter().map(of).collect()
    }

    fn predicted(&self, place: &Place, sight: &Sight) -> Vec<Option<Predicted>> {
        let of = |(frame, seen): (usize, &Option<Vec<u32>>)| {
            let pose = self.pose(place, frame)?;
            Some(Predicted::new(self.readings, &pose, &self.poses.group, seen.as_ref()?))
        };
        sight.par_iter().enumerate().map(of).collect()
    }

    fn compared(&self, predicted: &[Option<Predicted>], later_rad: f64) -> Vec<Option<Compared>> {
        let of = |(frame, predicted): (usize, &Option<Predicted>)| {
            Some(predicted.as_ref()?.against(self.readings, frame, self.coherence, later_rad))
        };
        predicted.par_iter().enumerate().map(of).collect()
    }

    fn judge(&self, compared: &[Option<Compared>], near: Option<&[f64; WEIGHTS]>) -> Score {
        let training: Vec<&Compared> =
            self.readings.split.training.iter().filter_map(|&frame| compared[frame].as_ref()).collect();
        let mut weights = near.copied().unwrap_or_else(|| first_weights(&training));
        improve(&training, &mut weights, if near.is_some() { MORE_STEPS } else { STEPS });
        let gain = |frame: &Option<Compared>| frame.as_ref().map_or(0.0, |frame| frame.gain(&weights));
        Score { by_frame: compared.par_iter().map(gain).collect(), weights }
    }

    /// `near`: weights of a place nearby.
    pub fn score(&self, place: &Place, sight: &Sight, near: Option<&[f64; WEIGHTS]>) -> Score {
        self.judge(&self.compared(&self.predicted(place, sight), 0.0), near)
    }

    /// The same from nothing.
    pub fn score_at(&self, place: &Place) -> Score {
        self.score(place, &self.sight(place, 0.0), None)
    }

    /// Share of what could be gained in the frames that a place explains, if what is expected of every cell were read from the recording
    /// itself, that the place gains.
    pub fn explained(&self, place: &Place, weights: &[f64; WEIGHTS]) -> f64 {
        let of = |(frame, predicted): (usize, &Option<Predicted>)| {
            let Some(predicted) = predicted else { return [0.0; 2] };
            [predicted.power_gain(self.readings, frame, weights), most_power_gain(self.readings, frame)]
        };
        let predicted = self.predicted(place, &self.sight(place, 0.0));
        let sums: Vec<[f64; 2]> = predicted.par_iter().enumerate().map(of).collect();
        let [own, most] = [0, 1].map(|side| sums.iter().map(|sum| sum[side]).sum::<f64>());
        if most > 0.0 { own / most } else { 0.0 }
    }

    /// With the coherence that makes the training frames likeliest at a place.
    pub fn with_best_coherence(self, place: &Place) -> Self {
        if self.readings.channels.len() < 2 {
            return self;
        }
        let predicted = self.predicted(place, &self.sight(place, 0.0));
        let gain = |coherence: &f64| {
            let fitter = Self { coherence: *coherence, ..self };
            fitter.judge(&fitter.compared(&predicted, 0.0), None).over(&self.readings.split.training)
        };
        let best = COHERENCES.iter().map(|coherence| (*coherence, gain(coherence))).max_by(|a, b| a.1.total_cmp(&b.1));
        Self { coherence: best.map_or(self.coherence, |(coherence, _)| coherence), ..self }
    }

    /// Gains of the training frames with the body at other azimuths, its heading to the line of sight kept.
    pub fn over_azimuths(&self, place: &Place, azimuths_rad: &[f64]) -> Vec<f64> {
        let predicted = self.predicted(place, &self.sight(place, 0.0));
        let gain = |azimuth: &f64| {
            let compared = self.compared(&predicted, azimuth - place.azimuth_rad);
            self.judge(&compared, None).over(&self.readings.split.training)
        };
        azimuths_rad.iter().map(gain).collect()
    }
}
