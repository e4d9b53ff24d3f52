//! Geometry and time: the body is not where or when it was predicted, or it is seen a second time among its own cells.

mod replica;
mod bearing;
mod cells;
mod change;
mod channels;
mod coupling;
mod covariance;
mod displaced;
mod fitted;
mod found;
mod lost;
mod mismatch;
mod numbers;
mod places;
mod skew;
mod wall_bearings;
mod trial;
#[cfg(test)]
mod receding;
#[cfg(test)]
mod walking;

use change::Moves;
use channels::Observed;
use trial::Trial;

use nalgebra::DVector;

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::estimated::Estimated;
use crate::diagnosis::speckle::Look;
use crate::diagnosis::{Candidate, Evidence};

/// Chance below which the body is elsewhere than predicted.
const DISPLACED: f64 = 1e-3;

/// At most one candidate for a change of the body's place or time or for an echo of it, and one for what differs between receivers.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let Some(model) = evidence.power() else { return vec![] };
    let Some(body) = evidence.body.as_ref() else { return vec![] };
    // Beside another mover that is stronger than the body, the body's place and time are not estimable.
    let outshone = evidence.accepted_unnamed.contains(&Behaviour::PathLikeOverTheBody);
    let mut found = if outshone { vec![] } else { displaced::find(&Trial::new(evidence, model, body)) };
    let displaced = found.iter().any(|found| found.p_value < DISPLACED && found.nats > 0.0);
    found.extend(channels::find(evidence, model, body, Moves::new(evidence.radar.centre_m()), displaced));
    found
}

/// Chance that phases between receivers that are alike, beside directions, look as uneven. None without a body that is observed at
/// a sufficient SNR.
pub fn chance(evidence: &Evidence) -> Option<f64> {
    let Observed { array, .. } = Observed::new(evidence, evidence.power()?, evidence.body.as_ref()?)?;
    let directions = array.cells.numbers().own(&evidence.radar, &[array.cells.numbers().phase(0)]);
    let (none, floors) = (DVector::zeros(directions.ncols()), vec![0.0; directions.ncols()]);
    Some(Estimated::new(&array.looks, &none, &directions, &floors)?.p_value)
}

/// What the moving body's cells say of one receiver's logarithmic gain against the others, `[rx][frame][group]`: values and their
/// inverse variances. None without a body that is observed.
pub fn gains(evidence: &Evidence) -> Option<Vec<Vec<Vec<[f64; 2]>>>> {
    let Observed { array, .. } = Observed::new(evidence, evidence.power()?, evidence.body.as_ref()?)?;
    let numbers = array.cells.numbers();
    let gain = |look: &Look, number: usize| {
        let information = look.information[(number, number)];
        (look.place.is_none() && information > 0.0).then(|| [look.score[number] / information, information])
    };
    let of_frame = |looks: &Vec<Look>, number: usize| looks.iter().filter_map(|look| gain(look, number)).collect();
    let of_receiver = |rx: usize| array.looks.iter().map(|looks| of_frame(looks, numbers.gain(rx))).collect();
    Some((0..numbers.receivers).map(of_receiver).collect())
}
