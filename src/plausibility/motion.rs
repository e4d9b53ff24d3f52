//! The motion: angles, speeds, and which way is up.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use super::facts::{minus, norm};
use super::units::{LENGTHS, Unit, likely};
use super::{Facts, Finding, Kind, Part};
use crate::person::JOINT_NAMES;

/// The fastest that anybody has run: Usain Bolt between 60 m and 80 m, Berlin 2009, 44.72 km/h (Graubner and Nixdorf 2011,
/// "Biomechanical analysis of the sprint and hurdles events at the 2009 IAAF World Championships").
const FASTEST_RUN_MPS: f64 = 12.42;
/// A hand is no faster than what it throws: the fastest pitch on record, 105.8 mph (Aroldis Chapman 2010, Guinness World
/// Records). Kicks and punches are slower.
const FASTEST_HAND_MPS: f64 = 47.3;
/// Seconds between two poses: half a step of a walk, and the fastest cameras of motion capture.
const STEPS_S: [f64; 2] = [0.5e-3, 0.5];
const TIMES: [Unit; 2] = [("ms", 1e-3), ("us", 1e-6)];
/// From a shuffle to a run: how fast a person usually goes, for telling units apart.
const USUAL_MPS: [f64; 2] = [0.05, 8.0];

/// The array that holds the way of the root.
fn path_key(facts: &Facts) -> (&'static str, Part) {
    match facts.motion {
        Some(_) => ("trans", Part::Motion),
        None => ("vertices", Part::Body),
    }
}

/// A joint other than the root turns by one turn at most: its axis-angle is no longer than 2π.
pub fn angles(facts: &Facts) -> Vec<Finding> {
    let Some(motion) = &facts.motion else { return vec![] };
    let joints = motion.poses.iter().enumerate().flat_map(|(pose, joints)| {
        joints.iter().enumerate().skip(1).map(move |(joint, &rotation)| (norm(rotation), pose, joint))
    });
    let finite = joints.filter(|(angle, ..)| angle.is_finite());
    let Some((largest, pose, joint)) = finite.max_by(|a, b| a.0.total_cmp(&b.0)) else { return vec![] };
    // Rounding of a whole turn.
    if largest <= TAU * 1.001 {
        return vec![];
    }
    let name = JOINT_NAMES.get(joint).map(|name| format!(" ({name})")).unwrap_or_default();
    let found = format!("a turn of {largest:.1} rad at pose {pose}, joint {joint}{name}");
    vec![
        Finding::new(Kind::Refuse, Part::Motion, "poses", found, "axis-angles in radians, of one turn at most")
            .with_hint(format!("in degrees it would be {:.2} rad: multiply the poses by pi / 180", largest.to_radians())),
    ]
}

/// Poses follow each other so that steps of a walk, one or two a second (M. P. Murray et al., J. Bone Joint Surg. 46-A, 1964), show, and no
/// faster than any motion capture.
pub fn rate(facts: &Facts) -> Vec<Finding> {
    let Some(step) = facts.pose_interval_s else { return vec![] };
    if (STEPS_S[0]..=STEPS_S[1]).contains(&step) {
        return vec![];
    }
    let (field, part) = match facts.motion {
        Some(_) => ("mocap_framerate", Part::Motion),
        None => ("pose_times", Part::Body),
    };
    let found = format!("a pose every {step:.4} s, {:.4} a second", 1.0 / step);
    let expected = format!("{:.0} to {:.0} poses a second", 1.0 / STEPS_S[1], 1.0 / STEPS_S[0]);
    let finding = Finding::new(Kind::Refuse, part, field, found, expected);
    vec![match likely(step, &TIMES, STEPS_S) {
        _ if facts.motion.is_some() && (STEPS_S[0]..=STEPS_S[1]).contains(&(1.0 / step)) => finding
            .with_hint(format!("a frame time where a rate is expected? as a frame time it would be {step:.2} poses a second")),
        Some((unit, factor)) => {
            finding.with_hint(format!("in {unit} it would be one every {:.4} s: multiply the times by {factor}", step * factor))
        }
        None => finding.with_hint("correct the frame rate, or the frame time"),
    }]
}

/// Nobody is faster than the fastest runner.
pub fn speed_of_the_root(facts: &Facts) -> Vec<Finding> {
    let Some(root) = &facts.root else { return vec![] };
    let steps = || (1..root.times_s.len()).map(|pose| (root.times_s[pose] - root.times_s[pose - 1], pose));
    let speed = |(after_s, pose): (f64, usize)| norm(minus(root.positions_m[pose], root.positions_m[pose - 1])) / after_s;
    let mut speeds: Vec<f64> = steps().map(speed).collect();
    let Some((fastest, pose)) = steps().map(|step| (speed(step), step.1)).max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return vec![];
    };
    if fastest <= FASTEST_RUN_MPS {
        return vec![];
    }
    let (field, part) = path_key(facts);
    let found = format!("a person of {fastest:.1} m/s at {:.2} s", root.times_s[pose]);
    let expected = format!("nobody faster than {FASTEST_RUN_MPS} m/s, the fastest run on record");
    let finding = Finding::new(Kind::Refuse, part, field, found, expected);
    speeds.sort_by(f64::total_cmp);
    let usual = speeds[speeds.len() / 2];
    vec![match likely(usual, &LENGTHS, USUAL_MPS).filter(|_| usual > USUAL_MPS[1]) {
        Some((unit, factor)) => finding.with_hint(format!(
            "in {unit} the median speed would be {:.2} m/s: multiply the path by {factor}, or correct the frame rate",
            usual * factor
        )),
        None => finding.with_hint("the path jumps there: interpolate it or cut the motion, or correct the frame rate"),
    }]
}

/// No part of a body is faster than the fastest throw.
pub fn speed_of_limbs(facts: &Facts) -> Vec<Finding> {
    let looks = facts.course.iter().flat_map(|course| &course.looks);
    let speeds = looks.filter_map(|look| Some((look.speed_mps?[0], look.time_s)));
    let Some((fastest, time_s)) = speeds.max_by(|a, b| a.0.total_cmp(&b.0)) else { return vec![] };
    if fastest <= FASTEST_HAND_MPS {
        return vec![];
    }
    let (_, part) = path_key(facts);
    let field = if facts.motion.is_some() { "poses" } else { "vertices" };
    let found = format!("a part of the body that moves at {fastest:.1} m/s at {time_s:.2} s");
    let expected = format!("no part of a body faster than {FASTEST_HAND_MPS} m/s, the fastest throw on record");
    vec![
        Finding::new(Kind::Refuse, part, field, found, expected)
            .with_hint("the pose jumps there: interpolate it or cut the motion, or correct the frame rate"),
    ]
}

/// Trunks are nearer to upright than to lying, to lying than to upside down. Lying may be meant, upside down is a camera's
/// frame; somebody who goes up and down while lying is walking in a frame whose up is another axis.
pub fn upright(facts: &Facts) -> Vec<Finding> {
    let looks = facts.course.iter().flat_map(|course| &course.looks);
    let mut cosines: Vec<f64> = looks.filter_map(|look| look.upright).collect();
    if cosines.is_empty() {
        return vec![];
    }
    cosines.sort_by(f64::total_cmp);
    let cosine = cosines[cosines.len() / 2];
    if cosine >= FRAC_1_SQRT_2 {
        return vec![];
    }
    let angle = cosine.clamp(-1.0, 1.0).acos().to_degrees();
    let upright = "somebody upright";
    let finding = |kind, found: String| Finding::new(kind, Part::Motion, "poses", found, upright);
    if cosine < -FRAC_1_SQRT_2 {
        let hint = "the motion's up points down, as in a camera's frame: turn the motion, or motion.radar_from_motion";
        return vec![finding(Kind::Refuse, format!("a person upside down, the trunk {angle:.0} deg from up")).with_hint(hint)];
    }
    let hint = "a motion whose z is up, as AMASS has it, needs --up z, or an upright motion.radar_from_motion";
    let heights = || facts.root.iter().flat_map(|root| root.positions_m.iter().map(|place| place[2]));
    let climb = heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
    let length = facts.body.as_ref().map_or(f64::INFINITY, |body| body.length_m[1]);
    // Whoever lies down or gets up raises the pelvis by a leg, half of a person.
    if climb > 0.5 * length {
        let found = format!("a person who lies, the trunk {angle:.0} deg from up, and goes up and down by {climb:.2} m");
        return vec![finding(Kind::Refuse, found).with_hint(hint)];
    }
    vec![finding(Kind::Note, format!("a person who lies, the trunk {angle:.0} deg from up")).with_hint(hint)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::person::Motion;
    use crate::plausibility::test_support::{facts, walker};
    use crate::plausibility::{BodyFacts, Course, Look, RootPath};
    use crate::room::Room;

    fn moving(poses: Vec<Vec<[f64; 3]>>) -> Facts {
        let translations = vec![[0.0; 3]; poses.len()];
        Facts { motion: Some(Motion { poses, translations, betas: vec![], rate_hz: 30.0 }), ..Facts::default() }
    }

    #[test]
    fn degrees_are_recognised_and_the_root_may_turn_on_and_on() {
        assert!(angles(&moving(vec![vec![[0.0, 40.0, 0.0], [0.0, 3.1, 0.0]]])).is_empty());
        let found = angles(&moving(vec![vec![[0.0; 3]; 19], {
            let mut pose = vec![[0.0; 3]; 19];
            pose[18] = [0.0, 90.0, 0.0];
            pose
        }]));
        assert_eq!(found[0].found, "a turn of 90.0 rad at pose 1, joint 18 (left_elbow)");
        assert!(found[0].hint.as_ref().unwrap().contains("1.57 rad"));
    }

    fn path(step_m: f64) -> Facts {
        let positions_m = (0..20).map(|pose| [0.0, step_m * pose as f64, 0.0]).collect();
        let times_s = (0..20).map(|pose| pose as f64 / 30.0).collect();
        Facts { root: Some(RootPath { times_s, positions_m }), ..Facts::default() }
    }

    #[test]
    fn times_in_milliseconds_and_a_frame_time_for_a_rate_are_recognised() {
        let of = |step: f64, motion: bool| {
            let facts = if motion { moving(vec![]) } else { Facts::default() };
            rate(&Facts { pose_interval_s: Some(step), ..facts })
        };
        for step in [1.0 / 240.0, 1.0 / 30.0, 0.2] {
            assert!(of(step, true).is_empty() && of(step, false).is_empty());
        }
        let meshes = &of(100.0, false)[0];
        assert!(meshes.field == "pose_times" && meshes.hint.as_ref().unwrap().contains("in ms it would be one every 0.1000 s"));
        let motion = &of(60.0, true)[0];
        assert!(motion.kind == Kind::Refuse && motion.field == "mocap_framerate", "{motion:?}");
        assert!(motion.hint.as_ref().unwrap().contains("as a frame time it would be 60.00 poses a second"), "{motion:?}");
        assert!(rate(&Facts::default()).is_empty());
    }

    #[test]
    fn a_sprinter_passes_and_a_path_in_centimetres_is_named() {
        assert!(speed_of_the_root(&path(12.0 / 30.0)).is_empty());
        let found = speed_of_the_root(&path(120.0 / 30.0));
        assert_eq!((found[0].field.as_str(), found[0].kind), ("vertices", Kind::Refuse));
        assert!(found[0].hint.as_ref().unwrap().contains("in centimetres the median speed would be 1.20 m/s"), "{found:?}");
        let mut jump = path(1.0 / 30.0);
        jump.root.as_mut().unwrap().positions_m[7] = [0.0, 5.0, 0.0];
        let found = speed_of_the_root(&jump);
        assert!(found[0].found.ends_with("at 0.23 s") && found[0].hint.as_ref().unwrap().contains("jumps"), "{found:?}");
    }

    #[test]
    fn a_part_that_is_faster_than_a_throw_is_refused() {
        let quick = |step_m: f64| facts(&walker(&[[0.0, 2.0, -1.0], [0.0, 2.0 + step_m, -1.0]]), Room::default());
        assert!(speed_of_limbs(&quick(4.0)).is_empty());
        assert!(speed_of_limbs(&quick(6.0))[0].found.contains("60.0 m/s at 0.00 s"));
    }

    fn standing(cosine: f64, climb_m: f64) -> Facts {
        let look = Look {
            time_s: 0.0,
            low_m: [0.0; 3],
            high_m: [1.0; 3],
            nearest_m: 2.0,
            farthest_m: 3.0,
            encloses_radar: false,
            upright: Some(cosine),
            speed_mps: None,
        };
        Facts {
            body: Some(BodyFacts { length_m: [1.7; 2], volume_m3: 0.07, open: None, meshes: false, longest_along_z: None }),
            root: Some(RootPath { times_s: vec![0.0, 1.0], positions_m: vec![[0.0; 3], [0.0, 0.0, climb_m]] }),
            course: Some(Course { looks: vec![look; 3] }),
            ..Facts::default()
        }
    }

    #[test]
    fn lying_is_a_note_and_upside_down_or_walking_vertically_a_refusal() {
        assert!(upright(&standing(0.9, 3.0)).is_empty());
        assert_eq!(upright(&standing(0.1, 0.3))[0].kind, Kind::Note);
        let vertical = &upright(&standing(0.1, 2.0))[0];
        assert!(vertical.kind == Kind::Refuse && vertical.found.contains("goes up and down by 2.00 m"), "{vertical:?}");
        let upside_down = &upright(&standing(-0.95, 0.0))[0];
        assert!(upside_down.kind == Kind::Refuse && upside_down.found.contains("upside down"), "{upside_down:?}");
    }
}
