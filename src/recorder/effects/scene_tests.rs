use std::f64::consts::TAU;

use num_complex::Complex64;

use super::test_support::*;
use super::*;
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::recorder::record::Recorder;
use crate::recorder::test_support::{bare_world, gliding, plate, sphere};
use crate::recorder::world::World;
use crate::room::{Boundary, Room};

fn extra(with: &World, without: &World, frame: usize) -> Vec<Complex64> {
    field(with, frame).iter().zip(field(without, frame)).map(|(a, b)| a - b).collect()
}

#[test]
fn reflectors_have_their_level_and_place_and_movers_their_swing() {
    let plain = ball_world(EffectsConfig::default());
    let still = StaticReflector { position_m: [-0.5, 2.0, 0.3], amplitude: 0.5 };
    let with = ball_world(EffectsConfig { static_reflector: vec![still.clone()], ..Default::default() });
    let echo = extra(&with, &plain, 1);
    let level = (0..3).map(|k| (energy(chirp(&field(&plain, k), &plain.radar, 0)) / 128.0).sqrt()).fold(0.0, f64::max);
    assert!((echo[5].norm() / level - 0.5).abs() < 0.02, "{}", echo[5].norm() / level);
    let wanted = path(&plain.radar, delay(&plain.radar, still.position_m, 0));
    let ratio: Vec<Complex64> = chirp(&echo, &plain.radar, 0).iter().zip(&wanted).map(|(a, b)| a / b).collect();
    assert!(ratio.iter().all(|r| (r - ratio[0]).norm() < 1e-4 * ratio[0].norm()));
    let mover =
        MovingReflector { position_m: [-0.5, 2.0, 0.3], axis: [0.0, 2.0, 0.0], swing_m: 0.05, rate_hz: 2.0, amplitude: 0.5 };
    let with = ball_world(EffectsConfig { moving_reflector: vec![mover], ..Default::default() });
    let phase = planted(&with)["phase_rad"].as_f64().unwrap();
    for frame in 0..3 {
        let echo = extra(&with, &plain, frame);
        let radar = &plain.radar;
        for n in [0, 64, 127] {
            let time = radar.chirp_time_s(frame, 0, 0) + radar.sample_time_s(n);
            let position = [-0.5, 2.0 + 0.05 * (TAU * 2.0 * time + phase).sin(), 0.3];
            let wanted = path(radar, delay(radar, position, 0))[n];
            let still = path(radar, delay(radar, [-0.5, 2.0, 0.3], 0))[n];
            let turn = (echo[n] / wanted).arg() - ratio[0].arg();
            assert!(Complex64::cis(turn).re > 0.999, "frame {frame}, sample {n}: {turn}");
            assert!((wanted - still).norm() > 0.0);
        }
    }
}

#[test]
fn a_vibrating_radar_turns_every_echo_and_the_body_alike() {
    let vibration = RadarVibration { amplitude_m: 2e-5, frequency_hz: 31.0 };
    let effects = EffectsConfig { radar_vibration: Some(vibration), ..Default::default() };
    let phase = planted(&point_world(effects.clone()))["phase_rad"].as_f64().unwrap();
    for (with, without, cosine) in [
        (point_world(effects.clone()), point_world(EffectsConfig::default()), 3.0 / (0.09f64 + 9.0 + 0.01).sqrt()),
        (ball_world(effects.clone()), ball_world(EffectsConfig::default()), 1.0),
    ] {
        let (a, b) = (field(&with, 1), field(&without, 1));
        for index in [0, 3] {
            let time = with.radar.chirp_time_s(1, 0, index) + with.radar.sample_time_s(64);
            let shift = 2e-5 * (TAU * 31.0 * time + phase).sin();
            let wanted = -2.0 * TAU * cosine * shift / with.radar.wavelength_m();
            let turn = (a[index * 128 + 64] / b[index * 128 + 64]).arg();
            assert!((turn - wanted).abs() < 0.01 * 0.066, "loop {index}: {turn} against {wanted}");
        }
    }
}

#[test]
fn a_body_that_stands_elsewhere_is_recorded_there() {
    let pose = PoseOffset { offset_m: [0.02, -0.1, 0.05], yaw_deg: 0.0 };
    let moved = field(&ball_world(EffectsConfig { pose_offset: Some(pose), ..Default::default() }), 0);
    let mut there = ball_world(EffectsConfig::default());
    there.person = Some(gliding(sphere([0.12, 2.9, 0.05], 0.05, 2), [0.0, 1.0, 0.0]));
    assert!(difference_db(&moved, &field(&there, 0), energy(&moved)) < -80.0);
    let turned = PoseOffset { offset_m: [0.0; 3], yaw_deg: 90.0 };
    let mut world = ball_world(EffectsConfig { pose_offset: Some(turned), ..Default::default() });
    let (vertices, faces) = sphere([0.1, 3.0, 0.0], 0.05, 2);
    // A quarter turn to the right, which the offset takes back.
    let right = vertices.iter().map(|[x, y, z]| [*y, -x, *z]).collect();
    world.person = Some(gliding((right, faces), [1.0, 0.0, 0.0]));
    let straight = field(&ball_world(EffectsConfig::default()), 0);
    assert!(difference_db(&field(&world, 0), &straight, energy(&straight)) < -80.0);
}

#[test]
fn a_ghost_of_a_named_wall_is_the_image_machinery_with_its_own_coefficient() {
    let room = Room { right_m: Some(1.2), floor_m: Some(1.0), ..Room::default() };
    let base = |effects: EffectsConfig| {
        let radar = Radar { loops_per_frame: 1, ..radar(1) };
        World { room: room.clone(), effects, ..bare_world(radar, gliding(plate([0.4, 2.0, 0.1], 0.01, 2), [0.0; 3])) }
    };
    let ghost = |coefficient, order| WallGhost { boundary: Boundary::Right, coefficient, order };
    let with = base(EffectsConfig { wall_ghost: vec![ghost(0.35, 1)], ..Default::default() });
    let mut old = base(EffectsConfig::default());
    old.walls.images = 1;
    old.walls.image_walls = vec![Boundary::Right];
    old.walls.image_coefficient = Some(0.35);
    assert_eq!(field(&with, 0), field(&old, 0));
    // Twice as good a mirror, twice the ghost; with the second order there is more; the floor adds its own.
    let plain = base(EffectsConfig::default());
    let half = base(EffectsConfig { wall_ghost: vec![ghost(0.175, 1)], ..Default::default() });
    let (one, two) = (extra(&with, &plain, 0), extra(&half, &plain, 0));
    assert!((energy(&one) / energy(&two) - 4.0).abs() < 1e-3);
    let second = base(EffectsConfig { wall_ghost: vec![ghost(0.35, 2)], ..Default::default() });
    assert!(energy(&extra(&second, &with, 0)) > 1e-4 * energy(&one));
    let floor = base(EffectsConfig { floor_bounce: Some(FloorBounce { coefficient: 0.3 }), ..Default::default() });
    assert!(energy(&extra(&floor, &plain, 0)) > 1e-3 * energy(&field(&plain, 0)));
    let mut none = base(EffectsConfig { wall_ghost: vec![ghost(0.3, 1)], ..Default::default() });
    none.room.right_m = None;
    let error = Recorder::new(&none).err().unwrap();
    assert!(error.to_string().contains("effects.wall_ghost[0].boundary") && error.hint().unwrap().contains("room.right_m"));
}

#[test]
fn a_bounce_off_the_board_comes_from_twice_the_range_with_its_level() {
    let effects = EffectsConfig { object_radar_object: Some(ObjectRadarObject { coefficient: 0.01 }), ..Default::default() };
    let (with, plain) = (point_world(effects), point_world(EffectsConfig::default()));
    let bounce = extra(&with, &plain, 0);
    let radar = &plain.radar;
    // There and back to the board, and again to the receiver: antennas are millimetres apart.
    let mut at_board = radar.clone();
    at_board.rx_m = vec![[0.0; 3]];
    let total = delay(&at_board, POINT_M, 0) + delay(radar, POINT_M, 1);
    let wanted = path(radar, total);
    let found = chirp(&bounce, radar, 1);
    let level = 20.0 * (found[64].norm() / peak(&plain)).log10();
    assert!((level + 40.0).abs() < 0.2, "{level}");
    let ratio: Vec<Complex64> = found.iter().zip(&wanted).map(|(a, b)| a / b).collect();
    assert!(ratio.iter().all(|r| (r - ratio[64]).norm() < 0.02 * ratio[64].norm()), "a path of its own");
    assert!((ratio[64].arg()).abs() < 0.05, "{}", ratio[64].arg());
}

#[test]
fn beyond_the_unambiguous_range_a_reflector_folds_back() {
    let alias = RangeAlias { range_m: 13.0, azimuth_deg: 10.0, amplitude: 0.2, swing_m: 0.0, rate_hz: 0.0 };
    let effects = EffectsConfig { range_alias: Some(alias.clone()), ..Default::default() };
    let (with, plain) = (point_world(effects), point_world(EffectsConfig::default()));
    let echo = extra(&with, &plain, 0);
    let folded = 13.0 - plain.radar.max_range_m();
    let turns = plain.radar.slope_hz_per_s * 2.0 * folded / SPEED_OF_LIGHT / plain.radar.sample_rate_hz;
    let echo = chirp(&echo, &plain.radar, 0);
    assert!(tone(echo, turns).norm() > 0.99 * echo[0].norm());
    let near = RangeAlias { range_m: 5.0, ..alias };
    let wrong = point_world(EffectsConfig { range_alias: Some(near), ..Default::default() });
    assert!(Recorder::new(&wrong).err().unwrap().to_string().contains("effects.range_alias.range_m"));
}

#[test]
fn the_body_shadows_what_stands_behind_it_and_nothing_else() {
    let world = |x: f64, effects: EffectsConfig| {
        let radar = Radar { loops_per_frame: 1, ..radar(1) };
        let mut world = bare_world(radar, gliding(plate([0.0, 2.0, 0.0], 0.8, 8), [0.0; 3]));
        world.surface.returns = crate::recorder::Returns::Vertices;
        world.furniture = vec![crate::recorder::Reflector { position_m: [x, 4.0, 0.0], rcs_m2: 1.0 }];
        world.effects = effects;
        world
    };
    let shadowed = EffectsConfig { soft_occlusion: Some(SoftOcclusion { width: 1.0 }), ..Default::default() };
    let left = |x: f64| {
        let mut nothing = world(x, EffectsConfig::default());
        nothing.furniture.clear();
        let whole = extra(&world(x, EffectsConfig::default()), &nothing, 0);
        (energy(&extra(&world(x, shadowed.clone()), &nothing, 0)) / energy(&whole)).sqrt()
    };
    // The plate's edge at 0.4 m throws its shadow to 0.8 m.
    let found = [0.0, 0.75, 0.8, 0.85, 1.5].map(left);
    assert!(found[0] < 1e-9 && (found[4] - 1.0).abs() < 1e-9, "{found:?}");
    assert!(found[1] < found[2] && found[2] < found[3] && (0.1..0.5).contains(&found[2]), "{found:?}");
}

#[test]
fn a_second_bounce_on_the_body_is_a_delayed_copy() {
    let bounce = BodyMultibounce { extra_m: 0.3, coefficient: 0.2 };
    let still = |effects| {
        let radar = Radar { loops_per_frame: 1, ..radar(1) };
        World { effects, ..bare_world(radar, gliding(plate([0.0, 2.0, 0.0], 2e-3, 1), [0.0; 3])) }
    };
    let plain = still(EffectsConfig::default());
    let copy = extra(&still(EffectsConfig { body_multibounce: Some(bounce), ..Default::default() }), &plain, 0);
    let radar = &plain.radar;
    let direct = path(radar, delay(radar, [0.0, 2.0, 0.0], 0));
    let later = path(radar, delay(radar, [0.0, 2.0, 0.0], 0) + 0.6 / SPEED_OF_LIGHT);
    let base = field(&plain, 0);
    for n in [0, 64, 127] {
        let wanted = 0.2 * base[n] / direct[n] * later[n];
        assert!((copy[n] - wanted).norm() < 2e-3 * wanted.norm(), "sample {n}: {} against {wanted}", copy[n]);
    }
}

#[test]
fn the_trunk_breathes_a_garment_delays_and_a_part_can_be_brighter() {
    let plain = skinned_world(EffectsConfig::default());
    let wavelength = plain.radar.wavelength_m();
    let turn = |effects: EffectsConfig, frame: usize| {
        let (a, b) = (field(&skinned_world(effects), frame), field(&plain, frame));
        a.iter().zip(&b).map(|(x, y)| x * y.conj()).sum::<Complex64>() / energy(&b)
    };
    let breathing = EffectsConfig { breathing: Some(Breathing { rate_hz: 1.0, amplitude_m: 2e-4 }), ..Default::default() };
    let phase = planted(&skinned_world(breathing.clone()))["phase_rad"].as_f64().unwrap();
    for frame in 0..4 {
        let time = plain.radar.chirp_time_s(frame, 0, 0);
        // The ball's nearest point comes closer; its coarse facets are tilted by up to 20 degrees.
        let wanted = -2.0 * TAU * 2e-4 * (TAU * time + phase).sin() / wavelength;
        let found = turn(breathing.clone(), frame).arg();
        assert!((found - wanted).abs() < 0.1 * 2.0 * TAU * 2e-4 / wavelength, "frame {frame}: {found} against {wanted}");
    }
    let beating = EffectsConfig { heartbeat: Some(Heartbeat { rate_hz: 1.2, amplitude_m: 2e-4 }), ..Default::default() };
    let turns: Vec<f64> = (0..4).map(|frame| turn(beating.clone(), frame).arg()).collect();
    assert!(turns.iter().all(|t| t.abs() < 0.8) && turns.iter().any(|t| (t - turns[0]).abs() > 0.05), "{turns:?}");
    let cloth = ClothingDelay { extra_m: 3e-4, body_parts: vec!["spine2".into()] };
    let found = turn(EffectsConfig { clothing_delay: Some(cloth), ..Default::default() }, 0).arg();
    assert!((found - 2.0 * TAU * 3e-4 / wavelength).abs() < 0.01, "{found}");
    let bright = PartReflectivity { body_part: "spine2".into(), db: 3.0 };
    let found = turn(EffectsConfig { part_reflectivity: Some(bright.clone()), ..Default::default() }, 0);
    assert!((20.0 * found.norm().log10() - 3.0).abs() < 1e-3, "{found}");
    let other = PartReflectivity { body_part: "left_hip".into(), ..bright };
    let wrong = skinned_world(EffectsConfig { part_reflectivity: Some(other), ..Default::default() });
    assert!(Recorder::new(&wrong).err().unwrap().to_string().contains("a joint that moves some vertices"));
    let unknown = ClothingDelay { extra_m: 1e-3, body_parts: vec!["tail".into()] };
    let wrong = skinned_world(EffectsConfig { clothing_delay: Some(unknown), ..Default::default() });
    let error = Recorder::new(&wrong).err().unwrap();
    assert!(error.to_string().contains("`tail`") && error.hint().unwrap().contains("spine1"));
}

#[test]
fn a_carried_thing_goes_where_its_joint_goes() {
    let carried = CarriedReflector { body_part: "spine2".into(), amplitude: 1.0 };
    let (with, plain) = (
        skinned_world(EffectsConfig { carried_reflector: Some(carried), ..Default::default() }),
        skinned_world(EffectsConfig::default()),
    );
    let echo = extra(&with, &plain, 1);
    let wanted = path(&plain.radar, delay(&plain.radar, [0.0, 3.0, 0.0], 0));
    let ratio: Vec<Complex64> = chirp(&echo, &plain.radar, 0).iter().zip(&wanted).map(|(a, b)| a / b).collect();
    assert!(ratio.iter().all(|r| (r - ratio[0]).norm() < 1e-3 * ratio[0].norm()));
}
