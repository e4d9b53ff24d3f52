//! Sinusoids over slow time: a coherent periodogram over all frames, of frames that are apart.

use num_complex::Complex64;
use rayon::prelude::*;
use rustfft::FftPlanner;

use super::field::{Field, Series};
use crate::diagnosis::suspects::climb::climb;

/// A sinusoid `a cos + b sin` of 2π f T, with its harmonics.
#[derive(Clone, Debug)]
pub struct Line {
    pub frequency_hz: f64,
    /// Of the fundamental and of its harmonics, the cosine's and the sine's amplitude each.
    pub amplitudes: Vec<[f64; 2]>,
    /// What makes its mean over the training frames zero.
    pub constant: f64,
    /// Log-likelihood that the training frames gain, nats.
    pub training_gain: f64,
    pub held_out_gain: f64,
    /// Independent frequencies that were looked at.
    pub tried: f64,
    pub frequency_deviation_hz: f64,
    pub amplitude_deviation: f64,
    /// Of the spectra at its frequency, over the noise, where it is more than that: the held-out gain counts it.
    pub background: f64,
    /// Degrees of freedom of the background that the gains are in units of; none where it is the noise's, which is known.
    pub freedom: Option<f64>,
}

/// Harmonics that may be needed to describe what is periodic.
const HARMONICS: usize = 4;
/// A harmonic that gains less (nats) is left out.
const HARMONIC_GAIN: f64 = 10.0;
/// Aliases that explain only so much less (nats) cannot be told apart.
const ALIAS_GAIN: f64 = 4.6;
/// A background above this many times the noise is more than noise.
pub const LOUD: f64 = 1.5;
/// Degrees of freedom that the noise's law is worth beside what frames show of it: of 155 strongest lines of recordings without anything
/// missing, those slower than a frame gained as little as faster ones wherever the other frames scattered as the noise does.
const KNOWN: f64 = 20.0;
/// What moves besides is not white: it shifts a line by such a share of a resolution cell.
const COLOURED: f64 = 0.02;
/// Points per resolution cell of a frame's own spectrum.
const PADDING: usize = 16;

/// A gain over a background of so many degrees of freedom, as Student's law has it.
pub fn unsure(gain: f64, freedom: f64) -> f64 {
    if gain > 0.0 { 0.5 * freedom * (2.0 * gain / freedom).ln_1p() } else { gain }
}

impl Line {
    pub fn value(&self, time_s: f64) -> f64 {
        self.amplitudes.iter().enumerate().fold(self.constant, |sum, (harmonic, [cosine, sine])| {
            let (s, c) = (std::f64::consts::TAU * self.frequency_hz * (harmonic + 1) as f64 * time_s).sin_cos();
            sum + cosine * c + sine * s
        })
    }

    /// Of the fundamental.
    pub fn amplitude(&self) -> f64 {
        self.amplitudes[0][0].hypot(self.amplitudes[0][1])
    }
}

/// The strongest line of a series, fitted to the training frames; of `largest` amplitude at most.
pub fn strongest(field: &Field, series: &Series, training: &[usize], held_out: &[usize], largest: f64) -> Option<Line> {
    let frames: Vec<usize> = training.iter().copied().filter(|&f| series.weight[f] > 0.0).collect();
    if frames.len() < 3 {
        return None;
    }
    let loops = field.loops;
    let loop_s = field.times_s[1] - field.times_s[0];
    let duration_s = field.times_s[frames[frames.len() - 1] * loops + loops - 1] - field.times_s[frames[0] * loops];
    // What is slower than the recording is a drift.
    let lowest = 1.5 / duration_s;
    let highest = 0.5 / loop_s;
    let step = 0.25 / duration_s;
    let count = ((highest - lowest) / step).floor() as usize;
    if count < 2 {
        return None;
    }
    let spectra = frame_spectra(field, series, &frames);
    let padded = (loops * PADDING).next_power_of_two();
    let total: f64 = frames.iter().map(|&f| series.weight[f] * loops as f64).sum();
    let mean = frames.iter().zip(&spectra).map(|(_, spectrum)| spectrum[0].re).sum::<f64>() / total;
    let middles: Vec<f64> =
        frames.iter().map(|f| 0.5 * (field.times_s[f * loops] + field.times_s[f * loops + loops - 1])).collect();
    let period = field.times_s[loops] - field.times_s[0];
    // With a free constant: frames may see the same part of every period.
    let power = |index: usize| {
        let frequency = lowest + index as f64 * step;
        let place = frequency * loop_s * padded as f64;
        let (below, share) = (place.floor() as usize, place.fract());
        let kernels = [dirichlet(frequency * loop_s, loops), dirichlet(2.0 * frequency * loop_s, loops)];
        let [mut data, mut once, mut twice] = [Complex64::ZERO; 3];
        let (mut turn, mut last_s) = (Complex64::ONE, 0.0);
        let once_more = Complex64::cis(-std::f64::consts::TAU * frequency * period);
        for (at, (&frame, spectrum)) in frames.iter().zip(&spectra).enumerate() {
            let value = spectrum[below % padded] * (1.0 - share) + spectrum[(below + 1) % padded] * share;
            // Frames follow each other regularly: most turns are products of known ones.
            let steps = (middles[at] - last_s) / period;
            turn = if at > 0 && steps < 2.5 && (steps - steps.round()).abs() < 1e-6 {
                if steps < 1.5 { turn * once_more } else { turn * once_more * once_more }
            } else {
                Complex64::cis(-std::f64::consts::TAU * frequency * middles[at])
            };
            last_s = middles[at];
            data += value * turn;
            once += turn * (series.weight[frame] * kernels[0]);
            twice += turn * turn * (series.weight[frame] * kernels[1]);
        }
        let (cosine, sine) = (once.re, -once.im);
        let cc = 0.5 * (total + twice.re) - cosine * cosine / total;
        let ss = 0.5 * (total - twice.re) - sine * sine / total;
        let cs = -0.5 * twice.im - cosine * sine / total;
        let (yc, ys) = (data.re - mean * cosine, -data.im - mean * sine);
        let determinant = cc * ss - cs * cs;
        if determinant < 1e-3 * total * total {
            0.0
        } else {
            0.5 * (yc * yc * ss + ys * ys * cc - 2.0 * yc * ys * cs) / determinant
        }
    };
    let best = (0..count).into_par_iter().map(|i| (i, power(i))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let gain = |f: f64| if (lowest..=highest).contains(&f) { fit(field, series, &frames, f, 1).2 } else { f64::NEG_INFINITY };
    // The peak is a parabola near its top.
    let refined = |frequency: f64| climb(gain, frequency, step, 1e-3 * step);
    let (mut frequency, mut centre) = refined(lowest + best.0 as f64 * step);
    // Gaps between frames make a comb of nearly equal peaks, a frame rate apart; the grid may have missed its top.
    let frame_rate = 1.0 / (field.times_s[loops] - field.times_s[0]);
    if frame_rate * loop_s * (loops as f64) < 0.9 {
        let first = frequency;
        for k in [-3.0, -2.0, -1.0, 1.0, 2.0, 3.0] {
            let (found, value) = refined(first + k * frame_rate);
            if value > centre {
                (frequency, centre) = (found, value);
            }
        }
        // Of frequencies that only the short frames could tell apart, the lowest is taken, which may be a drift.
        let nearest = (frequency / frame_rate).round();
        let mut aliases: Vec<f64> = (0..=3).map(|k| (frequency - (nearest - f64::from(k)) * frame_rate).abs()).collect();
        aliases.sort_by(f64::total_cmp);
        if aliases[0] < lowest && fit(field, series, &frames, aliases[0], 1).2 > centre - ALIAS_GAIN {
            return None;
        }
        let slower = aliases.into_iter().filter(|alias| *alias > lowest + step && *alias < 0.9 * frequency).map(refined);
        if let Some(found) = slower.into_iter().find(|(_, value)| *value > centre - ALIAS_GAIN) {
            (frequency, centre) = found;
        }
    }
    let mut harmonics = 1;
    let (mut amplitudes, mut constant, mut training_gain) = fit(field, series, &frames, frequency, 1);
    for more in 2..=HARMONICS {
        if frequency * more as f64 >= highest {
            break;
        }
        let (found, offset, better) = fit(field, series, &frames, frequency, more);
        if better > training_gain + HARMONIC_GAIN {
            (harmonics, amplitudes, constant, training_gain) = (more, found, offset, better);
        }
    }
    amplitudes.truncate(harmonics);
    let curvature = {
        let h = 0.05 / duration_s;
        (2.0 * centre - gain(frequency - h) - gain(frequency + h)) / (h * h)
    };
    // Not small: no modulation of static returns, but something else.
    if amplitudes.iter().any(|[cosine, sine]| cosine.hypot(*sine) > largest) {
        return None;
    }
    let mut line = Line {
        frequency_hz: frequency,
        amplitudes,
        constant,
        training_gain,
        held_out_gain: 0.0,
        tried: (highest - lowest) * duration_s * 3.0,
        frequency_deviation_hz: if curvature.is_finite() && curvature > 0.0 {
            curvature.sqrt().recip()
        } else {
            0.5 / duration_s
        },
        amplitude_deviation: (2.0 / total).sqrt(),
        background: 1.0,
        freedom: None,
    };
    // What leaks from movers is no line: it raises the spectra of single frames at that frequency, most plainly of those that it was
    // not fitted to.
    let judged: Vec<usize> = training.iter().chain(held_out).copied().filter(|&f| series.weight[f] > 0.0).collect();
    let background = judged.iter().map(|&frame| leftover(field, series, frame, &line)).sum::<f64>() / judged.len() as f64;
    let background = background.max(1.0);
    // What is slower than a frame is seen in how few frames differ, and a background of more than noise is known from
    // few frames only. Where it is no more than noise, the noise's law is known besides.
    let slow = frequency * loop_s * (loops as f64) < 1.0;
    let own = (2 * frames.len()).saturating_sub(2 * harmonics + 1).max(1) as f64;
    if background > LOUD {
        line.freedom = Some(own);
    } else if slow {
        line.freedom = Some(own + KNOWN);
    }
    line.training_gain /= background;
    line.frequency_deviation_hz = (line.frequency_deviation_hz * background.sqrt()).hypot(COLOURED / duration_s);
    line.amplitude_deviation *= background.sqrt();
    // What may be the noise alone is the same for all laws that are compared.
    line.background = if background > LOUD { background } else { 1.0 };
    line.held_out_gain = series.gain(field, held_out, |_, _, time| line.value(time)) / line.background;
    Some(line)
}

/// Power of a frame at the line's frequency after the line is taken out, relative to the noise's.
fn leftover(field: &Field, series: &Series, frame: usize, line: &Line) -> f64 {
    let sum: Complex64 = (frame * field.loops..(frame + 1) * field.loops)
        .map(|i| {
            let time_s = field.times_s[i];
            (series.value[i] - line.value(time_s)) * Complex64::cis(-std::f64::consts::TAU * line.frequency_hz * time_s)
        })
        .sum();
    sum.norm_sqr() * series.weight[frame] / field.loops as f64
}

/// Padded spectra of the weighted series of each frame, phases relative to the frame's middle.
fn frame_spectra(field: &Field, series: &Series, frames: &[usize]) -> Vec<Vec<Complex64>> {
    let loops = field.loops;
    let padded = (loops * PADDING).next_power_of_two();
    let fft = FftPlanner::new().plan_fft_forward(padded);
    frames
        .par_iter()
        .map(|&frame| {
            let mut spectrum = vec![Complex64::ZERO; padded];
            for (value, own) in spectrum.iter_mut().zip(&series.value[frame * loops..(frame + 1) * loops]) {
                *value = (own * series.weight[frame]).into();
            }
            fft.process(&mut spectrum);
            for (bin, value) in spectrum.iter_mut().enumerate() {
                *value *= Complex64::cis(std::f64::consts::PI * bin as f64 * (loops - 1) as f64 / padded as f64);
            }
            spectrum
        })
        .collect()
}

/// Least squares of a fundamental, its harmonics and a constant: amplitudes, constant, log-likelihood gained.
fn fit(field: &Field, series: &Series, frames: &[usize], frequency_hz: f64, harmonics: usize) -> (Vec<[f64; 2]>, f64, f64) {
    let size = 2 * harmonics + 1;
    let (mut normal, mut right) = (nalgebra::DMatrix::<f64>::zeros(size, size), nalgebra::DVector::<f64>::zeros(size));
    // The last is the constant.
    let mut row = vec![1.0; size];
    for &frame in frames {
        let weight = series.weight[frame];
        for index in frame * field.loops..(frame + 1) * field.loops {
            for harmonic in 0..harmonics {
                let phase = std::f64::consts::TAU * frequency_hz * (harmonic + 1) as f64 * field.times_s[index];
                (row[2 * harmonic + 1], row[2 * harmonic]) = phase.sin_cos();
            }
            for i in 0..size {
                right[i] += weight * row[i] * series.value[index];
                for j in 0..=i {
                    normal[(i, j)] += weight * row[i] * row[j];
                }
            }
        }
    }
    let normal_constant = normal[(size - 1, size - 1)];
    normal.fill_upper_triangle_with_lower_triangle();
    let Some(solved) = normal.cholesky() else { return (vec![[0.0; 2]; harmonics], 0.0, 0.0) };
    let found = solved.solve(&right);
    let gain = 0.5 * (found.dot(&right) - right[size - 1] * right[size - 1] / normal_constant);
    ((0..harmonics).map(|h| [found[2 * h], found[2 * h + 1]]).collect(), found[size - 1], gain)
}

/// Σ exp(−2πi x l) over so many l, relative to their middle.
fn dirichlet(turns: f64, count: usize) -> f64 {
    let half = std::f64::consts::PI * turns;
    if half.sin().abs() < 1e-9 {
        count as f64 * (half * (count - 1) as f64).cos().signum()
    } else {
        (half * count as f64).sin() / half.sin()
    }
}
