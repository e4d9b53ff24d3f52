//! The direction in which the body is seen: phases between receivers that grow in proportion to their places.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::diagnosis::statistics;
use crate::radar::Radar;

/// What the power model's errors, and other effects that were not taken out, do to a phase between neighbouring receivers (half a
/// wavelength).
pub const PHASE_FLOOR_RAD: f64 = 3.0 * PI / 180.0;

/// Sums over the cells of a frame after the predicted steering.
#[derive(Clone, Debug)]
pub struct Sums {
    /// `[rx, rx]`, the second one conjugated.
    pub products: Vec<Complex64>,
    pub cells: f64,
    pub range_m: f64,
}

impl Sums {
    fn receivers(&self) -> usize {
        self.products.len().isqrt()
    }

    /// With the first receiver.
    pub fn cross(&self, rx: usize) -> Complex64 {
        self.products[rx * self.receivers()]
    }

    pub fn own(&self, rx: usize) -> f64 {
        self.products[rx * self.receivers() + rx].re
    }

    /// How far aside the body is seen (as a sine), its range, and how much information this frame has of it.
    pub fn sine(&self, radar: &Radar) -> [f64; 3] {
        let (places, wave) = (along(radar), TAU / radar.wavelength_m());
        let sum = |of: &dyn Fn(usize) -> f64| (1..places.len()).map(|rx| self.cross(rx).norm() * of(rx)).sum::<f64>();
        let spread = sum(&|rx| places[rx].powi(2));
        let sine = -sum(&|rx| self.cross(rx).arg() * places[rx]) / (spread * wave).max(f64::MIN_POSITIVE);
        [sine, self.range_m, spread]
    }
}

/// A mean over frames and the standard error of it.
#[derive(Clone, Copy, Debug)]
struct Mean {
    value: f64,
    deviation: f64,
}

/// How far aside of its place the body is seen.
#[derive(Clone, Copy, Debug)]
pub struct Bearing {
    pub sine: f64,
    pub deviation: f64,
    /// Chance that it is none.
    pub p_value: f64,
}

impl Bearing {
    /// What turns the body back to where it stands, `[rx, rx]`.
    pub fn turned_back(&self, radar: &Radar) -> DMatrix<Complex64> {
        let wave = TAU / radar.wavelength_m();
        let turns = along(radar).into_iter().map(|x| Complex64::cis(self.sine * wave * x));
        DMatrix::from_diagonal(&DVector::from_iterator(radar.rx_m.len(), turns))
    }
}

/// Places of the receivers along x, from the first one.
pub fn along(radar: &Radar) -> Vec<f64> {
    radar.rx_m.iter().map(|rx| rx[0] - radar.rx_m[0][0]).collect()
}

/// The part of the phases between receivers that is a direction: least squares through the receivers' places.
pub fn bearing(radar: &Radar, training: &[Sums]) -> Bearing {
    let receivers = radar.rx_m.len();
    let phases: Vec<Mean> = (1..receivers).map(|rx| phase(training, rx)).collect();
    let (places, wave) = (along(radar), TAU / radar.wavelength_m());
    let spread: f64 = places.iter().map(|x| x * x).sum();
    if spread <= 0.0 {
        return Bearing { sine: 0.0, deviation: 0.0, p_value: 1.0 };
    }
    let over = |of: &dyn Fn(&Mean, f64) -> f64| phases.iter().zip(&places[1..]).map(|(phase, &x)| of(phase, x)).sum::<f64>();
    let sine = -over(&|phase, x| phase.value * x) / (spread * wave);
    // One direction for all: its error from those of the phases, as if they erred together.
    let deviation = over(&|phase, x| phase.deviation * x.abs()) / (spread * wave);
    let excess = (sine.abs() - PHASE_FLOOR_RAD / PI).max(0.0);
    let own = (2.0 * statistics::student_tail(excess / deviation.max(1e-12), training.len() as f64 - 1.0)).min(1.0);
    Bearing { sine, deviation, p_value: statistics::corrected(own, 2.0 * receivers as f64) }
}

/// Phase of a receiver against the first, radians.
fn phase(frames: &[Sums], rx: usize) -> Mean {
    let total: Complex64 = frames.iter().map(|sums| sums.cross(rx)).sum();
    let turned = |sums: &Sums| (sums.cross(rx) * total.conj() / total.norm().max(f64::MIN_POSITIVE)).im;
    let scatter: f64 = frames.iter().map(|sums| turned(sums).powi(2)).sum();
    let count = frames.len() as f64;
    Mean { value: total.arg(), deviation: (scatter * count / (count - 1.0)).sqrt() / total.norm().max(f64::MIN_POSITIVE) }
}
