//! What a tone of every range, velocity and direction explains of a frame, against the noise and the body's returns.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::coloured::{Coloured, FINE};
use super::scene::{STILL_BINS, Scene};
use crate::diagnosis::Point;
use crate::diagnosis::cube::mean_chirp;
use crate::diagnosis::power::Cells;
use crate::diagnosis::prediction::range_and_velocity;
use crate::diagnosis::statistics::median;
use crate::diagnosis::suspects::clutter::still_power;
use crate::diagnosis::suspects::steering::{beam, power, sines, steering};

/// The body may return so much more than is expected of it.
const SAFETY: f64 = 2.0;
/// Share of a tone's power that errors of velocity and range carry into the neighbours on the fine grid.
const BLUR: f64 = 0.2;
/// Tones weaker than this share of the noise, in a transform, do not count.
const FAINTEST: f64 = 0.03;
/// Draws of coloured noise, and fine cells to either side, from which it is estimated how much of a tone stays.
const DRAWS: usize = 4;
const AROUND: usize = 2;
/// Least share of the body's mean power that is expected in a beam which looks past it.
const BESIDE: f64 = 0.3;

/// Samples after the body's covariance is undone, and what that leaves of a tone.
pub struct Beams<'a> {
    scene: &'a Scene<'a>,
    /// Beams: x over range.
    pub sines: Vec<f64>,
    frames: Vec<Option<Frame>>,
    /// Static clutter, `[channel · samples + sample]`.
    still: Vec<Complex64>,
    /// Mean power of the body's tones that is left in that, in a sample over the noise, by range.
    rest: Vec<f64>,
    /// Power of static clutter over the noise of a frame's map, by range.
    clutter: Vec<f64>,
    /// The body's points in every frame with the power that each is expected to have in the peak.
    body: Vec<Vec<(Point, f64)>>,
    /// The transform to the fine grid.
    fine: Coloured,
}

struct Frame {
    /// `[channel][loop · samples + sample]`
    whitened: Vec<Vec<Complex64>>,
    /// Share of a tone's energy that is left, `[range · doppler]` on the fine grid.
    share: Vec<f32>,
    /// Power that a beam is expected to show without any tone, over the noise's, `[beam][range · doppler]`.
    expected: Vec<Vec<f32>>,
}

/// A tone at one place and from one direction.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Energy of the tone that explains most, all receivers together, over the noise; mean over the transmitters.
    pub power: f64,
    /// The same without any tone.
    pub expected: f64,
    /// Share of `expected` that is the body's.
    pub body: f64,
}

impl<'a> Beams<'a> {
    pub fn new(scene: &'a Scene<'a>) -> Self {
        let evidence = scene.evidence;
        let mut beams = Self {
            scene,
            sines: sines(&evidence.radar),
            frames: (0..scene.frames()).map(|_| None).collect(),
            still: vec![],
            rest: vec![],
            clutter: still_power(evidence),
            body: (0..scene.frames()).into_par_iter().map(|frame| body(scene, frame)).collect(),
            fine: Coloured::new(scene.loops, scene.samples, vec![0.0; FINE * FINE * scene.size()]),
        };
        (beams.still, beams.rest) = beams.what_stands();
        beams
    }

    /// Looks at more frames.
    pub fn prepare(&mut self, frames: &[usize]) {
        let missing: Vec<usize> = frames.iter().copied().filter(|&frame| self.frames[frame].is_none()).collect();
        let made: Vec<Frame> = missing.par_iter().map(|&frame| self.frame(frame)).collect();
        missing.into_iter().zip(made).for_each(|(frame, made)| self.frames[frame] = Some(made));
    }

    /// The body's points in a frame with the power that each is expected to have in the peak.
    pub fn body(&self, frame: usize) -> &[(Point, f64)] {
        &self.body[frame]
    }

    pub fn rows(&self) -> usize {
        FINE * self.scene.loops
    }

    pub fn columns(&self) -> usize {
        FINE * self.scene.bins
    }

    /// Of every cell of the fine grid in a prepared frame, `[beam][range · doppler]`.
    pub fn looks(&self, frame: usize) -> Vec<Vec<Look>> {
        let Some(made) = &self.frames[frame] else { return vec![] };
        let cells: Vec<Vec<Complex64>> = made.whitened.iter().map(|channel| self.fine.cells(channel)).collect();
        let count = self.rows() * self.columns();
        let steering: Vec<Vec<Complex64>> = self.sines.iter().map(|&sine| self.steering(sine)).collect();
        let mut looks: Vec<Vec<Look>> = steering.iter().map(|_| Vec::with_capacity(count)).collect();
        let mut values = vec![Complex64::ZERO; cells.len()];
        for cell in 0..count {
            values.iter_mut().zip(&cells).for_each(|(value, cells)| *value = cells[cell]);
            for (beam, (looks, steering)) in looks.iter_mut().zip(&steering).enumerate() {
                looks.push(self.seen(made, cell, self.power(&values, steering), beam));
            }
        }
        looks
    }

    /// At any place (cells of the transform, not wrapped) and direction in a prepared frame.
    pub fn look(&self, frame: usize, place: (f64, f64), sine: f64) -> Option<Look> {
        let (made, values, cell) = self.values(frame, place)?;
        Some(self.seen(made, cell, self.power(&values, &self.steering(sine)), self.nearest(sine)))
    }

    /// Amplitudes `[channel]` of the most likely tone in units of each channel's samples.
    pub fn tone(&self, frame: usize, place: (f64, f64), sine: f64) -> Option<Vec<Complex64>> {
        let (made, values, cell) = self.values(frame, place)?;
        let rx_m = &self.scene.evidence.radar.rx_m;
        let left = (self.scene.loops * self.scene.samples * rx_m.len()) as f64 * f64::from(made.share[cell]);
        let noise = self.scene.evidence.noise();
        let steering = self.steering(sine);
        let amplitudes = values.chunks_exact(rx_m.len()).flat_map(|values| {
            let sum = beam(values, &steering) / left;
            steering.iter().map(move |turn| sum * turn.conj()).collect::<Vec<_>>()
        });
        Some(amplitudes.zip(noise).map(|(value, noise)| value * noise.sqrt()).collect())
    }

    fn values(&self, frame: usize, (doppler, range): (f64, f64)) -> Option<(&Frame, Vec<Complex64>, usize)> {
        let made = self.frames.get(frame)?.as_ref()?;
        let (loops, samples) = (self.scene.loops, self.scene.samples);
        let column = (FINE as f64 * range).round();
        if !(0.0..self.columns() as f64).contains(&column) {
            return None;
        }
        let row = ((FINE as f64 * doppler).round() as i64).rem_euclid(self.rows() as i64) as usize;
        let turns = |cells: f64, length: usize| -> Vec<Complex64> {
            (0..length).map(|i| Complex64::cis(-TAU * cells * i as f64 / length as f64)).collect()
        };
        let (slow, fast) = (turns(doppler, loops), turns(range, samples));
        let of_channel = |channel: &Vec<Complex64>| -> Complex64 {
            let chirps = channel.chunks_exact(samples).zip(&slow);
            chirps.map(|(chirp, turn)| chirp.iter().zip(&fast).map(|(a, b)| a * b).sum::<Complex64>() * turn).sum()
        };
        Some((made, made.whitened.iter().map(of_channel).collect(), column as usize * self.rows() + row))
    }

    /// Energy over the noise in a beam of the whitened cells, mean over the transmitters.
    fn power(&self, values: &[Complex64], steering: &[Complex64]) -> f64 {
        power(values, steering) / (self.scene.size() * values.len()) as f64
    }

    /// Undoes the phases that a direction has at the receivers.
    fn steering(&self, sine: f64) -> Vec<Complex64> {
        steering(&self.scene.evidence.radar, sine)
    }

    fn nearest(&self, sine: f64) -> usize {
        let apart = |beam: &usize| (self.sines[*beam] - sine).abs();
        (0..self.sines.len()).min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or(0)
    }

    fn seen(&self, made: &Frame, cell: usize, power: f64, beam: usize) -> Look {
        let share = f64::from(made.share[cell]);
        let expected = f64::from(made.expected[beam][cell]);
        Look { power: power / (share * share), expected, body: (1.0 - 1.0 / expected).clamp(0.0, 1.0) }
    }

    fn frame(&self, frame: usize) -> Frame {
        let evidence = self.scene.evidence;
        let (loops, samples) = (self.scene.loops, self.scene.samples);
        let (rows, all) = (FINE * loops, FINE * samples);
        let mut power = self.tones(frame);
        self.rest.iter().enumerate().for_each(|(range, rest)| power[FINE * range * rows] += rest);
        let power = blurred(&power, rows);
        let gain = (loops * samples) as f64;
        let power: Vec<f64> = power.iter().map(|power| if *power * gain < FAINTEST { 0.0 } else { SAFETY * power }).collect();
        let coloured = Coloured::new(loops, samples, power);
        let whitened: Vec<Vec<Complex64>> = (0..evidence.cube.channels())
            .map(|channel| {
                let mean = &self.still[channel * samples..][..samples];
                let scale = evidence.noise()[channel].max(f64::MIN_POSITIVE).sqrt().recip();
                let chirps = evidence.cube.channel(frame, channel).chunks_exact(samples);
                let moving: Vec<Complex64> =
                    chirps.flat_map(|chirp| chirp.iter().zip(mean).map(|(value, mean)| (value - mean) * scale)).collect();
                coloured.whitened(&moving)
            })
            .collect();
        let share = share(&coloured, rows, all, frame);
        let mut expected = self.expected(frame, &share);
        // Static clutter is not the same in every frame where the receiver is not.
        self.raise_what_stands(&whitened, &share, &mut expected);
        Frame { whitened, share, expected }
    }

    /// Mean power of the body's tones in a sample over the noise, on the fine grid `[range · doppler]`.
    fn tones(&self, frame: usize) -> Vec<f64> {
        let (loops, samples) = (self.scene.loops as f64, self.scene.samples as f64);
        let (rows, all) = (self.rows(), FINE * self.scene.samples);
        let mut power = vec![0.0; rows * all];
        // From the peak after two Hann windows to a sample.
        let gain = 2.25 / (loops * samples);
        for &(point, level) in self.body(frame) {
            let (range_m, velocity) = range_and_velocity(&self.scene.evidence.radar, point.position_m, point.velocity_mps);
            let (doppler, range) = self.scene.model.cells.place(range_m, velocity);
            let split = |place: f64, length: usize| {
                let low = (FINE as f64 * place).floor();
                let over = FINE as f64 * place - low;
                [0, 1].map(|step| {
                    ((low as i64 + step).rem_euclid(length as i64) as usize, if step == 0 { 1.0 - over } else { over })
                })
            };
            for (column, fast) in split(range, all) {
                for (row, slow) in split(doppler, rows) {
                    power[column * rows + row] += level * gain * fast * slow;
                }
            }
        }
        power
    }

    /// Static clutter, `[channel · samples + sample]`: the mean over the training frames, at every range of those most in
    /// which the body is elsewhere; and the power of the body that is left in it.
    fn what_stands(&self) -> (Vec<Complex64>, Vec<f64>) {
        let evidence = self.scene.evidence;
        let (loops, samples, training) = (self.scene.loops, self.scene.samples, &evidence.split.training);
        let rows = self.rows();
        // Share of a tone's power in the mean over a frame's loops, by Doppler; and in a range, by how far it is off.
        let share = |cells: f64, length: usize| {
            let angle = std::f64::consts::PI * cells;
            let below = length as f64 * (angle / length as f64).sin();
            if below.abs() < 1e-9 { 1.0 } else { (angle.sin() / below).powi(2) }
        };
        let slow: Vec<f64> = (0..rows).map(|row| share(row as f64 / FINE as f64, loops)).collect();
        let fast: Vec<f64> = (0..FINE * samples).map(|off| share(off as f64 / FINE as f64, samples)).collect();
        let at_rest = |&frame: &usize| -> Vec<f64> {
            let along = self
                .tones(frame)
                .chunks_exact(rows)
                .map(|cells| cells.iter().zip(&slow).map(|(a, b)| a * b).sum())
                .collect::<Vec<f64>>();
            let seen = |range: usize| {
                let off = |other: usize| (FINE * range + FINE * samples - other) % (FINE * samples);
                along.iter().enumerate().filter(|(_, power)| **power > 0.0).map(|(other, power)| power * fast[off(other)]).sum()
            };
            (0..samples).map(seen).collect()
        };
        let body: Vec<Vec<f64>> = training.par_iter().map(at_rest).collect();
        let weights: Vec<Vec<f64>> = body
            .iter()
            .map(|body| body.iter().map(|power| 1.0 / (1.0 / loops as f64 + SAFETY * samples as f64 * power)).collect())
            .collect();
        let total: Vec<f64> = (0..samples).map(|range| weights.iter().map(|weights| weights[range]).sum()).collect();
        let rest = (0..samples)
            .map(|range| {
                let left: f64 = body.iter().zip(&weights).map(|(body, weights)| body[range] * weights[range].powi(2)).sum();
                left / total[range].powi(2)
            })
            .collect();
        let mut planner = rustfft::FftPlanner::new();
        let (forward, inverse) = (planner.plan_fft_forward(samples), planner.plan_fft_inverse(samples));
        let of_channel = |channel: usize| -> Vec<Complex64> {
            let mut sum = vec![Complex64::ZERO; samples];
            for (&frame, weights) in training.iter().zip(&weights) {
                let mut mean = mean_chirp(evidence.cube.channel(frame, channel).chunks_exact(samples), samples);
                forward.process(&mut mean);
                sum.iter_mut()
                    .zip(mean)
                    .zip(weights.iter().zip(&total))
                    .for_each(|((sum, value), (weight, total))| *sum += value * (weight / total));
            }
            inverse.process(&mut sum);
            sum.iter().map(|value| value / samples as f64).collect()
        };
        ((0..evidence.cube.channels()).into_par_iter().flat_map_iter(of_channel).collect(), rest)
    }

    /// Power in every beam without any tone, over what it would be of noise alone, `[beam][range · doppler]`.
    fn expected(&self, frame: usize, share: &[f32]) -> Vec<Vec<f32>> {
        let (scene, rx_m) = (self.scene, &self.scene.evidence.radar.rx_m);
        let (samples, rows) = (scene.samples, self.rows());
        let cells: &Cells = &scene.model.cells;
        let centre = scene.evidence.radar.centre_m();
        let mut map = vec![0.0f32; scene.size()];
        let mut beams = vec![vec![0.0f32; scene.size()]; self.sines.len()];
        for (point, level) in self.body(frame) {
            let (range_m, velocity) = range_and_velocity(&scene.evidence.radar, point.position_m, point.velocity_mps);
            let way: [f64; 3] = std::array::from_fn(|axis| point.position_m[axis] - centre[axis]);
            let sine = way[0] / way.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-6);
            cells.deposit(&mut map, range_m, velocity, *level);
            for (beam, &towards) in beams.iter_mut().zip(&self.sines) {
                let sum: Complex64 = self.steering(towards - sine).iter().sum();
                cells.deposit(beam, range_m, velocity, level * sum.norm_sqr() / rx_m.len() as f64);
            }
        }
        let floor = scene.floor(frame);
        let of_beam = |beam: &Vec<f32>| -> Vec<f32> {
            (0..rows * self.columns())
                .map(|cell| {
                    let (range, row) = ((cell / rows) / FINE, (cell % rows) / FINE);
                    let coarse = row * samples + range;
                    let towards = f64::from((beam[coarse] + 0.01) / (map[coarse] + 0.01)).max(BESIDE);
                    let left = f64::from(share[cell]);
                    // Of the whitened power that share is noise's, and the rest the body's.
                    let expected = (left + (1.0 - left) * towards) / left;
                    (expected.max(floor[coarse].into()) * scene.shape[range]) as f32
                })
                .collect()
        };
        beams.iter().map(of_beam).collect()
    }

    /// Raises what is expected beside zero Doppler to a share of the power that stands at each range.
    fn raise_what_stands(&self, whitened: &[Vec<Complex64>], share: &[f32], expected: &mut [Vec<f32>]) {
        const STRONG: f64 = 100.0;
        const FEWEST: usize = 8;
        let clutter = &self.clutter;
        let (rows, bins) = (self.rows(), self.scene.bins);
        let cells: Vec<Vec<Complex64>> = whitened.iter().map(|channel| self.fine.cells(channel)).collect();
        let scale = 1.0 / (self.scene.size() * whitened.len()) as f64;
        for slow in -STILL_BINS..=STILL_BINS {
            let row = (FINE as i64 * slow).rem_euclid(rows as i64) as usize;
            let power = |cell: usize| cells.iter().map(|channel| channel[cell].norm_sqr()).sum::<f64>() * scale;
            let mut shares: Vec<f64> = (0..bins)
                .filter(|&range| clutter[range] > STRONG)
                .map(|range| {
                    let cell = FINE * range * rows + row;
                    let (left, usual) = (f64::from(share[cell]), f64::from(expected[0][cell]));
                    (power(cell) / (left * left) - 1.5 * usual).max(0.0) / clutter[range]
                })
                .collect();
            let smear = if shares.len() < FEWEST { 0.0 } else { 3.0 * median(&mut shares) };
            for beam in expected.iter_mut() {
                for range in 0..self.columns() {
                    for near in [row, (row + 1) % rows, (row + rows - 1) % rows] {
                        let cell = range * rows + near;
                        beam[cell] = beam[cell].max((1.0 + smear * clutter[range / FINE]) as f32);
                    }
                }
            }
        }
    }
}

/// The body's points, other ways included, with the power that each is expected to have in the peak.
fn body(scene: &Scene, frame: usize) -> Vec<(Point, f64)> {
    let radar = &scene.evidence.radar;
    let Some(body) = &scene.evidence.body else { return vec![] };
    let points = body.with_echoes(radar, body.frames[frame].clone(), None);
    let level = |point: Point| (point, scene.model.peak(radar, point));
    points.into_iter().map(level).filter(|(_, power)| *power > 0.0 && power.is_finite()).collect()
}

/// A little of every cell's power moved to its neighbours.
fn blurred(power: &[f64], rows: usize) -> Vec<f64> {
    let count = power.len() / rows;
    let mut along = vec![0.0; power.len()];
    for (cell, &value) in power.iter().enumerate().filter(|(_, value)| **value > 0.0) {
        let (column, row) = (cell / rows, cell % rows);
        along[cell] += (1.0 - 2.0 * BLUR) * value;
        [(row + 1) % rows, (row + rows - 1) % rows].into_iter().for_each(|near| along[column * rows + near] += BLUR * value);
    }
    let mut result = vec![0.0; power.len()];
    for (cell, &value) in along.iter().enumerate().filter(|(_, value)| **value > 0.0) {
        let (column, row) = (cell / rows, cell % rows);
        result[cell] += (1.0 - 2.0 * BLUR) * value;
        [(column + 1) % count, (column + count - 1) % count]
            .into_iter()
            .for_each(|near| result[near * rows + row] += BLUR * value);
    }
    result
}

/// aᴴ C⁻¹ a over aᴴ a of every tone on the fine grid: the power of whitened noise over that of white noise.
fn share(coloured: &Coloured, rows: usize, columns: usize, seed: usize) -> Vec<f32> {
    let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
    let (mut above, mut below) = (vec![0.0; rows * columns], vec![0.0; rows * columns]);
    for _ in 0..DRAWS {
        let [white, drawn] = coloured.draw(&mut random);
        for (sum, frame) in [(&mut above, coloured.whitened(&drawn)), (&mut below, white)] {
            sum.iter_mut().zip(coloured.cells(&frame)).for_each(|(sum, value)| *sum += value.norm_sqr());
        }
    }
    let (above, below) = (smooth(above, rows), smooth(below, rows));
    above.iter().zip(below).map(|(above, below)| (above / below.max(f64::MIN_POSITIVE)).clamp(1e-6, 1.0) as f32).collect()
}

/// Means over neighbours along both axes.
fn smooth(mut values: Vec<f64>, rows: usize) -> Vec<f64> {
    let columns = values.len() / rows;
    let mut along = |count: usize, length: usize, at: &dyn Fn(usize, usize) -> usize| {
        let mut line = vec![0.0; length];
        for other in 0..count {
            (0..length).for_each(|i| line[i] = values[at(other, i)]);
            for i in 0..length {
                let near = (0..=2 * AROUND).map(|step| line[(i + length + step - AROUND) % length]);
                values[at(other, i)] = near.sum::<f64>();
            }
        }
    };
    along(columns, rows, &|column, row| column * rows + row);
    along(rows, columns, &|row, column| column * rows + row);
    values
}
