//! A rough little body in a room, made path by path.

use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::beams::{Beams, Look};
use super::{find, scene::Scene, sinusoidal};
use crate::diagnosis::cube::Loaded;
use crate::diagnosis::misfit::Misfit;
use crate::diagnosis::{BodyPrediction, Candidate, Cube, Evidence, Point, Split};
use crate::effects;
use crate::paths::distance;
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::room::Room;

const FRAMES: usize = 16;
const RIGHT_M: f64 = 2.4;

/// Adds a path of this length (tx to rx, at the frame's start) and its rate.
fn path(cube: &mut Cube, radar: &Radar, frame: usize, rx: usize, length: (f64, f64), amplitude: Complex64) {
    let [_, _, receivers, loops, samples] = cube.dims;
    for i in 0..loops {
        let delay = (length.0 + length.1 * i as f64 * radar.loop_period_s()) / SPEED_OF_LIGHT;
        let start = amplitude * Complex64::cis(std::f64::consts::TAU * (radar.carrier_hz() * delay).fract());
        let turn = Complex64::cis(std::f64::consts::TAU * radar.slope_hz_per_s * delay / radar.sample_rate_hz);
        let at = ((frame * receivers + rx) * loops + i) * samples;
        let mut value = start;
        for sample in &mut cube.samples[at..at + samples] {
            *sample += value;
            value *= turn;
        }
    }
}

/// Body walking away, with a mirror on the right, an oscillating untracked mover before it, or neither.
fn evidence(mirror: f64, untracked: f64) -> Evidence {
    made(mirror, untracked, 1.0)
}

/// `centre_m`: about which the untracked mover oscillates.
fn made(mirror: f64, untracked: f64, centre_m: f64) -> Evidence {
    let mut radar = Radar { samples_per_chirp: 64, loops_per_frame: 64, frames: FRAMES, ..Radar::mmmesh(FRAMES) };
    radar.tx_m.truncate(1);
    radar.chirp_period_s *= 3.0;
    radar.rx_m.truncate(2);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut cube = Cube::new(radar.dims(), vec![Complex64::ZERO; radar.dims().iter().product()]);
    let mut frames = vec![];
    let period_s = radar.loop_period_s();
    for frame in 0..FRAMES {
        let time_s = frame as f64 * radar.frame_period_s;
        let mut points = vec![];
        for _ in 0..40 {
            let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
            let velocity = [0.1, 1.2 + between(-0.2, 0.2), 0.0];
            let position = [0.3 + between(-0.2, 0.2), 1.6 + 0.8 * time_s + between(-0.1, 0.1), between(-0.5, 0.5)];
            let amplitude = Complex64::from_polar(1.0, between(0.0, 6.3));
            for rx in 0..2 {
                let (tx_m, rx_m) = (radar.tx_position_m(0), radar.rx_position_m(rx));
                let length = |mirrored: [bool; 2], later: f64| {
                    let at: [f64; 3] = std::array::from_fn(|axis| position[axis] + velocity[axis] * later);
                    let image = [2.0 * RIGHT_M - at[0], at[1], at[2]];
                    let seen = |mirrored: bool| if mirrored { image } else { at };
                    distance(tx_m, seen(mirrored[0])) + distance(seen(mirrored[1]), rx_m)
                };
                for (mirrored, gain) in [([false, false], 1.0), ([true, false], mirror), ([false, true], mirror)] {
                    if gain > 0.0 {
                        let (start, end) = (length(mirrored, 0.0), length(mirrored, period_s));
                        path(&mut cube, &radar, frame, rx, (start, (end - start) / period_s), amplitude * gain);
                    }
                }
            }
            let middle: [f64; 3] = std::array::from_fn(|axis| position[axis] + velocity[axis] * 0.5 * radar.frame_duration_s());
            let facing = distance(middle, [0.0; 3]);
            let normal = middle.map(|x| -x / facing);
            points.push(Point { position_m: middle, velocity_mps: velocity, normal, area_m2: 0.01, part: 0 });
        }
        frames.push(points);
        if untracked > 0.0 {
            let phase = std::f64::consts::TAU * 0.8 * time_s;
            let (range, velocity) = (centre_m + 0.12 * phase.sin(), 0.12 * std::f64::consts::TAU * 0.8 * phase.cos());
            for rx in 0..2 {
                path(&mut cube, &radar, frame, rx, (2.0 * range, 2.0 * velocity), Complex64::from(untracked));
            }
        }
    }
    for value in &mut cube.samples {
        let (level, angle) = ((-2.0 * (1.0 - random.random::<f64>()).ln()).sqrt(), random.random::<f64>());
        *value += Complex64::from_polar(level, std::f64::consts::TAU * angle);
    }
    in_a_room(radar, cube, frames)
}

/// `points`: of the body, by frame.
fn in_a_room(radar: Radar, cube: Cube, points: Vec<Vec<Point>>) -> Evidence {
    let starts_s: Vec<f64> = (0..FRAMES).map(|frame| frame as f64 * radar.frame_period_s).collect();
    let middle_s = starts_s.iter().map(|start| start + 0.5 * radar.frame_duration_s()).collect();
    let (held_out, training) = (0..FRAMES).partition(|frame| frame % 4 == 2);
    let split = Split { training, held_out, block_loops: None };
    let room = Room { left_m: Some(1.3), right_m: Some(RIGHT_M), front_m: Some(4.0), ..Room::default() };
    let body = BodyPrediction { parts: vec!["body".into()], frames: points, middle_s, ..BodyPrediction::default() };
    Evidence::new(Loaded { cube, radar, split, starts_s, extremes: [-1.0, 1.0] }, Some(room), Some(body))
}

/// What is believed of what was found.
fn believed(evidence: &Evidence) -> Vec<Candidate> {
    find(evidence).into_iter().filter(|found| found.p_value < 5e-4).collect()
}

fn corrected(mut evidence: Evidence, found: &Candidate) -> Evidence {
    if let Some(correct) = found.correction.undo() {
        correct(&mut evidence.cube);
    }
    evidence.accepted.extend(found.id);
    evidence.changed()
}

#[test]
fn a_body_alone_is_no_path() {
    assert!(believed(&evidence(0.0, 0.0)).is_empty());
}

#[test]
fn a_mirror_on_the_right_is_found_and_removed() {
    // Longer ways and a side turned away leave 0.21 of what a mirror of amplitude 1 would return of this body.
    let evidence = evidence(0.4 * 0.21, 0.0);
    let found = believed(&evidence);
    assert_eq!(
        (found.len(), found[0].id, found[0].choice.as_deref()),
        (1, Some(effects::wall_ghost::ID), Some("right")),
        "{found:?}"
    );
    let [low, high] = found[0].estimates[0].ci90[0];
    assert!(low < 0.4 && 0.4 < high, "{low} {high}");
    assert!(found[0].nats > 20.0);
    let after = believed(&corrected(evidence, &found[0]));
    assert!(after.is_empty(), "{after:?}");
}

#[test]
fn an_oscillating_stranger_is_found_and_removed() {
    let evidence = evidence(0.0, 1.0);
    let found = believed(&evidence);
    assert_eq!((found.len(), found[0].id), (1, Some(effects::moving_reflector::ID)), "{found:?}");
    let of = |name: &str| found[0].estimates.iter().find(|estimate| estimate.name == name).unwrap();
    assert!((of("rate_hz").values[0] - 0.8).abs() < 0.05 && (of("swing_m").values[0] - 0.12).abs() < 0.02, "{found:?}");
    let after = believed(&corrected(evidence, &found[0]));
    assert!(after.is_empty(), "{after:?}");
}

#[test]
fn what_was_taken_out_of_a_channel_counts_as_predicted_by_those_before_it() {
    let (with, without) = (evidence(0.0, 1.0), evidence(0.0, 0.0));
    let found = believed(&with);
    let explained = corrected(with.clone(), &found[0]);
    let [before, after, best] = [Misfit::of(&with), Misfit::after(&with, &explained), Misfit::of(&without)];
    let [before, after, best] = [before, after, best].map(|misfit| misfit.loglik_per_sample);
    let recovered = (after - before) / (best - before);
    // Nobody predicts the first of the two channels; the second costs a little, for its amplitudes are not known.
    assert!((0.4..0.95).contains(&recovered), "{before} {after} {best}");
}

#[test]
fn a_sinusoidal_motion_among_the_bodys_returns_is_found_by_its_law() {
    let among = made(0.0, 2.0, 2.2);
    let scene = Scene::new(&among).unwrap();
    let found = sinusoidal::strongest(&scene).unwrap().mover;
    let fit = found.oscillation.unwrap();
    assert!((fit.rate_hz - 0.8).abs() < 0.08 && (fit.mean_m - 2.2).abs() < 0.1, "{fit:?}");
    assert!((fit.excursion_m() - 0.12).abs() < 0.012, "{fit:?}");
    assert!(found.gain > 6.0 && found.track.p_value < 1e-3, "{} {}", found.gain, found.track.p_value);
    let alone = evidence(0.0, 0.0);
    let nothing = sinusoidal::strongest(&Scene::new(&alone).unwrap());
    assert!(nothing.is_none_or(|found| found.mover.track.p_value > 0.01 || found.mover.gain < 6.0));
}

#[test]
fn a_sinusoidal_motion_too_weak_for_any_single_frame_is_found_by_all_of_them() {
    // In a frame 8 times the energy of the noise in one cell, of which there are thousands.
    let weak = made(0.0, 0.044, 1.0);
    let scene = Scene::new(&weak).unwrap();
    let found = sinusoidal::strongest(&scene).unwrap().mover;
    let fit = found.oscillation.unwrap();
    assert_eq!(found.id, Some(effects::moving_reflector::ID));
    assert!(
        (fit.rate_hz - 0.8).abs() < 0.1 && (fit.excursion_m() - 0.12).abs() < 0.04 && (fit.mean_m - 1.0).abs() < 0.1,
        "{fit:?}"
    );
    let near = |sighting: &super::track::Sighting| (1.0..40.0).contains(&sighting.power);
    assert!(found.gain > 6.0 && found.track.p_value < 1e-4 && found.track.sightings.iter().all(near), "{}", found.track.p_value);
}

#[test]
fn no_sinusoidal_motion_is_sought_in_noise_that_receivers_share() {
    let mut weak = made(0.0, 0.044, 1.0);
    let oscillates = |evidence: &Evidence| find(evidence).iter().any(|found| found.id == Some(effects::moving_reflector::ID));
    assert!(oscillates(&weak));
    weak.accepted.push(effects::correlated_noise::ID);
    assert!(!oscillates(&weak));
}

#[test]
fn away_from_the_body_looks_are_those_of_noise_and_where_it_is_a_tone_must_be_stronger() {
    let alone = evidence(0.0, 0.0);
    let scene = Scene::new(&alone).unwrap();
    let mut beams = Beams::new(&scene);
    beams.prepare(&[4]);
    let looks: Vec<Look> = beams.looks(4).into_values();
    let (among, away): (Vec<&Look>, Vec<&Look>) = looks.iter().partition(|look| look.body > 0.9);
    let ratios: Vec<f64> = away.iter().filter(|look| look.body < 0.02).map(|look| look.power / look.expected).collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let beyond = ratios.iter().filter(|ratio| **ratio > 4.0).count() as f64 / ratios.len() as f64;
    assert!((mean - 1.0).abs() < 0.06 && (0.7..1.3).contains(&(beyond / (-4.0f64).exp())), "{mean} {beyond}");
    assert!(among.len() > 100, "{}", among.len());
    let louder = among.iter().filter(|look| look.power > 10.0 * look.expected).count();
    assert!(50 * louder < among.len(), "{louder} of {}", among.len());
}

#[test]
fn something_far_stronger_than_the_body_is_seen_where_the_body_is() {
    // It oscillates where the body walks, 20 dB above all of it.
    let found = believed(&made(0.0, 60.0, 2.2));
    assert!(found.iter().any(|found| found.behaves_like.is_path() && found.nats > 100.0), "{found:?}");
}
