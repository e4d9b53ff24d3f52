//! How far a platform moves, where most ranges show that it does.

use num_complex::Complex64;

use super::cells::{Cells, Vibration};
use crate::diagnosis::detectors::slow::field::{PATTERN, ahead};
use crate::diagnosis::evidence::Evidence;

/// Bins whose deviations are judged together.
const GROUP_BINS: usize = 4;
/// Groups that must be able to contradict, and the share of them that must agree.
const LEAST_GROUPS: usize = 5;
const AGREEING: f64 = 0.75;
/// Share of what a group is expected to show, from which on it agrees: the pattern over directions is not known.
const SHOWN: f64 = 0.15;
/// A deviation of the returns' amplitudes only is a gain.
const GAIN_LIKE: f64 = 0.7;
/// A phase beyond that is no small deviation (rad).
const LARGEST: f64 = 1.5;

/// Of the phase along the boresight (rad), with its sign, and its deviation; none where the ranges do not share it.
pub fn amplitude(evidence: &Evidence, cells: &Cells, vibration: &Vibration) -> Option<(f64, f64)> {
    let bin_m = evidence.radar.range_resolution_m();
    let (mut groups, mut along, mut of_clutter, mut of_pattern) = (vec![], Complex64::ZERO, 0.0, 0.0);
    let [channels, bins] = cells.clutter.shape();
    for start in (0..bins).step_by(GROUP_BINS) {
        let lever = ahead(evidence.room.as_ref(), (start as f64 + 0.5 * GROUP_BINS as f64) * bin_m).powi(2);
        let (mut shown, mut wanted, mut noise) = (0.0, 0.0, 0.0);
        let group = start..(start + GROUP_BINS).min(bins);
        for cell in (0..channels).flat_map(|channel| group.clone().map(move |bin| [channel, bin])) {
            let Some((pattern, information)) = vibration.pattern[cell] else { continue };
            let clutter = cells.clutter[cell];
            shown += pattern.norm_sqr() - 1.0 / information;
            noise += 1.0 / information;
            wanted += lever * clutter.norm_sqr();
            along += clutter.conj() * pattern;
            of_clutter += clutter.norm_sqr();
            of_pattern += pattern.norm_sqr();
        }
        if wanted > 0.0 {
            groups.push((shown, wanted, noise));
        }
    }
    let ratio = |groups: &[(f64, f64, f64)]| {
        let (shown, wanted) = groups.iter().fold((0.0, 0.0), |sum, group| (sum.0 + group.0, sum.1 + group.1));
        shown / f64::max(wanted, f64::MIN_POSITIVE)
    };
    let square = ratio(&groups);
    if square <= 0.0 || along.re.abs() > GAIN_LIKE * (of_clutter * of_pattern).sqrt() {
        return None;
    }
    let informative: Vec<&(f64, f64, f64)> = groups.iter().filter(|(_, wanted, noise)| square * wanted > 10.0 * noise).collect();
    let agree = informative.iter().filter(|(shown, wanted, _)| *shown > SHOWN * square * wanted).count();
    if informative.len() < LEAST_GROUPS || (agree as f64) < AGREEING * informative.len() as f64 {
        return None;
    }
    // Deviation of the ratio: leave one group out.
    let n = groups.len() as f64;
    let without = (0..groups.len()).map(|out| {
        let kept: Vec<_> = groups.iter().enumerate().filter(|(at, _)| *at != out).map(|(_, group)| *group).collect();
        (ratio(&kept).max(0.0).sqrt() - square.sqrt()).powi(2)
    });
    let deviation = ((n - 1.0) / n * without.sum::<f64>()).sqrt();
    // 2 J₁(φ) / J₀(φ) = φ + φ³/8 + …
    let measured = square.sqrt();
    let phase = (0..20).fold(measured, |phase, _| measured - phase.powi(3) / 8.0);
    // The pattern is i times the static return where that comes from ahead.
    (phase < LARGEST && phase > 0.0).then(|| (phase.copysign(along.im), deviation.hypot(PATTERN * phase)))
}
