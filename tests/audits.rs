//! What is said of conventions that are wrong, and that nothing is said where all is well: each check has a recording on which it fails
//! and one on which it does not.

use std::path::Path;

use hybridsim::data::Recording;
use hybridsim::diagnosis::audit::{Check, audit};
use hybridsim::diagnosis::cube::Loaded;
use hybridsim::diagnosis::{BodyPrediction, Evidence};
use hybridsim::person::Person;

use crate::scenes::{ONE, SQUARE, THREE, TWO, recorded, recorded_as};

/// What the audit says of a recording, with another header where one is given.
fn audited(folder: &Path, change: &dyn Fn(String) -> String) -> Vec<Check> {
    audited_as(folder, change, &|_| {})
}

/// The same, with other samples where they are changed.
fn audited_as(folder: &Path, change: &dyn Fn(String) -> String, spoil: &dyn Fn(&mut Loaded)) -> Vec<Check> {
    let header = folder.join("recording.toml");
    let text = std::fs::read_to_string(&header).unwrap();
    let changed = change(text.clone());
    std::fs::write(&header, &changed).unwrap();
    let recording = Recording::open(folder).unwrap();
    std::fs::write(&header, &text).unwrap();
    let mut loaded = Loaded::read(&recording, 256).unwrap();
    spoil(&mut loaded);
    let body = recording.person().map(|person| BodyPrediction::new(person, &loaded.radar, &loaded.starts_s).unwrap());
    audit(&Evidence::new(loaded, recording.room.clone(), body), recording.person().and_then(Person::origin_m))
}

fn check<'a>(checks: &'a [Check], name: &str) -> &'a Check {
    checks.iter().find(|check| check.check == name).unwrap_or_else(|| panic!("{name} in {checks:?}"))
}

/// `key = [a, b, …]` with the entries in another order.
fn reordered(text: String, key: &str, order: &[usize]) -> String {
    let radar: toml::Table = text.parse().unwrap();
    let list = radar["radar"][key].as_array().unwrap();
    let entries: Vec<String> = order.iter().map(|&entry| list[entry].to_string()).collect();
    let mut lines: Vec<String> = vec![];
    let mut skipping = false;
    for line in text.lines() {
        if line.starts_with(&format!("{key} =")) {
            lines.push(format!("{key} = [{}]", entries.join(", ")));
            skipping = !line.trim_end().ends_with("]]") && line.trim_end().ends_with('[');
        } else if skipping {
            skipping = line.trim() != "]";
        } else {
            lines.push(line.into());
        }
    }
    lines.join("\n")
}

/// A person so many degrees to the right who comes and goes, 3 m away.
fn aside(seed: u64, degrees: f64) -> String {
    let (x, y) = (3.0 * degrees.to_radians().sin(), 3.0 * degrees.to_radians().cos());
    format!(
        "seed = {seed}\nmesh_error_m = 2e-3\n[room]\nleft_m = 3.0\nright_m = 3.0\nfront_m = 6.0\nfloor_m = 1.0\nceiling_m = 1.7\n\
         [person.placement]\norigin_m = [{x:.3}, {y:.3}, -1.0]"
    )
}

#[test]
fn receivers_in_reverse_are_found_with_the_person_well_aside() {
    for degrees in [17.0, 30.0] {
        let folder = tempfile::tempdir().unwrap();
        let plain = recorded(folder.path(), &aside(31, degrees), ONE);
        let stated = audited(&plain, &|text| text);
        assert!(stated.iter().all(|check| check.ok), "{degrees}: {stated:?}");
        let reversed = audited(&plain, &|text| reordered(text, "rx_m", &[3, 2, 1, 0]));
        let sides = check(&reversed, "sides");
        assert!(!sides.ok && sides.found.contains("the receivers in reverse order"), "{degrees}: {sides:?}");
        assert!(sides.found.contains("left and right exchanged"), "{degrees}: {sides:?}");
    }
}

#[test]
fn up_and_down_exchanged_are_told_from_left_and_right() {
    let folder = tempfile::tempdir().unwrap();
    // Two heights of receivers see little of an array's baseline: four seconds tell.
    let text = format!("frames = 40\n{}", aside(32, 15.0))
        .replace("-1.0]", "-1.6]")
        .replace("floor_m = 1.0", "floor_m = 1.6")
        .replace("ceiling_m = 1.7", "ceiling_m = 1.1");
    let plain = recorded(folder.path(), &text, SQUARE);
    let stated = audited(&plain, &|text| text);
    assert!(check(&stated, "sides").ok, "{stated:?}");
    let upside_down = audited(&plain, &|text| reordered(text, "rx_m", &[2, 3, 0, 1]));
    let sides = check(&upside_down, "sides");
    assert!(!sides.ok && sides.found.contains("up and down") && !sides.found.contains("left"), "{sides:?}");
    let mirrored = audited(&plain, &|text| reordered(text, "rx_m", &[1, 0, 3, 2]));
    let sides = check(&mirrored, "sides");
    assert!(!sides.ok && sides.found.contains("left and right") && !sides.found.contains("up and down"), "{sides:?}");
}

#[test]
fn two_transmitters_in_the_wrong_order_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let plain = recorded(folder.path(), &aside(33, 25.0), TWO);
    let stated = audited(&plain, &|text| text);
    assert!(stated.iter().all(|check| check.ok), "{stated:?}");
    let swapped = audited(&plain, &|text| reordered(text, "tx_m", &[1, 0]));
    let order = check(&swapped, "tx_order");
    assert!(!order.ok && order.found.contains("the order [1, 0]"), "{order:?}");
    // Receivers and transmitters that differ by constant phases are in no other order.
    let folder = tempfile::tempdir().unwrap();
    let uneven = format!(
        "{}\n[effects.channel_mismatch]\ngain_db = [0.0, 1.0, -1.0, 0.5, 0.0, 1.0, 0.0, -1.0]\nphase_deg = [0.0, 40.0, -60.0, 120.0, 180.0, 100.0, -150.0, 30.0]",
        aside(34, 25.0)
    );
    let differ = audited(&recorded(folder.path(), &uneven, TWO), &|text| text);
    assert!(check(&differ, "tx_order").ok && check(&differ, "sides").ok, "{differ:?}");
}

/// Straight ahead a direction and its mirror image hardly differ, and which part of the body returns most decides between them.
#[test]
fn antennas_are_not_doubted_because_of_a_person_straight_ahead() {
    for seed in 0..6 {
        let folder = tempfile::tempdir().unwrap();
        let text = format!("{}\n[surface]\nreturns = \"random\"\nedge_m = 0.012", aside(40 + seed, 0.0));
        let timing = "loops_per_frame = 16\nchirp_period_s = 72.0e-6\nframe_period_s = 0.1";
        let stated = audited(&recorded_as(timing, folder.path(), &text, THREE), &|text| text);
        assert!(check(&stated, "sides").ok && check(&stated, "tx_order").ok, "{seed}: {stated:?}");
    }
}

#[test]
fn a_heading_turned_by_half_a_turn_and_a_wrong_frame_period_are_found() {
    let folder = tempfile::tempdir().unwrap();
    // Half of the period shows half of the frames: twenty of them tell.
    let timing = "loops_per_frame = 64\nchirp_period_s = 216.0e-6\nframe_period_s = 0.2";
    let plain = recorded_as(timing, folder.path(), "seed = 35\nframes = 40\nmesh_error_m = 2e-3", ONE);
    let stated = audited(&plain, &|text| text);
    assert!(stated.iter().all(|check| check.ok), "{stated:?}");
    let turned = audited(&plain, &|text| {
        let mut table: toml::Table = text.parse().unwrap();
        let rows = table["motion"]["radar_from_motion"].as_array_mut().unwrap();
        for row in &mut rows[..2] {
            for value in row.as_array_mut().unwrap() {
                *value = toml::Value::Float(-value.as_float().unwrap());
            }
        }
        toml::to_string(&table).unwrap()
    });
    let heading = check(&turned, "heading");
    assert!(!heading.ok && heading.found.contains("180°"), "{heading:?}");
    let halved = audited(&plain, &|text| text.replace("frame_period_s = 0.2", "frame_period_s = 0.1"));
    let period = check(&halved, "frame_period");
    assert!(!period.ok && period.found.contains("should be 0.200000"), "{period:?}");
}

/// Loops in reverse order change the sign of all velocities.
#[test]
fn velocities_of_the_other_sign_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let plain = recorded(folder.path(), &aside(36, 10.0), ONE);
    let reversed = audited_as(&plain, &|text| text, &|loaded| {
        let length = loaded.cube.dims[4];
        for (frame, channel) in (0..loaded.cube.dims[0]).flat_map(|frame| (0..4).map(move |channel| (frame, channel))) {
            let chirps: Vec<_> = loaded.cube.channel(frame, channel).chunks_exact(length).rev().flatten().copied().collect();
            loaded.cube.channel_mut(frame, channel).copy_from_slice(&chirps);
        }
    });
    let sign = check(&reversed, "doppler_sign");
    assert!(!sign.ok && sign.found.contains("the Doppler axis runs the other way"), "{sign:?}");
    assert!(check(&audited(&plain, &|text| text), "doppler_sign").ok);
}

/// Receivers whose phases grow by a constant step see everything in another direction.
#[test]
fn a_body_in_another_direction_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let plain = recorded(folder.path(), &aside(37, 0.0), ONE);
    let turned = |radians: f64| {
        let checks = audited_as(&plain, &|text| text, &|loaded| {
            loaded.cube.each_chirp(|[_, channel, _], chirp| {
                chirp.iter_mut().for_each(|value| *value *= num_complex::Complex64::cis(radians * channel as f64));
            });
        });
        check(&checks, "body_direction").clone()
    };
    // Half a wavelength apart, π sin 40° each.
    let aside = turned(2.0);
    assert!(!aside.ok && aside.found.contains("farther to the"), "{aside:?}");
    assert!(turned(0.0).ok);
}

/// Of a room that is stated at a quarter of its size, all returns are beyond its farthest corner.
#[test]
fn a_room_that_is_smaller_than_its_returns_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let sides = "left_m = 3.2\nright_m = 3.2\nfront_m = 4.8\nfloor_m = 2.4\nceiling_m = 2.4";
    let plain = recorded(folder.path(), &format!("seed = 38\nmesh_error_m = 2e-3\n[room]\n{sides}"), ONE);
    assert!(check(&audited(&plain, &|text| text), "room").ok);
    let shrunk = |text: String| text.replace("m = 3.2", "m = 0.8").replace("m = 4.8", "m = 1.2").replace("m = 2.4", "m = 0.6");
    let shrunk = audited(&plain, &shrunk);
    let room = check(&shrunk, "room");
    assert!(!room.ok && room.found.contains("the room's size contradicts the ranges"), "{room:?}");
}

#[test]
fn samples_at_the_ends_of_the_converters_range_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let plain = recorded(folder.path(), "seed = 39\nmesh_error_m = 2e-3", ONE);
    let clipped = audited_as(&plain, &|text| text, &|loaded| {
        let [low, high] = loaded.extremes.map(|extreme| 0.8 * extreme);
        loaded.extremes = [low, high];
        for value in &mut loaded.cube.samples {
            *value = num_complex::Complex64::new(value.re.clamp(low, high), value.im.clamp(low, high));
        }
    });
    let range = check(&clipped, "converter_range");
    assert!(!range.ok && !range.found.starts_with("0.0000 %"), "{range:?}");
    assert!(check(&audited(&plain, &|text| text), "converter_range").ok);
}

/// Points half a metre apart say nothing within a range bin of 7 cm.
#[test]
fn a_body_of_too_few_points_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let plain = recorded(folder.path(), &aside(40, 10.0), ONE);
    let recording = Recording::open(&plain).unwrap();
    let loaded = Loaded::read(&recording, 256).unwrap();
    let sampled = |every: usize| {
        let mut body = BodyPrediction::new(recording.person().unwrap(), &loaded.radar, &loaded.starts_s).unwrap();
        for points in &mut body.frames {
            let kept: Vec<_> = points.iter().step_by(every).cloned().collect();
            let area_m2 = points.iter().map(|point| point.area_m2).sum::<f64>() / kept.len() as f64;
            *points = kept;
            points.iter_mut().for_each(|point| point.area_m2 = area_m2);
        }
        let checks = audit(&Evidence::new(loaded.clone(), recording.room.clone(), Some(body)), None);
        check(&checks, "surface_sampling").clone()
    };
    assert!(sampled(1).ok && !sampled(200).ok, "{:?}, {:?}", sampled(1), sampled(200));
}
