use std::f64::consts::TAU;

use num_complex::Complex64;

use super::*;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::{Correction, Place};
use crate::effects::{self, Stage};
use crate::radar::Radar;

const FRAMES: usize = 32;
const SAMPLES: usize = 96;

fn radar() -> Radar {
    Radar { samples_per_chirp: SAMPLES, loops_per_frame: 8, ..Radar::small(FRAMES) }
}

fn tone(bin: f64, n: usize) -> Complex64 {
    Complex64::cis(TAU * bin * n as f64 / SAMPLES as f64)
}

/// A static room that turns by a course of about a radian to either side, and an offset that does not; the course is undone and known.
fn turned(seed: u64, offset: Complex64) -> Evidence {
    let course = |frame: usize| 0.9 * (TAU * 0.7 * frame as f64 / FRAMES as f64).sin();
    let evidence = Evidence::in_noise(radar(), seed, |[frame, channel, _, n]| {
        let room = |bin: f64| tone(bin, n) * Complex64::from_polar(30.0, channel as f64 + bin);
        let clutter = [14.0, 23.4, 37.0].into_iter().map(room).sum::<Complex64>() * Complex64::cis(course(frame));
        clutter + offset
    });
    let [_, tx, _, loops, _] = evidence.cube.dims;
    let turned: Vec<Complex64> = (0..FRAMES * tx * loops).map(|i| Complex64::cis(course(i / (tx * loops)))).collect();
    let known = turned.clone();
    let undo = Correction::samples(move |cube: &mut crate::diagnosis::Cube| {
        let [_, tx, rx, loops, _] = cube.dims;
        cube.each_chirp(|[frame, channel, index], chirp| {
            let back = known[frame * tx * loops + channel / rx * loops + index].conj();
            chirp.iter_mut().for_each(|value| *value *= back);
        });
    });
    after(evidence, Correction::Followed(Box::new(undo), Arc::new(Course { of: Of::All, turned })))
}

fn after(evidence: Evidence, correction: Correction) -> Evidence {
    evidence.with(&Candidate { correction, ..Candidate::new(Behaviour::SlowTimePhase, Place::at(Stage::Receiver), 0.0, 1.0) })
}

fn sure(evidence: &Evidence) -> Vec<Candidate> {
    find(evidence).into_iter().filter(|found| found.p_value < 1e-4 && found.nats > 5.0).collect()
}

#[test]
fn what_does_not_turn_with_the_room_is_an_offset() {
    let offset = Complex64::new(4.0, -2.0);
    let of = |found: &Candidate, name: &str| found.estimates.iter().find(|e| e.name == name).unwrap().clone();
    let mut held = 0;
    for seed in 1..7 {
        let evidence = turned(seed, offset);
        let found = sure(&evidence);
        assert_eq!(found.iter().filter_map(|found| found.id).collect::<Vec<_>>(), [effects::dc_offset::ID], "{found:?}");
        for (name, truth) in [("i", offset.re), ("q", offset.im)] {
            let intervals = of(&found[0], name).ci90;
            assert!(intervals.iter().all(|[low, high]| high - low < 0.2), "{name}: {intervals:?}");
            held += intervals.iter().filter(|[low, high]| (*low..*high).contains(&truth)).count();
        }
        let mut left = found.iter().fold(evidence.clone(), |evidence, found| evidence.with(found));
        left.accepted.clear();
        left.accepted_unnamed.clear();
        assert!(sure(&left).is_empty(), "{:?}", sure(&left));
    }
    // Of 24 intervals of 90 % fewer hold once in a hundred times.
    assert!(held >= 18, "{held}");
}

#[test]
fn a_room_that_only_turns_has_neither() {
    for seed in 2..10 {
        let found = find(&turned(seed, Complex64::ZERO));
        assert!(found.iter().all(|found| found.p_value > 1e-3), "{found:?}");
    }
}

/// Somebody at bin 9 who breathes, and at twice the range something that turns `order` times as far.
fn breathes(seed: u64, order: f64, amplitude: f64) -> Evidence {
    let radar = Radar { frame_period_s: 0.1, frames: 160, ..radar() };
    let evidence = Evidence::in_noise(Radar { frames: 160, ..radar }, seed, |[frame, channel, _, n]| {
        let phase = 4.0 * (TAU * 0.25 * 0.1 * frame as f64).sin() + 0.3 * (TAU * 0.031 * frame as f64).cos();
        let arrival = Complex64::cis(0.9 * channel as f64);
        (tone(9.0, n) * Complex64::cis(phase) * 20.0 + tone(18.0, n) * Complex64::cis(order * phase) * amplitude) * arrival
            + tone(9.4, n) * 40.0
    });
    let candidate = crate::diagnosis::detectors::vital::find(&evidence).pop().expect("somebody who breathes");
    assert_eq!(candidate.id, Some(effects::breathing::ID), "{candidate:?}");
    evidence.with(&candidate)
}

#[test]
fn a_return_that_goes_out_again_turns_twice_and_a_second_mover_with_the_same_course_does_not() {
    let found = sure(&breathes(1, 2.0, 3.0));
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].id, Some(effects::object_radar_object::ID), "{found:?}");
    assert!(sure(&breathes(1, 1.0, 3.0)).is_empty());
    assert!(sure(&breathes(1, 2.0, 0.0)).is_empty());
}
