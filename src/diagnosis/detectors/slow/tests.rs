//! Static returns in white noise, with and without something that all of them share.

use num_complex::Complex64;

use super::field::ahead;
use super::find;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, NINETY};
use crate::effects;
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::room::Room;
use crate::support;

/// Frames of 32 loops and 64 samples, four channels, returns all over the ranges about 30 dB above the noise.
fn evidence(seed: u64, change: impl Fn(f64, usize, usize, f64) -> Complex64) -> Evidence {
    let mut radar = Radar::small(12);
    radar.loops_per_frame = 32;
    radar.samples_per_chirp = 64;
    radar.frame_period_s = 0.1;
    radar.rx_m = (0..4).map(|i| [0.0019 * f64::from(i), 0.0, 0.0]).collect();
    let mut normal = support::normal(seed);
    let returns: Vec<(f64, Vec<Complex64>)> =
        (0..40).map(|i| (5.0 + f64::from(i) * 1.1, (0..4).map(|_| 3.0 * Complex64::new(normal(), normal())).collect())).collect();
    let delay_of_bin = radar.sample_rate_hz / (64.0 * radar.slope_hz_per_s);
    let clock = radar.clone();
    Evidence::in_noise(radar, seed + 100, |[frame, rx, index, n]| {
        let time_s = clock.chirp_time_s(frame, 0, index);
        let value = |(bin, amplitude): &(f64, Vec<Complex64>)| {
            let tone = Complex64::cis(std::f64::consts::TAU * bin * n as f64 / 64.0);
            amplitude[rx] * tone * change(time_s, frame, index, bin * delay_of_bin)
        };
        returns.iter().map(value).sum()
    })
}

fn best(evidence: &Evidence) -> Option<Candidate> {
    find(evidence).into_iter().filter(|c| c.p_value < 5e-4).max_by(|a, b| a.nats.total_cmp(&b.nats))
}

/// Found and undone, nothing is left to find.
fn found_once(mut evidence: Evidence) -> Candidate {
    let candidate = best(&evidence).expect("nothing found");
    let undo = candidate.correction.undo().expect("no correction of samples");
    undo(&mut evidence.cube);
    let left = best(&evidence.changed());
    assert!(left.is_none(), "after {candidate:?} still {left:?}");
    candidate
}

fn within(candidate: &Candidate, name: &str, truth: f64) {
    let estimate = candidate.estimates.iter().find(|e| e.name == name).unwrap_or_else(|| panic!("no {name}: {candidate:?}"));
    let [low, high] = estimate.ci90[0];
    // Three deviations instead: one draw of the noise must not fail.
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) * 3.0 / NINETY);
    assert!((truth - middle).abs() < half, "{name}: {truth} not within {low} … {high}");
    assert!(half < 0.25 * truth.abs(), "{name}: {half} is no measurement of {truth}");
}

#[test]
fn nothing_is_found_where_nothing_changes() {
    for seed in 0..4 {
        let found = best(&evidence(seed, |_, _, _, _| Complex64::ONE));
        assert!(found.is_none(), "{found:?}");
    }
}

#[test]
fn a_ripple_of_the_gain_has_no_name_but_a_frequency() {
    let found = found_once(evidence(1, |t, _, _, _| (1.0 + 0.04 * (std::f64::consts::TAU * 100.0 * t + 0.4).sin()).into()));
    assert_eq!((found.id, found.behaves_like), (None, Behaviour::SlowTimeGain));
    assert!(found.statement.contains("at 100.0") || found.statement.contains("at 99.9"), "{}", found.statement);
}

#[test]
fn a_common_phase_is_a_vibration_and_one_in_proportion_to_the_delay_is_none() {
    let sinusoid = |t: f64| (std::f64::consts::TAU * 83.0 * t).sin();
    let found = found_once(evidence(2, |t, _, _, _| Complex64::cis(0.05 * sinusoid(t))));
    assert_eq!(found.id, Some(effects::radar_vibration::ID));
    within(&found, "frequency_hz", 83.0);
    let found = found_once(evidence(3, |t, _, _, delay| Complex64::cis(2.5e6 * delay * sinusoid(t))));
    assert_eq!((found.id, found.behaves_like), (None, Behaviour::DelayProportionalPhase));
}

#[test]
fn a_large_phase_excursion_is_read_as_an_angle() {
    let sinusoid = |t: f64| 1.3 * (std::f64::consts::TAU * 83.0 * t).sin();
    let evidence = evidence(5, |t, _, _, _| Complex64::cis(sinusoid(t)));
    let metres = evidence.radar.wavelength_m() / (4.0 * std::f64::consts::PI);
    let found = found_once(evidence);
    assert_eq!(found.id, Some(effects::radar_vibration::ID));
    within(&found, "frequency_hz", 83.0);
    // Its interval is wide for what returns from where: its middle is known better.
    let amplitude = found.estimates.iter().find(|estimate| estimate.name == "amplitude_m").unwrap().values[0];
    assert!((amplitude / (1.3 * metres) - 1.0).abs() < 0.02, "{amplitude}");
}

#[test]
fn a_phase_that_grows_towards_the_boresight_is_a_vibration() {
    let room = Room { left_m: Some(1.5), right_m: Some(1.5), floor_m: Some(1.0), ..Room::default() };
    let sinusoid = |t: f64, delay_s: f64| {
        let cosine = ahead(Some(&room), 0.5 * SPEED_OF_LIGHT * delay_s);
        Complex64::cis(0.1 * cosine * (std::f64::consts::TAU * 27.0 * t).sin())
    };
    let mut evidence = evidence(21, |t, _, _, delay_s| sinusoid(t, delay_s));
    evidence.room = Some(room.clone());
    let found = found_once(evidence.changed());
    assert_eq!(found.id, Some(effects::radar_vibration::ID));
    within(&found, "frequency_hz", 27.0);
    // Its interval is wide, for where returns come from is not known; here they come from where the room says.
    let (amplitude, truth) = (&found.estimates[0], 0.1 * Radar::small(1).wavelength_m() / (2.0 * std::f64::consts::TAU));
    assert_eq!(amplitude.name, "amplitude_m");
    assert!((amplitude.values[0] / truth - 1.0).abs() < 0.1, "{amplitude:?} of {truth}");
}

#[test]
fn one_strong_return_that_comes_late_is_no_gain_of_the_radar() {
    let delay_of_bin = {
        let radar = Radar::small(1);
        radar.sample_rate_hz / (64.0 * radar.slope_hz_per_s)
    };
    let late = |frame: usize, delay_s: f64| {
        let there = (delay_s / delay_of_bin - 27.0).abs() < 0.5;
        if !there { 1.0 } else { f64::from(u8::from(frame >= 7)) * 30.0 }
    };
    let found = find(&evidence(22, |_, frame, _, delay_s| late(frame, delay_s).into()));
    assert!(found.iter().all(|candidate| candidate.id != Some(effects::gain_drift::ID)), "{found:?}");
}

#[test]
fn a_drift_and_a_step_are_measured() {
    let db = |db: f64| Complex64::from(10f64.powf(db / 20.0));
    within(&found_once(evidence(4, |_, frame, _, _| db(0.4 * frame as f64 / 11.0))), "db", 0.4);
    let step = found_once(evidence(5, |_, frame, _, _| db(if frame >= 7 { 0.3 } else { 0.0 })));
    within(&step, "db", 0.3);
    assert_eq!(step.place.frames, Some(vec![7, 8, 9, 10, 11]));
}

/// At some ranges something moves slowly besides, by far more than the noise, and otherwise at each of them.
#[test]
fn a_drift_is_distinguished_from_slow_parts_of_a_body() {
    let radar = Radar::small(1);
    let delay_of_bin = radar.sample_rate_hz / (64.0 * radar.slope_hz_per_s);
    let wandering = |frame: usize, delay_s: f64| {
        let (bin, time) = (delay_s / delay_of_bin, frame as f64 / 11.0);
        let turn = Complex64::cis(2.0 * time * (1.0 + (0.9 * bin).sin()) + 1.7 * bin);
        if (14.0..30.0).contains(&bin) { 1.0 + 0.04 * turn } else { Complex64::ONE }
    };
    let wanders = |seed: u64| evidence(seed, |_, frame, _, delay_s| wandering(frame, delay_s));
    assert!(best(&wanders(24)).is_none_or(|found| found.id != Some(effects::gain_drift::ID)));
    let drifts = evidence(25, |_, frame, _, delay_s| wandering(frame, delay_s) * (1.0 + 0.1 * frame as f64 / 11.0));
    let found = best(&drifts).expect("nothing found");
    assert_eq!(found.id, Some(effects::gain_drift::ID));
    within(&found, "db", 20.0 * 1.1f64.log10());
}

/// Seen ten times a second, what turns slower than the recording lasts looks like something that turns 0.4 times a second faster than
/// the frames come.
#[test]
fn a_slow_turn_is_a_drift_and_no_vibration_at_the_rate_of_the_frames() {
    let slowly = |frame: usize| Complex64::cis(0.06 * (std::f64::consts::TAU * 0.04 * frame as f64 + 0.5).cos());
    let found = find(&evidence(26, |_, frame, _, _| slowly(frame)));
    assert!(found.iter().any(|found| found.behaves_like == Behaviour::SlowTimePhase && found.p_value < 5e-4), "{found:?}");
    assert!(found.iter().all(|found| found.id != Some(effects::radar_vibration::ID)), "{found:?}");
}

#[test]
fn the_first_chirps_of_a_frame_settle() {
    let found = found_once(evidence(6, |_, _, index, _| (1.0 - 0.1 * (-(index as f64) / 5.0).exp()).into()));
    assert_eq!(found.id, Some(effects::chirp_settling::ID));
    within(&found, "depth", 0.1);
    within(&found, "chirps", 5.0);
}

#[test]
fn what_does_not_settle_or_begins_in_no_frame_is_no_settling() {
    let settles = |evidence: &Evidence| find(evidence).iter().any(|found| found.id == Some(effects::chirp_settling::ID));
    let rises = evidence(6, |_, _, index, _| (1.0 + 0.1 * index as f64 / 31.0).into());
    assert!(find(&rises).iter().any(|found| found.behaves_like == Behaviour::SlowTimeGain), "{:?}", find(&rises));
    assert!(!settles(&rises));
    let mut in_blocks = evidence(6, |_, _, index, _| (1.0 - 0.1 * (-(index as f64) / 5.0).exp()).into());
    assert!(settles(&in_blocks));
    in_blocks.split.block_loops = Some(32);
    assert!(!settles(&in_blocks));
}

#[test]
fn random_chirps_are_phase_noise_or_jitter() {
    let bell: Vec<f64> = std::iter::repeat_with(support::normal(9)).take(12 * 32).collect();
    let at_stated = 2.0 * 3.0 / crate::radar::SPEED_OF_LIGHT;
    let noisy = |scale: f64, values: Vec<f64>| {
        move |_: f64, frame: usize, index: usize, delay: f64| Complex64::cis(scale * delay * values[frame * 32 + index])
    };
    let found = found_once(evidence(7, noisy(0.05 / at_stated, bell.clone())));
    assert_eq!(found.id, Some(effects::phase_noise::ID));
    within(&found, "per_chirp_rad", 0.05);
    let two: Vec<f64> = bell.iter().map(|v| if *v > 0.0 { 1.0 } else { 0.0 }).collect();
    let slope = Radar::small(1).slope_hz_per_s;
    let found = found_once(evidence(8, noisy(std::f64::consts::TAU * slope * 1.2e-8, two)));
    assert_eq!(found.id, Some(effects::chirp_start_jitter::ID));
    within(&found, "jitter_s", 1.2e-8);
    // Two times that are not quite two: a normal law of all chirps is worse.
    let spread = std::iter::repeat_with(support::normal(10)).map(|value| 0.06 * value);
    let blurred: Vec<f64> = bell.iter().zip(spread).map(|(v, spread)| spread + if *v > 0.0 { 1.0 } else { 0.0 }).collect();
    let found = found_once(evidence(8, noisy(std::f64::consts::TAU * slope * 4e-8, blurred)));
    assert_eq!((found.id, found.look_alikes.len()), (Some(effects::chirp_start_jitter::ID), 0));
}

#[test]
fn one_receiver_that_hops_is_distinguished_from_all_that_drift() {
    let hopping = |change: bool| {
        let mut evidence = evidence(11, |_, _, _, _| Complex64::ONE);
        evidence.cube.each_chirp(|[frame, channel, _], chirp| {
            let factor = if change && channel == 2 && [0, 3, 4, 6, 10].contains(&frame) { 1.05 } else { 1.0 };
            chirp.iter_mut().for_each(|value| *value *= factor);
        });
        evidence.changed()
    };
    assert!(super::channels::find(&hopping(false)).iter().all(|c| c.p_value > 5e-4));
    let mut evidence_hopping = hopping(true);
    let found = super::channels::find(&evidence_hopping);
    assert!(found.len() == 1 && found[0].p_value < 1e-6 && found[0].nats > 10.0, "{found:?}");
    assert_eq!(found[0].place.rx, Some(vec![2]));
    let undo = found[0].correction.undo().expect("no correction of samples");
    undo(&mut evidence_hopping.cube);
    let left = super::channels::find(&evidence_hopping.changed());
    assert!(left.iter().all(|c| c.p_value > 5e-4), "{left:?}");
    let drifting = evidence(12, |_, frame, _, _| (1.0 + 0.01 * frame as f64).into());
    assert!(super::channels::find(&drifting).iter().all(|c| c.p_value > 5e-4));
}

/// A radar that moves takes its leakage with it.
#[test]
fn a_vibration_is_measured_beside_a_leakage_that_stays_and_is_none_where_that_turns_as_well() {
    let shake = |t: f64| Complex64::cis(0.1 * (std::f64::consts::TAU * 83.0 * t).sin());
    let leaking = |with_leakage: bool| {
        let mut evidence = evidence(31, |t, _, _, _| shake(t));
        let radar = evidence.radar.clone();
        let bin = 0.1 / radar.range_resolution_m();
        evidence.cube.each_chirp(|[frame, _, index], chirp| {
            let turn = if with_leakage { shake(radar.chirp_time_s(frame, 0, index)) } else { Complex64::ONE };
            let tone = |n: usize| Complex64::cis(std::f64::consts::TAU * bin * n as f64 / 64.0) * 300.0;
            chirp.iter_mut().enumerate().for_each(|(n, value)| *value += tone(n) * turn);
        });
        best(&evidence.changed()).expect("nothing found")
    };
    let stays = leaking(false);
    assert_eq!(stays.id, Some(effects::radar_vibration::ID), "{}", stays.statement);
    let truth = 0.1 * Radar::small(1).wavelength_m() / (2.0 * std::f64::consts::TAU);
    assert!((stays.estimates[0].values[0] / truth - 1.0).abs() < 0.1, "{stays:?}");
    let turns = leaking(true);
    assert_eq!((turns.id, turns.behaves_like), (None, Behaviour::SlowTimePhase), "{}", turns.statement);
}

/// Where something was taken out, what all returns do went with it.
#[test]
fn a_step_is_seen_at_the_ranges_where_nothing_was_taken_out() {
    let radar = Radar::small(1);
    let delay_of_bin = radar.sample_rate_hz / (64.0 * radar.slope_hz_per_s);
    let taken = |range: usize| (13..47).contains(&range);
    let step = |frame: usize, delay_s: f64| {
        let stays = taken((delay_s / delay_of_bin).round() as usize);
        if frame >= 7 && !stays { 1.1 } else { 1.0 }
    };
    let mut evidence = evidence(5, |_, frame, _, delay_s| step(frame, delay_s).into());
    let is_step = |evidence: &Evidence| best(evidence).is_some_and(|found| found.id == Some(effects::gain_drift::ID));
    assert!(!is_step(&evidence));
    evidence.emptied.push(std::sync::Arc::new(move |_, range| taken(range)));
    assert!(is_step(&evidence.changed()));
}

#[test]
fn a_single_receiver_shows_a_step() {
    let radar = Radar { samples_per_chirp: 64, loops_per_frame: 32, rx_m: vec![[0.0; 3]], ..Radar::small(12) };
    let evidence = Evidence::in_noise(radar, 4, |[frame, _, _, n]| {
        let tone = |bin: f64| Complex64::cis(std::f64::consts::TAU * bin * n as f64 / 64.0 + bin) * 30.0;
        let gain = if frame >= 7 { 0.8 } else { 1.0 };
        [7.0, 15.0, 23.0, 31.0, 45.0].into_iter().map(tone).sum::<Complex64>() * gain
    });
    within(&found_once(evidence), "db", 20.0 * 0.8f64.log10());
}

#[test]
fn two_strong_things_that_move_alike_are_no_receiver() {
    let mut evidence = evidence(14, |_, _, _, _| Complex64::ONE);
    evidence.cube.each_chirp(|[frame, channel, _], chirp| {
        let level = if channel == 2 { 100.0 * (1.3 * frame as f64).sin() } else { 0.0 };
        let tone = |n: usize, bin: f64| Complex64::cis(std::f64::consts::TAU * bin * n as f64 / 64.0) * level;
        chirp.iter_mut().enumerate().for_each(|(n, value)| *value += tone(n, 9.0) + tone(n, 40.0));
    });
    let found = super::channels::find(&evidence.changed());
    assert!(found.iter().all(|found| found.p_value > 5e-4), "{found:?}");
}
