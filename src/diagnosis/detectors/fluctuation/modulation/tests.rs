//! Returns whose amplitude is modulated, in made recordings.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::find;
use crate::diagnosis::evidence::Evidence;
use crate::radar::Radar;

const MODULATION_HZ: f64 = 160.0;

/// Two static returns, of which one is modulated, or both, and somebody who moves, in noise.
fn evidence(depth: f64, both: bool, walker: f64) -> Evidence {
    let mut radar = Radar::small(8);
    (radar.loops_per_frame, radar.samples_per_chirp) = (16, 64);
    let clock = radar.clone();
    Evidence::in_noise(radar, 4, |[frame, rx, slow, n]| {
        let (time, n) = (clock.chirp_time_s(frame, 0, slow), n as f64);
        let mover = Complex64::cis(0.6 * n + 0.4 * slow as f64 + 1.9 * (frame * frame) as f64) * walker;
        let modulated = 1.0 + depth * (TAU * MODULATION_HZ * time).cos();
        let lamp = Complex64::cis(1.8 * n - 0.2 * rx as f64) * 8.0 * modulated;
        let wall = Complex64::cis(0.9 * n + 0.4 * rx as f64) * 30.0 * if both { modulated } else { 1.0 };
        wall + mover + lamp
    })
}

#[test]
fn a_modulated_return_is_found_at_its_range_and_is_gone_once_it_is_explained() {
    let before = evidence(0.3, false, 4.0);
    let found = find(&before).expect("it is modulated");
    let [near, far] = found.place.range_m.unwrap();
    let wanted = 1.8 / TAU * 64.0 * before.radar.range_resolution_m();
    assert!((near..far).contains(&wanted), "{wanted} in {near} to {far}");
    assert!(found.p_value < 1e-4 && found.nats > 10.0, "{} {}", found.p_value, found.nats);
    let after = before.with(&found);
    let energy = |evidence: &Evidence| evidence.cube.samples.iter().map(|value| value.norm_sqr()).sum::<f64>();
    let removed = energy(&before) - energy(&after);
    // Every frame sees the same half of a turn: its mean is static.
    let radar = &before.radar;
    let times = (0..8).flat_map(|frame| (0..16).map(move |slow| radar.chirp_time_s(frame, 0, slow)));
    let waves: Vec<f64> = times.map(|time| 8.0 * 0.3 * (TAU * MODULATION_HZ * time).cos()).collect();
    let mean = waves.iter().sum::<f64>() / waves.len() as f64;
    let variance = waves.iter().map(|wave| (wave - mean).powi(2)).sum::<f64>() / waves.len() as f64;
    let planted = variance * before.cube.samples.len() as f64;
    assert!((removed / planted - 1.0).abs() < 0.2, "{removed} of {planted}");
}

#[test]
fn what_stands_or_moves_is_not_modulated_and_the_receivers_modulation_is_no_lamp() {
    assert!(find(&evidence(0.0, false, 4.0)).is_none());
    assert!(find(&evidence(0.3, true, 4.0)).is_none());
}

#[test]
fn somebody_who_outshines_the_lamp_elsewhere_does_not_make_it_the_receivers() {
    let found = find(&evidence(0.5, false, 40.0)).expect("it is modulated");
    let wanted = 1.8 / TAU * 64.0 * Radar::small(8).range_resolution_m();
    assert!(found.p_value < 1e-4 && found.place.range_m.is_some_and(|[near, far]| (near..far).contains(&wanted)));
    assert!(find(&evidence(0.5, true, 40.0)).is_none());
}
