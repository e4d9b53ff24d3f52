use std::f64::consts::TAU;

use super::*;
use crate::diagnosis::prediction::{BodyPrediction, Point};
use crate::radar::{Radar, SPEED_OF_LIGHT};
use crate::room::Room;

const FRAMES: usize = 16;
const FRONT_M: f64 = 5.0;

/// A body that steps into the line of sight and out again.
fn covers(frame: usize) -> bool {
    frame % 5 < 2
}

/// Three static returns, the last of them the front wall behind the body; `change`: factor of return and frame.
fn evidence(seed: u64, change: impl Fn(usize, usize) -> Complex64) -> Evidence {
    let mut radar = Radar::small(FRAMES);
    (radar.loops_per_frame, radar.samples_per_chirp) = (16, 128);
    let ranges = [1.2, 4.2, FRONT_M];
    let starts_s: Vec<f64> = (0..FRAMES).map(|frame| radar.chirp_time_s(frame, 0, 0)).collect();
    let points = |frame: usize| {
        let side_m = if covers(frame) { 0.0 } else { 0.7 };
        let at = |i: usize, j: usize| Point {
            position_m: [side_m + 0.02 * i as f64 - 0.2, 2.6, 0.02 * j as f64 - 0.5],
            velocity_mps: [0.0; 3],
            normal: [0.0, -1.0, 0.0],
            area_m2: 4e-4,
            part: 0,
        };
        (0..20).flat_map(|i| (0..30).map(move |j| (i, j))).map(|(i, j)| at(i, j)).collect()
    };
    let body = BodyPrediction {
        parts: vec!["body".into()],
        frames: (0..FRAMES).map(points).collect(),
        middle_s: starts_s,
        ..BodyPrediction::default()
    };
    let room = Room { front_m: Some(FRONT_M), floor_m: Some(1.2), ..Room::default() };
    let cycles_per_m = 2.0 / SPEED_OF_LIGHT * radar.slope_hz_per_s / radar.sample_rate_hz;
    let mut evidence = Evidence::in_noise(radar, seed, |[frame, channel, _, n]| {
        let returns = ranges.iter().enumerate().map(|(index, range)| {
            let phase = TAU * cycles_per_m * range * n as f64 + (index * 3 + channel * (index + 1)) as f64;
            Complex64::cis(phase) * change(index, frame)
        });
        returns.sum()
    });
    (evidence.room, evidence.body) = (Some(room), Some(body));
    evidence
}

#[test]
fn a_shadow_is_named_and_a_curtain_is_not() {
    let shadow = evidence(1, |index, frame| Complex64::from(if index == 2 && covers(frame) { 0.5 } else { 1.0 }));
    let found = find(&shadow);
    assert!(found.len() == 1 && found[0].id == Some(ID) && found[0].p_value < 1e-6 && found[0].nats > 15.0, "{found:?}");
    let [near, far] = found[0].place.range_m.unwrap();
    assert!(near < FRONT_M && far > FRONT_M);
    // What was taken out is gone, though nothing forbids to find it again.
    let mut next = shadow.with(&found[0]);
    next.accepted.clear();
    next.accepted_unnamed.clear();
    assert!(find(&next).iter().all(|left| left.nats < 0.05 * found[0].nats), "{:?}", find(&next));

    let curtain =
        evidence(2, |index, frame| Complex64::cis(if index == 2 { 0.6 * (TAU * frame as f64 / 7.3).sin() } else { 0.0 }));
    let found = find(&curtain);
    assert!(found.len() == 1 && found[0].id.is_none() && found[0].nats > 15.0, "{found:?}");
    let found = find(&nobody_tracked(curtain));
    assert!(found.len() == 1 && found[0].id.is_none() && found[0].nats > 15.0, "{found:?}");
    assert!(!found[0].statement.contains("silhouette"));
}

fn nobody_tracked(mut evidence: Evidence) -> Evidence {
    evidence.body = None;
    evidence.changed()
}

#[test]
fn noise_and_what_all_returns_do_is_nothing() {
    for seed in 3..9 {
        let noise = evidence(seed, |_, _| Complex64::ONE);
        assert!(find(&noise).is_empty() && find(&nobody_tracked(noise)).is_empty());
        let drift = evidence(seed, |index, frame| {
            let turn = 0.01 * frame as f64 * (1.0 + [1.2, 4.2, FRONT_M][index]);
            Complex64::from_polar(1.0 + 0.02 * frame as f64, turn)
        });
        assert!(find(&drift).is_empty(), "{:?}", find(&drift));
        assert!(find(&nobody_tracked(drift)).is_empty());
    }
}
