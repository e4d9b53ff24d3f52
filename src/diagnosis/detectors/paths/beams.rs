//! What a tone of every range, velocity and direction explains of a frame, against the noise and the body's returns.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rayon::prelude::*;

use super::coloured::{Coloured, FINE};
use super::returns::Returns;
use super::scene::Scene;
use super::whitened::Whitened;
use crate::diagnosis::Point;
use crate::diagnosis::detectors::steering::{beam, power, sines, steering};
use crate::grid::Grid;

/// Samples after the body's covariance is undone, and what that leaves of a tone.
pub struct Beams<'a> {
    scene: &'a Scene<'a>,
    /// Beams: x over range.
    pub sines: Vec<f64>,
    returns: Returns<'a>,
    frames: Vec<Option<Whitened>>,
    /// The transform to the fine grid.
    fine: Coloured,
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
        Self {
            scene,
            sines: sines(&scene.evidence.radar),
            returns: Returns::new(scene),
            frames: (0..scene.frames()).map(|_| None).collect(),
            fine: Coloured::new(scene.loops, scene.samples, vec![0.0; FINE * FINE * scene.size()]),
        }
    }

    /// Looks at more frames.
    pub fn prepare(&mut self, frames: &[usize]) {
        let missing: Vec<usize> = frames.iter().copied().filter(|&frame| self.frames[frame].is_none()).collect();
        let whitened = |&frame: &usize| Whitened::new(&self.returns, frame, &self.sines, &self.fine);
        let made: Vec<Whitened> = missing.par_iter().map(whitened).collect();
        missing.into_iter().zip(made).for_each(|(frame, made)| self.frames[frame] = Some(made));
    }

    /// The body's points in a frame with the power that each is expected to have in the peak.
    pub fn body(&self, frame: usize) -> &[(Point, f64)] {
        self.returns.body(frame)
    }

    /// Of every cell of the fine grid in a prepared frame.
    pub fn looks(&self, frame: usize) -> Grid<Look, 3> {
        let made = self.frames[frame].as_ref().expect("frames are prepared before they are looked at");
        let cells: Vec<Vec<Complex64>> = made.channels.iter().map(|channel| self.fine.cells(channel)).collect();
        let steering: Vec<Vec<Complex64>> = self.sines.iter().map(|&sine| self.steering(sine)).collect();
        let [_, _, rows] = made.expected.shape();
        let mut values = vec![Complex64::ZERO; cells.len()];
        Grid::from_fn(["beam", "range", "doppler"], made.expected.shape(), |[beam, column, row]| {
            values.iter_mut().zip(&cells).for_each(|(value, cells)| *value = cells[column * rows + row]);
            self.seen(made, [column, row], self.power(&values, &steering[beam]), beam)
        })
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

    /// Of all channels, and the nearest cell of the fine grid, `[range, doppler]`.
    fn values(&self, frame: usize, (doppler, range): (f64, f64)) -> Option<(&Whitened, Vec<Complex64>, [usize; 2])> {
        let made = self.frames.get(frame)?.as_ref()?;
        let (loops, samples) = (self.scene.loops, self.scene.samples);
        let [_, columns, rows] = made.expected.shape();
        let column = (FINE as f64 * range).round();
        if !(0.0..columns as f64).contains(&column) {
            return None;
        }
        let row = ((FINE as f64 * doppler).round() as i64).rem_euclid(rows as i64) as usize;
        let turns = |cells: f64, length: usize| -> Vec<Complex64> {
            (0..length).map(|i| Complex64::cis(-TAU * cells * i as f64 / length as f64)).collect()
        };
        let (slow, fast) = (turns(doppler, loops), turns(range, samples));
        let of_channel = |channel: &Vec<Complex64>| -> Complex64 {
            let chirps = channel.chunks_exact(samples).zip(&slow);
            chirps.map(|(chirp, turn)| chirp.iter().zip(&fast).map(|(a, b)| a * b).sum::<Complex64>() * turn).sum()
        };
        Some((made, made.channels.iter().map(of_channel).collect(), [column as usize, row]))
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

    fn seen(&self, made: &Whitened, [range, doppler]: [usize; 2], power: f64, beam: usize) -> Look {
        let share = f64::from(made.share[[range, doppler]]);
        let expected = f64::from(made.expected[[beam, range, doppler]]);
        Look { power: power / (share * share), expected, body: (1.0 - 1.0 / expected).clamp(0.0, 1.0) }
    }
}
