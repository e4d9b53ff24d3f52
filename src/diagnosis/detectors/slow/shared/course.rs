//! Courses over slow time and their spectra.

use std::f64::consts::PI;
use std::iter::once;

use hybridsim_fft::{FftDirection, FftPlanner};
use num_complex::Complex64;

use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::statistics;

/// Half turns up to which a course is slow: what turns less than one and a half times during a recording is a drift (as in
/// `platform_vibration`).
const SLOW: usize = 3;
/// First frequency of a stretch, in turns: slower ones are taken out.
const FIRST: usize = SLOW.div_ceil(2);

/// How a course over all chirps is turned into values of independent phases and back: over all chirps where these follow one another
/// evenly, else over the frames' means and within each frame.
pub struct Course {
    pub frames: usize,
    pub loops: usize,
    pub even: bool,
    pub frame_s: f64,
    loop_s: f64,
}

impl Course {
    pub fn of(evidence: &Evidence) -> Self {
        let [frames, _, _, loops, _] = evidence.cube.dims;
        let loop_s = evidence.radar.loop_period_s();
        let starts = &evidence.starts_s;
        let frame_s = (starts[frames - 1] - starts[0]) / (frames - 1).max(1) as f64;
        let even = starts.windows(2).all(|pair| (pair[1] - pair[0] - loops as f64 * loop_s).abs() < 0.5 * loop_s);
        Self { frames, loops, even, frame_s, loop_s }
    }

    /// Stretches of even sampling: all chirps, or the frames' means (scaled to a chirp's noise) and each frame about its own.
    fn stretches(&self, course: &[f64]) -> Vec<Vec<f64>> {
        if self.even {
            return vec![course.to_vec()];
        }
        let root = (self.loops as f64).sqrt();
        let means: Vec<f64> = course.chunks_exact(self.loops).map(|frame| frame.iter().sum::<f64>() / root).collect();
        let within = course.chunks_exact(self.loops).zip(&means);
        let within: Vec<Vec<f64>> = within.map(|(frame, mean)| frame.iter().map(|value| value - mean / root).collect()).collect();
        once(means).chain(within).collect()
    }

    /// The spectrum of each stretch without what is slow in it, under a taper; white noise keeps its variance.
    pub fn spectrum(&self, course: &[f64]) -> Vec<Complex64> {
        let of_stretch = |stretch: Vec<f64>| {
            let count = stretch.len();
            let taper = |i: usize| (2.0 / count as f64).sqrt() * (PI * (i as f64 + 0.5) / count as f64).sin();
            let left = without_slow(&stretch).into_iter().enumerate();
            let mut values: Vec<Complex64> = left.map(|(i, value)| Complex64::from(value * taper(i))).collect();
            FftPlanner::new().plan_fft(count, FftDirection::Forward).process(&mut values);
            values.into_iter().take(count.div_ceil(2)).skip(FIRST)
        };
        self.stretches(course).into_iter().flat_map(of_stretch).collect()
    }

    /// Chance that a white course looks so: of both halves of its frequencies, each of which is independent under the taper, the
    /// smaller one (Bonferroni).
    pub fn white_chance(&self, course: &[f64]) -> f64 {
        let powers = self.spectrum(course).into_iter().map(|value| value.norm_sqr());
        // What is slow was taken out of the first of each stretch, too, in part.
        let all = self.bins().into_iter().zip(powers).enumerate().filter(|(_, ((turns, _), _))| *turns > FIRST);
        let mut by_frequency: Vec<(usize, f64, f64)> = all.map(|(index, ((_, hz), power))| (index, hz, power)).collect();
        by_frequency.sort_by(|a, b| a.1.total_cmp(&b.1));
        let half = |parity: usize| {
            let of_half = by_frequency.iter().filter(|(index, ..)| index % 2 == parity).map(|(.., power)| *power);
            statistics::white_chance(&of_half.collect::<Vec<f64>>())
        };
        (2.0 * half(0).min(half(1))).min(1.0)
    }

    /// What of a course in white noise of a variance is no noise, by Wiener's filter.
    pub fn denoised(&self, course: &[f64], variance: f64) -> Vec<f64> {
        let mut stretches = self.stretches(course);
        for stretch in &mut stretches {
            let count = stretch.len();
            let mut values: Vec<Complex64> = stretch.iter().copied().map(Complex64::from).collect();
            let mut planner = FftPlanner::new();
            planner.plan_fft(count, FftDirection::Forward).process(&mut values);
            for value in &mut values {
                let ratio = (value.norm_sqr() / (count as f64 * variance) - 1.0).max(0.0);
                *value *= statistics::kept(ratio) / count as f64;
            }
            planner.plan_fft(count, FftDirection::Inverse).process(&mut values);
            stretch.iter_mut().zip(values).for_each(|(own, value)| *own = value.re);
        }
        if self.even {
            return stretches.swap_remove(0);
        }
        let root = (self.loops as f64).sqrt();
        let (means, within) = (&stretches[0], &stretches[1..]);
        means.iter().zip(within).flat_map(|(mean, frame)| frame.iter().map(move |value| mean / root + value)).collect()
    }

    /// Frequency (Hz) of each value of a spectrum.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        self.bins().into_iter().map(|(_, hz)| hz).collect()
    }

    /// Of each value of a spectrum, turns in its stretch and frequency (Hz).
    fn bins(&self) -> Vec<(usize, f64)> {
        let half =
            |count: usize, period_s: f64| (FIRST..count.div_ceil(2)).map(move |k| (k, k as f64 / (count as f64 * period_s)));
        if self.even {
            return half(self.frames * self.loops, self.loop_s).collect();
        }
        let within = (0..self.frames).flat_map(|_| half(self.loops, self.loop_s));
        half(self.frames, self.frame_s).chain(within).collect()
    }

    pub fn duration_s(&self) -> f64 {
        self.frames as f64 * if self.even { self.loops as f64 * self.loop_s } else { self.frame_s }
    }
}

/// What is left of a stretch once its slowest cosines are away (a type-II transform: they have no jump at the ends).
pub fn without_slow(stretch: &[f64]) -> Vec<f64> {
    let count = stretch.len();
    let mut left = stretch.to_vec();
    for k in 0..=SLOW.min(count - 1) {
        let cosine = |i: usize| (PI * k as f64 * (i as f64 + 0.5) / count as f64).cos();
        let square: f64 = (0..count).map(|i| cosine(i).powi(2)).sum();
        let along = left.iter().enumerate().map(|(i, value)| value * cosine(i)).sum::<f64>() / square;
        left.iter_mut().enumerate().for_each(|(i, value)| *value -= along * cosine(i));
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::support;

    #[test]
    fn white_courses_are_called_otherwise_as_rarely_as_stated_and_a_weak_line_is() {
        for (frames, loops, even) in [(24, 16, true), (24, 16, false), (400, 16, false)] {
            let course = Course { frames, loops, even, frame_s: 0.1, loop_s: 1e-3 };
            let mut draw = support::normal(frames as u64);
            let mut is_coloured = |line: f64| {
                let value = |i: usize| line * (2.0 * PI * 0.19 * i as f64).sin() + draw();
                course.white_chance(&(0..frames * loops).map(value).collect::<Vec<f64>>()) < 0.01
            };
            let alarms = (0..60).filter(|_| is_coloured(0.0)).count();
            // More than four of sixty: a chance of 4e-4 at 1 %.
            assert!(alarms <= 4, "{alarms} of 60 with {frames} frames, even: {even}");
            if even {
                assert!((0..20).filter(|_| is_coloured(0.8)).count() >= 18);
            }
        }
    }
}
