//! Bends and tilts of bodies in noise, and a warped tone.

use super::*;
use crate::support;

const PARTS: usize = 16;

/// A body of points over ranges of a few bins, in twelve frames, and what becomes of it on the way.
fn chirps(seed: u64, changed: impl Fn(usize, f64) -> Complex64) -> Chirps {
    let mut normal = support::normal(seed);
    let mut chirps = Chirps { frames: vec![], parts: PARTS, delay_s: 2e-8 };
    for frame in 0..12 {
        let mut cell = || {
            let (mut expected, mut field) = (vec![Complex64::ZERO; PARTS], DVector::zeros(PARTS));
            for _ in 0..8 {
                let (power, turn) = (100.0, 0.3 * normal());
                let amplitude = Complex64::new(normal(), normal()) * f64::sqrt(0.5 * power);
                expected
                    .iter_mut()
                    .enumerate()
                    .for_each(|(apart, sum)| *sum += Complex64::from_polar(power, turn * apart as f64));
                // The body is a little beside where it is predicted.
                field += DVector::from_fn(PARTS, |part, _| amplitude * Complex64::cis((turn + 0.02) * part as f64));
            }
            let noise = DVector::from_fn(PARTS, |_, _| Complex64::new(normal(), normal()) * f64::sqrt(0.5));
            let observed = DVector::from_fn(PARTS, |part, _| field[part] * changed(frame, place(part, PARTS)) + noise[part]);
            Cell { observed: vec![observed], expected, delay: 1.0 }
        };
        chirps.frames.push((0..5).map(|_| (0..2).map(|_| cell()).collect()).collect());
    }
    chirps
}

fn converged(chirps: &Chirps, numbers: &[usize]) -> Estimated {
    chirps.converged(&chirps.looks(0.0, [0.0; 2]), numbers).unwrap()
}

#[test]
fn a_bend_a_changing_bend_and_a_tilt_are_told_with_their_sizes() {
    let bend = converged(&chirps(1, |_, x| Complex64::cis(0.2 * legendre(2, x))), &[BEND]);
    assert!((bend.values[0] - 0.2).abs() < 0.03 && bend.p_value < 1e-6 && bend.nats > 10.0, "{:?}", bend.values);
    let changing = chirps(2, |frame, x| Complex64::cis(0.2 * (frame as f64 / 5.5 - 1.0) * legendre(2, x)));
    let changing = converged(&changing, &[BEND, TREND]);
    assert!((changing.values[1] - 0.2).abs() < 0.04 && changing.values[0].abs() < 0.03, "{:?}", changing.values);
    let tilt = converged(&chirps(3, |_, x| Complex64::from(f64::exp(-0.3 * x))), &[TILT]);
    assert!((tilt.values[0] + 0.3).abs() < 0.08 && tilt.p_value < 1e-3, "{:?}", tilt.values);
}

#[test]
fn a_body_beside_its_place_neither_bends_nor_tilts() {
    let chances: Vec<f64> = (10..40)
        .flat_map(|seed| {
            let none = chirps(seed, |_, _| Complex64::ONE);
            [[TILT], [BEND]].map(|number| converged(&none, &number).p_value)
        })
        .collect();
    // Uniform or larger.
    let below = |chance: f64| chances.iter().filter(|&&p| p < chance).count();
    assert!(below(0.01) <= 4 && below(0.1) <= 14, "{chances:?}");
}

#[test]
fn a_warped_tone_is_straight_again() {
    let shifts: Vec<f64> = (0..128).map(|n| 0.2 * legendre(2, place(n, 128))).collect();
    for turns in [0.02, 0.2, 0.35] {
        let tone = |at: f64| Complex64::cis(TAU * turns * at);
        let mut chirp: Vec<Complex64> = shifts.iter().enumerate().map(|(n, shift)| tone(n as f64 + shift)).collect();
        straighten(&mut chirp, &shifts);
        let error = |n: usize| (chirp[n] - tone(n as f64)).norm();
        let inside = (4..124).map(error).fold(0.0, f64::max);
        // At the very end nothing is known beyond: it stays as it was.
        let before = (tone(shifts[0]) - tone(0.0)).norm();
        assert!(inside < 0.01 && error(0) < before + 1e-9, "{turns}: {inside} {}", error(0));
    }
}
