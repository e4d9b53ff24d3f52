//! What arrives without any further tone: the body's returns, and static clutter.

use num_complex::Complex64;
use rayon::prelude::*;

use super::coloured::FINE;
use super::scene::Scene;
use crate::diagnosis::Point;
use crate::diagnosis::cube::mean_chirp;
use crate::diagnosis::detectors::clutter::clutter_power;
use crate::diagnosis::prediction::range_and_velocity;
use crate::grid::Grid;

/// The body may return so much more than is expected of it.
const SAFETY: f64 = 2.0;
/// Share of a tone's power that errors of velocity and range carry into the neighbours on the fine grid.
const BLUR: f64 = 0.2;
/// Tones weaker than this share of the noise, in a transform, do not count.
const FAINTEST: f64 = 0.03;

pub struct Returns<'a> {
    pub scene: &'a Scene<'a>,
    /// Static clutter, `[channel · samples + sample]`.
    clutter: Vec<Complex64>,
    /// Mean power of the body's tones that is left in that, in a sample over the noise, by range.
    rest: Vec<f64>,
    /// Power of static clutter over the noise of a frame's map, by range.
    pub clutter_power: Vec<f64>,
    /// The body's points in every frame with the power that each is expected to have in the peak.
    body: Vec<Vec<(Point, f64)>>,
}

impl<'a> Returns<'a> {
    pub fn new(scene: &'a Scene<'a>) -> Self {
        let body = (0..scene.frames()).into_par_iter().map(|frame| body(scene, frame)).collect();
        let mut returns = Self { scene, clutter: vec![], rest: vec![], clutter_power: clutter_power(scene.evidence), body };
        (returns.clutter, returns.rest) = returns.static_clutter();
        returns
    }

    /// The body's points in a frame with the power that each is expected to have in the peak.
    pub fn body(&self, frame: usize) -> &[(Point, f64)] {
        &self.body[frame]
    }

    /// A channel of a frame without static clutter, over the noise, `[loop · sample]`.
    pub fn moving(&self, frame: usize, channel: usize) -> Vec<Complex64> {
        let (evidence, samples) = (self.scene.evidence, self.scene.samples);
        let mean = &self.clutter[channel * samples..][..samples];
        let scale = evidence.noise()[channel].max(f64::MIN_POSITIVE).sqrt().recip();
        let chirps = evidence.cube.channel(frame, channel).chunks_exact(samples);
        chirps.flat_map(|chirp| chirp.iter().zip(mean).map(|(value, mean)| (value - mean) * scale)).collect()
    }

    /// Most power that tones of the body may have in a sample over the noise, on the fine grid; nothing where that does not count.
    pub fn most(&self, frame: usize) -> Grid<f64, 2> {
        let mut power = self.tones(frame);
        self.rest.iter().enumerate().for_each(|(range, rest)| power[[FINE * range, 0]] += rest);
        let mut power = blurred(&power);
        let gain = self.scene.size() as f64;
        let most = |power: f64| if power * gain < FAINTEST { 0.0 } else { SAFETY * power };
        power.values_mut().iter_mut().for_each(|power| *power = most(*power));
        power
    }

    /// Mean power of the body's tones in a sample over the noise, on the fine grid.
    fn tones(&self, frame: usize) -> Grid<f64, 2> {
        let (loops, samples) = (self.scene.loops as f64, self.scene.samples as f64);
        let [columns, rows] = [FINE * self.scene.samples, FINE * self.scene.loops];
        let mut power = Grid::filled(["range", "doppler"], [columns, rows], 0.0);
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
            for (column, fast) in split(range, columns) {
                for (row, slow) in split(doppler, rows) {
                    power[[column, row]] += level * gain * fast * slow;
                }
            }
        }
        power
    }

    /// Static clutter, `[channel · samples + sample]`: the mean over the training frames, at every range of those most in
    /// which the body is elsewhere; and the power of the body that is left in it.
    fn static_clutter(&self) -> (Vec<Complex64>, Vec<f64>) {
        let evidence = self.scene.evidence;
        let (loops, samples, training) = (self.scene.loops, self.scene.samples, &evidence.split.training);
        let rows = FINE * loops;
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
                .values()
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
        let mut planner = hybridsim_fft::FftPlanner::new();
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
fn blurred(power: &Grid<f64, 2>) -> Grid<f64, 2> {
    let [columns, rows] = power.shape();
    let cells = || (0..columns).flat_map(|column| (0..rows).map(move |row| [column, row]));
    let none = Grid::filled(["range", "doppler"], power.shape(), 0.0);
    let mut along = none.clone();
    for [column, row] in cells().filter(|&cell| power[cell] > 0.0) {
        let value = power[[column, row]];
        along[[column, row]] += (1.0 - 2.0 * BLUR) * value;
        [(row + 1) % rows, (row + rows - 1) % rows].into_iter().for_each(|near| along[[column, near]] += BLUR * value);
    }
    let mut result = none;
    for [column, row] in cells().filter(|&cell| along[cell] > 0.0) {
        let value = along[[column, row]];
        result[[column, row]] += (1.0 - 2.0 * BLUR) * value;
        [(column + 1) % columns, (column + columns - 1) % columns]
            .into_iter()
            .for_each(|near| result[[near, row]] += BLUR * value);
    }
    result
}
