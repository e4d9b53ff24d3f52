//! Receivers that hear their neighbours (card C4): the inner ones have two of them, the outer ones one.
//!
//! In the body's cells, whose direction is known, receiver r is too strong by the factor 1 + c n_r, where n_r are its
//! neighbours' steering phases relative to its own. The part of n_r that is neither common to all receivers nor in
//! proportion to their places (a direction) is no error of the pose.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::channels::{Sums, likelihood_gain, tail};
use crate::diagnosis::{Candidate, Correction, Cube, Estimate, Evidence, Place, Rung, statistics};
use crate::radar::Radar;

/// What errors of the power model and of the mesh may imitate: 0.6° and 0.09 dB.
const FLOOR: f64 = 0.01;
/// Least share of the neighbours' sum (squares, of some receivers) that must be neither common nor a direction.
const LEAST_CONTRAST: f64 = 0.1;
/// Beyond, it is no weak coupling.
const STRONGEST: f64 = 0.5;
/// Parts of a complex number, and of the family's two looks at the receivers.
const TRIED: f64 = 4.0;

/// A coupling that was found, and its strength.
pub struct Found {
    pub candidate: Candidate,
    pub strength: Complex64,
}

/// Strength with the standard errors of its parts, from leaving out one frame after the other.
pub fn find(evidence: &Evidence, training: &[Sums], held_out: &[Sums]) -> Option<Found> {
    let radar = &evidence.radar;
    let all = strength(radar, training.iter())?;
    let count = training.len() as f64;
    let without: Vec<Complex64> = (0..training.len())
        .map(|left| strength(radar, training.iter().enumerate().filter(|(i, _)| *i != left).map(|(_, sums)| sums)))
        .collect::<Option<_>>()?;
    let mean = without.iter().sum::<Complex64>() / count;
    let (re, im) = without.iter().fold((0.0, 0.0), |(re, im), c| (re + (c - mean).re.powi(2), im + (c - mean).im.powi(2)));
    let [re, im] = [re, im].map(|sum| ((count - 1.0) / count * sum).sqrt());
    let p = |value: f64, deviation: f64| tail((value.abs() - FLOOR) / deviation.max(1e-12), count - 1.0);
    let p_value = statistics::corrected(p(all.re, re).min(p(all.im, im)), TRIED);
    if p_value > 0.05 || all.norm() > STRONGEST {
        return None;
    }
    let sine = mean_sine(training.iter());
    let heard = neighbours(radar, sine);
    let first = 1.0 + all * heard[0];
    let amplitudes: Vec<Complex64> = heard.iter().map(|n| (1.0 + all * n) / first).collect();
    let gain = likelihood_gain(training, held_out, &amplitudes);
    let deviation = (re * re * all.re.powi(2) + im * im * all.im.powi(2)).sqrt() / all.norm();
    let deviation = deviation.hypot(0.5 * FLOOR);
    (gain > 0.0).then(|| Found { candidate: candidate(evidence, all, deviation, p_value, gain), strength: all })
}

fn mean_sine<'a>(frames: impl Iterator<Item = &'a Sums>) -> f64 {
    let (sum, cells) = frames.fold((0.0, 0.0), |(sum, cells), sums| (sum + sums.sine * sums.cells, cells + sums.cells));
    sum / f64::max(cells, 1.0)
}

/// Sum of the neighbours' fields over a receiver's own, for a direction.
fn neighbours(radar: &Radar, sine: f64) -> Vec<Complex64> {
    let wave = TAU / radar.wavelength_m();
    let count = radar.rx_m.len();
    let turn = |of: usize, at: usize| Complex64::cis(-wave * (radar.rx_m[of][0] - radar.rx_m[at][0]) * sine);
    (0..count)
        .map(|rx| {
            let before = if rx > 0 { turn(rx - 1, rx) } else { Complex64::ZERO };
            let after = if rx + 1 < count { turn(rx + 1, rx) } else { Complex64::ZERO };
            before + after
        })
        .collect()
}

/// Without what is common to all receivers and what grows with their places.
fn contrast(radar: &Radar, values: &[Complex64]) -> Vec<Complex64> {
    let count = values.len() as f64;
    let middle = radar.rx_m.iter().map(|at| at[0]).sum::<f64>() / count;
    let places: Vec<f64> = radar.rx_m.iter().map(|at| at[0] - middle).collect();
    let spread: f64 = places.iter().map(|x| x * x).sum();
    let mean = values.iter().sum::<Complex64>() / count;
    let slope = values.iter().zip(&places).map(|(v, x)| v * x).sum::<Complex64>() / spread.max(1e-30);
    values.iter().zip(&places).map(|(v, x)| v - mean - slope * x).collect()
}

/// What the receivers would have heard alone, for directions near the mean one. None where that cannot be told.
pub fn uncoupled(radar: &Radar, sums: &Sums, strength: Complex64) -> Option<Sums> {
    let wave = TAU / radar.wavelength_m();
    let count = radar.rx_m.len();
    let coupled = DMatrix::from_fn(count, count, |row, column| match row.abs_diff(column) {
        0 => Complex64::ONE,
        1 => strength * Complex64::cis(-wave * (radar.rx_m[column][0] - radar.rx_m[row][0]) * sums.sine),
        _ => Complex64::ZERO,
    });
    let inverse = coupled.try_inverse()?;
    let products = &inverse * DMatrix::from_row_slice(count, count, &sums.products) * inverse.adjoint();
    Some(Sums { products: products.transpose().as_slice().to_vec(), ..sums.clone() })
}

/// The coupling that, undone, leaves receivers as alike as can be; none where the array cannot tell.
fn strength<'a>(radar: &Radar, frames: impl Iterator<Item = &'a Sums> + Clone) -> Option<Complex64> {
    const ROUNDS: usize = 4;
    let mut total = Complex64::ZERO;
    for _ in 0..ROUNDS {
        // Neighbours do not hear quite the same of a wide body, so that one step falls short.
        let undone: Vec<Sums> = frames.clone().map(|sums| uncoupled(radar, sums, total)).collect::<Option<_>>()?;
        total += step(radar, undone.iter())?;
        if !total.is_finite() || total.norm() > 2.0 * STRONGEST {
            return None;
        }
    }
    Some(total)
}

/// Least squares of the receivers' logarithmic gains.
fn step<'a>(radar: &Radar, frames: impl Iterator<Item = &'a Sums> + Clone) -> Option<Complex64> {
    let count = radar.rx_m.len();
    let mut products = vec![Complex64::ZERO; count * count];
    for sums in frames.clone() {
        products.iter_mut().zip(&sums.products).for_each(|(sum, product)| *sum += product);
    }
    let gains = log_gains(&products, count)?;
    let lever = contrast(radar, &neighbours(radar, mean_sine(frames)));
    let energy: f64 = lever.iter().map(|value| value.norm_sqr()).sum();
    let data: Complex64 = contrast(radar, &gains).iter().zip(&lever).map(|(gain, n)| gain * n.conj()).sum();
    (energy >= LEAST_CONTRAST).then(|| data / energy)
}

/// Logarithms of the receivers' amplitudes: from their powers, and phases that agree best with all products.
fn log_gains(products: &[Complex64], count: usize) -> Option<Vec<Complex64>> {
    const ROUNDS: usize = 30;
    let mut turns = vec![Complex64::ONE; count];
    for _ in 0..ROUNDS {
        turns = (0..count)
            .map(|rx| {
                let others = (0..count).filter(|&other| other != rx);
                let sum: Complex64 = others.map(|other| products[rx * count + other] * turns[other]).sum();
                // Half of the old one keeps two receivers from swapping for ever.
                let both = sum / sum.norm().max(f64::MIN_POSITIVE) + turns[rx];
                both / both.norm().max(f64::MIN_POSITIVE)
            })
            .collect();
    }
    let first = turns[0].conj();
    let power = |rx: usize| products[rx * count + rx].re;
    (0..count)
        .all(|rx| power(rx) > 0.0)
        .then(|| (0..count).map(|rx| Complex64::new(0.5 * (power(rx) / power(0)).ln(), (turns[rx] * first).arg())).collect())
}

fn candidate(evidence: &Evidence, strength: Complex64, deviation: f64, p_value: f64, gain: f64) -> Candidate {
    let receivers = evidence.radar.rx_m.len();
    let level_db = 20.0 * strength.norm().log10();
    let samples = evidence.cube.samples.iter().map(|value| value.norm_sqr()).sum::<f64>();
    let mean_neighbours = 2.0 * (receivers as f64 - 1.0) / receivers as f64;
    Candidate {
        id: Some("mutual_coupling"),
        behaves_like: "channel gain",
        estimates: vec![Estimate::normal("level_db", level_db, statistics::DECIBEL * deviation / strength.norm())],
        choice: None,
        place: Place::at("antenna"),
        p_value,
        gain,
        rung: Rung::E,
        // Of three receivers only the middle one is odd.
        look_alikes: if receivers < 4 { vec!["channel_mismatch"] } else { vec![] },
        statement: format!(
            "Each receiver also hears its neighbours, {:.1} dB below them and {:.0}° ahead: the inner receivers, which have two \
             neighbours, differ from the outer ones, which have one, in the way that every direction of the body predicts.",
            -level_db,
            strength.arg().to_degrees()
        ),
        curve: None,
        energy: samples * strength.norm_sqr() * mean_neighbours,
        correction: Correction::Samples(Arc::new(move |cube| undo(cube, strength))),
    }
}

/// Solves for what the receivers would have heard alone.
fn undo(cube: &mut Cube, strength: Complex64) {
    let [_, _, receivers, loops, samples] = cube.dims;
    let coupled = DMatrix::from_fn(receivers, receivers, |row, column| match row.abs_diff(column) {
        0 => Complex64::ONE,
        1 => strength,
        _ => Complex64::ZERO,
    });
    let Some(inverse) = coupled.try_inverse() else { return };
    let length = loops * samples;
    let mut heard = vec![Complex64::ZERO; receivers];
    for block in cube.samples.chunks_exact_mut(receivers * length) {
        for at in 0..length {
            heard.iter_mut().enumerate().for_each(|(rx, value)| *value = block[rx * length + at]);
            for rx in 0..receivers {
                block[rx * length + at] = heard.iter().enumerate().map(|(other, value)| inverse[(rx, other)] * value).sum();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn radar() -> Radar {
        let mut radar = Radar::small(12);
        let half = 0.5 * radar.wavelength_m();
        radar.rx_m = (0..4).map(|rx| [rx as f64 * half, 0.0, 0.0]).collect();
        radar
    }

    /// Speckle of a body some degrees wide, after the predicted steering; `change`: what the receivers make of it.
    fn frames(radar: &Radar, seed: u64, sine: f64, change: impl Fn(Vec<Complex64>) -> Vec<Complex64>) -> Vec<Sums> {
        const CELLS: usize = 60;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let wave = TAU / radar.wavelength_m();
        (0..12)
            .map(|_| {
                let mut products = vec![Complex64::ZERO; 16];
                for _ in 0..CELLS {
                    let mut field = vec![Complex64::ZERO; 4];
                    for _ in 0..8 {
                        let (amplitude, direction) = (Complex64::new(normal(), normal()), sine + 0.05 * normal());
                        for (rx, value) in field.iter_mut().enumerate() {
                            *value += amplitude * Complex64::cis(-wave * radar.rx_m[rx][0] * direction);
                        }
                    }
                    let field = change(field);
                    let steered: Vec<Complex64> =
                        field.iter().zip(&radar.rx_m).map(|(value, at)| value * Complex64::cis(wave * at[0] * sine)).collect();
                    for (i, product) in products.iter_mut().enumerate() {
                        *product += steered[i / 4] * steered[i % 4].conj();
                    }
                }
                Sums { products, along: vec![], cells: CELLS as f64, range_m: 3.0, sine }
            })
            .collect()
    }

    fn measured(radar: &Radar, frames: &[Sums]) -> Complex64 {
        strength(radar, frames.iter()).unwrap()
    }

    #[test]
    fn coupling_is_read_back_at_any_direction_and_a_turned_body_is_none() {
        let radar = radar();
        let coupling = Complex64::from_polar(0.1, 1.1);
        let coupled = |field: Vec<Complex64>| -> Vec<Complex64> {
            (0..4)
                .map(|rx| {
                    let before = if rx > 0 { field[rx - 1] } else { Complex64::ZERO };
                    field[rx] + coupling * (before + field.get(rx + 1).copied().unwrap_or_default())
                })
                .collect()
        };
        for sine in [0.0, 0.2] {
            let found = measured(&radar, &frames(&radar, 5, sine, coupled));
            assert!((found - coupling).norm() < 0.02, "{found} at {sine}");
            assert!(measured(&radar, &frames(&radar, 6, sine, |field| field)).norm() < 0.02);
        }
        // A body 2° aside and a stronger last receiver leave the first no trace, and the second half of one.
        let wave = TAU / radar.wavelength_m();
        let aside = |field: Vec<Complex64>| {
            field.iter().zip(&radar.rx_m).map(|(value, at)| value * Complex64::cis(-wave * at[0] * 0.035)).collect()
        };
        assert!(measured(&radar, &frames(&radar, 7, 0.0, aside)).norm() < 0.02);
    }

    #[test]
    fn undoing_is_the_inverse() {
        let strength = Complex64::new(0.1, -0.2);
        let clean: Vec<Complex64> = (0..12).map(|i| Complex64::cis(f64::from(i) * 0.7) * f64::from(i + 1)).collect();
        let at = |rx: usize, n: usize| clean[rx * 3 + n];
        let samples = (0..12).map(|i| {
            let (rx, n) = (i / 3, i % 3);
            let before = if rx > 0 { at(rx - 1, n) } else { Complex64::ZERO };
            let after = if rx < 3 { at(rx + 1, n) } else { Complex64::ZERO };
            clean[i] + strength * (before + after)
        });
        let mut cube = Cube::new([1, 1, 4, 1, 3], samples.collect());
        undo(&mut cube, strength);
        assert!(cube.samples.iter().zip(&clean).all(|(a, b)| (a - b).norm() < 1e-12));
    }
}
