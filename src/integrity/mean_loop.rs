//! The mean of what repeats itself from loop to loop, and how a loop fits it in its place and turned.

use std::sync::Arc;

use hybridsim_fft::{Fft, FftPlanner};
use num_complex::{Complex32, Complex64};

/// Loops whose running mean the next one is held against: half of the weight is in that many. What moves averages out over them.
const MEMORY: f64 = 64.0;
/// Least weight of a frequency's noise against the mean one: where the converter rounds everything to nothing, there is no less.
const LEAST_NOISE: f64 = 1e-6;

/// How one loop fits.
pub(super) struct Fit {
    /// In samples, of the turn that fits best.
    pub turn: usize,
    /// Of the mean in its place, and turned.
    pub gains: [Complex64; 2],
    /// What each leaves, in units of the noise.
    pub left: [f64; 2],
}

/// Spectra of `[piece, frequency]`; a loop is turned piece by piece.
pub(super) struct MeanLoop {
    /// Samples of one piece.
    piece: usize,
    fft: [Arc<dyn Fft<f64>>; 2],
    /// Spectrum of the mean loop, and power of what differs from it.
    clutter: Vec<Complex64>,
    noise: Vec<f64>,
    /// Least of that power that counts.
    floor: f64,
    pub averaged: usize,
    /// Rest of the last loop that was averaged, and how far the energies of two such neighbours are correlated.
    rest: Vec<Complex64>,
    pub alike: f64,
}

impl MeanLoop {
    /// Of loops of `period` samples in pieces of `piece`.
    pub fn new(period: usize, piece: usize) -> Self {
        let mut planner = FftPlanner::new();
        let fft = [planner.plan_fft_forward(piece), planner.plan_fft_inverse(piece)];
        let (clutter, noise) = (vec![Complex64::ZERO; period], vec![0.0; period]);
        Self { piece, fft, clutter, noise, floor: 0.0, averaged: 0, rest: vec![], alike: 0.0 }
    }

    /// Turns that [`Self::fit`] tries.
    pub fn turns(&self) -> usize {
        self.piece
    }

    pub fn spectrum(&self, samples: &[Complex32]) -> Vec<Complex64> {
        let mut spectrum: Vec<Complex64> = samples.iter().map(|v| Complex64::new(v.re.into(), v.im.into())).collect();
        spectrum.chunks_exact_mut(self.piece).for_each(|piece| self.fft[0].process(piece));
        spectrum
    }

    pub fn learn(&mut self, spectrum: &[Complex64], gain: Complex64) {
        self.averaged += 1;
        let weight = 1.0 / (self.averaged as f64).min(MEMORY);
        if self.averaged == 2 {
            // Of one difference, only the mean over all frequencies says anything.
            let rest: f64 = spectrum.iter().zip(&self.clutter).map(|(value, clutter)| (value - clutter).norm_sqr()).sum();
            self.noise.fill(rest / spectrum.len() as f64);
        }
        if self.averaged > 2 {
            let rest: Vec<Complex64> =
                spectrum.iter().zip(&self.clutter).map(|(value, clutter)| value - gain * clutter).collect();
            if !self.rest.is_empty() {
                self.alike += weight * (self.correlation(&self.rest, &rest) - self.alike);
            }
            self.noise.iter_mut().zip(&rest).for_each(|(noise, rest)| *noise += weight * (rest.norm_sqr() - *noise));
            self.rest = rest;
        }
        self.clutter.iter_mut().zip(spectrum).for_each(|(clutter, value)| *clutter += weight * (value - *clutter));
    }

    /// Of the energies of two loops' rests: the square of their coherence, as both are complex Gaussian.
    pub fn correlation(&self, a: &[Complex64], b: &[Complex64]) -> f64 {
        let (mut both, mut of_a, mut of_b) = (Complex64::ZERO, 0.0, 0.0);
        for ((a, b), &noise) in a.iter().zip(b).zip(&self.noise) {
            let weight = self.weight(noise);
            both += weight * a * b.conj();
            of_a += weight * a.norm_sqr();
            of_b += weight * b.norm_sqr();
        }
        both.norm_sqr() / (of_a * of_b).max(f64::MIN_POSITIVE)
    }

    /// The mean loop, turned.
    pub fn turned(&self, turn: usize) -> impl Iterator<Item = Complex64> + '_ {
        let step = -std::f64::consts::TAU * turn as f64 / self.piece as f64;
        self.clutter.iter().enumerate().map(move |(k, value)| value * Complex64::cis(step * (k % self.piece) as f64))
    }

    pub fn turn(&mut self, turn: usize) {
        self.clutter = self.turned(turn).collect();
    }

    /// Of a frequency with so much noise.
    fn weight(&self, noise: f64) -> f64 {
        1.0 / (noise + self.floor).max(f64::MIN_POSITIVE)
    }

    pub fn fit(&mut self, spectrum: &[Complex64]) -> Fit {
        self.floor = LEAST_NOISE * self.noise.iter().sum::<f64>() / self.noise.len() as f64;
        let (mut own, mut clutter) = (0.0, 0.0);
        let mut common = vec![Complex64::ZERO; self.piece];
        for (k, ((value, mean), &noise)) in spectrum.iter().zip(&self.clutter).zip(&self.noise).enumerate() {
            let weight = self.weight(noise);
            own += weight * value.norm_sqr();
            clutter += weight * mean.norm_sqr();
            common[k % self.piece] += weight * value * mean.conj();
        }
        self.fft[1].process(&mut common);
        let clutter = clutter.max(f64::MIN_POSITIVE);
        let turn = (0..common.len()).max_by(|a, b| common[*a].norm_sqr().total_cmp(&common[*b].norm_sqr())).unwrap_or(0);
        let left = [0, turn].map(|turn| (own - common[turn].norm_sqr() / clutter).max(f64::MIN_POSITIVE));
        Fit { turn, gains: [0, turn].map(|turn| common[turn] / clutter), left }
    }
}
