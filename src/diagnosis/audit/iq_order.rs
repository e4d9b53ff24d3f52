//! I and Q exchanged.

use num_complex::Complex64;

use super::{CLEARLY_DB, Check};
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::support::Support;

/// Static echoes lie at the room's delays; with I and Q swapped their mirror images do. Nothing can be said of an
/// unknown room: its far returns may fill the upper half of the spectrum.
pub(super) fn iq_order(evidence: &Evidence) -> Check {
    let expected = "static echoes at the beat frequencies of the room's ranges";
    if evidence.room.is_none() {
        return Check::new("iq_order", expected, "cannot be told without the room's size", true);
    }
    let support = Support::new(&evidence.radar, evidence.room.as_ref());
    let outside = |chirp: &[Complex64]| -> f64 {
        support.project(chirp).iter().zip(chirp).map(|(inside, value)| (value - inside).norm_sqr()).sum()
    };
    let samples = evidence.cube.dims[4];
    let (mut as_is, mut swapped) = (0.0, 0.0);
    for chirp in evidence.still().chunks_exact(samples) {
        as_is += outside(chirp);
        swapped += outside(&chirp.iter().map(Complex64::conj).collect::<Vec<_>>());
    }
    let db = 10.0 * (as_is.max(1e-30) / swapped.max(1e-30)).log10();
    let ok = db < CLEARLY_DB;
    let hint = if ok { "" } else { ": I and Q are swapped, or the samples conjugated" };
    Check::new("iq_order", expected, format!("{db:+.1} dB left outside them, against the conjugated samples{hint}"), ok)
}
