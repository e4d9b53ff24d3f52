//! What the answer rests on numerically.

use super::Check;
use crate::diagnosis::evidence::Evidence;

/// What the answer rests on numerically.
pub(super) fn numerics(evidence: &Evidence) -> Vec<Check> {
    let mut checks = vec![Check::new("precision", "double precision", "all sums and transforms in double precision", true)];
    if let Some(body) = &evidence.body {
        let (points, area) = body.frames.iter().flatten().fold((0.0, 0.0), |(n, sum), point| (n + 1.0, sum + point.area_m2));
        let spacing = if points > 0.0 { f64::sqrt(area / points) } else { 0.0 };
        let bin = evidence.radar.range_resolution_m();
        checks.push(Check::new(
            "surface_sampling",
            format!("points of the body much closer than a range bin of {:.0} mm", 1e3 * bin),
            format!("{:.0} mm apart; only powers and delays are predicted from them, no carrier phases", 1e3 * spacing),
            points > 0.0 && spacing < 0.5 * bin,
        ));
    }
    checks
}
