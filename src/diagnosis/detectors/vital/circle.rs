//! A return whose phase alone changes: a circle in the complex plane of every channel, `c + a exp(jψ(T))`, with one ψ for all.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::frames::Frames;

/// Reflector whose echo is `c + a exp(jψ)` in some cells.
pub struct Reflector {
    pub cells: Vec<usize>,
    /// The constant `c` of each cell.
    pub clutter: Vec<Complex64>,
    pub amplitude: Vec<Complex64>,
    /// `[frame]`, unwrapped.
    pub phase: Vec<f64>,
    /// Of what is left in each cell, over the training frames.
    pub variance: Vec<f64>,
}

/// The circle at one of several ranges whose phase explains most of what changes at all of them.
///
/// A body fills several ranges, and what its parts have in common is its motion: a circle that fits one range alone (a far larger one,
/// of which only a short arc is seen, does) explains nothing of the others.
pub fn common(data: &Frames, mean: &[Complex64], bins: &[usize], training: &[usize]) -> Option<Reflector> {
    let circles = bins.iter().filter_map(|&bin| reflector(data, mean, bin, training));
    let explained = |circle: &Reflector| -> f64 { bins.iter().map(|&bin| explained(data, mean, bin, training, circle)).sum() };
    let all: Vec<(f64, Reflector)> = circles.map(|circle| (explained(&circle), circle)).collect();
    all.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, circle)| circle)
}

/// What a channel has, at a range, of a course of turns.
pub struct Along {
    /// Of what turns so.
    pub amplitude: Complex64,
    /// Energy of all changes, and of those that turn so.
    all: f64,
    turning: f64,
    /// Of a value.
    noise: f64,
}

impl Along {
    /// Energy of what turns so, over the noise of a value.
    pub fn over_noise(&self) -> f64 {
        self.turning / self.noise
    }
}

/// By channel.
pub fn along(data: &Frames, mean: &[Complex64], bin: usize, training: &[usize], circle: &Reflector) -> Vec<Along> {
    let count = training.len() as f64;
    let turned: Vec<Complex64> = training.iter().map(|&frame| Complex64::cis(circle.phase[frame])).collect();
    let centre = turned.iter().sum::<Complex64>() / count;
    let energy = (count * (1.0 - centre.norm_sqr())).max(f64::MIN_POSITIVE);
    let of_channel = |channel: usize| {
        let cell = channel * data.bins + bin;
        let deviation = |i: usize| data.values[training[i]][cell] - mean[cell];
        let all: f64 = (0..training.len()).map(|i| deviation(i).norm_sqr()).sum();
        let along: Complex64 = turned.iter().enumerate().map(|(i, turned)| deviation(i) * (turned - centre).conj()).sum();
        Along { amplitude: along / energy, all, turning: along.norm_sqr() / energy, noise: data.noise[channel] }
    };
    (0..data.noise.len()).map(of_channel).collect()
}

/// Log-likelihood that a range's cells gain by a return that turns as a circle does, each with a variance of its own that is fitted
/// with and without it.
fn explained(data: &Frames, mean: &[Complex64], bin: usize, training: &[usize], circle: &Reflector) -> f64 {
    let count = training.len() as f64;
    let of_channel = |channel: Along| {
        let variance = |sum: f64| (sum / count).max(channel.noise);
        count * (variance(channel.all) / variance(channel.all - channel.turning)).ln()
    };
    along(data, mean, bin, training, circle).into_iter().map(of_channel).sum()
}

/// Alternates between the phase of every frame and the cells' constants.
fn reflector(data: &Frames, mean: &[Complex64], bin: usize, training: &[usize]) -> Option<Reflector> {
    let channels = data.noise.len();
    let cells: Vec<usize> = (0..channels).map(|c| c * data.bins + bin).collect();
    let weight: Vec<f64> = data.noise.iter().map(|v| 1.0 / v).collect();
    let mut clutter: Vec<Complex64> = cells.iter().map(|&cell| centre(data, mean, cell, training)).collect();
    // First amplitudes: relative phases of the channels about their centres.
    let reference = cells[0];
    let mut amplitude: Vec<Complex64> = cells
        .iter()
        .enumerate()
        .map(|(i, &cell)| {
            let product: Complex64 = training
                .iter()
                .map(|&f| (data.values[f][cell] - clutter[i]) * (data.values[f][reference] - clutter[0]).conj())
                .sum();
            let power: f64 = training.iter().map(|&f| (data.values[f][reference] - clutter[0]).norm_sqr()).sum();
            product / power.max(f64::MIN_POSITIVE)
        })
        .collect();
    let mut turned = vec![Complex64::ONE; data.values.len()];
    for _ in 0..20 {
        for (frame, turn) in turned.iter_mut().enumerate() {
            let sum: Complex64 = cells
                .iter()
                .enumerate()
                .map(|(i, &cell)| amplitude[i].conj() * (data.values[frame][cell] - clutter[i]) * weight[i])
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
            clutter[i] = mean[cell] - amplitude[i] * centre;
        }
    }
    let variance = cells
        .iter()
        .enumerate()
        .map(|(i, &cell)| {
            let left: f64 =
                training.iter().map(|&f| (data.values[f][cell] - clutter[i] - amplitude[i] * turned[f]).norm_sqr()).sum();
            (left / training.len() as f64).max(data.noise[i])
        })
        .collect();
    let mut phase: Vec<f64> = turned.iter().map(|t| t.arg()).collect();
    for frame in 1..phase.len() {
        let jump = phase[frame] - phase[frame - 1];
        phase[frame] -= TAU * (jump / TAU).round();
    }
    Some(Reflector { cells, clutter, amplitude, phase, variance })
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
