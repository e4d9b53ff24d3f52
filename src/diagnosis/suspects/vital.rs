//! Breathing and heartbeat of somebody nobody tracked: a return whose phase swings from frame to frame.
//!
//! PHYSICS cards T1 and T2. At some range the echo is `c + a exp(jψ(T))`: what stands still there, and what moves by
//! more or less than a wavelength, ψ = 4π/λ times its displacement. c and a of all channels and of neighbouring ranges
//! and the common ψ are fitted in turns; ψ is then searched for a rhythm.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rustfft::FftPlanner;

use super::region::{Region, remove};
use crate::diagnosis::cube::mean_chirp;
use crate::diagnosis::evidence::{Evidence, hann};
use crate::diagnosis::finding::{Candidate, Correction, Curve, Estimate, Place};
use crate::diagnosis::statistics;

/// Rates of breathing and of a heart, Hz.
const BREATHING_HZ: [f64; 2] = [0.1, 0.7];
const HEART_HZ: [f64; 2] = [0.8, 2.2];
/// Displacements of a chest in a breath and in a heartbeat, m.
const LARGEST_BREATH_M: f64 = 0.03;
const LARGEST_HEARTBEAT_M: f64 = 0.8e-3;
/// A rhythm needs so many periods.
const FEWEST_PERIODS: f64 = 2.5;
const FEWEST_FRAMES: usize = 24;
/// Nearer ranges belong to leakage and offsets.
const NEAREST_BIN: usize = 3;
/// Ranges on each side that may belong to the same reflector.
const NEIGHBOURS: usize = 1;
/// Share of the phase's variance that a rhythm must hold.
const RHYTHMIC: f64 = 0.5;

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    // Of a tracked body the phase is known to millimetres only, which is more than a breath.
    if evidence.body.is_some() || evidence.cube.dims[0] < FEWEST_FRAMES || evidence.split.block_loops.is_some() {
        return vec![];
    }
    if evidence.accepted.iter().any(|id| ["breathing", "heartbeat"].contains(id)) {
        return vec![];
    }
    one(evidence).into_iter().collect()
}

/// The frames' means after a Hann window and the transform to ranges.
struct Frames {
    /// `[frame][channel · bins + bin]`
    values: Vec<Vec<Complex64>>,
    /// Of a value, by channel.
    noise: Vec<f64>,
    bins: usize,
}

fn frames(evidence: &Evidence) -> Frames {
    let [count, _, _, loops, samples] = evidence.cube.dims;
    let (channels, bins) = (evidence.cube.channels(), evidence.range_bins());
    let window = hann(samples);
    let fft = FftPlanner::new().plan_fft_forward(samples);
    let values = (0..count)
        .map(|frame| {
            (0..channels)
                .flat_map(|channel| {
                    let mut sum = mean_chirp(evidence.cube.channel(frame, channel).chunks_exact(samples), samples);
                    sum.iter_mut().zip(&window).for_each(|(s, w)| *s *= w);
                    fft.process(&mut sum);
                    sum.truncate(bins);
                    sum
                })
                .collect()
        })
        .collect();
    Frames { values, noise: evidence.noise().iter().map(|v| v / loops as f64).collect(), bins }
}

/// Reflector whose echo is `c + a exp(jψ)` in some cells.
struct Reflector {
    cells: Vec<usize>,
    still: Vec<Complex64>,
    amplitude: Vec<Complex64>,
    /// `[frame]`, unwrapped.
    phase: Vec<f64>,
    /// Of what is left in each cell, over the training frames.
    variance: Vec<f64>,
}

fn one(evidence: &Evidence) -> Option<Candidate> {
    let data = frames(evidence);
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let channels = evidence.cube.channels();
    let bins = data.bins;
    let mean: Vec<Complex64> = (0..channels * bins)
        .map(|i| training.iter().map(|&f| data.values[f][i]).sum::<Complex64>() / training.len() as f64)
        .collect();
    // Power of what changes over the noise, by range.
    let change: Vec<f64> = (0..bins)
        .map(|bin| {
            let sum: f64 = (0..channels)
                .map(|c| {
                    let i = c * bins + bin;
                    training.iter().map(|&f| (data.values[f][i] - mean[i]).norm_sqr()).sum::<f64>() / data.noise[c]
                })
                .sum();
            sum / (channels * (training.len() - 1)) as f64
        })
        .collect();
    let strongest = (NEAREST_BIN..bins.saturating_sub(1)).max_by(|&a, &b| change[a].total_cmp(&change[b]))?;
    if change[strongest] < 10.0 {
        return None;
    }
    let near = strongest.saturating_sub(NEIGHBOURS + 1)..(strongest + NEIGHBOURS + 2).min(bins);
    // A neighbour may be the cleaner circle: where other parts of the body are not at the same range.
    let fits: Vec<Reflector> =
        near.filter(|&bin| change[bin] > 10.0).filter_map(|bin| reflector(&data, &mean, bin, training)).collect();
    let share = |r: &Reflector| {
        let left: f64 = r.variance.iter().sum();
        r.amplitude.iter().map(|a| a.norm_sqr()).sum::<f64>() / left
    };
    let best = fits.into_iter().max_by(|a, b| share(a).total_cmp(&share(b)))?;
    let times: Vec<f64> = evidence.starts_s.clone();
    let rhythm = rhythm(&times, &best.phase, training, held_out);
    let metres = evidence.radar.wavelength_m() / (4.0 * PI);
    let named = rhythm.as_ref().filter(|r| r.share > RHYTHMIC && r.p_value < 1e-3).and_then(|r| {
        let (rate, amplitude_m) = (r.frequency_hz, r.amplitude * metres);
        if (BREATHING_HZ[0]..=BREATHING_HZ[1]).contains(&rate) && amplitude_m < LARGEST_BREATH_M {
            Some(("breathing", r))
        } else if (HEART_HZ[0]..=HEART_HZ[1]).contains(&rate) && amplitude_m < LARGEST_HEARTBEAT_M {
            Some(("heartbeat", r))
        } else {
            None
        }
    });
    // A held-out frame lies between two training frames; its phase is between theirs.
    let gain: f64 = held_out
        .iter()
        .map(|&f| {
            let before = training.iter().rev().find(|&&t| t < f);
            let after = training.iter().find(|&&t| t > f);
            let (Some(&b), Some(&a)) = (before, after) else { return 0.0 };
            let share = (times[f] - times[b]) / (times[a] - times[b]);
            let turned = Complex64::cis(best.phase[b] + share * (best.phase[a] - best.phase[b]));
            best.cells
                .iter()
                .enumerate()
                .map(|(i, &cell)| {
                    let value = data.values[f][cell];
                    let left = value - best.still[i] - best.amplitude[i] * turned;
                    ((value - mean[cell]).norm_sqr() - left.norm_sqr()) / best.variance[i]
                })
                .sum::<f64>()
        })
        .sum();
    if gain <= 3.0 {
        return None;
    }
    let reach = |mut bin: usize, step: isize| {
        while change[bin] > 2.0 && bin > NEAREST_BIN && bin + 1 < bins {
            bin = bin.wrapping_add_signed(step);
        }
        bin
    };
    let ends = [reach(strongest, -1), reach(strongest, 1)];
    let bin_m = evidence.radar.range_resolution_m();
    let range_m = strongest as f64 * bin_m;
    let displacement: Vec<f64> = best.phase.iter().map(|p| 1e3 * p * metres).collect();
    let swing = displacement.iter().fold([f64::MAX, f64::MIN], |[low, high], &d| [low.min(d), high.max(d)]);
    let statement = match named {
        Some((id, r)) => format!(
            "At {range_m:.2} m something moves to and fro {:.1} times a minute ({:.3} Hz) by {:.2} mm (amplitude of the \
             fundamental); {:.0} % of its motion has this rhythm, as {} has.",
            60.0 * r.frequency_hz,
            r.frequency_hz,
            1e3 * r.amplitude * metres,
            100.0 * r.share,
            if id == "breathing" { "a breathing chest" } else { "a beating heart" }
        ),
        None => format!(
            "At {range_m:.2} m something moves slowly, over {:.1} mm during the recording, without a rhythm that would show \
             within its length.",
            swing[1] - swing[0]
        ),
    };
    // Of the change alone; the rhythm has its own.
    let changed = statistics::corrected(
        statistics::mean_power_tail(change[strongest], (channels * (training.len() - 1)) as f64),
        bins as f64,
    );
    let region = Region { range: [ends[0].saturating_sub(1) as f64, (ends[1] + 1) as f64], doppler: [-1.0, 1.0] };
    let training = training.clone();
    let energy: f64 = change.iter().map(|c| (c - 1.0).max(0.0)).sum::<f64>()
        * data.noise.iter().sum::<f64>()
        * (evidence.cube.dims[0] * evidence.cube.dims[3]) as f64;
    Some(Candidate {
        id: named.map(|n| n.0),
        behaves_like: super::paths::PATH_LIKE,
        estimates: named.map_or(vec![], |(_, r)| {
            vec![
                Estimate::normal("rate_hz", r.frequency_hz, r.frequency_deviation_hz),
                Estimate::normal("amplitude_m", r.amplitude * metres, r.amplitude_deviation * metres),
            ]
        }),
        choice: None,
        place: Place {
            range_m: Some([ends[0] as f64 * bin_m, ends[1] as f64 * bin_m]),
            ..Place::at(if named.is_some() { "body" } else { "scene" })
        },
        p_value: named.map_or(changed, |(_, r)| statistics::corrected(r.p_value, 4.0)),
        gain,
        errs_alike: true,
        // A curtain in the wind does the same; so does whatever swings there.
        look_alikes: if named.is_some() { vec!["moving_reflector"] } else { vec![] },
        statement,
        curve: Some(Curve {
            title: format!("Displacement at {range_m:.2} m"),
            x_label: "time, s".into(),
            y_label: "displacement, mm".into(),
            series: vec![("measured".into(), times, displacement)],
        }),
        energy,
        correction: Correction::Samples(Arc::new(move |cube| remove(cube, &training, 1, region))),
    })
}

/// Alternates between the phase of every frame and the cells' constants.
fn reflector(data: &Frames, mean: &[Complex64], bin: usize, training: &[usize]) -> Option<Reflector> {
    let channels = data.noise.len();
    let cells: Vec<usize> = (0..channels).map(|c| c * data.bins + bin).collect();
    let weight: Vec<f64> = data.noise.iter().map(|v| 1.0 / v).collect();
    let mut still: Vec<Complex64> = cells.iter().map(|&cell| centre(data, mean, cell, training)).collect();
    // First amplitudes: relative phases of the channels about their centres.
    let reference = cells[0];
    let mut amplitude: Vec<Complex64> = cells
        .iter()
        .enumerate()
        .map(|(i, &cell)| {
            let product: Complex64 =
                training.iter().map(|&f| (data.values[f][cell] - still[i]) * (data.values[f][reference] - still[0]).conj()).sum();
            let power: f64 = training.iter().map(|&f| (data.values[f][reference] - still[0]).norm_sqr()).sum();
            product / power.max(f64::MIN_POSITIVE)
        })
        .collect();
    let mut turned = vec![Complex64::ONE; data.values.len()];
    for _ in 0..20 {
        for (frame, turn) in turned.iter_mut().enumerate() {
            let sum: Complex64 = cells
                .iter()
                .enumerate()
                .map(|(i, &cell)| amplitude[i].conj() * (data.values[frame][cell] - still[i]) * weight[i])
                .sum();
            if sum.norm() > 0.0 {
                *turn = sum / sum.norm();
            }
        }
        let count = training.len() as f64;
        let centre = training.iter().map(|&f| turned[f]).sum::<Complex64>() / count;
        let spread = 1.0 - centre.norm_sqr();
        if spread < 1e-6 {
            return None;
        }
        for (i, &cell) in cells.iter().enumerate() {
            let product = training.iter().map(|&f| data.values[f][cell] * (turned[f] - centre).conj()).sum::<Complex64>() / count;
            amplitude[i] = product / spread;
            still[i] = mean[cell] - amplitude[i] * centre;
        }
    }
    let variance = cells
        .iter()
        .enumerate()
        .map(|(i, &cell)| {
            let left: f64 =
                training.iter().map(|&f| (data.values[f][cell] - still[i] - amplitude[i] * turned[f]).norm_sqr()).sum();
            (left / training.len() as f64).max(data.noise[i])
        })
        .collect();
    let mut phase: Vec<f64> = turned.iter().map(|t| t.arg()).collect();
    for frame in 1..phase.len() {
        let jump = phase[frame] - phase[frame - 1];
        phase[frame] -= TAU * (jump / TAU).round();
    }
    Some(Reflector { cells, still, amplitude, phase, variance })
}

/// Centre of the circle through a cell's values (Kåsa's least squares).
fn centre(data: &Frames, mean: &[Complex64], cell: usize, training: &[usize]) -> Complex64 {
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    let mut right = nalgebra::Vector3::<f64>::zeros();
    for &frame in training {
        let value = data.values[frame][cell] - mean[cell];
        let row = nalgebra::Vector3::new(value.re, value.im, 1.0);
        normal += row * row.transpose();
        right += row * value.norm_sqr();
    }
    normal.lu().solve(&right).map_or(mean[cell], |s| mean[cell] + 0.5 * Complex64::new(s[0], s[1]))
}

/// A rhythm in a phase.
struct Rhythm {
    frequency_hz: f64,
    frequency_deviation_hz: f64,
    amplitude: f64,
    amplitude_deviation: f64,
    /// Of the variance about a straight line that it explains.
    share: f64,
    p_value: f64,
}

fn rhythm(times: &[f64], phase: &[f64], training: &[usize], held_out: &[usize]) -> Option<Rhythm> {
    let duration = times[times.len() - 1] - times[0];
    let interval = duration / (times.len() - 1) as f64;
    let frames: Vec<usize> = {
        let mut all = [training, held_out].concat();
        all.sort_unstable();
        all
    };
    let lowest = (FEWEST_PERIODS / duration).max(0.5 * BREATHING_HZ[0]);
    let highest = HEART_HZ[1].min(0.4 / interval);
    // A straight line is the body's slow sway.
    let fit = |frequency: Option<f64>| -> (f64, f64, Vec<f64>) {
        let size = if frequency.is_some() { 4 } else { 2 };
        let mut normal = DMatrix::<f64>::zeros(size, size);
        let mut right = DVector::<f64>::zeros(size);
        let row = |t: f64| {
            let mut row = vec![1.0, (t - times[0]) / duration - 0.5];
            if let Some(f) = frequency {
                let (s, c) = (TAU * f * t).sin_cos();
                row.extend([c, s]);
            }
            DVector::from_vec(row)
        };
        for &f in &frames {
            let row = row(times[f]);
            right += &row * phase[f];
            normal += &row * row.transpose();
        }
        let found = normal.cholesky().map_or_else(|| DVector::zeros(size), |c| c.solve(&right));
        let left: Vec<f64> = frames.iter().map(|&f| phase[f] - found.dot(&row(times[f]))).collect();
        let misfit = left.iter().map(|l| l * l).sum();
        (misfit, if size == 4 { found[2].hypot(found[3]) } else { 0.0 }, left)
    };
    let step = 0.1 / duration;
    let steps = ((highest - lowest) / step).floor();
    if steps < 2.0 {
        return None;
    }
    let total = fit(None).0;
    let best =
        (0..=steps as usize).map(|i| lowest + i as f64 * step).min_by(|a, b| fit(Some(*a)).0.total_cmp(&fit(Some(*b)).0))?;
    let mut frequency_hz = best;
    let mut width = 0.5 * step;
    while width > 1e-3 * step {
        let misfit = |f: f64| fit(Some(f)).0;
        if misfit(frequency_hz + width) < misfit(frequency_hz) {
            frequency_hz += width;
        } else if misfit(frequency_hz - width) < misfit(frequency_hz) {
            frequency_hz -= width;
        } else {
            width *= 0.5;
        }
    }
    let (misfit, amplitude, left) = fit(Some(frequency_hz));
    let share = 1.0 - misfit / total.max(f64::MIN_POSITIVE);
    // The rest of the motion is slow as well: what counts is how far the line stands out of the frequencies around it,
    // its harmonics left out.
    let reach = if frequency_hz < HEART_HZ[0] { [0.0, HEART_HZ[0]] } else { [frequency_hz - 0.5, frequency_hz + 0.5] };
    let mut around = vec![];
    for k in 1..(0.5 * duration / interval) as usize {
        let f = k as f64 / duration;
        let harmonic = (f / frequency_hz).round().max(1.0) * frequency_hz;
        if f >= reach[0] && f <= reach[1] && (f - harmonic).abs() > 1.0 / duration {
            let sum: Complex64 = left.iter().zip(&frames).map(|(l, &i)| l * Complex64::cis(-TAU * f * times[i])).sum();
            around.push((2.0 * sum.norm() / left.len() as f64).powi(2));
        }
    }
    if around.len() < 3 {
        return None;
    }
    let count = around.len() as f64;
    let background = (around.iter().sum::<f64>() / count).max(1e-12);
    let p = (1.0 + amplitude * amplitude / background / count).powf(-count);
    let deviation = (0.5 * background).sqrt();
    Some(Rhythm {
        frequency_hz,
        // Of a sinusoid in noise of that density, twice the variance because no body keeps time exactly.
        frequency_deviation_hz: deviation / amplitude.max(1e-9) * 12.0f64.sqrt() / (PI * duration),
        amplitude,
        amplitude_deviation: deviation,
        share,
        p_value: statistics::corrected(p, (highest - lowest) * duration),
    })
}
