use std::sync::OnceLock;

use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::person::procedural;

pub(super) type Points = Vec<Vector3<f64>>;

pub(super) fn body() -> &'static BodyModel {
    static BODY: OnceLock<BodyModel> = OnceLock::new();
    BODY.get_or_init(|| procedural::person(&procedural::PersonConfig::default()).unwrap())
}

/// Joints and vertices of every `step`-th pose, by plain linear blend skinning.
pub(super) fn posed(model: &BodyModel, motion: &Motion, step: usize) -> Vec<(Points, Points)> {
    let rest: Points = model.rest_joints(&motion.betas).into_iter().map(Vector3::from).collect();
    let shaped = model.shaped(&motion.betas);
    let every = motion.poses.iter().zip(&motion.translations).step_by(step);
    every
        .map(|(pose, translation)| {
            let (mut turns, mut places): (Vec<Rotation3<f64>>, Points) = (Vec::new(), Vec::new());
            for (joint, rotation) in pose.iter().enumerate() {
                let local = Rotation3::new(Vector3::from(*rotation));
                let (turn, place) = match model.parents[joint] {
                    Some(parent) => (turns[parent] * local, places[parent] + turns[parent] * (rest[joint] - rest[parent])),
                    None => (local, rest[0] + Vector3::from(*translation)),
                };
                turns.push(turn);
                places.push(place);
            }
            let move_vertex = |(vertex, weights): (&[f64; 3], &Vec<(usize, f64)>)| -> Vector3<f64> {
                let vertex = Vector3::from(*vertex);
                weights.iter().map(|&(joint, weight)| (places[joint] + turns[joint] * (vertex - rest[joint])) * weight).sum()
            };
            let vertices = shaped.iter().zip(&model.skinning).map(move_vertex).collect();
            (places, vertices)
        })
        .collect()
}

pub(super) fn usual(action: Action, seconds: f64) -> Motion {
    motion(action, &StyleConfig::default(), body(), &[], seconds, 60.0).unwrap()
}

#[test]
fn the_feet_stay_on_the_floor() {
    for action in Action::every() {
        let motion = usual(action, 12.0);
        for (pose, (_, vertices)) in posed(body(), &motion, 3).iter().enumerate() {
            let lowest = vertices.iter().map(|vertex| vertex.y).fold(f64::INFINITY, f64::min);
            assert!((-0.015..0.01).contains(&lowest), "{} at pose {}: {lowest} m", action.name(), 3 * pose);
        }
    }
}

#[test]
fn a_foot_that_carries_weight_does_not_slide() {
    // While the lower foot is flat, its ankle moves at most a little (it pivots in turns).
    for action in Action::every() {
        let motion = usual(action, 10.0);
        let joints: Vec<Points> = posed(body(), &motion, 1).into_iter().map(|(joints, _)| joints).collect();
        let flat = body().rest_joints(&[])[7][1] + 0.936;
        let slide = joints.windows(2).flat_map(|pair| {
            [7, 8].into_iter().filter(|&ankle| pair.iter().all(|joints| joints[ankle].y < flat + 0.004)).map(|ankle| {
                let moved = pair[1][ankle] - pair[0][ankle];
                60.0 * moved.x.hypot(moved.z)
            })
        });
        let (sum, count, most) =
            slide.fold((0.0, 0, 0.0f64), |(sum, count, most), speed| (sum + speed, count + 1, most.max(speed)));
        println!("{}: {} flat poses, mean slide {:.3} m/s, most {most:.3}", action.name(), count, sum / count as f64);
        assert!(
            count > 200 && sum / (count as f64) < 0.05 && most < 0.5,
            "{}: mean {} most {most}",
            action.name(),
            sum / count as f64
        );
    }
}

#[test]
fn knees_and_elbows_bend_the_way_they_do() {
    for action in Action::every() {
        let motion = usual(action, 10.0);
        for (pose, rotations) in motion.poses.iter().enumerate() {
            for joint in [4, 5] {
                // A knee turns about +x, which takes the shank backwards, and hardly about anything else.
                let [x, y, z] = rotations[joint];
                assert!(
                    (-0.02..2.4).contains(&x) && y.abs() < 0.2 && z.abs() < 0.2,
                    "{} pose {pose}: {:?}",
                    action.name(),
                    rotations[joint]
                );
            }
            assert!(rotations[18][1] <= 0.05 && rotations[19][1] >= -0.05, "{} pose {pose}", action.name());
        }
    }
}

#[test]
fn arms_hang_while_walking() {
    for action in [Action::WalkBackForth, Action::WalkClockwise, Action::WalkCounterclockwise, Action::WalkBackForthArmswing] {
        for (joints, _) in posed(body(), &usual(action, 8.0), 6) {
            for side in 0..2 {
                assert!(joints[20 + side].y < joints[16 + side].y - 0.3, "{}", action.name());
            }
        }
    }
}

#[test]
fn motions_are_smooth() {
    for action in Action::every() {
        let motion = usual(action, 12.0);
        let joints: Vec<Points> = posed(body(), &motion, 1).into_iter().map(|(joints, _)| joints).collect();
        let mut most = (0.0f64, 0.0f64);
        for triple in joints.windows(3) {
            let [before, now, after] = triple else { unreachable!() };
            for ((before, now), after) in before.iter().zip(now).zip(after) {
                let (velocity, acceleration) = ((after - now) * 60.0, (after - now * 2.0 + before) * 3600.0);
                most = (most.0.max(velocity.norm()), most.1.max(acceleration.norm()));
            }
        }
        println!("{}: {:.2} m/s, {:.1} m/s2", action.name(), most.0, most.1);
        // Sprinters exceed these, an everyday walk does not.
        assert!(most.0 < 5.0 && most.1 < 60.0, "{}: {most:?}", action.name());
    }
}

#[test]
fn twice_the_rate_halves_the_steps_of_the_velocity() {
    // Continuous velocity: its largest step between poses shrinks with the pose interval.
    for action in Action::every() {
        let step = |rate: f64| {
            let motion = motion(action, &StyleConfig::default(), body(), &[], 6.0, rate).unwrap();
            let joints: Vec<Points> = posed(body(), &motion, 1).into_iter().map(|(joints, _)| joints).collect();
            let jump =
                |triple: &[Points], joint: usize| (triple[2][joint] - 2.0 * triple[1][joint] + triple[0][joint]).norm() * rate;
            joints.windows(3).flat_map(|triple| (0..24).map(move |joint| jump(triple, joint))).fold(0.0, f64::max)
        };
        let (coarse, fine) = (step(120.0), step(480.0));
        assert!(fine < 0.4 * coarse, "{}: {fine} m/s after {coarse} m/s", action.name());
    }
}

#[test]
fn walks_cover_their_path_at_walking_speed() {
    let speed_and_span = |action: Action| {
        let motion = usual(action, 14.0);
        let speeds = motion.translations.windows(2).map(|pair| {
            let [x, _, z]: [f64; 3] = std::array::from_fn(|axis| pair[1][axis] - pair[0][axis]);
            60.0 * x.hypot(z)
        });
        let mut speeds: Vec<f64> = speeds.collect();
        speeds.sort_by(f64::total_cmp);
        let span = |axis: usize| {
            motion
                .translations
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| (low.min(place[axis]), high.max(place[axis])))
        };
        (speeds[speeds.len() * 9 / 10], span(0), span(2))
    };
    for action in [Action::WalkClockwise, Action::WalkCounterclockwise] {
        let (fast, x, z) = speed_and_span(action);
        assert!((0.9..1.5).contains(&fast), "{fast}");
        for (low, high) in [x, z] {
            assert!((low + 1.0).abs() < 0.1 && (high - 1.0).abs() < 0.1, "{low} to {high}");
        }
    }
    for action in [Action::WalkBackForth, Action::WalkBackForthArmswing] {
        let (fast, x, z) = speed_and_span(action);
        assert!((0.9..1.5).contains(&fast), "{fast}");
        assert!(x.0 > -0.1 && x.1 < 0.1 && (z.0 + 1.0).abs() < 0.1 && (z.1 - 1.0).abs() < 0.1, "{x:?} {z:?}");
    }
    for action in [Action::TorsoRotation, Action::ArmSwing, Action::MarchInPlace] {
        let (_, x, z) = speed_and_span(action);
        assert!(x.1 - x.0 < 0.12 && z.1 - z.0 < 0.12, "{}: {x:?} {z:?}", action.name());
    }
    let (_, _, z) = speed_and_span(Action::Lunge);
    assert!(z.1 > 0.3 && z.1 < 0.7, "{z:?}");
}

#[test]
fn clockwise_turns_right_and_walkers_face_where_they_go() {
    for (action, sense) in [(Action::WalkClockwise, -1.0), (Action::WalkCounterclockwise, 1.0)] {
        let motion = usual(action, 3.0);
        let (mut turned, mut before) = (0.0, None);
        for (pose, pair) in motion.translations.windows(2).enumerate() {
            let facing = Rotation3::new(Vector3::from(motion.poses[pose][0])) * Vector3::z();
            let going = Vector3::from(pair[1]) - Vector3::from(pair[0]);
            assert!(facing.dot(&going.normalize()) > 0.8, "{} pose {pose}", action.name());
            let heading = facing.x.atan2(facing.z);
            if let Some(before) = before {
                let change: f64 = heading - before;
                turned += change.sin().atan2(change.cos());
            }
            before = Some(heading);
        }
        assert!(sense * turned > 2.0, "{} turned by {turned}", action.name());
    }
}

#[test]
fn lunges_go_down_and_marching_lifts_the_knees() {
    let lowest = |action: Action| usual(action, 8.0).translations.iter().map(|place| place[1]).fold(f64::INFINITY, f64::min);
    assert!(lowest(Action::Lunge) < lowest(Action::ArmSwing) - 0.2);
    let joints = posed(body(), &usual(Action::MarchInPlace, 4.0), 1);
    for knee in [4, 5] {
        let highest = joints.iter().map(|(joints, _)| joints[knee].y - joints[knee - 3].y).fold(f64::NEG_INFINITY, f64::max);
        assert!(highest > -0.25, "knee {knee} only reaches {highest} m from the hip");
    }
}

#[test]
fn styles_and_bodies_change_the_motion_and_every_number_is_finite() {
    let model = procedural::person(&procedural::subject("s2").unwrap()).unwrap();
    for action in Action::every() {
        for (tempo, amplitude, path_scale) in [(0.3, 0.3, 0.3), (2.0, 1.5, 5.0), (1.0, 1.2, 0.5)] {
            let style = StyleConfig { tempo, amplitude, path_scale, variation: 2.0, seed: 7, backward: amplitude == 1.2 };
            let motion = motion(action, &style, &model, &[0.5, -1.0], 6.0, 30.0).unwrap();
            assert_eq!(motion.poses.len(), 181);
            assert_eq!(motion.betas, [0.5, -1.0]);
            assert!(
                motion
                    .poses
                    .iter()
                    .flatten()
                    .flatten()
                    .chain(motion.translations.iter().flatten())
                    .all(|value| value.is_finite())
            );
        }
    }
}

#[test]
fn equal_seeds_give_equal_motions_and_others_differ() {
    let with_seed = |seed: u64| {
        let style = StyleConfig { seed, ..StyleConfig::default() };
        motion(Action::WalkBackForth, &style, body(), &[], 3.0, 60.0).unwrap()
    };
    assert_eq!(with_seed(3), with_seed(3));
    assert_ne!(with_seed(3), with_seed(4));
}

#[test]
fn settings_that_cannot_work_are_refused() {
    let refused = |style: StyleConfig, seconds: f64, rate: f64| {
        motion(Action::Lunge, &style, body(), &[], seconds, rate).unwrap_err().to_string()
    };
    assert_eq!(refused(StyleConfig { tempo: 0.0, ..Default::default() }, 1.0, 60.0), "`style.tempo` is 0, expected 0.3 to 2");
    assert_eq!(
        refused(StyleConfig::default(), f64::NAN, 60.0),
        "`motion.duration_s` is NaN, expected a duration above zero in seconds"
    );
    assert_eq!(refused(StyleConfig::default(), 1.0, 0.0), "`motion.rate_hz` is 0, expected 10 to 1000 poses per second");
}

#[test]
fn names_are_those_of_the_settings_file() {
    for action in Action::every() {
        let value = toml::Value::try_from(action).unwrap();
        assert_eq!(value.as_str(), Some(action.name()));
    }
}

#[test]
fn a_placed_person_stands_on_the_floor_and_faces_the_radar() {
    let placement = placement(1.1, 3.0);
    assert_eq!(placement.origin_m, [0.0, 3.0, -1.1]);
    let facing = placement.radar_from_motion.map(|row| row[2]);
    assert_eq!(facing, [0.0, -1.0, 0.0]);
}

#[test]
fn arms_swing_against_the_legs() {
    // Facing +z on the first way: how far wrist and ankle are in front of shoulder and hip.
    let joints = posed(body(), &usual(Action::WalkBackForthArmswing, 2.0), 1);
    let product = joints.iter().map(|(joints, _)| (joints[20].z - joints[16].z - 0.1) * (joints[7].z - joints[1].z)).sum::<f64>();
    assert!(product < -0.5, "{product}");
}

#[test]
fn arm_swings_go_horizontally_upward_and_downward_at_random() {
    let style = StyleConfig { seed: 4, ..StyleConfig::default() };
    let motion = motion(Action::ArmSwing, &style, body(), &[], 40.0, 30.0).unwrap();
    let joints = posed(body(), &motion, 1);
    // Of every swing of either arm: the wrist's farthest way up, to the side and behind, seen from the shoulder.
    let mut seen = [0; 3];
    let repetition = (30.0 / 0.55f64) as usize;
    for side in 0..2 {
        let out = if side == 0 { 1.0 } else { -1.0 };
        for swing in joints.chunks_exact(repetition) {
            let reach: Points = swing.iter().map(|(joints, _)| joints[20 + side] - joints[16 + side]).collect();
            let most = |of: &dyn Fn(&Vector3<f64>) -> f64| reach.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
            let level = most(&|wrist| if wrist.y.abs() < 0.2 { out * wrist.x } else { f64::NEG_INFINITY });
            seen[0] += usize::from(level > 0.35);
            seen[1] += usize::from(most(&|wrist| wrist.y) > 0.3);
            seen[2] += usize::from(most(&|wrist| -wrist.z) > 0.15);
        }
    }
    assert!(seen.iter().all(|&count| count >= 5), "{seen:?}");
    let other = StyleConfig { seed: 5, ..style };
    assert_ne!(motion.poses, super::motion(Action::ArmSwing, &other, body(), &[], 40.0, 30.0).unwrap().poses);
}

#[test]
fn walking_backward_faces_the_radar_all_the_time() {
    let style = StyleConfig { backward: true, ..StyleConfig::default() };
    for action in [Action::WalkBackForth, Action::WalkBackForthArmswing] {
        let motion = motion(action, &style, body(), &[], 14.0, 60.0).unwrap();
        let (mut ahead, mut back) = (0, 0);
        for (pose, pair) in motion.translations.windows(2).enumerate() {
            let facing = Rotation3::new(Vector3::from(motion.poses[pose][0])) * Vector3::z();
            assert!(facing.z > 0.9, "{} pose {pose}", action.name());
            let speed = 60.0 * (pair[1][2] - pair[0][2]);
            ahead += usize::from(speed > 0.6);
            back += usize::from(speed < -0.6);
        }
        assert!(ahead > 150 && back > 150, "{}: {ahead} poses ahead, {back} back", action.name());
        let [low, high] = [f64::min, f64::max].map(|pick| motion.translations.iter().map(|place| place[2]).reduce(pick).unwrap());
        assert!((low + 1.0).abs() < 0.1 && (high - 1.0).abs() < 0.1, "{low} to {high}");
        // As on the floor and as smooth as the others.
        let joints = posed(body(), &motion, 1);
        let lowest = |vertices: &Points| vertices.iter().map(|vertex| vertex.y).fold(f64::INFINITY, f64::min);
        assert!(joints.iter().step_by(3).all(|(_, vertices)| (-0.015..0.01).contains(&lowest(vertices))), "{}", action.name());
        let jump = joints.windows(3).flat_map(|triple| {
            (0..24).map(move |joint| (triple[2].0[joint] - triple[1].0[joint] * 2.0 + triple[0].0[joint]).norm())
        });
        assert!(jump.fold(0.0, f64::max) * 3600.0 < 60.0, "{}", action.name());
    }
}
