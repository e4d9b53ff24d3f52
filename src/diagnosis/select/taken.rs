//! A recording with what was accepted taken into account.

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction};
use crate::diagnosis::residual::stands_still;
use crate::diagnosis::tones;
use crate::effects::Stage;

/// Whether it is a person or a vehicle beside the body, of which limbs are left: what oscillates is taken out whole.
fn moves_by_no_law(candidate: &Candidate) -> bool {
    candidate.behaves_like == Behaviour::PathLike
        && candidate.place.stage == Some(Stage::Scene)
        && candidate.place.velocity_mps.is_some()
        && candidate.estimates.iter().all(|estimate| estimate.name != "swing_m")
}

impl Evidence {
    /// The same with one more effect taken into account.
    pub fn with(&self, candidate: &Candidate) -> Self {
        let mut next = self.clone().changed();
        if candidate.behaves_like.is_path() || candidate.behaves_like == Behaviour::ExcessPower {
            // Where paths were cut out there is not even noise left.
            next.once.noise = self.once.noise.clone();
        }
        next.correct(&candidate.correction);
        if candidate.correction.empties() || !self.emptied.is_empty() {
            // The radar moves no less where some of what seems to was taken out.
            next.once.may_move = self.may_move().into();
        }
        if stands_still(candidate) {
            let gone = self.standing().iter().zip(next.clutter()).map(|(before, after)| before - after).collect();
            next.subtracted = Some(gone);
        }
        if moves_by_no_law(candidate) {
            next.others_m.extend(candidate.place.range_m);
        }
        match candidate.id {
            Some(id) => next.accepted.push(id),
            None => next.accepted_unnamed.push(candidate.behaves_like),
        }
        next
    }

    fn correct(&mut self, correction: &Correction) {
        match correction {
            Correction::Samples(undo) => undo(&mut self.cube),
            Correction::Inverse(undo, volume) => {
                undo(&mut self.cube);
                self.inverses.push((undo.clone(), volume.clone()));
            }
            Correction::Emptied(tones, cells) => {
                self.regions.push(tones.clone());
                tones::remove(&mut self.cube, &self.split.training, &self.regions);
                self.emptied.push(cells.clone());
            }
            Correction::Followed(correction, course) => {
                self.correct(correction);
                self.courses.push(course.clone());
            }
            Correction::Body(change) => {
                if let Some(body) = &mut self.body {
                    change(body);
                }
            }
            Correction::None => {}
        }
    }
}
