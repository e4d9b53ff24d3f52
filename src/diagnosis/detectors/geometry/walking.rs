//! A body that walks across in front of receivers, as cells that they observe: for tests.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

use super::cells::{Cell, Cells, Group};
use crate::radar::Radar;

/// A body that walks across in front of four receivers half a wavelength apart, a little beside where it is predicted. What comes
/// from a sine reaches a receiver `turned`, and the receivers observe `array` times that.
pub fn walking(seed: u64, turned: impl Fn(usize, f64) -> Complex64, array: &DMatrix<Complex64>) -> Cells {
    let receivers = array.nrows();
    let mut radar = four_receivers();
    radar.rx_m.truncate(receivers);
    let wave = TAU / radar.wavelength_m();
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut cell = |middle: f64, aside: f64| {
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut expected = DMatrix::zeros(receivers, receivers);
        let mut mean = 0.0;
        let mut observed = DVector::from_fn(receivers, |_, _| Complex64::new(normal(), normal()) * 0.5f64.sqrt());
        let mut field = DVector::zeros(receivers);
        for _ in 0..8 {
            let power: f64 = 10.0;
            let amplitude = Complex64::new(normal(), normal()) * (0.5 * power).sqrt();
            let sine = middle + 0.05 * normal();
            let from = |sine: f64| DVector::from_fn(receivers, |rx, _| Complex64::cis(-wave * radar.rx_m[rx][0] * sine));
            let predicted = from(sine);
            expected += &predicted * predicted.adjoint() * Complex64::from(power);
            mean += sine / 8.0;
            let real = from(sine + aside);
            field += DVector::from_fn(receivers, |rx, _| amplitude * real[rx] * turned(rx, sine + aside));
        }
        observed += array * field;
        Cell { observed: vec![observed], expected, sine: mean }
    };
    let mut errors = rand_chacha::ChaCha8Rng::seed_from_u64(seed + 1000);
    let frames = (0..12)
        .map(|frame| {
            let aside = 0.01 * (errors.random::<f64>() - 0.5);
            let mut group = || (0..12).map(|_| cell(0.05 * f64::from(frame) - 0.25, aside)).collect();
            (0..5).map(|_| Group { cells: group(), place: None }).collect()
        })
        .collect();
    Cells { radar, frames, noise: vec![1.0; receivers] }
}

pub fn four_receivers() -> Radar {
    let mut radar = Radar::small(12);
    radar.rx_m = (0..4).map(|rx| [0.5 * f64::from(rx) * radar.wavelength_m(), 0.0, 0.0]).collect();
    radar
}
