//! How finely the body is sampled.

use super::Check;
use crate::diagnosis::evidence::Evidence;

/// Whether the points that stand for the body's surface are closer to each other than the radar resolves; none without a body.
pub(super) fn surface_sampling(evidence: &Evidence) -> Option<Check> {
    let body = evidence.body.as_ref()?;
    let (points, area) = body.frames.iter().flatten().fold((0.0, 0.0), |(n, sum), point| (n + 1.0, sum + point.area_m2));
    let spacing = if points > 0.0 { f64::sqrt(area / points) } else { 0.0 };
    let bin = evidence.radar.range_resolution_m();
    Some(Check::new(
        "surface_sampling",
        format!("points of the body much closer than a range bin of {:.0} mm", 1e3 * bin),
        format!("{:.0} mm apart; only powers and delays are predicted from them, no carrier phases", 1e3 * spacing),
        points > 0.0 && spacing < 0.5 * bin,
    ))
}
