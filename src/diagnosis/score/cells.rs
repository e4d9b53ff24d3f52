//! Cells of range and Doppler in which what an operator puts there stands out of the signal that it acts on.
//!
//! A cell's own returns have free amplitudes: a small change of them is no evidence. So a cell counts where what the effect can put there
//! exceeds, by far, all that the clean signal has around it in any channel. What is left there is noise, weak movers, and the effect.

use std::ops::Range;
use std::sync::Arc;

use num_complex::Complex64;

use super::directions::{Amplitudes, Direction, Drive};
use crate::diagnosis::cube::mean_chirp;
use crate::diagnosis::evidence::{Evidence, blackman_harris, denoised, transform_under};
use crate::grid::Grid;

/// Cells to each side that the windows' main lobes fill (Blackman-Harris, four terms: Harris 1978, table 1).
pub const LOBE: usize = 4;
/// The signal around a cell is at most this share of the power that the effect can put there: 10 dB below.
const APART: f64 = 0.1;
/// Power that the effect can put there over the noise, below which a cell cannot add to the evidence.
const LEAST: f64 = 0.03;

/// One cell of a channel.
#[derive(Clone, Debug)]
pub struct Cell {
    pub receiver: usize,
    pub doppler: usize,
    pub range: usize,
    pub found: Complex64,
    /// Its variance.
    pub noise: f64,
    /// Derivative of what is expected by every amplitude.
    pub tangents: Vec<Complex64>,
}

impl Cell {
    pub fn expected(&self, amplitudes: &Amplitudes) -> Complex64 {
        self.tangents.iter().zip(amplitudes.of(self.receiver)).map(|(tangent, amplitude)| tangent * *amplitude).sum()
    }
}

/// What changes within a frame, and what does not.
#[derive(Clone, Copy, Debug)]
pub enum Part {
    Moving,
    Clutter,
}

/// Cells by which an effect's pattern is shifted, `[doppler, range]`: none is where the effect puts it.
pub type Shift = [usize; 2];

/// What changes within a frame, `[doppler, range]`, and what does not, `[0, range]`.
struct Maps {
    moving: Grid<Complex64, 2>,
    clutter: Grid<Complex64, 2>,
}

/// Of the windows over loops and samples.
struct Windows {
    slow: Vec<f64>,
    fast: Vec<f64>,
}

impl Windows {
    fn new(loops: usize, samples: usize) -> Self {
        Self { slow: blackman_harris(loops), fast: blackman_harris(samples) }
    }

    /// Of one channel, `[loop · sample]`.
    fn maps(&self, channel: &[Complex64]) -> Maps {
        let (loops, samples) = (self.slow.len(), self.fast.len());
        let mean = mean_chirp(channel.chunks_exact(samples), samples);
        let moving: Vec<Complex64> =
            channel.chunks_exact(samples).flat_map(|chirp| chirp.iter().zip(&mean).map(|(value, mean)| value - mean)).collect();
        let grid = |loops: usize, values: Vec<Complex64>| Grid::new(["doppler", "range"], [loops, samples], values);
        Maps {
            moving: grid(loops, transform_under(&moving, &self.slow, &self.fast)),
            clutter: grid(1, transform_under(&mean, &[1.0], &self.fast)),
        }
    }
}

/// Largest power of any channel within the lobes around every cell.
fn around<'a>(maps: impl Iterator<Item = &'a Grid<Complex64, 2>>) -> Option<Grid<f64, 2>> {
    let largest = |mut most: Grid<f64, 2>, map: &Grid<Complex64, 2>| {
        most.values_mut().iter_mut().zip(map.values()).for_each(|(most, value)| *most = most.max(value.norm_sqr()));
        most
    };
    let mut maps = maps.peekable();
    let [loops, samples] = maps.peek()?.shape();
    let most = maps.fold(Grid::filled(["doppler", "range"], [loops, samples], 0.0), largest);
    let over = |count: usize, index: usize, value: &dyn Fn(usize) -> f64| {
        let reach = LOBE.min(count / 2);
        (0..=2 * reach).map(|offset| value((index + count + offset - reach) % count)).fold(0.0, f64::max)
    };
    let axes = ["doppler", "range"];
    let by_range = Grid::from_fn(axes, [loops, samples], |[d, r]| over(samples, r, &|r| most[[d, r]]));
    Some(Grid::from_fn(axes, [loops, samples], |[d, r]| over(loops, d, &|d| by_range[[d, r]])))
}

/// What effects share of one frame.
struct Shared {
    /// By channel: noise of a cell, and what was found.
    noise: Vec<f64>,
    found: Vec<Maps>,
    /// Largest power of the clean signal around a cell: what moves, and what does not.
    around: [Option<Grid<f64, 2>>; 2],
    receivers: usize,
    /// Range bins in which noise is observed.
    ranges: Range<usize>,
}

/// What an effect can put into the cells of one frame.
pub struct Pattern {
    shared: Arc<Shared>,
    /// By amplitude and channel.
    tangents: Vec<Vec<Maps>>,
    /// What each amplitude can be at most.
    most: Vec<f64>,
    /// Sum over all samples of |tangent|², by amplitude.
    pub energies: Vec<f64>,
}

/// Patterns of a frame, by effect.
pub fn of_frame(evidence: &Evidence, effects: &[(Drive, Vec<Direction>)], frame: usize) -> Vec<Pattern> {
    let [_, _, receivers, loops, samples] = evidence.cube.dims;
    let windows = Windows::new(loops, samples);
    let clean = denoised::frame(evidence, frame).concat();
    let of_clean: Vec<Maps> = clean.chunks_exact(loops * samples).map(|channel| windows.maps(channel)).collect();
    let shared = Arc::new(Shared {
        noise: evidence.noise().iter().map(|noise| noise.max(f64::MIN_POSITIVE)).collect(),
        found: (0..evidence.cube.channels()).map(|channel| windows.maps(evidence.cube.channel(frame, channel))).collect(),
        around: [around(of_clean.iter().map(|maps| &maps.moving)), around(of_clean.iter().map(|maps| &maps.clutter))],
        receivers,
        ranges: evidence.noise_bins(),
    });
    let energy = |values: &[Complex64]| values.iter().map(Complex64::norm_sqr).sum::<f64>();
    let of_effect = |(drive, directions): &(Drive, Vec<Direction>)| {
        let mut pattern = Pattern { shared: shared.clone(), tangents: vec![], most: vec![], energies: vec![] };
        for &direction in directions {
            let tangent = drive.tangent(&clean, frame, direction);
            let of_tangent = energy(&tangent);
            // As far as it is believed, or until it is as strong as the signal.
            let believed = direction.parameter.most - direction.parameter.neutral;
            pattern.most.push(believed.min((energy(&clean) / of_tangent.max(f64::MIN_POSITIVE)).sqrt()));
            pattern.energies.push(of_tangent);
            pattern.tangents.push(tangent.chunks_exact(loops * samples).map(|channel| windows.maps(channel)).collect());
        }
        pattern
    };
    effects.iter().map(of_effect).collect()
}

impl Pattern {
    /// Cells where the pattern, shifted, stands out of the signal.
    pub fn cells(&self, part: Part, [by_doppler, by_range]: Shift) -> Vec<Cell> {
        let Shared { noise, found, around, receivers, ranges } = &*self.shared;
        let (of, around): (fn(&Maps) -> &Grid<Complex64, 2>, _) = match part {
            Part::Moving => (|maps| &maps.moving, &around[0]),
            Part::Clutter => (|maps| &maps.clutter, &around[1]),
        };
        let Some(around) = around else { return vec![] };
        let mut cells = vec![];
        let [rows, samples] = around.shape();
        let [loops, _] = found[0].moving.shape();
        for (channel, found) in found.iter().enumerate() {
            // The mean over a frame's chirps has as much less noise.
            let noise = noise[channel] * rows as f64 / loops as f64;
            for doppler in dopplers(rows) {
                for range in ranges.clone() {
                    let at = [doppler, range];
                    let from = [(doppler + rows - by_doppler) % rows, (range + samples - by_range) % samples];
                    let tangents = || self.tangents.iter().map(|channels| of(&channels[channel])[from]);
                    let reaches = tangents().zip(&self.most).map(|(tangent, most)| tangent.norm_sqr() * most * most);
                    let reach = reaches.fold(0.0, f64::max);
                    if reach > LEAST * noise && around[at] < APART * reach {
                        let (receiver, found) = (channel % receivers, of(found)[at]);
                        cells.push(Cell { receiver, doppler, range, found, noise, tangents: tangents().collect() });
                    }
                }
            }
        }
        cells
    }

    /// Cells where the pattern is, with what was undone there put back to first order.
    pub fn put_back(&self, part: Part, undone: &Amplitudes) -> Vec<Cell> {
        let mut cells = self.cells(part, Shift::default());
        cells.iter_mut().for_each(|cell| cell.found += cell.expected(undone));
        cells
    }

    /// Shifts that share no main lobe, at most so many, evenly spread: along range, and along Doppler of what moves.
    pub fn shifts(&self, part: Part, most: usize) -> Vec<Shift> {
        let [loops, samples] = self.shared.found[0].moving.shape();
        let along = |count: usize| (0..count).step_by(LOBE + 1).filter(move |shift| *shift == 0 || count - shift > LOBE);
        let rows = match part {
            Part::Moving => loops,
            Part::Clutter => 1,
        };
        let all: Vec<Shift> = along(rows).flat_map(|doppler| along(samples).map(move |range| [doppler, range])).skip(1).collect();
        let count = all.len().min(most);
        (0..count).map(|index| all[index * all.len() / count]).collect()
    }
}

/// Doppler cells beyond what the mean over a frame's chirps leaves near zero; the one of a mean itself.
fn dopplers(loops: usize) -> impl Iterator<Item = usize> {
    let lobe = LOBE.min(loops / 4);
    (0..loops).filter(move |&doppler| loops == 1 || doppler.min(loops - doppler) > lobe)
}
