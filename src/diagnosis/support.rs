//! Which delays static clutter may have, and what of a chirp can come from them.

use nalgebra::{DMatrix, SymmetricEigen};
use num_complex::Complex64;

use crate::radar::{Radar, SPEED_OF_LIGHT, Sampling};
use crate::room::Room;

/// Where static returns are expected: ranges, and the subspace of chirps that tones at these delays span.
#[derive(Clone, Debug)]
pub struct Support {
    pub near_m: f64,
    pub far_m: f64,
    /// Orthonormal, `[direction][sample]`.
    basis: Vec<Vec<Complex64>>,
}

/// Nearest that a thing of an unknown room is expected: closer returns are the radar's own.
pub const UNKNOWN_NEAR_M: f64 = 0.45;
/// Of the eigenvalue of a tone that a direction must hold to count.
const NEGLIGIBLE: f64 = 1e-7;
/// A wall's cell or antenna spread beyond the geometry.
const MARGIN_M: f64 = 0.15;

impl Support {
    /// The room's visible surfaces, from the nearest boundary in front of the radar to the farthest corner; an unknown
    /// room may have anything but the nearest.
    pub fn new(radar: &Radar, room: Option<&Room>) -> Self {
        let most = radar.max_range_m();
        let (near_m, far_m) = match room {
            Some(room) => {
                let nearest = room.boundaries().into_iter().filter_map(|wall| room.distance_m(wall)).fold(most, f64::min);
                let far = room.farthest_m().map_or(most, |far| far + MARGIN_M);
                ((nearest - MARGIN_M).max(UNKNOWN_NEAR_M), far.min(most))
            }
            None => (UNKNOWN_NEAR_M, if radar.sampling == Sampling::Complex { 0.5 * most } else { most }),
        };
        Self { near_m, far_m: far_m.max(near_m), basis: basis(radar, near_m, far_m.max(near_m)) }
    }

    /// How many directions of a chirp it holds.
    pub fn rank(&self) -> usize {
        self.basis.len()
    }

    /// The part of a chirp that can come from these delays.
    pub fn project(&self, chirp: &[Complex64]) -> Vec<Complex64> {
        let mut within = vec![Complex64::ZERO; chirp.len()];
        for direction in &self.basis {
            let share: Complex64 = direction.iter().zip(chirp).map(|(d, value)| d.conj() * value).sum();
            within.iter_mut().zip(direction).for_each(|(sum, d)| *sum += share * d);
        }
        within
    }
}

/// The tones between two ranges have the sinc kernel as their Gram matrix (discrete prolate spheroidal sequences,
/// Slepian 1978), moved to the middle of the band.
fn basis(radar: &Radar, near_m: f64, far_m: f64) -> Vec<Vec<Complex64>> {
    let samples = radar.samples_per_chirp;
    let cycles = |range_m: f64| 2.0 * range_m / SPEED_OF_LIGHT * radar.slope_hz_per_s / radar.sample_rate_hz;
    let (low, high) = (cycles(near_m), cycles(far_m));
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let kernel = DMatrix::from_fn(samples, samples, |i, j| {
        let lag = i as f64 - j as f64;
        if i == j { 2.0 * half } else { (std::f64::consts::TAU * half * lag).sin() / (std::f64::consts::PI * lag) }
    });
    let eigen = SymmetricEigen::new(kernel);
    let turn: Vec<Complex64> = (0..samples).map(|n| Complex64::cis(std::f64::consts::TAU * middle * n as f64)).collect();
    (0..samples)
        .filter(|&index| eigen.eigenvalues[index] > NEGLIGIBLE)
        .map(|index| eigen.eigenvectors.column(index).iter().zip(&turn).map(|(value, turn)| turn * *value).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_is_within_and_leakage_is_not() {
        let radar = Radar { samples_per_chirp: 128, ..Radar::small(1) };
        let room = Room { front_m: Some(5.6), floor_m: Some(1.0), ..Room::default() };
        let support = Support::new(&radar, Some(&room));
        let tone = |range_m: f64| -> Vec<Complex64> {
            let cycles = 2.0 * range_m / SPEED_OF_LIGHT * radar.slope_hz_per_s / radar.sample_rate_hz;
            (0..128).map(|n| Complex64::cis(std::f64::consts::TAU * cycles * n as f64 + 0.7)).collect()
        };
        let share = |range_m: f64| support.project(&tone(range_m)).iter().map(Complex64::norm_sqr).sum::<f64>() / 128.0;
        assert!(share(1.0) > 1.0 - 1e-4 && share(5.6) > 1.0 - 1e-4 && share(3.0) > 1.0 - 1e-8);
        // Tones just outside share the directions that tones at the edge need.
        assert!(share(0.1) < 0.1 && share(9.0) < 0.05, "{} {}", share(0.1), share(9.0));
        assert!(support.rank() < 90);
    }
}
