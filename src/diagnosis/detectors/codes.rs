//! A bit of one receiver's converter that is stuck, or far more often set than not.
//!
//! Bits far below the signal's deviation are set half of the time, whatever the signal is (Widrow's theorem of
//! quantisation). A bit that all channels share out unevenly belongs to the format of the codes and is no finding.

use num_complex::Complex64;

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::codes::{BITS, Component};
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction, Place};
use crate::diagnosis::statistics;
use crate::effects::Stage;

/// The signal's deviation in units of the bit's value from which on the bit must be fair.
const FAR_BELOW: f64 = 8.0;
/// Least deviation of a bit's share from one half that is detected.
const LEAST_BIAS: f64 = 0.05;
/// How much of that the same bit may deviate elsewhere.
const ELSEWHERE: f64 = 0.3;
/// And the same of a bit that never changes, though it is not far below the signal.
const ELSEWHERE_STUCK: f64 = 0.6;
/// Deviation of the codes in units of such a bit's value: a signal that large crosses it.
const CROSSED: f64 = 0.5;
/// Samples that lie so close to one another that their codes may be alike.
const ALIKE: usize = 4;

/// p-value below which a bit is passed on.
const PASSED_ON: f64 = 0.01;

/// A bit's share of ones in the training frames.
struct Share {
    share: f64,
    count: f64,
    /// How many codes stand for one independent one: static returns repeat from chirp to chirp.
    repeated: f64,
    /// Whether it must be fair, being far below the signal and the noise.
    fair: bool,
}

/// `noise`: standard deviation of a component's noise, which alone makes low bits fair.
fn share(component: &Component, bit: usize, noise: f64) -> Option<Share> {
    let counts = &component.counts[0];
    let [ones, count] = counts.total(bit);
    let value = f64::from(1u32 << bit);
    if count < 1000.0 || CROSSED * value > component.deviation {
        return None;
    }
    let fair = FAR_BELOW * value <= component.deviation && value <= noise;
    let share = ones / count;
    let samples = counts.all.len();
    // Without noise the same codes come again in every chirp, and their bits need not be fair.
    let of_sample = |sample: usize| (counts.ones[bit * samples + sample], counts.all[sample]);
    let repeats = (0..samples).map(of_sample).all(|(ones, all)| ones == 0 || ones == all);
    if fair && repeats && (0.001..0.999).contains(&share) {
        return None;
    }
    let blocks: Vec<[f64; 2]> = (0..samples / ALIKE)
        .map(|block| {
            let range = block * ALIKE..(block + 1) * ALIKE;
            let sum = |values: &[u32]| values[range.clone()].iter().map(|&v| f64::from(v)).sum::<f64>();
            [sum(&counts.ones[bit * samples..][..samples]), sum(&counts.all)]
        })
        .filter(|block| block[1] > 0.0)
        .collect();
    let variance = (share * (1.0 - share)).max(1e-3);
    let scatter: f64 = blocks.iter().map(|[ones, all]| (ones - share * all).powi(2) / (variance * all)).sum();
    Some(Share { share, count, repeated: (scatter / blocks.len().max(1) as f64).max(1.0), fair })
}

/// At most one candidate, the bit that gains most. None where samples are no whole codes or come from a single channel.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let Some(components) = &evidence.codes else { return vec![] };
    if evidence.accepted_unnamed.contains(&Behaviour::Quantisation) || evidence.cube.channels() < 2 {
        return vec![];
    }
    let tried = (components.len() * BITS) as f64;
    let noise = |component: &Component| (0.5 * evidence.noise()[component.channel]).sqrt();
    let mut found = vec![];
    for bit in 0..BITS {
        let shares: Vec<Option<Share>> = components.iter().map(|component| share(component, bit, noise(component))).collect();
        for (component, own) in components.iter().zip(&shares) {
            let Some(own) = own else { continue };
            let bias = (own.share - 0.5).abs();
            let others = || {
                components
                    .iter()
                    .zip(&shares)
                    .filter(|(other, _)| other.channel != component.channel)
                    .filter_map(|(_, s)| s.as_ref())
            };
            // A bit that is not far below the signal shows only by never changing at all.
            let elsewhere = match (own.fair, own.share) {
                (true, _) => ELSEWHERE,
                (false, 0.0 | 1.0) => ELSEWHERE_STUCK,
                _ => continue,
            };
            if bias < LEAST_BIAS || others().next().is_none() || others().any(|s| (s.share - 0.5).abs() > elsewhere * bias) {
                continue;
            }
            // A stuck bit does not show how far codes repeat; the other channels do.
            let repeated = others().map(|s| s.repeated).fold(own.repeated, f64::max);
            let z = 2.0 * bias * (own.count / repeated).sqrt();
            let p_value = statistics::corrected(statistics::normal_tails(z), tried);
            let [ones, all] = component.counts[1].total(bit);
            let expected = own.share.clamp(1.0 / (own.count + 2.0), 1.0 - 1.0 / (own.count + 2.0));
            let gain = (ones * (2.0 * expected).ln() + (all - ones) * (2.0 * (1.0 - expected)).ln()) / repeated;
            if p_value < PASSED_ON && gain > 0.0 {
                found.push(candidate(evidence, component, bit, own.share, p_value, gain));
            }
        }
    }
    found.sort_by(|a, b| b.nats.total_cmp(&a.nats));
    found.truncate(1);
    found
}

fn candidate(evidence: &Evidence, component: &Component, bit: usize, share: f64, p_value: f64, gain: f64) -> Candidate {
    let [frames, _, receivers, loops, samples] = evidence.cube.dims;
    let rx = component.channel % receivers;
    let value = f64::from(1u32 << bit);
    let stuck = component.channel;
    let offset = (share - 0.5) * value * if component.imaginary { Complex64::I } else { Complex64::ONE };
    let what = match share {
        s if s > 0.999 => "is always 1".to_string(),
        s if s < 0.001 => "is always 0".to_string(),
        s => format!("is 1 in {:.1} % of its codes", 100.0 * s),
    };
    let part = match (evidence.is_real(), component.imaginary) {
        (true, _) => "",
        (false, true) => " (imaginary component)",
        (false, false) => " (real component)",
    };
    let place = Place { rx: Some(vec![rx]), ..Place::at(Stage::Receiver) };
    Candidate {
        statement: format!(
            "Bit {bit} (value {value:.0}) of the converter of receiver {rx}{part} {what}, while in the other receivers the same bit \
             is 1 half of the time, as it must be so far below the signal: the bit is {}.",
            if (share - 0.5).abs() > 0.499 { "stuck" } else { "biased" }
        ),
        energy: (share - 0.5).abs() * value * value * (frames * loops * samples) as f64,
        // What the bit was is lost but for its mean: without it, the offset of a stuck bit is no offset of the receiver.
        correction: Correction::samples(move |cube| {
            cube.each_chirp(|[_, channel, _], chirp| {
                if channel == stuck {
                    chirp.iter_mut().for_each(|value| *value -= offset);
                }
            });
        }),
        ..Candidate::new(Behaviour::Quantisation, place, p_value.max(f64::MIN_POSITIVE), gain)
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::diagnosis::cube::Loaded;
    use crate::radar::Radar;
    use crate::support;

    /// A static tone in noise as codes, changed by channel.
    fn evidence(change: impl Fn(usize, i64) -> i64) -> Evidence {
        let mut radar = Radar::small(8);
        (radar.loops_per_frame, radar.samples_per_chirp) = (16, 64);
        let dims = radar.dims();
        let mut normal = support::normal(3);
        let block = 16 * 64;
        let samples = (0..dims.iter().product::<usize>())
            .map(|i| {
                let rx = i / block % dims[2];
                let tone = Complex64::from_polar(900.0, 1.3 * (i % 64) as f64 + rx as f64);
                let mut code = |value: f64| change(rx, (value + 20.0 * normal()).round() as i64) as f64;
                Complex64::new(code(tone.re), tone.im.round())
            })
            .collect();
        Evidence::new(Loaded::of_samples(radar, samples, [-2e3, 2e3]), None, None)
    }

    #[test]
    fn a_stuck_bit_is_detected_and_a_coarse_converter_is_not() {
        let found = find(&evidence(|rx, code| if rx == 1 { code | 8 } else { code }));
        assert!(found.len() == 1 && found[0].p_value < 1e-6 && found[0].nats > 20.0, "{found:?}");
        assert_eq!(found[0].place.rx, Some(vec![1]));
        assert!(found[0].statement.starts_with("Bit 3 "), "{}", found[0].statement);
        assert!(find(&evidence(|_, code| code)).is_empty());
        assert!(find(&evidence(|_, code| code & !7)).is_empty());
    }

    #[test]
    fn samples_that_are_no_codes_say_nothing() {
        let mut evidence = evidence(|rx, code| if rx == 1 { code | 8 } else { code });
        evidence.cube.samples.iter_mut().for_each(|v| *v *= 1.37);
        let loaded = Loaded {
            cube: evidence.cube.clone(),
            radar: evidence.radar.clone(),
            split: evidence.split.clone(),
            starts_s: evidence.starts_s.clone(),
            extremes: evidence.extremes,
        };
        // What was counted before a correction still stands.
        assert_eq!(find(&evidence.changed()).len(), 1);
        assert!(find(&Evidence::new(loaded, None, None)).is_empty());
    }
}
