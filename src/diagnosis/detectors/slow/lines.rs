//! Sinusoids over slow time: a coherent periodogram over all frames, of frames that are apart.

use num_complex::Complex64;
use rayon::prelude::*;

use super::{
    field::{Field, Series},
    periodogram::Periodogram,
};
use crate::diagnosis::detectors::climb::climb;
use crate::diagnosis::statistics::{UNDECIDED, deviation_at_top};

/// A sinusoid `a cos + b sin` of 2π f T, with its harmonics.
#[derive(Clone, Debug)]
pub struct Line {
    pub frequency_hz: f64,
    /// Of the fundamental and of its harmonics, the cosine's and the sine's amplitude each.
    pub amplitudes: Vec<[f64; 2]>,
    /// What makes its mean over the training frames zero.
    pub constant: f64,
    /// Log-likelihood that the training frames gain, nats.
    pub training_nats: f64,
    pub held_out_nats: f64,
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
/// A background above this many times the noise is more than noise.
pub const LOUD: f64 = 1.5;
/// Degrees of freedom that the noise's law is worth beside what frames show of it: of 155 strongest lines of recordings without anything
/// missing, those slower than a frame gained as little as faster ones wherever the other frames scattered as the noise does.
const KNOWN: f64 = 20.0;
/// What moves besides is not white: it shifts a line by such a share of a resolution cell.
const COLOURED: f64 = 0.02;

/// A gain over a background of so many degrees of freedom, as Student's law has it.
pub fn unsure(gain: f64, freedom: f64) -> f64 {
    if gain > 0.0 { 0.5 * freedom * (2.0 * gain / freedom).ln_1p() } else { gain }
}

impl Line {
    /// Its value at a radar time.
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
    let search = Search::new(field, series, &frames)?;
    let periodogram = Periodogram::new(field, series, &frames);
    let (frequency, gain) = search.simplest(search.highest(&periodogram)?)?;
    let mut line = search.line(frequency, gain, periodogram.weight());
    // Not small: no modulation of static returns, but something else.
    if line.amplitudes.iter().any(|[cosine, sine]| cosine.hypot(*sine) > largest) {
        return None;
    }
    // What leaks from movers is no line: it raises the spectra of single frames at that frequency, most plainly of those that it was
    // not fitted to.
    let judged: Vec<usize> = training.iter().chain(held_out).copied().filter(|&f| series.weight[f] > 0.0).collect();
    let background = judged.iter().map(|&frame| leftover(field, series, frame, &line)).sum::<f64>() / judged.len() as f64;
    search.judge(&mut line, background.max(1.0));
    line.held_out_nats = series.log_likelihood_gain(field, held_out, |_, _, time| line.value(time)) / line.background;
    Some(line)
}

/// Where a line is looked for, and in what.
struct Search<'a> {
    field: &'a Field,
    series: &'a Series,
    /// Those of training with weight.
    frames: &'a [usize],
    loop_s: f64,
    duration_s: f64,
    lowest_hz: f64,
    highest_hz: f64,
    step_hz: f64,
}

impl<'a> Search<'a> {
    /// None where the frames are too few, or too short a time, for any frequency.
    fn new(field: &'a Field, series: &'a Series, frames: &'a [usize]) -> Option<Self> {
        if frames.len() < 3 {
            return None;
        }
        let loops = field.loops;
        let loop_s = field.times_s[1] - field.times_s[0];
        let duration_s = field.times_s[frames[frames.len() - 1] * loops + loops - 1] - field.times_s[frames[0] * loops];
        // What is slower than the recording is a drift.
        let (lowest_hz, highest_hz, step_hz) = (1.5 / duration_s, 0.5 / loop_s, 0.25 / duration_s);
        let search = Self { field, series, frames, loop_s, duration_s, lowest_hz, highest_hz, step_hz };
        (search.count() >= 2).then_some(search)
    }

    /// Frequencies that are tried.
    fn count(&self) -> usize {
        ((self.highest_hz - self.lowest_hz) / self.step_hz).floor() as usize
    }

    fn fit(&self, frequency_hz: f64, harmonics: usize) -> (Vec<[f64; 2]>, f64, f64) {
        fit(self.field, self.series, self.frames, frequency_hz, harmonics)
    }

    /// Log-likelihood that a sinusoid gains.
    fn gain(&self, frequency_hz: f64) -> f64 {
        if (self.lowest_hz..=self.highest_hz).contains(&frequency_hz) { self.fit(frequency_hz, 1).2 } else { f64::NEG_INFINITY }
    }

    /// The top of a peak, a parabola there, and its gain.
    fn refined(&self, frequency_hz: f64) -> (f64, f64) {
        climb(|f| self.gain(f), frequency_hz, self.step_hz, 1e-3 * self.step_hz)
    }

    /// The frequency of the highest peak, and its gain.
    fn highest(&self, periodogram: &Periodogram) -> Option<(f64, f64)> {
        let frequency = |index: usize| self.lowest_hz + index as f64 * self.step_hz;
        let of = |index: usize| (index, periodogram.gain(frequency(index)));
        let best = (0..self.count()).into_par_iter().map(of).max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(self.refined(frequency(best.0)))
    }

    /// Gaps between frames make a comb of nearly equal peaks, a frame rate apart; the grid may have missed its top. Of frequencies
    /// that only the short frames could tell apart, the lowest is taken; none where it may be a drift.
    fn simplest(&self, highest: (f64, f64)) -> Option<(f64, f64)> {
        let loops = self.field.loops;
        let frame_rate = 1.0 / (self.field.times_s[loops] - self.field.times_s[0]);
        if frame_rate * self.loop_s * (loops as f64) >= 0.9 {
            return Some(highest);
        }
        let beside = [-3.0, -2.0, -1.0, 1.0, 2.0, 3.0].map(|k| self.refined(highest.0 + k * frame_rate));
        let (frequency, centre) = beside.into_iter().fold(highest, |best, found| if found.1 > best.1 { found } else { best });
        let nearest = (frequency / frame_rate).round();
        let mut aliases: Vec<f64> = (0..=3).map(|k| (frequency - (nearest - f64::from(k)) * frame_rate).abs()).collect();
        aliases.sort_by(f64::total_cmp);
        if aliases[0] < self.lowest_hz && self.fit(aliases[0], 1).2 > centre - UNDECIDED {
            return None;
        }
        let slower = |alias: &f64| *alias > self.lowest_hz + self.step_hz && *alias < 0.9 * frequency;
        let mut slower = aliases.into_iter().filter(slower).map(|alias| self.refined(alias));
        Some(slower.find(|(_, gain)| *gain > centre - UNDECIDED).unwrap_or((frequency, centre)))
    }

    /// The line at a frequency where a sinusoid gains so much, with the harmonics that it needs, as if the background were the noise.
    /// `weight`: of all chirps.
    fn line(&self, frequency_hz: f64, gain: f64, weight: f64) -> Line {
        let mut harmonics = 1;
        let (mut amplitudes, mut constant, mut training_nats) = self.fit(frequency_hz, 1);
        for more in 2..=HARMONICS {
            if frequency_hz * more as f64 >= self.highest_hz {
                break;
            }
            let (found, offset, better) = self.fit(frequency_hz, more);
            if better > training_nats + HARMONIC_GAIN {
                (harmonics, amplitudes, constant, training_nats) = (more, found, offset, better);
            }
        }
        amplitudes.truncate(harmonics);
        let step = 0.05 / self.duration_s;
        let deviation_hz = deviation_at_top(|hertz| self.gain(hertz), frequency_hz, gain, step);
        Line {
            frequency_hz,
            amplitudes,
            constant,
            training_nats,
            held_out_nats: 0.0,
            tried: (self.highest_hz - self.lowest_hz) * self.duration_s * 3.0,
            frequency_deviation_hz: deviation_hz.unwrap_or(0.5 / self.duration_s),
            amplitude_deviation: (2.0 / weight).sqrt(),
            background: 1.0,
            freedom: None,
        }
    }

    /// What is slower than a frame is seen in how few frames differ, and a background of more than noise is known from few frames
    /// only. Where it is no more than noise, the noise's law is known besides.
    fn judge(&self, line: &mut Line, background: f64) {
        let slow = line.frequency_hz * self.loop_s * (self.field.loops as f64) < 1.0;
        let own = (2 * self.frames.len()).saturating_sub(2 * line.amplitudes.len() + 1).max(1) as f64;
        if background > LOUD {
            line.freedom = Some(own);
        } else if slow {
            line.freedom = Some(own + KNOWN);
        }
        line.training_nats /= background;
        line.frequency_deviation_hz = (line.frequency_deviation_hz * background.sqrt()).hypot(COLOURED / self.duration_s);
        line.amplitude_deviation *= background.sqrt();
        // What may be the noise alone is the same for all laws that are compared.
        line.background = if background > LOUD { background } else { 1.0 };
    }
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
