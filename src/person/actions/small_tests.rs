//! The small actions: their periods, their differences and their sizes.

use nalgebra::Vector3;

use super::tests::*;
use super::*;

/// Places of all joints, pose by pose, without the style's irregularity.
fn regular(action: Action, style: &StyleConfig, seconds: f64, rate_hz: f64) -> Vec<Points> {
    let style = StyleConfig { variation: 0.0, ..style.clone() };
    let motion = motion(action, &style, body(), &[], seconds, rate_hz).unwrap();
    posed(body(), &motion, 1).into_iter().map(|(joints, _)| joints).collect()
}

/// Root of the mean squared distance of joints, and of all poses.
fn apart(one: &[Points], other: &[Points]) -> f64 {
    let squares = one.iter().zip(other).flat_map(|(one, other)| one.iter().zip(other).map(|(a, b)| (a - b).norm_squared()));
    (squares.sum::<f64>() / (one.len() * one[0].len()) as f64).sqrt()
}

#[test]
fn small_actions_repeat_themselves_after_their_period_and_not_before() {
    for (action, rate_hz) in Action::SMALL.into_iter().zip([1.2, 0.25, 0.7, 0.4, 0.35, 0.5, 0.6, 0.45, 1.3, 0.8, 0.5, 1.1]) {
        for tempo in [1.0, 0.8] {
            // So many poses that a period is a whole number of them.
            let poses = 96;
            let joints =
                regular(action, &StyleConfig { tempo, ..Default::default() }, 2.2 / (tempo * rate_hz), 96.0 * tempo * rate_hz);
            let (first, second) = (&joints[..poses], &joints[poses..2 * poses]);
            assert!(apart(first, second) < 1e-9, "{}: {}", action.name(), apart(first, second));
            // Half of it is no period.
            let half = apart(first, &joints[poses / 2..poses + poses / 2]);
            assert!(half > 0.003, "{}: {half}", action.name());
        }
    }
}

/// Aligned in time as well as they can be, no action is another one.
#[test]
fn small_actions_differ_from_each_other() {
    // One repetition of each, sampled alike.
    let cycle =
        |(action, rate_hz): (Action, f64)| regular(action, &StyleConfig::default(), 1.0 / rate_hz, 40.0 * rate_hz)[..40].to_vec();
    let rates = [1.2, 0.25, 0.7, 0.4, 0.35, 0.5, 0.6, 0.45, 1.3, 0.8, 0.5, 1.1];
    let cycles: Vec<Vec<Points>> = Action::SMALL.into_iter().zip(rates).map(cycle).collect();
    for (index, one) in cycles.iter().enumerate() {
        for (other, another) in cycles.iter().enumerate().skip(index + 1) {
            let nearest =
                (0..40).map(|shift| apart(one, &[&another[shift..], &another[..shift]].concat())).fold(f64::INFINITY, f64::min);
            let names = [Action::SMALL[index].name(), Action::SMALL[other].name()];
            assert!(nearest > 0.01, "{names:?} differ by {nearest} m");
        }
    }
}

#[test]
fn small_actions_are_smaller_than_the_papers() {
    let speed = |action: Action| {
        let joints = regular(action, &StyleConfig::default(), 10.0, 60.0);
        60.0 * apart(&joints[1..], &joints[..joints.len() - 1])
    };
    let slowest = Action::ALL.into_iter().map(speed).fold(f64::INFINITY, f64::min);
    let speeds: Vec<f64> = Action::SMALL.into_iter().map(speed).collect();
    let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
    assert!(mean < slowest, "{speeds:?} m/s, the paper's slowest {slowest}");
}

/// The normal ranges of the American Academy of Orthopaedic Surgeons ("Joint Motion: Method of Measuring and Recording",
/// 1965): elbow 150°, knee 135°, hip 120°, ankle 50° down and 20° up, trunk 80° ahead, 35° aside and 45° about itself, neck 45°.
#[test]
fn small_actions_and_the_arm_swing_keep_within_the_ranges_of_the_joints() {
    for action in Action::SMALL.into_iter().chain([Action::ArmSwing]) {
        for (pose, rotations) in usual(action, 12.0).poses.iter().enumerate() {
            let angle = |joint: usize| Vector3::from(rotations[joint]).norm().to_degrees();
            let within = |what: &str, found: f64, most: f64| {
                assert!(found <= most, "{} pose {pose}: {what} {found:.0} degrees", action.name());
            };
            for side in 0..2 {
                within("elbow", angle(18 + side), 150.0);
                within("knee", angle(4 + side), 135.0);
                within("hip", angle(1 + side), 120.0);
                // About x: heel up is positive, toes up negative.
                let ankle = rotations[7 + side][0].to_degrees();
                within("ankle, foot down", ankle, 50.0);
                within("ankle, foot up", -ankle, 20.0);
            }
            // Three joints share the trunk's, two the neck's.
            let trunk = Vector3::from(rotations[3]).map(|part| 3.0 * part.to_degrees());
            within("trunk ahead", trunk.x.abs(), 80.0);
            within("trunk about itself", trunk.y.abs(), 45.0);
            within("trunk aside", trunk.z.abs(), 35.0);
            within("neck", 2.0 * angle(12), 45.0);
        }
    }
}
