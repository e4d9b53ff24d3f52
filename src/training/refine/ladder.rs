//! From the motion as given to finer corrections, each kept only where frames that were not fitted prefer it.

use super::{
    Judgement,
    expected::LOBES_A_PART,
    parameters::{Layout, Parts},
    refiner::Refiner,
};
use crate::{body::PoseCorrection, error::Result, paths::distance, simulator::Scene};

const WHOLE: Parts = Parts { clock: true, place: true };

/// A correction, its numbers and its scene, and the nats that it loses in every held-out frame.
struct Rung {
    parts: Parts,
    name: &'static str,
    correction: PoseCorrection,
    values: Vec<f64>,
    scene: Scene,
    lost: Vec<f64>,
}

impl Rung {
    /// All rungs have their gains fitted alike, so that they differ by their motion alone.
    fn new(
        refiner: &Refiner<'_>,
        held_out: &[usize],
        (parts, name): (Parts, &'static str),
        mut correction: PoseCorrection,
        mut values: Vec<f64>,
    ) -> Result<Self> {
        let scene = refiner.scene(&mut correction)?;
        let gains = layout(refiner, parts, &[]).gains();
        let fitted = refiner.gains(&scene, finest(refiner), &vec![0.0; gains.len()])?;
        let lost = refiner.lost(&scene, held_out, finest(refiner), &fitted)?;
        values[gains].copy_from_slice(&fitted);
        Ok(Self { parts, name, correction, values, scene, lost })
    }

    /// How far two rungs' bodies lie apart in range in some frames, root mean square.
    fn apart_m(&self, other: &Self, frames: &[usize]) -> Result<f64> {
        let (mut sum, mut count) = (0.0, 0.0);
        for &frame in frames {
            let views = [self.scene.view(frame)?, other.scene.view(frame)?];
            let [a, b] = views.each_ref().map(|view| &view.body.as_ref().expect("it has a person").vertices_m);
            for (&p, &q) in a.iter().zip(b) {
                sum += (distance(p, [0.0; 3]) - distance(q, [0.0; 3])).powi(2);
                count += 1.0;
            }
        }
        Ok((sum / f64::max(count, 1.0)).sqrt())
    }
}

fn layout(refiner: &Refiner<'_>, parts: Parts, knots_s: &[f64]) -> Layout {
    Layout::new(refiner.config, parts, knots_s, refiner.joints, refiner.joints * LOBES_A_PART)
}

/// Width of the last blur, cells.
fn finest(refiner: &Refiner<'_>) -> f64 {
    refiner.config.blur_cells.last().copied().unwrap_or(1.0)
}

pub struct Ladder<'a> {
    refiner: Refiner<'a>,
    held_out: Vec<usize>,
    kept: Rung,
    judgements: Vec<Judgement>,
}

impl<'a> Ladder<'a> {
    /// On its lowest rung.
    pub fn new(refiner: Refiner<'a>, held_out: Vec<usize>) -> Result<Self> {
        let parts = Parts::default();
        let values = vec![0.0; layout(&refiner, parts, &[]).len()];
        let correction = PoseCorrection { pivot_m: refiner.pivot_m()?, ..Default::default() };
        let kept = Rung::new(&refiner, &held_out, (parts, parts.name()), correction, values)?;
        Ok(Self { refiner, held_out, kept, judgements: vec![] })
    }

    /// What is kept, and why.
    pub fn found(self) -> (PoseCorrection, Vec<Judgement>) {
        (self.kept.correction, self.judgements)
    }

    /// Corrects clock, place and heading, or where held-out frames lose less by it the clock alone, or the place alone.
    pub fn climb_whole(&mut self) -> Result<()> {
        let mut best = self.whole(WHOLE)?;
        let judgement = self.judge(&best, &self.kept)?.of_least(self.refiner.config.least_m);
        if !self.note(judgement) {
            return Ok(());
        }
        for parts in [Parts { clock: true, place: false }, Parts { clock: false, place: true }] {
            let smaller = self.whole(parts)?;
            let judgement = self.judge(&smaller, &self.kept)?.of_least(self.refiner.config.least_m);
            let lost = |rung: &Rung| rung.lost.iter().sum::<f64>();
            let is_better = judgement.kept && lost(&smaller) < lost(&best);
            self.judgements.push(Judgement { kept: is_better, ..judgement });
            if is_better {
                best = smaller;
            }
        }
        self.kept = best;
        Ok(())
    }

    /// Corrects single frames on top of what is kept.
    pub fn climb_frames(&mut self, fitted: Vec<usize>, held_out: Vec<usize>) -> Result<()> {
        (self.refiner.frames, self.held_out) = (fitted, held_out);
        let Rung { parts, name, correction, values, .. } = &self.kept;
        self.kept = self.rung((*parts, name), correction.clone(), values.clone())?;
        let Refiner { recording, person, joints, frames, .. } = &self.refiner;
        let radar = &recording.scene.radar;
        let mut correction = self.kept.correction.clone();
        let began_s = person.pose_times_s()[0] + correction.clock_s;
        correction.knots_s =
            frames.iter().map(|&frame| radar.chirp_time_s(frame, 0, radar.loops_per_frame / 2) - began_s).collect();
        correction.turns_rad = vec![vec![[0.0; 3]; *joints]; frames.len()];
        correction.shifts_m = vec![[0.0; 3]; frames.len()];
        let layout = layout(&self.refiner, self.kept.parts, &correction.knots_s);
        let mut values = self.kept.values.clone();
        values.resize(layout.len(), 0.0);
        let correction = self.refiner.descend(&layout, &mut values, correction, finest(&self.refiner))?;
        let single = self.rung((self.kept.parts, "corrections of single frames"), correction, values)?;
        let judgement = self.judge(&single, &self.kept)?.of_least(self.refiner.config.least_m);
        if self.note(judgement) {
            self.kept = single;
        }
        Ok(())
    }

    /// The best correction by some parts, from coarse to fine. Gains are fitted before anything moves: where they are wrong, the body
    /// moves towards what only reflects more.
    fn whole(&self, parts: Parts) -> Result<Rung> {
        let layout = layout(&self.refiner, parts, &[]);
        let mut values = vec![0.0; layout.len()];
        let mut correction = PoseCorrection { pivot_m: self.kept.correction.pivot_m, ..Default::default() };
        for &blur in &self.refiner.config.blur_cells {
            let scene = self.refiner.scene(&mut correction)?;
            let gains = self.refiner.gains(&scene, blur, &values[layout.gains()])?;
            values[layout.gains()].copy_from_slice(&gains);
            correction = self.refiner.descend(&layout, &mut values, correction, blur)?;
        }
        self.rung((parts, parts.name()), correction, values)
    }

    fn rung(&self, name: (Parts, &'static str), correction: PoseCorrection, values: Vec<f64>) -> Result<Rung> {
        Rung::new(&self.refiner, &self.held_out, name, correction, values)
    }

    fn judge(&self, finer: &Rung, coarser: &Rung) -> Result<Judgement> {
        let radar = &self.refiner.recording.scene.radar;
        let times_s: Vec<f64> =
            self.held_out.iter().map(|&frame| radar.chirp_time_s(frame, 0, radar.loops_per_frame / 2)).collect();
        let names = [finer.name, coarser.name];
        let judgement = Judgement::new(names, &finer.lost, &coarser.lost, &times_s, self.refiner.config.smooth_s);
        Ok(Judgement { apart_m: finer.apart_m(coarser, &self.held_out)?, ..judgement })
    }

    /// Whether the finer one is preferred.
    fn note(&mut self, judgement: Judgement) -> bool {
        let kept = judgement.kept;
        self.judgements.push(judgement);
        kept
    }
}
