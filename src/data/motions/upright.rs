//! Which way is up in a motion, from how the person stands in it.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::person::{BodyModel, Motion};

type Point = Vector3<f64>;

/// The axis of a file that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum UpAxis {
    #[serde(rename = "x")]
    X,
    #[serde(rename = "y")]
    Y,
    #[serde(rename = "z")]
    Z,
    #[serde(rename = "-x")]
    MinusX,
    /// As cameras have it.
    #[serde(rename = "-y")]
    MinusY,
    #[serde(rename = "-z")]
    MinusZ,
}

impl UpAxis {
    /// All six directions.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::MinusX, Self::MinusY, Self::MinusZ];

    /// The name in settings.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::MinusX => "-x",
            Self::MinusY => "-y",
            Self::MinusZ => "-z",
        }
    }

    /// The unit vector that points up, in the motion's axes.
    pub fn direction(self) -> Point {
        match self {
            Self::X => Point::x(),
            Self::Y => Point::y(),
            Self::Z => Point::z(),
            Self::MinusX => -Point::x(),
            Self::MinusY => -Point::y(),
            Self::MinusZ => -Point::z(),
        }
    }

    /// The axis that is nearest to a direction.
    pub fn nearest(direction: Point) -> Self {
        let along = |axis: &Self| axis.direction().dot(&direction);
        Self::ALL.into_iter().max_by(|a, b| along(a).total_cmp(&along(b))).expect("there are six")
    }

    /// The turn that makes y the upward axis. Of z: x stays, so that who faces −y then faces +z.
    pub fn to_y(self) -> UnitQuaternion<f64> {
        use std::f64::consts::{FRAC_PI_2, PI};
        let (axis, angle) = match self {
            Self::Y => return UnitQuaternion::identity(),
            Self::MinusY => (Point::x_axis(), PI),
            Self::Z => (Point::x_axis(), -FRAC_PI_2),
            Self::MinusZ => (Point::x_axis(), FRAC_PI_2),
            Self::X => (Point::z_axis(), FRAC_PI_2),
            Self::MinusX => (Point::z_axis(), -FRAC_PI_2),
        };
        UnitQuaternion::from_axis_angle(&axis, angle)
    }
}

impl std::fmt::Display for UpAxis {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.write_str(self.name())
    }
}

/// A person in one pose, in the axes of the file.
pub struct Figure {
    pub head: Point,
    /// Between the ankles.
    pub feet: Point,
    /// Every joint.
    pub joints: Vec<Point>,
}

/// Length of the mean of the unit vectors from feet to head below which nothing stands: that of directions which fill
/// half a sphere evenly is one half.
const STANDS: f64 = 0.5;

/// The axis along which the person stands, and why it was chosen. `expected`: what the format or the rest pose says.
///
/// A person is up from the feet to the head; upside down is a camera's frame. A person who lies is distinguished
/// from a file with another axis by the floor: the lowest joint of a person keeps its height along gravity, and along no other
/// axis.
pub fn find_up(figures: &[Figure], expected: UpAxis) -> (UpAxis, String) {
    let body = |figure: &Figure| (figure.head - figure.feet).try_normalize(1e-9).unwrap_or_default();
    let mean = figures.iter().map(body).sum::<Point>() / figures.len().max(1) as f64;
    if mean.norm() < STANDS {
        return (expected, "the person does not stand long enough to tell; the format's own axis is taken".into());
    }
    let found = UpAxis::nearest(mean);
    if found == expected {
        return (found, "from the feet to the head".into());
    }
    let spread = |axis: UpAxis| {
        let along = |figure: &Figure| figure.joints.iter().map(|joint| axis.direction().dot(joint)).fold(f64::INFINITY, f64::min);
        let lowest: Vec<f64> = figures.iter().map(along).collect();
        let mean = lowest.iter().sum::<f64>() / lowest.len() as f64;
        lowest.iter().map(|height| (height - mean).powi(2)).sum::<f64>()
    };
    let opposite = found.direction().dot(&expected.direction()) < -0.5;
    if opposite || spread(found) < spread(expected) {
        (found, format!("from the feet to the head, where {expected} was expected"))
    } else {
        (expected, format!("the person lies along {found}, on a floor below {expected}"))
    }
}

/// Joints of the body alone, which SMPL and its relatives number alike.
const BODY: usize = 22;

fn turn_of(axis_angle: [f64; 3]) -> UnitQuaternion<f64> {
    UnitQuaternion::new(Point::from(axis_angle))
}

/// The joints of the body in one pose, about the pelvis.
fn joints(rest: &[[f64; 3]], parents: &[Option<usize>], pose: &[[f64; 3]]) -> Vec<Point> {
    let (mut turns, mut places): (Vec<UnitQuaternion<f64>>, Vec<Point>) = (Vec::new(), Vec::new());
    for joint in 0..BODY {
        let own = turn_of(pose[joint]);
        let (turn, place) = match parents[joint] {
            Some(parent) => {
                let bone = Point::from(rest[joint]) - Point::from(rest[parent]);
                (turns[parent] * own, places[parent] + turns[parent] * bone)
            }
            None => (own, Point::zeros()),
        };
        turns.push(turn);
        places.push(place);
    }
    places
}

/// Whether joints have the meaning from which standing is recognised.
fn is_smpl(model: &BodyModel) -> bool {
    super::layout::names(model.parents.len()).is_some()
}

/// The axis along which the person stands in a motion whose rest pose stands on y; notes say which and why. A body of
/// unknown joints stands on y.
pub fn stand(motion: &Motion, model: &BodyModel, up: Option<UpAxis>, notes: &mut Vec<String>) -> UpAxis {
    if let Some(up) = up {
        return up;
    }
    if !is_smpl(model) {
        notes.push("up axis: y, as of SMPL".into());
        return UpAxis::Y;
    }
    let rest = model.rest_joints(&motion.betas);
    let figure = |(pose, translation): (&Vec<[f64; 3]>, &[f64; 3])| {
        let mut joints = joints(&rest, &model.parents, pose);
        joints.iter_mut().for_each(|joint| *joint += Point::from(*translation));
        Figure { head: joints[15], feet: (joints[7] + joints[8]) * 0.5, joints }
    };
    let figures: Vec<Figure> = motion.poses.iter().zip(&motion.translations).map(figure).collect();
    let (up, why) = find_up(&figures, UpAxis::Y);
    notes.push(format!("up axis: {up} ({why}); `up` names another"));
    up
}

/// Turns the whole motion about the origin so that `up` becomes y: every vertex goes where the turn takes it.
pub fn turn(motion: &mut Motion, model: &BodyModel, up: UpAxis) {
    if up == UpAxis::Y {
        return;
    }
    let (turn, pelvis) = (up.to_y(), Point::from(model.rest_joints(&motion.betas)[0]));
    for (pose, translation) in motion.poses.iter_mut().zip(&mut motion.translations) {
        pose[0] = (turn * turn_of(pose[0])).scaled_axis().into();
        *translation = (turn * (pelvis + Point::from(*translation)) - pelvis).into();
    }
}

/// Raises a person without a place so that the lowest joint of all poses is at height 0; the height of the pelvis.
pub fn on_the_floor(motion: &mut Motion, model: &BodyModel) -> f64 {
    if !is_smpl(model) {
        return 0.0;
    }
    let rest = model.rest_joints(&motion.betas);
    let lowest =
        |pose: &Vec<[f64; 3]>| joints(&rest, &model.parents, pose).iter().map(|joint| joint.y).fold(f64::INFINITY, f64::min);
    let height = -motion.poses.iter().map(lowest).fold(f64::INFINITY, f64::min);
    motion.translations.iter_mut().for_each(|place| *place = [0.0, height - rest[0][1], 0.0]);
    height
}

/// Height of the pelvis above the lowest joint at rest, metres.
pub fn pelvis_height_m(model: &BodyModel, betas: &[f64]) -> f64 {
    let rest = model.rest_joints(betas);
    let lowest = rest.iter().map(|joint| joint[1]).fold(f64::INFINITY, f64::min);
    rest.first().map_or(0.0, |pelvis| pelvis[1] - lowest).max(0.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Someone along `body` who moves by `step` in each of ten poses.
    fn figures(body: Point, step: Point) -> Vec<Figure> {
        let side = Point::new(0.3, 0.2, 0.25);
        let figure = |pose: usize| {
            // A hand that swings, in no direction of its own.
            let at = step * pose as f64;
            let swing = side * (pose as f64).sin();
            let joints = [0.0, 0.3, 0.5, 0.8, 1.0].map(|share| at + body * share).to_vec();
            let joints = joints.into_iter().chain([at + body * 0.5 + swing]).collect();
            Figure { head: at + body, feet: at, joints }
        };
        (0..10).map(figure).collect()
    }

    #[test]
    fn whoever_walks_upright_shows_the_axis() {
        for axis in UpAxis::ALL {
            let forward = Point::new(axis.direction().y, axis.direction().z, axis.direction().x);
            let walk = figures(axis.direction() * 1.7 + forward * 0.2, forward * 0.1);
            assert_eq!(find_up(&walk, UpAxis::Y).0, axis);
            assert!((axis.to_y() * axis.direction() - Point::y()).norm() < 1e-12);
        }
    }

    #[test]
    fn whoever_lies_on_a_floor_changes_nothing() {
        // Rolling sideways over a floor below y.
        let (axis, why) = find_up(&figures(Point::z() * 1.7, Point::x() * 0.1), UpAxis::Y);
        assert_eq!(axis, UpAxis::Z, "nothing moves along z: the floor cannot tell, {why}");
        let crawl = figures(Point::z() * 1.7, Point::z() * 0.1 + Point::x() * 0.05);
        assert_eq!(find_up(&crawl, UpAxis::Y).0, UpAxis::Y, "a crawl moves along the body");
        assert!(find_up(&crawl, UpAxis::Y).1.contains("lies along z"));
    }

    #[test]
    fn whoever_turns_over_and_over_shows_nothing() {
        let tumble: Vec<Figure> = (0..12)
            .map(|pose| {
                let angle = pose as f64 * std::f64::consts::TAU / 12.0;
                let body = Point::new(0.0, angle.cos(), angle.sin());
                Figure { head: body, feet: -body, joints: vec![body, -body] }
            })
            .collect();
        let (axis, why) = find_up(&tumble, UpAxis::Z);
        assert!(axis == UpAxis::Z && why.contains("does not stand"), "{why}");
    }
}
