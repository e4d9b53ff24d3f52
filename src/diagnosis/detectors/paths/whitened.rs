//! A frame after the covariance of the body's returns is undone, what that leaves of a tone, and what is expected without any.

use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::coloured::{Coloured, FINE};
use super::returns::Returns;
use super::scene::CLUTTER_BINS;
use crate::diagnosis::detectors::steering::steering;
use crate::diagnosis::prediction::range_and_velocity;
use crate::diagnosis::statistics::median;
use crate::diagnosis::vector::sine;
use crate::grid::Grid;

/// Draws of coloured noise, and fine cells to either side, from which it is estimated how much of a tone stays.
const DRAWS: usize = 4;
const AROUND: usize = 2;
/// Least share of the body's mean power that is expected in a beam which looks past it.
const BESIDE: f64 = 0.3;

pub struct Whitened {
    /// `[channel][loop · samples + sample]`
    pub channels: Vec<Vec<Complex64>>,
    /// Share of a tone's energy that is left, on the fine grid.
    pub share: Grid<f32, 2>,
    /// Power that a beam is expected to show without any tone, over the noise's, at the ranges that mean something.
    pub expected: Grid<f32, 3>,
}

impl Whitened {
    /// `sines`: of the beams; `fine`: the transform to the fine grid.
    pub fn new(returns: &Returns, frame: usize, sines: &[f64], fine: &Coloured) -> Self {
        let scene = returns.scene;
        let coloured = Coloured::new(scene.loops, scene.samples, returns.most(frame).into_values());
        let channels: Vec<Vec<Complex64>> =
            (0..scene.evidence.cube.channels()).map(|channel| coloured.whitened(&returns.moving(frame, channel))).collect();
        let share = share(&coloured, [FINE * scene.samples, FINE * scene.loops], frame);
        let mut expected = expected(returns, frame, sines, &share);
        // Static clutter is not the same in every frame where the receiver is not.
        let cells: Vec<Vec<Complex64>> = channels.iter().map(|channel| fine.cells(channel)).collect();
        raise_what_stands(returns, &cells, &share, &mut expected);
        Self { channels, share, expected }
    }
}

/// Power in every beam without any tone, over what it would be of noise alone.
fn expected(returns: &Returns, frame: usize, sines: &[f64], share: &Grid<f32, 2>) -> Grid<f32, 3> {
    let (scene, radar) = (returns.scene, &returns.scene.evidence.radar);
    let ([_, rows], columns, samples) = (share.shape(), FINE * scene.bins, scene.samples);
    let centre = radar.centre_m();
    let mut map = vec![0.0f32; scene.size()];
    let mut beams = vec![vec![0.0f32; scene.size()]; sines.len()];
    for (point, level) in returns.body(frame) {
        let (range_m, velocity) = range_and_velocity(radar, point.position_m, point.velocity_mps);
        let sine = sine(point.position_m, centre);
        scene.model.cells.deposit(&mut map, range_m, velocity, *level);
        for (beam, &towards) in beams.iter_mut().zip(sines) {
            let sum: Complex64 = steering(radar, towards - sine).iter().sum();
            scene.model.cells.deposit(beam, range_m, velocity, level * sum.norm_sqr() / radar.rx_m.len() as f64);
        }
    }
    let floor = scene.floor(frame);
    Grid::from_fn(["beam", "range", "doppler"], [sines.len(), columns, rows], |[beam, column, row]| {
        let range = column / FINE;
        let coarse = row / FINE * samples + range;
        let towards = f64::from((beams[beam][coarse] + 0.01) / (map[coarse] + 0.01)).max(BESIDE);
        let left = f64::from(share[[column, row]]);
        // Of the whitened power that share is noise's, and the rest the body's.
        let expected = (left + (1.0 - left) * towards) / left;
        (expected.max(floor[coarse].into()) * scene.shape[range]) as f32
    })
}

/// Raises what is expected beside zero Doppler to a share of the power of static clutter at each range. `cells`: by channel, of the
/// whitened samples on the fine grid.
fn raise_what_stands(returns: &Returns, cells: &[Vec<Complex64>], share: &Grid<f32, 2>, expected: &mut Grid<f32, 3>) {
    const STRONG: f64 = 100.0;
    const FEWEST: usize = 8;
    let (scene, clutter) = (returns.scene, &returns.clutter_power);
    let [beams, columns, rows] = expected.shape();
    let scale = 1.0 / (scene.size() * cells.len()) as f64;
    let power =
        |column: usize, row: usize| cells.iter().map(|channel| channel[column * rows + row].norm_sqr()).sum::<f64>() * scale;
    for slow in -CLUTTER_BINS..=CLUTTER_BINS {
        let row = (FINE as i64 * slow).rem_euclid(rows as i64) as usize;
        let mut shares: Vec<f64> = (0..scene.bins)
            .filter(|&range| clutter[range] > STRONG)
            .map(|range| {
                let column = FINE * range;
                let (left, usual) = (f64::from(share[[column, row]]), f64::from(expected[[0, column, row]]));
                (power(column, row) / (left * left) - 1.5 * usual).max(0.0) / clutter[range]
            })
            .collect();
        let smear = if shares.len() < FEWEST { 0.0 } else { 3.0 * median(&mut shares) };
        for beam in 0..beams {
            for column in 0..columns {
                for near in [row, (row + 1) % rows, (row + rows - 1) % rows] {
                    let value = &mut expected[[beam, column, near]];
                    *value = value.max((1.0 + smear * clutter[column / FINE]) as f32);
                }
            }
        }
    }
}

/// aᴴ C⁻¹ a over aᴴ a of every tone on the fine grid: the power of whitened noise over that of white noise.
fn share(coloured: &Coloured, shape: [usize; 2], seed: usize) -> Grid<f32, 2> {
    let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
    let none = Grid::filled(["range", "doppler"], shape, 0.0);
    let (mut above, mut below) = (none.clone(), none);
    for _ in 0..DRAWS {
        let [white, drawn] = coloured.draw(&mut random);
        for (sum, frame) in [(&mut above, coloured.whitened(&drawn)), (&mut below, white)] {
            sum.values_mut().iter_mut().zip(coloured.cells(&frame)).for_each(|(sum, value)| *sum += value.norm_sqr());
        }
    }
    let (above, below) = (smooth(above), smooth(below));
    Grid::from_fn(["range", "doppler"], shape, |cell| (above[cell] / below[cell].max(f64::MIN_POSITIVE)).clamp(1e-6, 1.0) as f32)
}

/// Sums over neighbours along both axes.
fn smooth(mut values: Grid<f64, 2>) -> Grid<f64, 2> {
    let [columns, rows] = values.shape();
    let mut along = |count: usize, length: usize, at: &dyn Fn(usize, usize) -> [usize; 2]| {
        let mut line = vec![0.0; length];
        for other in 0..count {
            (0..length).for_each(|i| line[i] = values[at(other, i)]);
            for i in 0..length {
                let near = (0..=2 * AROUND).map(|step| line[(i + length + step - AROUND) % length]);
                values[at(other, i)] = near.sum::<f64>();
            }
        }
    };
    along(columns, rows, &|column, row| [column, row]);
    along(rows, columns, &|row, column| [column, row]);
    values
}
