//! What is common to all returns over slow time, in made recordings.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::bets::log_bessel_0;
use super::course::{Course, without_slow};
use super::find;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::Evidence;
use crate::effects;
use crate::radar::Radar;
use crate::support;

#[test]
fn bessel_function_of_order_zero() {
    // Abramowitz and Stegun, table 9.8: e^-x I0(x).
    for (x, scaled) in [(0.1, 0.907_100_93), (1.0, 0.465_759_61), (3.0, 0.243_000_35), (5.0, 0.183_540_81), (10.0, 0.127_833_34)]
    {
        assert!((log_bessel_0(x) - x - f64::ln(scaled)).abs() < 1e-6, "{x}");
    }
    assert_eq!(log_bessel_0(0.0), 0.0);
}

/// Static returns at several ranges, of which those beyond the first turn by `phase` of the time.
fn evidence(gap_s: f64, seed: u64, phase: impl Fn(f64) -> f64, own: impl Fn(f64, usize) -> f64) -> Evidence {
    let mut radar = Radar { samples_per_chirp: 96, loops_per_frame: 16, ..Radar::small(24) };
    radar.frame_period_s = radar.loops_per_frame as f64 * radar.loop_period_s() + gap_s;
    let clock = radar.clone();
    let bins = [3.0, 11.0, 20.0, 27.0, 34.0, 43.0, 52.0];
    Evidence::in_noise(radar, seed, move |[frame, channel, index, n]| {
        let time_s = clock.chirp_time_s(frame, 0, index);
        let range = |(i, bin): (usize, &f64)| {
            let turn = if i == 0 { 0.0 } else { phase(time_s) } + own(time_s, i);
            Complex64::from_polar(20.0 / (1 + i) as f64, TAU * bin * n as f64 / 96.0 + turn + (i * channel) as f64)
        };
        bins.iter().enumerate().map(range).sum()
    })
}

#[test]
fn noise_keeps_its_variance_under_the_taper_and_a_line_is_left_of_it() {
    for gap_s in [0.0, 0.02] {
        let course = Course::of(&evidence(gap_s, 1, |_| 0.0, |_, _| 0.0));
        assert_eq!(course.even, gap_s == 0.0);
        let white: Vec<f64> = std::iter::repeat_with(support::normal(7)).take(24 * 16).collect();
        let values = course.spectrum(&white);
        assert_eq!(values.len(), course.frequencies_hz().len());
        let power = values.iter().map(Complex64::norm_sqr).sum::<f64>() / values.len() as f64;
        assert!((power - 1.0).abs() < 0.3, "{power}");
        let line = |i: usize| 0.8 * (TAU * 0.19 * i as f64).sin();
        let loud: Vec<f64> = (0..24 * 16).map(|i| line(i) + 0.1 * white[i]).collect();
        let left = course.denoised(&loud, 0.01);
        let off = left.iter().enumerate().map(|(i, value)| (value - line(i)).powi(2)).sum::<f64>() / left.len() as f64;
        assert!(off < 0.05, "{off}");
    }
    // Of a straight line: the odd cosines from the fifth on have 1/k⁴ each of the power, and all of them π⁴/96.
    let line: Vec<f64> = (0..50).map(|i| f64::from(i) - 24.5).collect();
    let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    let share = square(&without_slow(&line)) / square(&line);
    let law = 1.0 - (1.0 + 1.0 / 81.0) / (std::f64::consts::PI.powi(4) / 96.0);
    assert!((share - law).abs() < 1e-4, "{share} of {law}");
}

/// Every range by a course of its own, far stronger at one.
fn own(time_s: f64, range: usize) -> f64 {
    0.05 * (1.0 + 10.0 * f64::from(u8::from(range == 1))) * (TAU * (7.0 + 1.7 * range as f64) * time_s + range as f64).sin()
}

#[test]
fn a_phase_that_most_ranges_share_is_found_beside_what_moves_by_itself() {
    // No single line: three that are no multiples of one another.
    let shakes = |time_s: f64| 0.1 * [31.0, 37.7, 44.1].iter().map(|f| (TAU * f * time_s).sin()).sum::<f64>();
    for gap_s in [0.0, 0.02] {
        let found = find(&evidence(gap_s, 2, shakes, own)).expect("a shared phase");
        assert_eq!(found.id, Some(effects::radar_vibration::ID), "{}", found.statement);
        assert!(found.p_value < 1e-6 && found.nats > 13.0, "{} {}", found.p_value, found.nats);
    }
    // Slower than the recording, it is a drift, which other laws describe.
    let duration_s = 24.0 * 16.0 * evidence(0.0, 1, |_| 0.0, own).radar.loop_period_s();
    let drifts = |time_s: f64| 0.4 * time_s / duration_s;
    assert!(find(&evidence(0.0, 2, drifts, |_, _| 0.0)).is_none_or(|found| found.p_value > 1e-3));
}

/// A phase that is drawn anew for each chirp, as of a trigger that jitters, is no vibration.
#[test]
fn what_the_ranges_share_at_all_frequencies_has_no_name() {
    let drawn: Vec<f64> = std::iter::repeat_with(support::normal(9)).take(24 * 16).collect();
    for gap_s in [0.0, 0.02] {
        let clock = evidence(gap_s, 1, |_| 0.0, own).radar;
        let index = |time_s: f64| {
            let frame = (time_s / clock.frame_period_s).floor();
            let within = ((time_s - frame * clock.frame_period_s) / clock.loop_period_s()).floor() as usize;
            frame as usize * 16 + within.min(15)
        };
        let found = find(&evidence(gap_s, 2, |time_s| 0.1 * drawn[index(time_s + 1e-9)], own)).expect("a shared phase");
        assert_eq!(found.id, None, "{}", found.statement);
        assert!(found.p_value < 1e-6, "{}", found.p_value);
    }
}

#[test]
fn ranges_that_vary_each_for_itself_share_nothing() {
    for seed in 0..12 {
        for gap_s in [0.0, 0.02] {
            let p_value = |evidence: &Evidence| find(evidence).map_or(1.0, |found| found.p_value);
            assert!(p_value(&evidence(gap_s, seed, |_| 0.0, |_, _| 0.0)) > 1e-3, "{seed}");
            assert!(p_value(&evidence(gap_s, seed, |_| 0.0, own)) > 1e-3, "{seed}");
            // Each drifts away by itself, to either side.
            let away = |time_s: f64, range: usize| {
                2.0 * time_s * (1.0 + range as f64) * if range.is_multiple_of(2) { 1.0 } else { -1.0 }
            };
            assert!(p_value(&evidence(gap_s, seed, |_| 0.0, away)) > 1e-3, "{seed}");
        }
    }
}

/// An oscillator's error, of no line either, turns far returns more than near ones.
#[test]
fn a_phase_in_proportion_to_the_delay_is_no_vibration() {
    let wanders = |time_s: f64| [31.0, 37.7, 44.1].iter().map(|f| (TAU * f * time_s).sin()).sum::<f64>();
    let bins = [3.0, 11.0, 20.0, 27.0, 34.0, 43.0, 52.0];
    for gap_s in [0.0, 0.02] {
        let found = find(&evidence(gap_s, 3, |_| 0.0, |time_s, i| 0.004 * bins[i] * wanders(time_s))).expect("a shared phase");
        assert_eq!((found.id, found.behaves_like), (None, Behaviour::DelayProportionalPhase), "{}", found.statement);
    }
}

/// As of an amplifier that is set anew for every frame.
#[test]
fn a_gain_of_any_course_is_found() {
    let mut draw = support::normal(5);
    let gains: Vec<f64> = (0..24).map(|_| 1.0 + 0.2 * draw()).collect();
    let mut amplified = evidence(0.02, 2, |_| 0.0, own);
    amplified.cube.each_chirp(|[frame, ..], chirp| chirp.iter_mut().for_each(|value| *value *= gains[frame]));
    let amplified = amplified.changed();
    let found = find(&amplified).expect("a shared gain");
    assert_eq!((found.id, found.behaves_like), (None, Behaviour::SlowTimeGain), "{}", found.statement);
    assert!(found.p_value < 1e-6 && found.statement.contains("dB"), "{found:?}");
}
