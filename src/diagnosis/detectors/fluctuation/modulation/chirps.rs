//! Chirps without what is static during a frame, and their sidebands.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::evidence::{Evidence, Tapered};
use crate::grid::Grid;

/// Slower modulations belong to people, faster ones to electronics.
const LOWEST_HZ: f64 = 20.0;
const HIGHEST_HZ: f64 = 500.0;
/// Part of a turn that a frame must see: less of it is a slope, which a slow body has, too.
const OF_TURN: f64 = 0.5;
/// Neighbouring ranges that are looked at together.
pub const TOGETHER: [usize; 3] = [1, 6, 20];
/// Bins to either side that a return reaches under the taper.
const REACH: usize = 3;
/// Share of the static returns' power that lies elsewhere at least: without it, noise would say whether it is the receiver's.
const ELSEWHERE: f64 = 0.01;

/// Chirps without what is static during a frame, by range, and when they were: what changes from frame to frame is no such
/// modulation.
pub struct Chirps<'a> {
    pub evidence: &'a Evidence,
    /// Static returns, `[channel, bin]`.
    pub clutter: Grid<Complex64, 2>,
    /// Of every frame, `[loop, channel, bin]`.
    pub spectra: Vec<Grid<Complex64, 3>>,
    /// First and last of ranges that are looked at together.
    pub windows: Vec<[usize; 2]>,
    /// Of the loops relative to their frame's middle.
    pub loops_s: Vec<f64>,
    /// Of the frames' middles.
    pub middles_s: Vec<f64>,
}

/// Amplitudes of both sidebands in every frame, `[frame, channel, bin]` each.
pub type Sidebands = [Grid<Complex64, 3>; 2];

impl<'a> Chirps<'a> {
    pub fn new(evidence: &'a Evidence) -> Option<Self> {
        let [frames, _, _, loops, samples] = evidence.cube.dims;
        let (channels, bins) = (evidence.cube.channels(), evidence.range_bins());
        if loops < 8 || bins < 16 {
            return None;
        }
        let tapered = Tapered::new(samples);
        let clutter = tapered.spectra(&evidence.standing(), 1.0);
        let of_frame = |frame: usize| {
            let mut spectra = Grid::filled(["loop", "channel", "bin"], [loops, channels, bins], Complex64::ZERO);
            for channel in 0..channels {
                let chirps = tapered.spectra(evidence.cube.channel(frame, channel), 1.0);
                for bin in 0..bins {
                    let chirp = |index: usize| chirps[index * samples + bin];
                    let mean = (0..loops).map(chirp).sum::<Complex64>() / loops as f64;
                    for index in 0..loops {
                        spectra[[index, channel, bin]] = chirp(index) - mean;
                    }
                }
            }
            spectra
        };
        let loop_s = evidence.radar.loop_period_s();
        let middle = 0.5 * (loops - 1) as f64;
        let clutter = Grid::from_fn(["channel", "bin"], [channels, bins], |[channel, bin]| clutter[channel * samples + bin]);
        Some(Self {
            evidence,
            windows: windows(&clutter, &evidence.touched()),
            spectra: (0..frames).into_par_iter().map(of_frame).collect(),
            clutter,
            loops_s: (0..loops).map(|index| (index as f64 - middle) * loop_s).collect(),
            middles_s: evidence.starts_s.iter().map(|start| start + middle * loop_s).collect(),
        })
    }

    /// Lowest and highest frequency that is looked at.
    pub fn band_hz(&self) -> [f64; 2] {
        [LOWEST_HZ.max(OF_TURN / self.frame_s()), HIGHEST_HZ.min(0.4 / self.evidence.radar.loop_period_s())]
    }

    pub fn frame_s(&self) -> f64 {
        self.loops_s.len() as f64 * self.evidence.radar.loop_period_s()
    }

    /// At plus and minus a frequency, with the phases of the frames' middles.
    pub fn sidebands(&self, frequency_hz: f64) -> Sidebands {
        let [channels, bins] = self.clutter.shape();
        [1.0, -1.0].map(|sign| {
            let turns: Vec<Complex64> =
                self.loops_s.iter().map(|time| Complex64::cis(-sign * TAU * frequency_hz * time)).collect();
            let shape = [self.spectra.len(), channels, bins];
            let mut sidebands = Grid::filled(["frame", "channel", "bin"], shape, Complex64::ZERO);
            for (frame, spectra) in self.spectra.iter().enumerate() {
                let sums = sidebands.below_mut([frame]);
                for (index, turn) in turns.iter().enumerate() {
                    sums.iter_mut().zip(spectra.below([index])).for_each(|(sum, value)| *sum += value * turn);
                }
                sums.iter_mut().for_each(|value| *value /= turns.len() as f64);
            }
            sidebands
        })
    }

    /// Back to the recording's beginning, by frame.
    pub fn turns(&self, frequency_hz: f64, sideband: usize) -> Vec<Complex64> {
        let sign = [-1.0, 1.0][sideband];
        self.middles_s.iter().map(|time| Complex64::cis(sign * TAU * frequency_hz * time)).collect()
    }

    /// Sidebands with the phases of the recording's beginning.
    pub fn referenced(&self, frequency_hz: f64) -> Sidebands {
        let mut sidebands = self.sidebands(frequency_hz);
        for (sideband, values) in sidebands.iter_mut().enumerate() {
            for (frame, turn) in self.turns(frequency_hz, sideband).into_iter().enumerate() {
                values.below_mut([frame]).iter_mut().for_each(|value| *value *= turn);
            }
        }
        sidebands
    }
}

/// Ranges that are reached from some.
pub fn reached(first: usize, last: usize) -> RangeInclusive<usize> {
    first.saturating_sub(REACH)..=last + REACH
}

/// First and last of ranges to look at together, beside which there are static returns, and where nothing was taken out. `clutter`:
/// `[channel, bin]`.
fn windows(clutter: &Grid<Complex64, 2>, touched: &[bool]) -> Vec<[usize; 2]> {
    let [channels, bins] = clutter.shape();
    let mut powers = vec![0.0; bins];
    for channel in 0..channels {
        powers.iter_mut().zip(clutter.below([channel])).for_each(|(power, value)| *power += value.norm_sqr());
    }
    let all: f64 = powers.iter().sum();
    let of_width = |width: usize| {
        (0..(bins + 1).saturating_sub(width)).step_by(width.div_ceil(2)).map(move |first| [first, first + width - 1])
    };
    let beside = |&[first, last]: &[usize; 2]| {
        let reached = reached(first, last);
        let elsewhere: f64 = (0..bins).filter(|bin| !reached.contains(bin)).map(|bin| powers[bin]).sum();
        elsewhere >= ELSEWHERE * all
    };
    TOGETHER
        .into_iter()
        .flat_map(of_width)
        .filter(|[first, last]| !touched[*first..=*last].contains(&true))
        .filter(beside)
        .collect()
}
