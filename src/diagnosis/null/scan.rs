//! Is there anything beside body and room? Power beyond the noise's, wherever it is and of whatever extent.
//!
//! Where neither is, a recording with nothing missing holds thermal noise: complex Gaussian, independent between channels, with a level
//! of its own in every channel and at every beat frequency. Whitened cells are scanned in boxes of all sizes along frame, Doppler and
//! range, for the mean of the channels and for each of the orthogonal beams that their DFT makes; the largest log-likelihood ratio of an
//! excess counts. It has no law in closed form (boxes overlap, windows correlate neighbours, levels are estimated), so its law is drawn:
//! a parametric bootstrap with refit, in which noise of the same extent goes through the same levels, beams and boxes, the body's cells
//! left out alike. A Gumbel law through the draws, to which maxima of exponential tails tend, gives chances between and beyond them.

use hybridsim_fft::FftPlanner32;
use num_complex::Complex32;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::diagnosis::Evidence;
use crate::diagnosis::locate::{Table, intervals};
use crate::diagnosis::power::CLUTTER_BINS;
use crate::diagnosis::statistics::{exponential_scale, gumbel_tail, median};
use crate::grid::Grid;

/// Draws of the null.
const DRAWS: u64 = 99;
/// Fewest loops of which some Doppler bins are free of static clutter.
const FEWEST_LOOPS: usize = 8;
/// Quantile that the noise's level is taken from: large values do not count.
const QUANTILE: f64 = 0.35;
/// Range bins to either side that share a level, at most.
const MOST_BESIDE: usize = 2;
/// Cells that a level is taken from where so many are near: its deviation is then (q / (1 − q) / n)^½ / −ln(1 − q), a sixth. Fewer bins
/// share one then, as what an inverted law makes of the noise may be steep.
const ENOUGH: usize = 100;
/// Complex values that are looked at, at most: whole frames, evenly spread.
const MOST_VALUES: usize = 4_000_000;
/// Squared correlation of cells under a Hann window that are one and two apart.
const CORRELATIONS: [f64; 2] = [4.0 / 9.0, 1.0 / 36.0];

/// Axes of spectra.
const SPECTRA: [&str; 4] = ["frame", "channel", "doppler", "range"];

/// Chances of an excess as strong as the strongest in noise alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chances {
    /// In all frames.
    pub all: f64,
    /// In the training frames, which the noise's levels come from, and in those held out, which nothing was fitted to.
    pub training: f64,
    pub held_out: f64,
}

/// None where body and room leave no cell, or where there is no noise at all.
pub fn scan(evidence: &Evidence, seed: u64) -> Option<Chances> {
    let (cells, spectra) = Cells::of(evidence)?;
    let found = cells.strongest(&spectra)?;
    // Draws of their own for every recording, so that what they do not tell of the law errs independently.
    let seed = seed ^ found[0].to_bits();
    let drawn: Vec<[f64; 3]> = (0..DRAWS).into_par_iter().filter_map(|draw| cells.strongest(&cells.noise(seed, draw))).collect();
    let chance = |which: usize| gumbel_tail(found[which], drawn.iter().map(|drawn| drawn[which]).collect());
    Some(Chances { all: chance(0), training: chance(1), held_out: chance(2) })
}

/// Which cells are looked at, and what is expected there.
struct Cells {
    channels: usize,
    /// Expected power over the noise's; zero for cells that are not looked at.
    expected: Grid<f32, 3>,
    /// All frames, those that the levels are taken from, and those held out.
    parts: [Part; 3],
}

/// Some frames, and what all spectra share in them.
struct Part {
    /// Indices along the first axis.
    frames: Vec<usize>,
    /// Cells that are looked at.
    counts: Table,
    boxes: [Vec<Interval>; 3],
}

impl Cells {
    /// With the spectra.
    fn of(evidence: &Evidence) -> Option<(Self, Grid<Complex32, 4>)> {
        let [_, _, _, loops, samples] = evidence.cube.dims;
        let (channels, bins) = (evidence.cube.channels(), evidence.range_bins());
        let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
        let values = (training.len() + held_out.len()) * channels * loops * bins;
        let step = values.div_ceil(MOST_VALUES).max(1);
        let mut frames: Vec<usize> = training.iter().copied().step_by(step).collect();
        let first_held_out = frames.len();
        frames.extend(held_out.iter().step_by(step));
        let expected = Grid::from_fn(["frame", "doppler", "range"], [frames.len(), loops, bins], |[frame, doppler, range]| {
            expected(evidence, frames[frame], doppler, doppler * samples + range)
        });
        let of_frame = |&frame: &usize| {
            let maps = (0..channels).flat_map(move |channel| {
                let map = evidence.range_doppler(frame, channel);
                (0..loops * bins).map(move |i| map[i / bins * samples + i % bins])
            });
            maps.map(|value| Complex32::new(value.re as f32, value.im as f32))
        };
        let values: Vec<Complex32> = frames.par_iter().flat_map_iter(of_frame).collect();
        let spectra = Grid::new(SPECTRA, [frames.len(), channels, loops, bins], values);
        let parts = [0..frames.len(), 0..first_held_out, first_held_out..frames.len()].map(|part| {
            let dims = [part.len(), loops, bins];
            let looked_at =
                |[frame, doppler, range]: [usize; 3]| f64::from(u8::from(expected[[part.start + frame, doppler, range]] > 0.0));
            let counts = Table::new(dims, looked_at);
            let boxes = dims.map(|length| intervals(length).into_iter().map(Interval::from).collect());
            Part { frames: part.collect(), counts, boxes }
        });
        let seen = expected.values().iter().any(|power| *power > 0.0);
        let usable = seen && spectra.values().iter().all(|value| value.is_finite());
        usable.then_some((Self { channels, expected, parts }, spectra))
    }

    /// White noise under Hann windows.
    fn noise(&self, seed: u64, stream: u64) -> Grid<Complex32, 4> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        let [frames, loops, bins] = self.expected.shape();
        // White noise has a white transform, in which a Hann window is a difference of neighbours.
        let window = |before: Complex32, here: Complex32, after: Complex32| (here * 2.0 - before - after) * 6f32.sqrt().recip();
        let mut white = vec![Complex32::ZERO; loops * bins];
        let mut along = white.clone();
        let mut values = Grid::filled(SPECTRA, [frames, self.channels, loops, bins], Complex32::ZERO);
        for map in values.values_mut().chunks_exact_mut(loops * bins) {
            white.fill_with(|| Complex32::new(StandardNormal.sample(&mut random), StandardNormal.sample(&mut random)));
            for (along, white) in along.chunks_exact_mut(bins).zip(white.chunks_exact(bins)) {
                for (range, value) in along.iter_mut().enumerate() {
                    *value = window(white[(range + bins - 1) % bins], white[range], white[(range + 1) % bins]);
                }
            }
            for (doppler, row) in map.chunks_exact_mut(bins).enumerate() {
                let [before, after] = [doppler + loops - 1, doppler + 1].map(|doppler| &along[doppler % loops * bins..][..bins]);
                for (range, value) in row.iter_mut().enumerate() {
                    *value = window(before[range], along[doppler * bins + range], after[range]);
                }
            }
        }
        values
    }

    /// Largest log-likelihood ratios in all frames and in both parts of them.
    fn strongest(&self, spectra: &Grid<Complex32, 4>) -> Option<[f64; 3]> {
        let beams = self.beams(spectra, &self.levels(spectra)?);
        Some(self.parts.each_ref().map(|part| self.largest(&beams, part)))
    }

    /// Of the noise's power in the training frames, `[channel, range]`. None where a channel has none.
    fn levels(&self, spectra: &Grid<Complex32, 4>) -> Option<Vec<f64>> {
        let [_, loops, bins] = self.expected.shape();
        let mut levels = Vec::with_capacity(self.channels * bins);
        for channel in 0..self.channels {
            let mut powers: Vec<Vec<f64>> = vec![vec![]; bins];
            for (frame, doppler) in self.parts[1].frames.iter().flat_map(|&frame| (0..loops).map(move |doppler| (frame, doppler)))
            {
                let (expected, spectrum) = (self.expected.below([frame, doppler]), spectra.below([frame, channel, doppler]));
                for ((powers, &expected), value) in powers.iter_mut().zip(expected).zip(spectrum) {
                    if expected > 0.0 {
                        powers.push(f64::from(value.norm_sqr() / expected));
                    }
                }
            }
            let near = |range: usize, beside: usize| {
                (0..(2 * beside + 1).min(bins)).map(move |i| (range + bins + i - beside.min(bins / 2)) % bins)
            };
            let count = |range: usize, beside: usize| near(range, beside).map(|range| powers[range].len()).sum::<usize>();
            let level = |range: usize| {
                let is_enough = |beside: &usize| *beside == MOST_BESIDE || count(range, *beside) >= ENOUGH;
                let beside = (0..=MOST_BESIDE).find(is_enough).unwrap_or(MOST_BESIDE);
                let mut near: Vec<f64> = near(range, beside).flat_map(|range| powers[range].iter().copied()).collect();
                exponential_scale(&mut near, QUANTILE)
            };
            let own: Vec<f64> = (0..bins).map(level).collect();
            // Where the body always is, nothing tells the level; nothing is asked there in these frames either.
            let middle = median(&mut own.iter().copied().filter(|level| *level > 0.0).collect::<Vec<f64>>());
            if middle <= 0.0 {
                return None;
            }
            levels.extend(own.into_iter().map(|level| if level > 0.0 { level } else { middle }));
        }
        Some(levels)
    }

    /// Whitened power in every beam, and the mean of all last.
    fn beams(&self, spectra: &Grid<Complex32, 4>, levels: &[f64]) -> Grid<f32, 4> {
        let [frames, loops, bins] = self.expected.shape();
        let channels = self.channels;
        let scales: Vec<f32> = levels.iter().map(|level| (level * channels as f64).sqrt().recip() as f32).collect();
        let fft = FftPlanner32::new().plan_fft_forward(channels);
        let mut scratch = vec![Complex32::ZERO; fft.get_inplace_scratch_len()];
        let mut column = vec![Complex32::ZERO; channels];
        let mut beams = Grid::filled(["beam", "frame", "doppler", "range"], [channels + 1, frames, loops, bins], 0.0);
        let rows = (0..frames).flat_map(|frame| (0..loops).map(move |doppler| (frame, doppler)));
        let cells = rows.flat_map(|(frame, doppler)| (0..bins).map(move |range| [frame, doppler, range]));
        for at @ [frame, doppler, range] in cells.filter(|&at| self.expected[at] > 0.0) {
            let expected = self.expected[at];
            for (channel, value) in column.iter_mut().enumerate() {
                *value = spectra[[frame, channel, doppler, range]] * scales[channel * bins + range];
            }
            fft.process_with_scratch(&mut column, &mut scratch);
            for (beam, value) in column.iter().enumerate() {
                beams[[beam, frame, doppler, range]] = value.norm_sqr() / expected;
            }
            beams[[channels, frame, doppler, range]] =
                column.iter().map(|value| value.norm_sqr()).sum::<f32>() / (expected * channels as f32);
        }
        beams
    }

    /// Of all boxes of some frames, in all beams.
    fn largest(&self, beams: &Grid<f32, 4>, part: &Part) -> f64 {
        let [_, loops, bins] = self.expected.shape();
        let [in_frames, in_doppler, in_range] = &part.boxes;
        let mut largest = 0.0f64;
        let (mut sums_before, mut counts_before) = (vec![], vec![]);
        for beam in 0..=self.channels {
            let together = if beam == self.channels { self.channels as f64 } else { 1.0 };
            let power = |[frame, doppler, range]: [usize; 3]| f64::from(beams[[beam, part.frames[frame], doppler, range]]);
            let sums = Table::new([part.frames.len(), loops, bins], power);
            for frames in in_frames {
                for doppler in in_doppler {
                    let [frames, dopplers] = [frames, doppler].map(|interval| [interval.low, interval.high]);
                    part.counts.along(frames, dopplers, &mut counts_before);
                    sums.along(frames, dopplers, &mut sums_before);
                    for range in in_range {
                        let [count, sum] = [&counts_before, &sums_before].map(|before| before[range.high] - before[range.low]);
                        if sum <= count || count < 0.5 {
                            continue;
                        }
                        let independent = together * count * doppler.independent * range.independent;
                        let excess = sum / count - 1.0;
                        // x − ln(1 + x) is less than x²/2: most boxes need no logarithm.
                        if 0.5 * independent * excess * excess > largest {
                            largest = largest.max(independent * (excess - excess.ln_1p()));
                        }
                    }
                }
            }
        }
        largest
    }
}

/// Expected power over the noise's; zero where body or room is.
fn expected(evidence: &Evidence, frame: usize, doppler: usize, cell: usize) -> f32 {
    let loops = evidence.cube.dims[3];
    let in_clutter = loops < FEWEST_LOOPS || doppler.min(loops - doppler) <= CLUTTER_BINS;
    let range = cell % evidence.cube.dims[4];
    match evidence.power() {
        _ if in_clutter || !evidence.noise_bins().contains(&range) => 0.0,
        Some(model) if model.support(frame)[cell] => 0.0,
        Some(model) => model.expected(frame)[cell],
        None => 1.0,
    }
}

/// Half open.
struct Interval {
    low: usize,
    high: usize,
    /// Share of its cells that is independent under a Hann window.
    independent: f64,
}

impl From<(usize, usize)> for Interval {
    fn from((low, high): (usize, usize)) -> Self {
        let cells = (high - low) as f64;
        let pairs = CORRELATIONS.iter().zip([1.0, 2.0]).map(|(square, apart)| 2.0 * square * (cells - apart).max(0.0));
        Self { low, high, independent: 1.0 / (1.0 + pairs.sum::<f64>() / cells) }
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::diagnosis::statistics::uniform_chance;
    use crate::radar::{Radar, Sampling};

    fn radar(loops: usize) -> Radar {
        Radar { samples_per_chirp: 32, loops_per_frame: loops, ..Radar::mmmesh(6) }
    }

    #[test]
    fn chances_in_noise_are_uniform_and_a_faint_line_is_seen() {
        let chances = |seed: u64, line: f64| {
            let signal = |[frame, _, index, sample]: [usize; 4]| {
                Complex64::cis(1.3 * frame as f64 + 1.1 * index as f64 + 0.9 * sample as f64) * line
            };
            scan(&Evidence::in_noise(radar(16), seed, signal), 1).unwrap()
        };
        let nulls: Vec<Chances> = (0..60).map(|seed| chances(seed, 0.0)).collect();
        let parts: [fn(&Chances) -> f64; 3] = [|null| null.all, |null| null.training, |null| null.held_out];
        for part in parts {
            let values: Vec<f64> = nulls.iter().map(part).collect();
            assert!(uniform_chance(&values) > 0.02, "{values:?}");
        }
        // 17 dB below the noise of a sample.
        assert!(chances(7, 0.2).all < 1e-6, "{:?}", chances(7, 0.2));
    }

    #[test]
    fn chances_are_uniform_without_quadrature() {
        let real = Radar { sampling: Sampling::Real, frames: 24, ..radar(16) };
        let nulls = (0..20).map(|seed| scan(&Evidence::in_noise(real.clone(), seed, |_| Complex64::ZERO), 1).unwrap().all);
        let values: Vec<f64> = nulls.collect();
        assert!(uniform_chance(&values) > 0.02, "{values:?}");
    }

    #[test]
    fn few_loops_and_empty_channels_are_no_trouble() {
        for loops in 1..FEWEST_LOOPS {
            assert_eq!(scan(&Evidence::in_noise(radar(loops), 3, |_| Complex64::ZERO), 1), None);
        }
        let mut silent = Evidence::in_noise(radar(16), 3, |_| Complex64::ZERO);
        silent.cube.samples.iter_mut().for_each(|value| *value = Complex64::ZERO);
        assert_eq!(scan(&silent.changed(), 1), None);
    }
}
