//! From the motion as given to finer corrections, each kept only where frames that were not fitted prefer it.

use super::{
    Judgement,
    expected::LOBES_A_PART,
    parameters::{Layout, Parts},
    refiner::Refiner,
};
use crate::{body::PoseCorrection, error::Result};

const WHOLE: Parts = Parts { clock: true, place: true };

/// A correction, its numbers, and the nats that it loses in every held-out frame.
struct Rung {
    parts: Parts,
    name: &'static str,
    correction: PoseCorrection,
    values: Vec<f64>,
    lost: Vec<f64>,
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
        let values = vec![0.0; Self::layout(&refiner, parts, &[]).len()];
        let correction = PoseCorrection { pivot_m: refiner.pivot_m()?, ..Default::default() };
        let kept = Rung { parts, name: parts.name(), correction, values, lost: vec![] };
        let mut ladder = Self { refiner, held_out, kept, judgements: vec![] };
        ladder.weigh_kept()?;
        Ok(ladder)
    }

    /// What is kept, and why.
    pub fn found(self) -> (PoseCorrection, Vec<Judgement>) {
        (self.kept.correction, self.judgements)
    }

    fn layout(refiner: &Refiner<'_>, parts: Parts, knots_s: &[f64]) -> Layout {
        Layout::new(refiner.config, parts, knots_s, refiner.joints, refiner.joints * LOBES_A_PART)
    }

    fn finest(&self) -> f64 {
        self.refiner.config.blur_cells.last().copied().unwrap_or(1.0)
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
        self.weigh_kept()?;
        let Refiner { recording, person, joints, frames, .. } = &self.refiner;
        let radar = &recording.scene.radar;
        let mut correction = self.kept.correction.clone();
        let began_s = person.pose_times_s()[0] + correction.clock_s;
        correction.knots_s =
            frames.iter().map(|&frame| radar.chirp_time_s(frame, 0, radar.loops_per_frame / 2) - began_s).collect();
        correction.turns_rad = vec![vec![[0.0; 3]; *joints]; frames.len()];
        correction.shifts_m = vec![[0.0; 3]; frames.len()];
        let layout = Self::layout(&self.refiner, self.kept.parts, &correction.knots_s);
        let mut values = self.kept.values.clone();
        values.resize(layout.len(), 0.0);
        let correction = self.refiner.descend(&layout, &mut values, correction, self.finest())?;
        let single = self.weighed(Rung {
            parts: self.kept.parts,
            name: "corrections of single frames",
            correction,
            values,
            lost: vec![],
        })?;
        let judgement = self.judge(&single, &self.kept)?.of_least(self.refiner.config.least_m);
        if self.note(judgement) {
            self.kept = single;
        }
        Ok(())
    }

    /// The best correction by some parts, from coarse to fine. Gains are fitted before anything moves: where they are wrong, the body
    /// moves towards what only reflects more.
    fn whole(&self, parts: Parts) -> Result<Rung> {
        let layout = Self::layout(&self.refiner, parts, &[]);
        let mut values = vec![0.0; layout.len()];
        let mut correction = PoseCorrection { pivot_m: self.kept.correction.pivot_m, ..Default::default() };
        for &blur in &self.refiner.config.blur_cells {
            let scene = self.refiner.scene(&mut correction)?;
            let gains = self.refiner.gains(&scene, blur, &values[layout.gains()])?;
            values[layout.gains()].copy_from_slice(&gains);
            correction = self.refiner.descend(&layout, &mut values, correction, blur)?;
        }
        self.weighed(Rung { parts, name: parts.name(), correction, values, lost: vec![] })
    }

    fn weigh_kept(&mut self) -> Result<()> {
        let Rung { parts, name, correction, values, .. } = &self.kept;
        let kept = Rung { parts: *parts, name, correction: correction.clone(), values: values.clone(), lost: vec![] };
        self.kept = self.weighed(kept)?;
        Ok(())
    }

    /// With what is lost in the held-out frames. All rungs have their gains fitted alike, so that they differ by their motion alone.
    fn weighed(&self, mut rung: Rung) -> Result<Rung> {
        let scene = self.refiner.scene(&mut rung.correction)?;
        let gains = Self::layout(&self.refiner, rung.parts, &[]).gains();
        let fitted = self.refiner.gains(&scene, self.finest(), &vec![0.0; gains.len()])?;
        rung.lost = self.refiner.lost(&scene, &self.held_out, self.finest(), &fitted)?;
        rung.values[gains].copy_from_slice(&fitted);
        Ok(rung)
    }

    fn judge(&self, finer: &Rung, coarser: &Rung) -> Result<Judgement> {
        let radar = &self.refiner.recording.scene.radar;
        let times_s: Vec<f64> =
            self.held_out.iter().map(|&frame| radar.chirp_time_s(frame, 0, radar.loops_per_frame / 2)).collect();
        let names = [finer.name, coarser.name];
        let judgement = Judgement::new(names, &finer.lost, &coarser.lost, &times_s, self.refiner.config.smooth_s);
        Ok(Judgement { apart_m: self.apart_m(finer, coarser)?, ..judgement })
    }

    /// How far two rungs' bodies lie apart in range in the held-out frames, root mean square.
    fn apart_m(&self, a: &Rung, b: &Rung) -> Result<f64> {
        let [a, b] = [a, b].map(|rung| self.refiner.scene(&mut rung.correction.clone()));
        let (a, b) = (a?, b?);
        let (mut sum, mut count) = (0.0, 0.0);
        for &frame in &self.held_out {
            let views = [a.view(frame)?, b.view(frame)?];
            let [a, b] = views.each_ref().map(|view| &view.body.as_ref().expect("it has a person").vertices_m);
            for (p, q) in a.iter().zip(b) {
                let range = |place: &[f64; 3]| place.iter().map(|x| x * x).sum::<f64>().sqrt();
                sum += (range(p) - range(q)).powi(2);
                count += 1.0;
            }
        }
        Ok((sum / f64::max(count, 1.0)).sqrt())
    }

    /// Whether the finer one is preferred.
    fn note(&mut self, judgement: Judgement) -> bool {
        let kept = judgement.kept;
        self.judgements.push(judgement);
        kept
    }
}
