//! Static echoes beyond the room.

use super::Check;
use crate::diagnosis::evidence::{Evidence, spectrum};

/// Static echoes beyond the farthest corner contradict the room, or the range axis.
pub(super) fn room_ranges(evidence: &Evidence) -> Option<Check> {
    let far = evidence.room.as_ref()?.farthest_m()?;
    let radar = &evidence.radar;
    if far > 0.8 * radar.max_range_m() {
        return None;
    }
    let samples = evidence.cube.dims[4];
    let bin_of = |range: f64| (range / radar.range_resolution_m()) as usize;
    let (mut inside, mut beyond) = (0.0f64, 0.0f64);
    for channel in 0..evidence.cube.channels() {
        let spectrum = spectrum(&evidence.clutter()[channel * samples..][..samples]);
        for (bin, value) in spectrum.iter().enumerate().take(evidence.range_bins()) {
            let range = bin as f64 * radar.range_resolution_m();
            if range > far + 0.6 && bin < bin_of(radar.max_range_m() * 0.9) {
                beyond = beyond.max(value.norm_sqr());
            } else if range > 0.6 && range <= far {
                inside = inside.max(value.norm_sqr());
            }
        }
    }
    let ratio = 10.0 * (beyond.max(1e-30) / inside.max(1e-30)).log10();
    let ok = ratio < -3.0;
    let hint = if ok { "" } else { ": the room's size contradicts the ranges" };
    Some(Check::new(
        "room",
        format!("static echoes end at the farthest corner, {far:.2} m"),
        format!("strongest echo beyond it {ratio:.1} dB against those inside{hint}"),
        ok,
    ))
}
