//! Taking what some cells of the range-Doppler maps hold out of the samples.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::diagnosis::evidence::{hann, transform};
use crate::diagnosis::{Correction, Cube, Evidence};

/// Directions of the cells' subspace that hold less than this share of a cell's energy are left alone.
const LEAST: f64 = 1e-3;
/// Cells of a frame that are taken out at once; more make the system of equations slow.
const MOST_CELLS: usize = 300;

/// Empties cells of some frames.
pub fn emptied(evidence: &Evidence, frames: Vec<(usize, Vec<usize>)>) -> Correction {
    let clutter = evidence.clutter().to_vec();
    Correction::samples(move |cube| frames.iter().for_each(|(frame, cells)| empty_cells(cube, &clutter, *frame, cells)))
}

/// Subtracts from a frame's moving part the smallest signal that empties the cells `[doppler · samples + range]`, in
/// every channel. `clutter` is static clutter, `[channel, sample]`.
fn empty_cells(cube: &mut Cube, clutter: &[Complex64], frame: usize, cells: &[usize]) {
    let cells = &cells[..cells.len().min(MOST_CELLS)];
    if cells.is_empty() {
        return;
    }
    let [_, _, _, loops, samples] = cube.dims;
    let (slow, fast) = (hann(loops), hann(samples));
    let Some(factor) = gram(cells, &slow, &fast).cholesky() else { return };
    for channel in 0..cube.channels() {
        let clutter = &clutter[channel * samples..][..samples];
        let moving: Vec<Complex64> = cube
            .channel(frame, channel)
            .chunks_exact(samples)
            .flat_map(|chirp| chirp.iter().zip(clutter).map(|(value, mean)| value - mean))
            .collect();
        let map = transform(&moving, samples);
        let amounts = factor.solve(&DVector::from_iterator(cells.len(), cells.iter().map(|&cell| map[cell])));
        let found = cube.channel_mut(frame, channel);
        for (cell, amount) in cells.iter().zip(&amounts) {
            let (doppler, range) = (cell / samples, cell % samples);
            let tone: Vec<Complex64> = (0..samples).map(|n| turn(range * n, samples) * fast[n]).collect();
            for (i, (window, chirp)) in slow.iter().zip(found.chunks_exact_mut(samples)).enumerate() {
                let weight = amount * turn(doppler * i, loops) * window;
                chirp.iter_mut().zip(&tone).for_each(|(value, tone)| *value -= weight * tone);
            }
        }
    }
}

/// Cells to empty for an expected map, largest first: where it is above `least`, and loud neighbours; never where `kept`.
pub fn patch(expected: &[f32], measured: &[f32], kept: &[bool], samples: usize, least: f32) -> Vec<usize> {
    /// Powers over the noise that noise alone hardly has.
    const LOUD: f32 = 2.5;
    let loops = expected.len() / samples;
    let mut chosen = vec![false; expected.len()];
    for cell in (0..expected.len()).filter(|&cell| expected[cell] > least) {
        chosen[cell] = true;
        for slow in -2..=2i64 {
            let row = ((cell / samples) as i64 + slow).rem_euclid(loops as i64) as usize * samples;
            for fast in -2..=2i64 {
                let near = row + ((cell % samples) as i64 + fast).rem_euclid(samples as i64) as usize;
                chosen[near] |= measured[near] > LOUD;
            }
        }
    }
    let mut cells: Vec<usize> = (0..expected.len()).filter(|&cell| chosen[cell] && !kept[cell]).collect();
    cells.sort_by(|&a, &b| (expected[b] + measured[b]).total_cmp(&(expected[a] + measured[a])));
    cells
}

fn turn(step: usize, length: usize) -> Complex64 {
    Complex64::cis(std::f64::consts::TAU * (step % length) as f64 / length as f64)
}

/// Inner products of the cells' windowed tones, with a small ridge.
fn gram(cells: &[usize], slow: &[f64], fast: &[f64]) -> DMatrix<Complex64> {
    let (loops, samples) = (slow.len(), fast.len());
    let along = |window: &[f64]| -> Vec<Complex64> {
        let length = window.len();
        (0..length)
            .map(|lag| window.iter().enumerate().map(|(n, w)| turn(lag * n, length).conj() * (w * w)).sum::<Complex64>())
            .collect()
    };
    let (slow, fast) = (along(slow), along(fast));
    DMatrix::from_fn(cells.len(), cells.len(), |i, j| {
        let (a, b) = (cells[i], cells[j]);
        let doppler = (a / samples + loops - b / samples) % loops;
        let range = (a % samples + samples - b % samples) % samples;
        slow[doppler] * fast[range] + if i == j { LEAST } else { 0.0 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_leaves_and_its_neighbour_stays() {
        let (loops, samples) = (32, 32);
        let tone = |doppler: f64, range: f64, i: usize| {
            let turns = doppler * (i / samples) as f64 / loops as f64 + range * (i % samples) as f64 / samples as f64;
            Complex64::cis(std::f64::consts::TAU * turns)
        };
        let signal: Vec<_> = (0..loops * samples).map(|i| tone(6.3, 9.6, i) + 0.1 * tone(-8.0, 20.0, i)).collect();
        let mut cube = Cube::new([1, 1, 1, loops, samples], signal.clone());
        let cells: Vec<usize> = (3..10).flat_map(|doppler| (7..13).map(move |range| doppler * samples + range)).collect();
        empty_cells(&mut cube, &vec![Complex64::ZERO; samples], 0, &cells);
        let (before, after) = (transform(&signal, samples), transform(&cube.samples, samples));
        let peak = before[6 * samples + 10].norm_sqr();
        for &cell in &cells {
            assert!(after[cell].norm_sqr() < 1e-4 * peak, "{cell}");
        }
        let other = 24 * samples + 20;
        assert!((after[other].norm_sqr() / before[other].norm_sqr() - 1.0).abs() < 0.05);
    }
}
