//! The Doppler axis the other way round.

use super::energy::{Alternative, fit, range_and_velocity};
use crate::diagnosis::evidence::Evidence;

pub(super) fn doppler_sign(evidence: &Evidence) -> Alternative {
    let flipped = fit(evidence, Some, |point| {
        let [range, velocity] = range_and_velocity(point, &evidence.radar);
        Some([range, -velocity])
    });
    Alternative {
        check: "doppler_sign",
        expected: "a receding body has a positive Doppler frequency",
        fit: flipped,
        place: "at the opposite velocities".into(),
        hint: "the Doppler axis runs the other way".into(),
    }
}
