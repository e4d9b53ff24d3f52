//! The orders in which SMPL and its relatives number their joints.

use crate::person::JOINT_NAMES;

const FINGERS: [&str; 5] = ["index", "middle", "pinky", "ring", "thumb"];

/// Joints of the body alone, which all of them share.
const BODY: usize = 22;

/// A model's joints by name; `None` where a number of joints is no known model's.
///
/// SMPL: 24. SMPL-H: the first 22 of SMPL and 15 fingers a hand. SMPL-X: the same with a jaw and two eyes before the
/// fingers. 22: the body of AMASS without hands.
pub fn names(joints: usize) -> Option<(&'static str, Vec<String>)> {
    let body = || JOINT_NAMES[..BODY].iter().map(|name| name.to_string());
    let face = || ["jaw", "left_eye", "right_eye"].into_iter().map(str::to_string);
    let hands = || hand("left").into_iter().chain(hand("right"));
    match joints {
        22 => Some(("SMPL's body without hands", body().collect())),
        24 => Some(("SMPL", JOINT_NAMES.iter().map(|name| name.to_string()).collect())),
        52 => Some(("SMPL-H", body().chain(hands()).collect())),
        55 => Some(("SMPL-X", body().chain(face()).chain(hands()).collect())),
        _ => None,
    }
}

/// The fingers of a hand, in the models' order.
pub fn hand(side: &str) -> Vec<String> {
    FINGERS.iter().flat_map(|finger| (1..=3).map(move |bone| format!("{side}_{finger}{bone}"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_relatives_part_after_the_wrists() {
        let at = |joints: usize, joint: usize| names(joints).unwrap().1[joint].clone();
        for joints in [22, 24, 52, 55] {
            assert_eq!(names(joints).unwrap().1.len(), joints);
            assert_eq!(at(joints, 21), "right_wrist");
        }
        assert_eq!([at(24, 22), at(52, 22), at(55, 22)], ["left_hand", "left_index1", "jaw"]);
        assert_eq!([at(52, 37), at(55, 40), at(55, 54)], ["right_index1", "right_index1", "right_thumb3"]);
        assert!(names(23).is_none() && names(69).is_none());
    }
}
