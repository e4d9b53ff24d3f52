//! Taking a vibration out of the samples: its own pattern with its harmonics', and its phase out of what moves.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::cells::{Cells, Vibration};
use crate::diagnosis::cube::Cube;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Correction, Volume};
use crate::grid::Grid;

/// Harmonics that are taken out again.
const HARMONICS: usize = 3;

/// `radians`: of the phase along the boresight. With the energy that the vibration adds.
pub fn undo(evidence: &Evidence, cells: &Cells, vibration: &Vibration, radians: f64) -> (Correction, f64) {
    let rx = evidence.cube.dims[2];
    let (starts, loop_s, chirp_s) = (evidence.starts_s.clone(), cells.loop_s, evidence.radar.chirp_period_s);
    let (frequency, phase) = (vibration.frequency_hz, vibration.phase);
    let turn = move |frame: usize, channel: usize, index: usize| {
        TAU * frequency * (starts[frame] + index as f64 * loop_s + (channel / rx) as f64 * chirp_s) + phase
    };
    let patterns = patterns(evidence, &turn);
    let chirps = evidence.cube.chirps();
    let energy = 0.5 * chirps * patterns.below([1]).iter().map(Complex64::norm_sqr).sum::<f64>();
    let undo = move |cube: &mut Cube| {
        cube.each_chirp(|[frame, channel, index], chirp| {
            let turn = turn(frame, channel, index);
            let back = Complex64::cis(-radians * turn.cos());
            for (n, value) in chirp.iter_mut().enumerate() {
                let vibration: Complex64 =
                    (1..=HARMONICS).map(|order| patterns[[order, channel, n]] * (order as f64 * turn).cos()).sum();
                // What moves lies ahead.
                let clutter = patterns[[0, channel, n]];
                *value = clutter + (*value - vibration - clutter) * back;
            }
        });
    };
    (Correction::inverse(Volume::KEPT, undo), energy)
}

/// What is constant, and what oscillates with the sinusoid and its harmonics, in the training frames: least squares,
/// `[order, channel, sample]`. Short frames far apart do not make the harmonics orthogonal.
fn patterns(evidence: &Evidence, turn: &impl Fn(usize, usize, usize) -> f64) -> Grid<Complex64, 3> {
    let (channels, samples) = (evidence.cube.channels(), evidence.cube.dims[4]);
    let size = HARMONICS + 1;
    let mut patterns = Grid::filled(["order", "channel", "sample"], [size, channels, samples], Complex64::ZERO);
    for channel in 0..channels {
        let mut normal = DMatrix::<f64>::zeros(size, size);
        let mut right = Grid::filled(["order", "sample"], [size, samples], Complex64::ZERO);
        for &frame in &evidence.split.training {
            for (index, chirp) in evidence.cube.channel(frame, channel).chunks_exact(samples).enumerate() {
                let turn = turn(frame, channel, index);
                let basis: Vec<f64> = (0..size).map(|order| (order as f64 * turn).cos()).collect();
                for (order, weight) in basis.iter().enumerate() {
                    right.below_mut([order]).iter_mut().zip(chirp).for_each(|(sum, value)| *sum += value * weight);
                    basis.iter().enumerate().for_each(|(other, factor)| normal[(order, other)] += weight * factor);
                }
            }
        }
        let Some(inverse) = normal.try_inverse() else { continue };
        for (order, n) in (0..size).flat_map(|order| (0..samples).map(move |n| (order, n))) {
            patterns[[order, channel, n]] = (0..size).map(|other| right[[other, n]] * inverse[(order, other)]).sum();
        }
    }
    patterns
}
