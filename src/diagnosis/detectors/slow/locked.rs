//! What one return, and not all of them, does alike in every frame: a function of the chirp's number in its frame, such as a leakage
//! that settles or an offset that creeps.
//!
//! A frame's chirps about their mean are transformed over the loop's number. Frames are independent draws, so that their scatter
//! shows what their mean may be by chance, movers included: of a complex normal law, `F |mean|² / scatter` of F frames exceeds x
//! with a probability of `(1 + x)^{−(F−1)}`, and logarithms of independent probabilities add (Fisher's method).

use hybridsim_fft::{FftDirection, FftPlanner};
use num_complex::Complex64;
use rayon::prelude::*;

use super::settling::{Decay, ENOUGH};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::mean_chirp;
use crate::diagnosis::detectors::filter::Filter;
use crate::diagnosis::evidence::{Evidence, HANN_LOBE, hann, spectrum, transform_under};
use crate::diagnosis::finding::{Candidate, Correction, Curve, Place};
use crate::diagnosis::statistics::{corrected, mean_power_tail, median};
use crate::effects::Stage;

/// Frames whose scatter says something.
const FEWEST_FRAMES: usize = 4;
/// p-value from which on a cell has it.
const SURE: f64 = 1e-3;
/// Power of a static return over the noise of its mean that says what all do.
const STRONG: f64 = 1e3;
/// Static returns at so many ranges say what all do; fewer may be the one that differs.
const FEWEST_RETURNS: usize = 3;

/// Of one channel over the training frames, `[harmonic − 1][bin]`, harmonics of the loop's number.
struct Channel {
    mean: Vec<Vec<Complex64>>,
    scatter: Vec<Vec<f64>>,
    clutter: Vec<Complex64>,
    noise: f64,
}

/// At most one candidate. None where somebody is tracked, of too few frames, loops or samples, or where the radar may move.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let training = evidence.split.training.len();
    // Blocks of a long frame are no frames.
    if evidence.body.is_some()
        || evidence.split.block_loops.is_some()
        || loops < 2
        || training < FEWEST_FRAMES
        || samples < 8
        || evidence.may_move()
    {
        return vec![];
    }
    let mut channels: Vec<Channel> =
        (0..evidence.cube.channels()).into_par_iter().map(|channel| of_channel(evidence, channel)).collect();
    let common = take_common(&mut channels, evidence.range_bins());
    strongest(evidence, &channels, common.as_deref()).into_iter().collect()
}

/// Harmonics over the loops of a frame's spectra, `[harmonic, bin]` with all bins of the transform.
fn harmonics(evidence: &Evidence, frame: usize, channel: usize) -> Vec<Complex64> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let slow = vec![(loops as f64).sqrt().recip(); loops];
    transform_under(evidence.cube.channel(frame, channel), &slow, &hann(samples))
}

/// Harmonics of a time that goes on evenly in a frame, about its middle.
fn ramp(loops: usize, loop_s: f64) -> Vec<Complex64> {
    let middle = 0.5 * (loops as f64 - 1.0);
    let scale = (loops as f64).sqrt().recip();
    let mut values: Vec<Complex64> = (0..loops).map(|index| Complex64::from((index as f64 - middle) * loop_s * scale)).collect();
    FftPlanner::new().plan_fft_forward(loops).process(&mut values);
    values
}

fn of_channel(evidence: &Evidence, channel: usize) -> Channel {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let bins = evidence.range_bins();
    let (training, starts) = (&evidence.split.training, &evidence.starts_s);
    let frames: Vec<Vec<Complex64>> = training.iter().map(|&frame| harmonics(evidence, frame, channel)).collect();
    let ramp = ramp(loops, evidence.radar.loop_period_s());
    let count = training.len();
    let root = (loops as f64).sqrt();
    // What goes on from frame to frame changes within a frame, too: that is no function of the loop's number.
    let slope = |i: usize, bin: usize| {
        let (before, after) = (i.saturating_sub(1), (i + 1).min(count - 1));
        let seconds = starts[training[after]] - starts[training[before]];
        (frames[after][bin] - frames[before][bin]) / (root * seconds)
    };
    let value = |i: usize, harmonic: usize, bin: usize| frames[i][harmonic * samples + bin] - slope(i, bin) * ramp[harmonic];
    let (mut mean, mut scatter) = (vec![], vec![]);
    for harmonic in 1..loops {
        let of_bin = |bin: usize| (0..count).map(|i| value(i, harmonic, bin)).sum::<Complex64>() / count as f64;
        let means: Vec<Complex64> = (0..bins).map(of_bin).collect();
        let of_bin = |bin: usize| (0..count).map(|i| (value(i, harmonic, bin) - means[bin]).norm_sqr()).sum::<f64>();
        // Where something was taken out there is not even noise.
        let least = (count as f64 - 1.0) * evidence.noise()[channel];
        scatter.push((0..bins).map(of_bin).map(|sum: f64| sum.max(least)).collect());
        mean.push(means);
    }
    let mut clutter: Vec<Complex64> =
        (0..bins).map(|bin| frames.iter().map(|frame| frame[bin]).sum::<Complex64>() / (root * count as f64)).collect();
    if let Some(subtracted) = &evidence.subtracted {
        let gone = spectrum(&subtracted[channel * samples..][..samples]);
        clutter.iter_mut().zip(gone).for_each(|(value, gone)| *value += gone);
    }
    let noise = evidence.noise()[channel] / (loops * count) as f64;
    Channel { mean, scatter, clutter, noise }
}

/// Takes what all static returns do alike out of the means: their deviation over themselves, by harmonic. None where too few say it.
fn take_common(channels: &mut [Channel], bins: usize) -> Option<Vec<Complex64>> {
    let strong: Vec<(usize, usize)> = (0..channels.len())
        .flat_map(|channel| (0..bins).map(move |bin| (channel, bin)))
        .filter(|&(channel, bin)| channels[channel].clutter[bin].norm_sqr() > STRONG * channels[channel].noise)
        .collect();
    let mut ranges: Vec<usize> = strong.iter().map(|place| place.1).collect();
    ranges.sort_unstable();
    ranges.dedup();
    let returns = 1 + ranges.windows(2).filter(|pair| pair[1] - pair[0] > HANN_LOBE).count();
    if ranges.is_empty() || returns < FEWEST_RETURNS {
        return None;
    }
    let of_harmonic = |harmonic: usize| {
        let ratios = strong.iter().map(|&(channel, bin)| channels[channel].mean[harmonic][bin] / channels[channel].clutter[bin]);
        let (mut real, mut imaginary): (Vec<f64>, Vec<f64>) = ratios.map(|ratio| (ratio.re, ratio.im)).unzip();
        Complex64::new(median(&mut real), median(&mut imaginary))
    };
    let common: Vec<Complex64> = (0..channels[0].mean.len()).map(of_harmonic).collect();
    for Channel { mean, clutter, .. } in channels {
        for (means, common) in mean.iter_mut().zip(&common) {
            means.iter_mut().zip(&*clutter).for_each(|(mean, clutter)| *mean -= common * clutter);
        }
    }
    Some(common)
}

/// Minus the logarithm of the chance of a cell's means, a sum over harmonics.
fn unlikely(channel: &Channel, bin: usize, frames: f64) -> f64 {
    let of = |(mean, scatter): (&Vec<Complex64>, &Vec<f64>)| {
        let ratio = frames * mean[bin].norm_sqr() / scatter[bin].max(f64::MIN_POSITIVE);
        (frames - 1.0) * ratio.ln_1p()
    };
    channel.mean.iter().zip(&channel.scatter).map(of).sum()
}

/// `common`: what all static returns do, over themselves.
fn strongest(evidence: &Evidence, channels: &[Channel], common: Option<&[Complex64]>) -> Option<Candidate> {
    let (bins, frames) = (evidence.range_bins(), evidence.split.training.len() as f64);
    let harmonics = channels[0].mean.len() as f64;
    let cells = (channels.len() * bins) as f64;
    let chance = |channel: usize, bin: usize| {
        corrected(mean_power_tail(unlikely(&channels[channel], bin, frames) / harmonics, harmonics), cells)
    };
    let touched = evidence.touched();
    let all = (0..channels.len()).flat_map(|channel| (0..bins).map(move |bin| (channel, bin)));
    let all = all.filter(|place| !touched[place.1]);
    let (channel, bin) =
        all.max_by(|&(a, i), &(b, j)| unlikely(&channels[a], i, frames).total_cmp(&unlikely(&channels[b], j, frames)))?;
    let p_value = chance(channel, bin);
    if p_value > SURE {
        return None;
    }
    let has: Vec<usize> = (0..channels.len()).filter(|&c| chance(c, bin) < SURE).collect();
    let gain: f64 = has.iter().map(|&c| held_out_gain(evidence, &channels[c], c, bin)).sum();
    let of_channel = |&c: &usize| (0..bins).filter(|&bin| chance(c, bin) < SURE).collect();
    let cells: Vec<Vec<usize>> = has.iter().map(of_channel).collect();
    let correction = correction(evidence, has.clone(), cells);
    let others = others(&channels[channel], bin, common);
    let candidate = candidate(evidence, &channels[channel], &has, bin, others, correction);
    Some(Candidate { p_value, nats: gain, ..candidate })
}

/// What is known of the other static returns, beside that which does more.
fn others(own: &Channel, bin: usize, common: Option<&[Complex64]>) -> &'static str {
    let Some(common) = common else { return "too few static returns say whether the others do" };
    let shared: f64 = common.iter().map(|value| (value * own.clutter[bin]).norm_sqr()).sum();
    let alone: f64 = own.mean.iter().map(|mean| mean[bin].norm_sqr()).sum();
    if shared > alone {
        "that is beside what all static returns do alike, which is more"
    } else {
        "the other static returns do not"
    }
}

/// Log-likelihood that held-out frames gain at a cell, by harmonic in the scatter of the training frames.
fn held_out_gain(evidence: &Evidence, own: &Channel, channel: usize, bin: usize) -> f64 {
    let (frames, samples) = (evidence.split.training.len() as f64, evidence.cube.dims[4]);
    let of_frame = |&frame: &usize| -> f64 {
        let values = harmonics(evidence, frame, channel);
        let better = |harmonic: usize| {
            let (value, mean) = (values[(harmonic + 1) * samples + bin], own.mean[harmonic][bin]);
            let variance = own.scatter[harmonic][bin] / (frames - 1.0);
            (value.norm_sqr() - (value - mean).norm_sqr()) / variance.max(f64::MIN_POSITIVE)
        };
        (0..own.mean.len()).map(better).sum()
    };
    evidence.split.held_out.iter().map(of_frame).sum()
}

/// A cell's mean over the loop's number, about its own mean.
fn pattern(channel: &Channel, bin: usize) -> Vec<Complex64> {
    let loops = channel.mean.len() + 1;
    let harmonics = std::iter::once(Complex64::ZERO).chain(channel.mean.iter().map(|mean| mean[bin]));
    let mut values: Vec<Complex64> = harmonics.map(|value| value / (loops as f64).sqrt()).collect();
    FftPlanner::new().plan_fft(loops, FftDirection::Inverse).process(&mut values);
    values
}

/// The length, in loops, of the decay that explains most of a pattern, and its share.
fn decay(pattern: &[Complex64]) -> (f64, f64) {
    let energy: f64 = pattern.iter().map(|value| value.norm_sqr()).sum();
    let share = |length: f64| {
        let fit = Decay::fit(pattern, length);
        fit.amplitude.norm_sqr() * fit.energy / energy
    };
    let lengths = Decay::lengths(pattern.len() as f64);
    lengths.map(|length| (length, share(length))).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((1.0, 0.0))
}

fn candidate(evidence: &Evidence, own: &Channel, has: &[usize], bin: usize, others: &str, correction: Correction) -> Candidate {
    let [frames, tx, rx, loops, samples] = evidence.cube.dims;
    let values = pattern(own, bin);
    let (length, share) = decay(&values);
    let settles = share > ENOUGH && length < loops as f64;
    let largest = values.iter().map(|value| value.norm()).fold(0.0, f64::max);
    // Beat frequencies below zero are what leaks over it.
    let signed = if !evidence.is_real() && 2 * bin > samples { bin as f64 - samples as f64 } else { bin as f64 };
    let bin_m = evidence.radar.range_resolution_m();
    let range = [signed - 1.0, signed + 1.0].map(|bin| bin.max(0.0) * bin_m);
    let mut receivers: Vec<usize> = has.iter().map(|channel| channel % rx).collect();
    let mut transmitters: Vec<usize> = has.iter().map(|channel| channel / rx).collect();
    for list in [&mut receivers, &mut transmitters] {
        list.sort_unstable();
        list.dedup();
    }
    let course = if settles {
        format!("settles within each frame: it decays in {length:.1} chirps")
    } else {
        "depends on the chirp's number in its frame".into()
    };
    // The window's sum, by which amplitudes of samples and of cells differ.
    let amplitude = largest / hann(samples).iter().sum::<f64>();
    let statement = format!(
        "The return at {:.2} m {course}, by up to {amplitude:.2} codes (or units of the recording), alike in all frames, in {} of {} \
         channels; {others}.",
        signed.max(0.0) * bin_m,
        has.len(),
        tx * rx,
    );
    let number: Vec<f64> = (0..loops).map(|index| index as f64).collect();
    let series = |name: &'static str, part: fn(&Complex64) -> f64| (name, number.clone(), values.iter().map(part).collect());
    let behaves_like = if settles { Behaviour::SlowTimeSettlingOfOneReturn } else { Behaviour::SlowTimePatternOfOneReturn };
    let place = Place {
        range_m: Some(range),
        tx: (transmitters.len() < tx).then_some(transmitters),
        rx: (receivers.len() < rx).then_some(receivers),
        ..Place::at(Stage::Receiver)
    };
    Candidate {
        statement,
        curve: Some(Curve::new(
            format!("Mean over the frames at {:.2} m", signed.max(0.0) * bin_m),
            ["chirp of the frame", "deviation, recording's unit"],
            [series("real part", |value| value.re), series("imaginary part", |value| value.im)],
        )),
        energy: values.iter().map(|value| value.norm_sqr()).sum::<f64>() * (frames * has.len()) as f64,
        correction,
        ..Candidate::new(behaves_like, place, 1.0, 0.0)
    }
}

/// Subtracts the training frames' mean deviation of every chirp of a frame from the frame's mean, at the cells of each channel and as
/// far around them as the window spreads.
fn correction(evidence: &Evidence, channels: Vec<usize>, cells: Vec<Vec<usize>>) -> Correction {
    let training = evidence.split.training.clone();
    let real = evidence.is_real();
    Correction::samples(move |cube| {
        let [_, _, _, loops, samples] = cube.dims;
        let near = |cells: &[usize], k: usize| {
            let away = |cell: usize| (k + samples - cell).rem_euclid(samples).min((cell + samples - k).rem_euclid(samples));
            cells.iter().any(|&cell| away(cell) <= HANN_LOBE || real && away((samples - cell) % samples) <= HANN_LOBE)
        };
        let patterns: Vec<Vec<Complex64>> = channels
            .iter()
            .zip(&cells)
            .map(|(&channel, cells)| {
                let mut mean = vec![Complex64::ZERO; loops * samples];
                for &frame in &training {
                    let values = cube.channel(frame, channel);
                    mean.iter_mut().zip(values).for_each(|(sum, value)| *sum += value / training.len() as f64);
                }
                let clutter = mean_chirp(mean.chunks_exact(samples), samples);
                for chirp in mean.chunks_exact_mut(samples) {
                    chirp.iter_mut().zip(&clutter).for_each(|(value, clutter)| *value -= clutter);
                }
                Filter::pass(samples, |k| near(cells, k)).apply(&mut mean);
                mean
            })
            .collect();
        cube.each_chirp(|[_, channel, index], chirp| {
            let Some(place) = channels.iter().position(|&own| own == channel) else { return };
            let pattern = &patterns[place][index * samples..][..samples];
            chirp.iter_mut().zip(pattern).for_each(|(value, pattern)| *value -= pattern);
        });
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::radar::Radar;

    /// Three static returns, of which the first has `own` of the frame and the loop, and all have `all` of the loop.
    fn evidence(seed: u64, own: impl Fn(usize, usize) -> Complex64, all: impl Fn(usize) -> f64) -> Evidence {
        let radar = Radar { samples_per_chirp: 64, loops_per_frame: 16, ..Radar::small(12) };
        Evidence::in_noise(radar, seed, |[frame, channel, index, n]| {
            let tone = |bin: f64, level: f64| Complex64::from_polar(level, TAU * bin * n as f64 / 64.0 + channel as f64 * bin);
            let leaks = if channel == 0 { own(frame, index) } else { Complex64::ZERO };
            (tone(2.0, 50.0) * (Complex64::ONE + leaks) + tone(11.0, 30.0) + tone(20.0, 20.0) + tone(27.0, 30.0))
                * (1.0 + all(index))
        })
    }

    fn settles(index: usize) -> f64 {
        0.2 * (-(index as f64) / 3.0).exp()
    }

    #[test]
    fn a_leakage_that_settles_is_found_in_its_channel_and_then_nothing() {
        let evidence = evidence(1, |_, index| settles(index).into(), |_| 0.0);
        let found = find(&evidence).pop().expect("a settling");
        assert_eq!((found.id, found.behaves_like), (None, Behaviour::SlowTimeSettlingOfOneReturn), "{found:?}");
        assert!(found.p_value < 1e-9 && found.nats > 20.0, "{found:?}");
        let bin_m = evidence.radar.range_resolution_m();
        let [low, high] = found.place.range_m.unwrap();
        assert!(low < 2.0 * bin_m && 2.0 * bin_m < high, "{low} to {high}");
        let left = find(&evidence.with(&found));
        assert!(left.iter().all(|left| left.p_value > 1e-3), "{left:?}");
    }

    #[test]
    fn what_is_beside_more_that_all_returns_do_is_not_said_to_be_alone() {
        let said = |all: fn(usize) -> f64| {
            let evidence = evidence(1, |_, index| (0.2 * settles(index)).into(), all);
            find(&evidence).pop().expect("a settling").statement
        };
        assert!(said(settles).contains("beside what all static returns do alike"), "{}", said(settles));
        assert!(said(|_| 0.0).contains("the other static returns do not"), "{}", said(|_| 0.0));
    }

    #[test]
    fn neither_what_all_returns_do_nor_what_goes_on_from_frame_to_frame_nor_a_mover_is_one() {
        for seed in 2..8 {
            let common = evidence(seed, |_, _| Complex64::ZERO, settles);
            let period_s = common.radar.frame_period_s;
            let time_s = |frame: usize, index: usize| frame as f64 * period_s + index as f64 * common.radar.loop_period_s();
            let drifts = evidence(seed, |frame, index| (0.3 * time_s(frame, index) / (12.0 * period_s)).into(), |_| 0.0);
            let moves = evidence(seed, |frame, index| Complex64::cis(TAU * 531.7 * time_s(frame, index)) * 0.3, |_| 0.0);
            let clutter = evidence(seed, |_, _| Complex64::ZERO, |_| 0.0);
            for (what, evidence) in [("common", &common), ("drifts", &drifts), ("moves", &moves), ("static", &clutter)] {
                let found = find(evidence);
                assert!(found.is_empty(), "{what}: {found:?}");
            }
        }
    }
}
