//! The Doppler axis the other way round.

use super::energy::{energy_at, range_and_velocity};
use super::{CLEARLY_DB, Check};
use crate::diagnosis::evidence::Evidence;

pub(super) fn doppler_sign(evidence: &Evidence) -> Option<Check> {
    evidence.body.as_ref()?;
    let as_is = energy_at(evidence, Some, |point| Some(range_and_velocity(point, &evidence.radar)));
    let flipped = energy_at(evidence, Some, |point| {
        let [range, velocity] = range_and_velocity(point, &evidence.radar);
        Some([range, -velocity])
    });
    let ok = flipped - as_is < CLEARLY_DB;
    let hint = if ok { "" } else { ": the Doppler axis runs the other way" };
    Some(Check::new(
        "doppler_sign",
        "a receding body has a positive Doppler frequency",
        format!("{as_is:.1} dB where the motion puts the body, {flipped:.1} dB at the opposite velocities{hint}"),
        ok,
    ))
}
