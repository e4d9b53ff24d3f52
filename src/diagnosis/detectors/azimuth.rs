//! Direction of one return by conventional beamforming across the array, where the array is shown to be calibrated.
//!
//! Channels whose phases are unknown have a best direction, too. The share of the power that it holds is compared with what it holds where
//! phases are drawn at random (a randomisation test): two channels always fit one direction, so that they never show it.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::diagnosis::evidence::Evidence;

/// Directions that are tried, in sines of the azimuth, up to this at either side.
const DIRECTIONS: usize = 181;
const WIDEST: f64 = 0.95;
/// Draws of random phases, and how many of them may not fit a direction as well: one in a hundred.
const DRAWS: usize = 400;
const BY_CHANCE: usize = 4;
/// Share of the power that one direction must have: less is of several movers.
const MOST: f64 = 0.5;
/// Of phases of a calibrated array's channels: its direction errs by degrees.
const LEAST_DEVIATION_DEG: f64 = 2.0;

/// Azimuth and its standard deviation, degrees.
#[derive(Clone, Copy, Debug)]
pub struct Azimuth {
    pub degrees: f64,
    pub deviation: f64,
}

/// Powers of all directions.
struct Beams {
    /// `[direction][channel]`
    steering: Vec<Vec<Complex64>>,
    /// `[channel][channel]`
    covariance: Vec<Vec<Complex64>>,
}

impl Beams {
    /// `across`: of each channel, in wavelengths.
    fn new(across: &[f64], snapshots: &[Vec<Complex64>]) -> Self {
        let of_direction = |i: usize| across.iter().map(|x| Complex64::cis(-TAU * x * sine(i))).collect();
        let of_pair = |a: usize, b: usize| snapshots.iter().map(|values| values[a] * values[b].conj()).sum();
        let channels = across.len();
        let covariance = (0..channels).map(|a| (0..channels).map(|b| of_pair(a, b)).collect()).collect();
        Self { steering: (0..DIRECTIONS).map(of_direction).collect(), covariance }
    }

    /// Share of the power that a direction has where the channels are turned by some phases.
    fn share(&self, direction: usize, turned: &[Complex64]) -> f64 {
        let towards: Vec<Complex64> = self.steering[direction].iter().zip(turned).map(|(a, turn)| a * turn).collect();
        let of_row = |(row, a): (&Vec<Complex64>, &Complex64)| {
            a.conj() * row.iter().zip(&towards).map(|(value, b)| value * b).sum::<Complex64>()
        };
        let power: Complex64 = self.covariance.iter().zip(&towards).map(of_row).sum();
        let all: f64 = (0..turned.len()).map(|channel| self.covariance[channel][channel].re).sum();
        power.re / (all * turned.len() as f64).max(f64::MIN_POSITIVE)
    }

    /// The direction that has most, and its share.
    fn best(&self, turned: &[Complex64]) -> (usize, f64) {
        let shares = (0..DIRECTIONS).map(|direction| (direction, self.share(direction, turned)));
        shares.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((DIRECTIONS / 2, 0.0))
    }
}

fn sine(direction: usize) -> f64 {
    WIDEST * (2.0 * direction as f64 / (DIRECTIONS - 1) as f64 - 1.0)
}

/// Of what turns by so much from loop to loop; `snapshots`: its values by channel, tx · rx. None where the array has no width, or does not show
/// that one direction explains what its channels hold.
pub fn azimuth(evidence: &Evidence, snapshots: &[Vec<Complex64>], turns_per_loop: f64) -> Option<Azimuth> {
    let receivers = evidence.cube.dims[2];
    let radar = &evidence.radar;
    let channels = evidence.cube.channels();
    // Distance across of each virtual antenna in wavelengths, and how far the return has turned when its transmitter's turn comes.
    let across = |c: usize| (radar.tx_m[c / receivers][0] + radar.rx_m[c % receivers][0]) / radar.wavelength_m();
    let across: Vec<f64> = (0..channels).map(across).collect();
    let turn = |c: usize| Complex64::cis(TAU * turns_per_loop * (c / receivers) as f64 / radar.tx_m.len() as f64);
    let mean = across.iter().sum::<f64>() / channels as f64;
    let spread = (across.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / channels as f64).sqrt();
    if spread < 0.1 {
        return None;
    }
    let beams = Beams::new(&across, snapshots);
    let (direction, share) = beams.best(&(0..channels).map(turn).collect::<Vec<_>>());
    if share < MOST {
        return None;
    }
    let mut random = ChaCha8Rng::seed_from_u64(channels as u64);
    let mut fits =
        || beams.best(&(0..channels).map(|_| Complex64::cis(TAU * random.random::<f64>())).collect::<Vec<_>>()).1 >= share;
    if (0..DRAWS).filter(|_| fits()).nth(BY_CHANCE - 1).is_some() {
        return None;
    }
    let power: f64 = snapshots.iter().flatten().map(Complex64::norm_sqr).sum();
    let ratio = (power * channels as f64 / evidence.total_noise()).max(1.0);
    let deviation = 1.0 / (TAU * spread) / (2.0 * ratio).sqrt();
    let azimuth = sine(direction).asin();
    Some(Azimuth { degrees: azimuth.to_degrees(), deviation: (deviation / azimuth.cos()).to_degrees().max(LEAST_DEVIATION_DEG) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Radar;

    /// Of eight channels in a row half a wavelength apart, with these phase errors.
    fn seen(count: usize, error: impl Fn(usize) -> f64) -> Option<Azimuth> {
        let mut radar = Radar { samples_per_chirp: 64, loops_per_frame: 16, ..Radar::small(4) };
        radar.tx_m = vec![[0.0; 3]];
        radar.rx_m = (0..count).map(|rx| [0.5 * rx as f64 * radar.wavelength_m(), 0.0, 0.0]).collect();
        let value = |c: usize| Complex64::from_polar(100.0, error(c) - TAU * 0.5 * c as f64 * 0.3);
        let snapshots = vec![(0..count).map(value).collect::<Vec<_>>()];
        azimuth(&Evidence::in_noise(radar, 1, |_| Complex64::ONE), &snapshots, 0.0)
    }

    #[test]
    fn an_array_that_is_not_calibrated_has_no_direction_and_neither_have_two_channels() {
        let found = seen(8, |_| 0.0).expect("a direction");
        assert!((found.degrees - 0.3f64.asin().to_degrees()).abs() < 1.0, "{found:?}");
        assert!(seen(8, |c| 0.2 * (2.3 * c as f64).sin()).is_some());
        assert!(seen(2, |_| 0.0).is_none());
        for seed in 0..30 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let phases: Vec<f64> = (0..8).map(|_| TAU * random.random::<f64>()).collect();
            assert!(seen(4, |c| phases[c]).is_none() && seen(8, |c| phases[c]).is_none(), "{seed}");
        }
    }
}
