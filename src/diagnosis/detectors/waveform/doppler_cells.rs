//! Doppler cells of a frame that the body fills: what is observed over the chirp's parts, and what is expected there.

use std::f64::consts::TAU;

use hybridsim_fft::FftPlanner;
use nalgebra::DVector;
use num_complex::Complex64;

use crate::diagnosis::evidence::hann;
use crate::diagnosis::power::PowerModel;
use crate::diagnosis::prediction::range_and_velocity;
use crate::diagnosis::{BodyPrediction, Evidence};
use crate::radar::SPEED_OF_LIGHT;

/// Expected power over the noise in a part from which on a Doppler cell is used.
const LEAST_POWER: f64 = 3.0;

/// A Doppler cell of a frame.
pub struct Cell {
    /// By channel, over the chirp's parts, in units of the noise, turned back by the mean range.
    pub observed: Vec<DVector<Complex64>>,
    /// Covariance that is expected of two parts by their distance.
    pub expected: Vec<Complex64>,
    /// Mean delay over the body's.
    pub delay: f64,
}

/// The middle of one of so many equal pieces of a chirp, −1 to 1.
pub fn place(piece: usize, of: usize) -> f64 {
    (2.0 * piece as f64 + 1.0) / of as f64 - 1.0
}

/// What the points of a body bring to one Doppler cell.
#[derive(Clone, Default)]
struct Share {
    /// Beat frequency (bins) and expected power of every point that reaches it.
    points: Vec<(f64, f64)>,
    /// Power at the chirp's start and end.
    at_ends: [f64; 2],
}

impl Share {
    /// Expected power, and the mean of the beat frequencies.
    fn mean(&self) -> (f64, f64) {
        let power: f64 = self.points.iter().map(|(_, power)| power).sum();
        (power, self.points.iter().map(|(bins, power)| bins * power).sum::<f64>() / power.max(f64::MIN_POSITIVE))
    }

    /// Covariance of two parts of so many samples by their distance, turned back by the mean beat frequency.
    fn expected(&self, middle: f64, parts: usize, length: usize, samples: usize) -> Vec<Complex64> {
        let mut expected = vec![Complex64::ZERO; parts];
        for (bins, power) in &self.points {
            // Phase from part to part, and what is left of the sum over a part.
            let turn = TAU * (bins - middle) * length as f64 / samples as f64;
            let half = 0.5 * turn;
            let power = power * if half.abs() < 1e-6 { 1.0 } else { (half.sin() / half).powi(2) };
            expected.iter_mut().enumerate().for_each(|(apart, sum)| *sum += Complex64::from_polar(power, turn * apart as f64));
        }
        expected
    }
}

/// By Doppler cell, `length`: samples of a chirp's part.
fn shares(evidence: &Evidence, model: &PowerModel, body: &BodyPrediction, frame: usize, length: usize) -> Vec<Share> {
    let radar = &evidence.radar;
    let [_, _, _, loops, samples] = evidence.cube.dims;
    // The same velocity is another Doppler frequency at the chirp's end than at its start.
    let ends = [-0.5, 0.5].map(|end| 1.0 + end * radar.bandwidth_hz() * radar.wavelength_m() / SPEED_OF_LIGHT);
    let mut shares = vec![Share::default(); loops];
    for point in body.with_echoes(radar, body.frames[frame].clone(), None) {
        let (range_m, velocity_mps) = range_and_velocity(radar, point.position_m, point.velocity_mps);
        let (_, bins) = model.cells.place(range_m, velocity_mps);
        // Of a part instead of a whole windowed chirp.
        let power = model.peak(radar, point) * 1.5 * length as f64 / samples as f64;
        if power > 0.0 && bins.is_finite() {
            model
                .cells
                .each_doppler(velocity_mps, |doppler, share| shares[doppler].points.push((bins, power * f64::from(share))));
            for (end, scale) in ends.into_iter().enumerate() {
                model.cells.each_doppler(velocity_mps * scale, |doppler, share| {
                    shares[doppler].at_ends[end] += power * f64::from(share)
                });
            }
        }
    }
    shares
}

/// In order; none without a sufficient SNR.
pub fn cells(evidence: &Evidence, model: &PowerModel, body: &BodyPrediction, frame: usize, parts: usize) -> Vec<Cell> {
    let radar = &evidence.radar;
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let length = samples / parts;
    let shares = shares(evidence, model, body, frame, length);
    let used: Vec<usize> =
        (0..loops).filter(|&doppler| model.usable()[doppler * samples] && shares[doppler].mean().0 > LEAST_POWER).collect();
    let mut observed: Vec<Vec<DVector<Complex64>>> = vec![vec![]; used.len()];
    let window = hann(loops);
    let fft = FftPlanner::new().plan_fft_forward(loops);
    let middles: Vec<f64> = used.iter().map(|&doppler| shares[doppler].mean().1).collect();
    // By the noise, too, which stays.
    let ends = used.iter().map(|&doppler| shares[doppler].at_ends);
    let tilts: Vec<f64> = ends.map(|[start, end]| 0.25 * ((1.0 + end) / (1.0 + start)).ln()).collect();
    for channel in 0..evidence.cube.channels() {
        let moving = evidence.moving(frame, channel);
        let scale = 1.0 / (evidence.noise()[channel].max(f64::MIN_POSITIVE) * length as f64).sqrt();
        observed.iter_mut().for_each(|observed| observed.push(DVector::zeros(parts)));
        for sample in 0..parts * length {
            let mut slow: Vec<Complex64> = (0..loops).map(|i| moving[i * samples + sample] * (window[i] * scale)).collect();
            fft.process(&mut slow);
            let part = place(sample / length, parts);
            for (((observed, &doppler), middle), tilt) in observed.iter_mut().zip(&used).zip(&middles).zip(&tilts) {
                let back = Complex64::from_polar((-tilt * part).exp(), -TAU * middle * sample as f64 / samples as f64);
                observed[channel][sample / length] += slow[doppler] * back;
            }
        }
    }
    let bins_to_delay = radar.sample_rate_hz / (samples as f64 * radar.slope_hz_per_s);
    let of = |((observed, &doppler), middle): ((Vec<DVector<Complex64>>, &usize), &f64)| {
        let expected = shares[doppler].expected(*middle, parts, length, samples);
        Cell { observed, expected, delay: middle * bins_to_delay }
    };
    observed.into_iter().zip(&used).zip(&middles).map(of).collect()
}
