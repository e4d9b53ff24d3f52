//! A body in another direction.

use num_complex::Complex64;

use super::Check;
use super::cells::{aligned, moving_cells};
use crate::diagnosis::evidence::Evidence;
use crate::paths::distance;

/// Sine of the direction by which a body must be aside before it is believed.
const ASIDE: f64 = 0.3;
/// How well the receivers' phases must then agree: receivers that differ by chance are in no such order.
const ALIGNED: f64 = 0.93;

/// Whether the receivers' phases in the body's cells come from where the motion puts the body.
pub(super) fn body_direction(evidence: &Evidence) -> Option<Check> {
    let receivers = evidence.cube.dims[2];
    let (body, radar) = (evidence.body.as_ref().filter(|_| receivers >= 3)?, &evidence.radar);
    let mut sums = vec![Complex64::ZERO; receivers];
    // Those of the first transmitter.
    let channels: Vec<usize> = (0..receivers).collect();
    moving_cells(evidence, body, &channels, |_, point, _, seen| {
        let path = |rx: usize| distance(point.position_m, radar.rx_position_m(rx));
        for (rx, sum) in sums.iter_mut().enumerate() {
            *sum += aligned(seen[rx], seen[0], path(rx) - path(0), radar);
        }
    });
    let phasors: Vec<Complex64> = sums.iter().filter(|sum| sum.norm() > 0.0).map(|sum| sum / sum.norm()).collect();
    if phasors.len() < receivers {
        return None;
    }
    // A shift of the direction's sine turns every receiver by its place across.
    let fit = |sine: f64| {
        let turned = |rx: usize| {
            let across = radar.rx_position_m(rx)[0] - radar.rx_position_m(0)[0];
            phasors[rx] * Complex64::cis(std::f64::consts::TAU * across * sine / radar.wavelength_m())
        };
        (0..receivers).map(turned).sum::<Complex64>().norm() / receivers as f64
    };
    let best = (-50..=50).map(|step| 0.02 * f64::from(step)).max_by(|a, b| fit(*a).total_cmp(&fit(*b)))?;
    let ok = best.abs() < ASIDE || fit(best) < ALIGNED || fit(0.0) > 0.75 * fit(best);
    let found = if ok {
        "array phases do not contradict it".into()
    } else {
        let side = if best > 0.0 { "right" } else { "left" };
        let degrees = best.abs().asin().to_degrees();
        format!(
            "array phases put it {degrees:.0}° farther to the {side}: the body is in the wrong place, or the receivers in another order"
        )
    };
    Some(Check::new("body_direction", "the body in the direction where the motion puts it", found, ok))
}
