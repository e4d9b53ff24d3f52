//! What survives, of effects that do and of some that do not.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;

const DIMS: [usize; 3] = [2, 16, 32];

fn frames(count: usize, value: impl Fn(usize, usize, usize, usize) -> Complex64) -> Frames {
    let [channels, loops, samples] = DIMS;
    let values = (0..count).map(|frame| {
        (0..channels * loops * samples).map(|i| value(frame, i / (loops * samples), i / samples % loops, i % samples)).collect()
    });
    Frames { dims: DIMS, values: values.collect() }
}

fn tone(doppler: f64, range: f64, slow: usize, fast: usize) -> Complex64 {
    Complex64::cis(std::f64::consts::TAU * (doppler * slow as f64 / 16.0 + range * fast as f64 / 32.0))
}

fn noisy(of: Frames, seed: u64) -> Frames {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let values =
        of.values.into_iter().map(|frame| frame.into_iter().map(|value| value + Complex64::new(normal(), normal())).collect());
    Frames { dims: of.dims, values: values.collect() }
}

/// A body of several returns in each of many cells, every one of an unknown phase, and a wall.
fn scene(seed: u64, body: f64, delay: f64) -> Frames {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let phases: Vec<f64> = (0..60).map(|_| std::f64::consts::TAU * random.random::<f64>()).collect();
    let person = |frame: usize, channel: usize, slow: usize, fast: usize| -> Complex64 {
        let part = |(i, phase): (usize, &f64)| {
            let place = i as f64 / 60.0;
            let turned = Complex64::cis(phase + 40.0 * place * frame as f64 + 2.0 * place * channel as f64);
            tone(2.0 + 5.0 * place, 6.0 + 8.0 * place + delay, slow, fast) * turned * body
        };
        phases.iter().enumerate().map(part).sum()
    };
    let wall = |slow: usize, fast: usize| tone(0.0, 20.0, slow, fast) * 30.0;
    noisy(frames(6, |frame, channel, slow, fast| person(frame, channel, slow, fast) + wall(slow, fast)), seed)
}

/// d′ and the coherent one of what `effect` makes of a scene, by seed, strength of the body, and the scene itself.
fn both(effect: impl Fn(u64, f64, &Frames) -> Frames) -> [f64; 2] {
    let draws = |body: f64, seeds: std::ops::Range<u64>| -> Vec<Draw> {
        let draw = |seed| {
            let clean = scene(seed, body, 0.0);
            let effect = effect(seed, body, &clean);
            Draw { clean, effect }
        };
        seeds.map(draw).collect()
    };
    let (draws, empty) = (draws(6.0, 1..5), draws(0.0, 5..8));
    let coherent = draws[0].effect.values.iter().flatten().map(Complex64::norm_sqr).sum::<f64>().sqrt();
    [d_prime(&draws, &empty, 2.0), coherent]
}

fn difference(a: &Frames, b: &Frames) -> Frames {
    let values = a.values.iter().zip(&b.values).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect());
    Frames { dims: a.dims, values: values.collect() }
}

#[test]
fn where_nothing_else_is_the_d_prime_is_the_coherent_one() {
    let [found, coherent] = both(|_, _, clean| frames(clean.count(), |_, _, slow, fast| tone(-5.0, 25.0, slow, fast) * 0.1));
    assert!((found / coherent - 1.0).abs() < 0.15, "{found} against {coherent}");
}

#[test]
fn another_draw_of_the_body_and_another_room_of_the_same_strength_are_no_effect() {
    let redrawn = both(|seed, body, clean| difference(&scene(seed + 100, body, 0.0), clean));
    let factor = |gain: Complex64| {
        both(move |_, _, clean| frames(clean.count(), |_, _, slow, fast| tone(0.0, 20.0, slow, fast) * 30.0 * (gain - 1.0)))
    };
    let [brighter, turned, opposite] = [1.2.into(), Complex64::cis(1.0), Complex64::from(-1.0)].map(factor);
    for [found, coherent] in [redrawn, brighter, turned, opposite] {
        assert!(coherent > 200.0 && found < 4.0, "{coherent} and {found}");
    }
    // Ten times as strong, it is something else: each return stands out as far as it is above the room.
    let [found, _] = factor(10.0.into());
    assert!(found > 10.0, "{found}");
}

#[test]
fn power_elsewhere_and_differences_between_channels_are_seen_under_any_phases() {
    let moved = both(|seed, body, clean| difference(&scene(seed + 100, body, 2.0), clean));
    let [channels, loops, samples] = DIMS;
    let turned = both(|_, _, clean| {
        let factor = |i: usize| if (i / (loops * samples)).is_multiple_of(channels) { 0.2 } else { -0.2 };
        let turn = |frame: &Vec<Complex64>| frame.iter().enumerate().map(|(i, value)| value * factor(i)).collect();
        Frames { dims: DIMS, values: clean.values.iter().map(turn).collect() }
    });
    for [found, _] in [moved, turned] {
        assert!(found > 15.0, "{found}");
    }
}
