//! Whether something at next to no beat frequency is a constant or a leakage: a leakage has the delay of the way between the nearest
//! antennas at least.

use std::f64::consts::PI;

use num_complex::Complex64;

use crate::diagnosis::Evidence;
use crate::diagnosis::finding::NINETY;
use crate::paths::distance;
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// A beat frequency next to zero, in bins.
pub struct ZeroBeat {
    bins: f64,
    deviation: f64,
    /// Of the shortest way from a transmitter to a receiver.
    least: f64,
}

impl ZeroBeat {
    /// Of what several channels have, each with the variance of the noise in its samples: the turn between the halves of a chirp.
    pub fn new(evidence: &Evidence, parts: &[Vec<Complex64>], variance: impl Fn(usize) -> f64) -> Self {
        let (mut product, mut spread) = (Complex64::ZERO, 0.0);
        for (channel, part) in parts.iter().enumerate() {
            let half = part.len() / 2;
            let mean = |half: &[Complex64]| half.iter().sum::<Complex64>() / half.len() as f64;
            let (early, late) = (mean(&part[..half]), mean(&part[part.len() - half..]));
            let weight = variance(channel).max(f64::MIN_POSITIVE).recip();
            product += late * early.conj() * weight;
            // Both halves err, each by half of that across its own direction.
            spread += weight * (early.norm_sqr() + late.norm_sqr()) * 0.5 / half as f64;
        }
        let deviation = spread.sqrt() / product.norm().max(f64::MIN_POSITIVE) / PI;
        Self { bins: product.arg() / PI, deviation, least: least_bins(evidence) }
    }

    /// Whether it may be a constant.
    pub fn may_be_constant(&self) -> bool {
        self.bins.abs() < NINETY * self.deviation || self.bins.abs() < 0.5 * self.least
    }

    /// Whether it may be a leakage.
    pub fn may_be_leakage(&self) -> bool {
        self.bins + NINETY * self.deviation > self.least
    }
}

fn least_bins(evidence: &Evidence) -> f64 {
    let radar = &evidence.radar;
    let delay_s = shortest_m(radar) / SPEED_OF_LIGHT;
    radar.slope_hz_per_s.abs() * delay_s * evidence.cube.dims[4] as f64 / radar.sample_rate_hz
}

/// Shortest way from a transmitter to a receiver.
pub fn shortest_m(radar: &Radar) -> f64 {
    let all = radar.tx_m.iter().flat_map(|&tx| radar.rx_m.iter().map(move |&rx| distance(tx, rx)));
    all.reduce(f64::min).unwrap_or(0.0)
}
