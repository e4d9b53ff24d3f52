//! Candidate: the body's mirror image at a boundary.

use super::ghost::Ghost;
use super::mover::energy;
use super::removal::{emptied, patch};
use super::scene::Scene;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::prediction::{SIDE_SPREAD, mirror_id, mirrored_return};
use crate::diagnosis::statistics::{UNDECIDED, chi2_tail, corrected};
use crate::diagnosis::{Candidate, Estimate, Place};
use crate::effects::Stage;

pub fn candidate(scene: &Scene, ghost: &Ghost, all: &[Ghost], tried: f64) -> Candidate {
    let evidence = scene.evidence;
    let distance_m = evidence.room.as_ref().and_then(|room| room.distance_m(ghost.boundary)).unwrap_or(0.0);
    let points = evidence.body.iter().flat_map(|body| body.frames.iter().flatten());
    let images = points.map(|point| mirrored_return(&evidence.radar, point, ghost.boundary, distance_m, false));
    let place = Place::spanning(Stage::Propagation, images.map(|image| (image.range_m, image.velocity_mps)));
    let name = ghost.boundary.name();
    let id = mirror_id(ghost.boundary);
    let peak = scene_power(scene, ghost);
    let statement = format!(
        "The body is seen a second time by way of the {name} boundary: power at half the summed lengths of the direct and \
         the mirrored way, with the mean of both velocities, as a mirror of amplitude {:.2} would send it; its strongest cell \
         is {:.0} dB over the noise.",
        ghost.coefficient,
        10.0 * peak.max(1.0).log10()
    );
    let others = all.iter().filter(|other| other.boundary != ghost.boundary && ghost.gain - other.gain < UNDECIDED);
    let mut look_alikes: Vec<&'static str> = others.map(|other| mirror_id(other.boundary)).filter(|other| *other != id).collect();
    look_alikes.dedup();
    let spread = 1.645 * SIDE_SPREAD;
    let coefficient = Estimate {
        name: "coefficient",
        values: vec![ghost.coefficient],
        ci90: vec![[ghost.coefficient * (-spread).exp(), ghost.coefficient * spread.exp()]],
    };
    let cells = (ghost.templates.iter().enumerate())
        .map(|(frame, template)| {
            let mut expected = vec![0.0; scene.size()];
            for (&cell, &power) in template.cells.iter().zip(&template.power) {
                expected[cell as usize] = ghost.weight as f32 * power;
            }
            (frame, patch(&expected, scene.map(frame), scene.model.support(frame), scene.samples, 0.1))
        })
        .collect();
    let power: f64 = (ghost.templates.iter())
        .map(|template| ghost.weight * template.power.iter().map(|&power| f64::from(power)).sum::<f64>())
        .sum();
    let place = Place { boundary: Some(name.into()), ..place };
    Candidate {
        id: Some(id),
        estimates: vec![coefficient],
        choice: Some(name.into()),
        look_alikes,
        statement,
        // The windows' cells hold every tone 2.25 times over.
        energy: energy(scene, power / 2.25),
        correction: emptied(evidence, cells),
        ..Candidate::new(Behaviour::PathLike, place, corrected(chi2_tail(2.0 * ghost.gain_all, 2.0), tried), ghost.gain)
    }
}

/// Strongest measured cell that the ghost expects power in.
fn scene_power(scene: &Scene, ghost: &Ghost) -> f64 {
    (ghost.templates.iter().enumerate())
        .flat_map(|(frame, template)| {
            template.cells.iter().zip(&template.power).map(move |(&cell, &power)| (frame, cell as usize, power))
        })
        .filter(|(_, _, power)| ghost.weight * f64::from(*power) > 0.5)
        .map(|(frame, cell, _)| f64::from(scene.map(frame)[cell]))
        .fold(0.0, f64::max)
}
