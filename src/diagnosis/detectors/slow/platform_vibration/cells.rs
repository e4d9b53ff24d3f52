//! Cells of range and channel where the body cannot be, over slow time, and a sinusoid that they have.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use rayon::prelude::*;

use super::sums::Sums;
use crate::diagnosis::detectors::climb::climb;
use crate::diagnosis::detectors::slow::field::free;
use crate::diagnosis::evidence::{Evidence, Tapered};
use crate::grid::Grid;

/// Bins over which the window spreads what is independent.
const BINS_PER_VALUE: f64 = 2.0;
/// Cells with the strongest returns, which suffice to find the frequency.
const SEARCHED: usize = 48;
/// Phases that are tried before the best is refined.
const PHASES: usize = 8;
/// Least determinant at which a cosine and a sine are distinguishable.
const DETERMINED: f64 = 0.05;

/// Deviations of the free cells from their mean, in units of the noise.
pub struct Cells {
    /// `[frame, channel, bin]`, each `[loop]`; none where the body may be.
    deviation: Grid<Option<Vec<Complex64>>, 3>,
    /// `[channel, bin]`
    pub clutter: Grid<Complex64, 2>,
    pub loops: usize,
    starts_s: Vec<f64>,
    pub loop_s: f64,
}

/// A sinusoid cos(2π f t + θ) with a pattern.
pub struct Vibration {
    pub frequency_hz: f64,
    pub phase: f64,
    /// `[channel, bin]` with its inverse variance, of the free cells; none where the body was in most frames.
    pub pattern: Grid<Option<(Complex64, f64)>, 2>,
    /// Log-likelihood, and the number of complex values fitted.
    pub gain: f64,
    pub values: f64,
    pub likeness: f64,
}

impl Cells {
    pub fn new(evidence: &Evidence) -> Option<Self> {
        let [frames, tx, _, loops, samples] = evidence.cube.dims;
        let (channels, bins, noise) = (evidence.cube.channels(), evidence.range_bins(), evidence.noise());
        if loops < 8 || frames < 4 || bins < 16 || noise.iter().any(|v| !v.is_finite() || *v <= 0.0) {
            return None;
        }
        let tapered = Tapered::new(samples);
        let clutter = (0..channels).flat_map(|channel| {
            let own = &evidence.clutter()[channel * samples..][..samples];
            tapered.spectra(own, 1.0 / noise[channel].sqrt())[..bins].to_vec()
        });
        let clutter = Grid::new(["channel", "bin"], [channels, bins], clutter.collect());
        let strong: Vec<bool> = (0..bins)
            .map(|bin| (0..channels).map(|c| clutter[[c, bin]].norm_sqr()).sum::<f64>() > 3.0 * channels as f64)
            .collect();
        let of_frame = |frame: usize| -> Vec<Option<Vec<Complex64>>> {
            let free = free(evidence, frame, bins);
            let mut cells = Vec::with_capacity(channels * bins);
            for channel in 0..channels {
                let spectra = tapered.spectra(evidence.cube.channel(frame, channel), 1.0 / noise[channel].sqrt());
                for bin in 0..bins {
                    let mean = clutter[[channel, bin]];
                    let values = || spectra[bin..].iter().step_by(samples).map(|value| value - mean).collect();
                    cells.push((free[bin] && strong[bin]).then(values));
                }
            }
            cells
        };
        let deviation = (0..frames).into_par_iter().flat_map_iter(of_frame).collect();
        let deviation = Grid::new(["frame", "channel", "bin"], [frames, channels, bins], deviation);
        let middle_s = 0.5 * (tx as f64 - 1.0) * evidence.radar.chirp_period_s;
        let starts_s = evidence.starts_s.iter().map(|start| start + middle_s).collect();
        Some(Self { deviation, clutter, loops, starts_s, loop_s: evidence.radar.loop_period_s() })
    }

    /// Channel and bin of all cells.
    pub fn all(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [channels, bins] = self.clutter.shape();
        (0..channels).flat_map(move |channel| (0..bins).map(move |bin| [channel, bin]))
    }

    pub fn time_s(&self, frame: usize, index: usize) -> f64 {
        self.starts_s[frame] + index as f64 * self.loop_s
    }

    fn sums(&self, frames: &[usize], [channel, bin]: [usize; 2], frequency_hz: f64) -> Sums {
        let mut sums = Sums::default();
        let step = Complex64::cis(TAU * frequency_hz * self.loop_s);
        for &frame in frames {
            let Some(values) = &self.deviation[[frame, channel, bin]] else { continue };
            let mut turn = Complex64::cis(TAU * frequency_hz * self.starts_s[frame]);
            for value in values {
                sums.add(*value, turn);
                turn *= step;
            }
        }
        sums
    }

    /// Of cells that `kept` says.
    pub fn fit(&self, frames: &[usize], frequency_hz: f64, kept: impl Fn([usize; 2]) -> bool + Sync) -> Vibration {
        let of_cell = |cell| if kept(cell) { self.sums(frames, cell, frequency_hz) } else { Sums::default() };
        let cells: Vec<[usize; 2]> = self.all().collect();
        let sums: Vec<Sums> = cells.into_par_iter().map(of_cell).map(Sums::centred).collect();
        let known: Vec<&Sums> = sums.iter().filter(|sums| sums.determinant() > DETERMINED).collect();
        let gain = |phase: f64| known.iter().map(|sums| sums.along(phase)).map(|(q, n)| q.norm_sqr() / n).sum::<f64>();
        let phases = (0..PHASES).map(|i| PI * i as f64 / PHASES as f64);
        let (first, _) = phases.map(|phase| (phase, gain(phase))).max_by(|a, b| a.1.total_cmp(&b.1)).expect("some phases");
        let (phase, top) = climb(gain, first, PI / PHASES as f64, 1e-3);
        let pattern = sums
            .iter()
            .map(|sums| {
                (sums.determinant() > DETERMINED).then(|| {
                    let (q, n) = sums.along(phase);
                    (q / n, n)
                })
            })
            .collect();
        let pattern = Grid::new(["channel", "bin"], self.clutter.shape(), pattern);
        // Noise alone has one unit in each of two courses in time.
        let (count, both) = (known.len() as f64, known.iter().map(|sums| sums.both()).sum::<f64>());
        let likeness = (top - count) / (both - 2.0 * count).max(f64::MIN_POSITIVE);
        Vibration { frequency_hz, phase, pattern, gain: top / BINS_PER_VALUE, values: count / BINS_PER_VALUE, likeness }
    }

    /// Those that suffice for a search.
    pub fn strongest(&self) -> Grid<bool, 2> {
        let mut order: Vec<[usize; 2]> = self.all().collect();
        order.sort_by(|&a, &b| self.clutter[b].norm_sqr().total_cmp(&self.clutter[a].norm_sqr()));
        let mut kept = Grid::filled(["channel", "bin"], self.clutter.shape(), false);
        order.iter().take(SEARCHED).for_each(|&cell| kept[cell] = true);
        kept
    }

    /// Log-likelihood that some frames gain by a vibration, over what is left of their own power along it.
    pub fn held_out(&self, frames: &[usize], vibration: &Vibration) -> f64 {
        let (mut gain, mut left, mut count) = (0.0, 0.0, 0.0);
        for cell in self.all() {
            let Some((pattern, _)) = vibration.pattern[cell] else { continue };
            let sums = self.sums(frames, cell, vibration.frequency_hz);
            let (q, n) = sums.along(vibration.phase);
            if n <= 0.0 {
                continue;
            }
            gain += 2.0 * (pattern.conj() * q).re - n * pattern.norm_sqr();
            left += (q - n * pattern).norm_sqr() / n;
            count += 1.0;
        }
        gain / BINS_PER_VALUE / (left / f64::max(count, 1.0)).max(1.0)
    }
}
