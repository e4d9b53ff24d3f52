//! Channels that hold nothing, and ADC clipping.

use num_complex::Complex64;

use super::{Check, RETURN};
use crate::diagnosis::evidence::{Evidence, spectrum};
use crate::diagnosis::statistics::median;

/// A channel whose strongest return is weaker than the middle channel's by this much has no signal.
const NO_SIGNAL_DB: f64 = 20.0;

/// Power of a channel's strongest static return over the noise of its mean.
pub(super) fn strongest_clutter(evidence: &Evidence, channel: usize) -> f64 {
    let samples = evidence.cube.dims[4];
    let loops = (evidence.cube.dims[3] * evidence.split.training.len()) as f64;
    let variance = evidence.noise()[channel].max(f64::MIN_POSITIVE);
    let spectrum = spectrum(&evidence.clutter()[channel * samples..][..samples]);
    spectrum.into_iter().map(|value| value.norm_sqr() * loops / variance).fold(0.0, f64::max)
}

pub(super) fn channels(evidence: &Evidence) -> Vec<Check> {
    let [frames, _, rx, ..] = evidence.cube.dims;
    let name = |channel: usize| format!("tx {} rx {}", channel / rx, channel % rx);
    let is_constant = |values: &[Complex64], part: fn(&Complex64) -> f64| values.iter().all(|v| part(v) == part(&values[0]));
    let mut bad: Vec<String> = vec![];
    for channel in 0..evidence.cube.channels() {
        let of_frame = |frame: usize| evidence.cube.channel(frame, channel);
        let both = |frame: &usize| is_constant(of_frame(*frame), |v| v.re) && is_constant(of_frame(*frame), |v| v.im);
        let dead: Vec<usize> = (0..frames).filter(both).collect();
        if dead.len() == frames {
            bad.push(format!("{} is constant", name(channel)));
        } else if let (Some(first), Some(last)) = (dead.first(), dead.last()) {
            let frames = if dead.len() == 1 { "frame".into() } else { format!("{} frames from", dead.len()) };
            let until = if dead.len() == 1 { String::new() } else { format!(" to {last}") };
            bad.push(format!("{} is constant in {frames} {first}{until}", name(channel)));
        } else if !evidence.is_real() {
            for (what, part) in [("I", (|v| v.re) as fn(&Complex64) -> f64), ("Q", |v| v.im)] {
                if (0..frames).all(|frame| is_constant(of_frame(frame), part)) {
                    bad.push(format!("{what} of {} is constant", name(channel)));
                }
            }
        }
    }
    if bad.is_empty() {
        let returns: Vec<f64> = (0..evidence.cube.channels()).map(|channel| strongest_clutter(evidence, channel)).collect();
        let middle = median(&mut returns.clone());
        let no_signal = |&channel: &usize| {
            returns[channel] < RETURN && 10.0 * (middle / returns[channel].max(f64::MIN_POSITIVE)).log10() > NO_SIGNAL_DB
        };
        bad.extend((0..returns.len()).filter(no_signal).map(|channel| format!("{} holds nothing but noise", name(channel))));
    }
    let found = if bad.is_empty() { "all channels vary".into() } else { bad.join(", ") };
    vec![Check::new("channels", "no channel is constant, missing or without signal", found, bad.is_empty())]
}

/// Share of the sampled components that lie at the recording's extremes.
pub(super) fn clipped_share(evidence: &Evidence) -> f64 {
    let [low, high] = evidence.extremes;
    // Half a code, or a hair of the range for samples that are no codes.
    let tolerance = if evidence.codes.is_some() { 0.5 } else { 1e-6 * (high - low) };
    let at = |value: f64, level: f64| (value - level).abs() <= tolerance;
    // Of a receiver without quadrature, the imaginary part was never sampled.
    let sampled = if evidence.is_real() { 1 } else { 2 };
    let parts = evidence.cube.samples.iter().flat_map(|value| [value.re, value.im].into_iter().take(sampled));
    let (mut count, mut all) = (0usize, 0usize);
    for part in parts {
        all += 1;
        count += usize::from(at(part, low) || at(part, high));
    }
    count as f64 / all.max(1) as f64
}

/// Samples that pile up at the ADC's clipping level.
pub(super) fn clipping(evidence: &Evidence) -> Check {
    let [low, high] = evidence.extremes;
    let share = clipped_share(evidence);
    // The extremes of a recording without clipping are reached once or twice.
    let ok = share < 1e-4;
    Check::new(
        "converter_range",
        "the extreme codes are rare",
        format!("{:.4} % of the samples lie on {low} or {high}", 100.0 * share),
        ok,
    )
}
