//! How the axes of a file's joints lie in a person who stands in SMPL's rest pose: one constant turn a joint.
//!
//! Most files have a rest pose in which somebody stands (T, A, or arms down): then the axes of all joints are parallel
//! there, and limbs turn by the shortest way from the body's direction to the file's. Others build every bone along an
//! axis of its own; in their rest pose nobody stands. There, up, front and twist come from posed frames: up is the world's,
//! left is from hip to hip and from collar to collar, a limb has on average no twist against its parent, the sole of a foot
//! that stands still is level, and joints whose bone is anatomy rather than pose (collars, head, toes, hands) are on
//! average as in SMPL's rest pose.

use nalgebra::{Matrix3, Matrix4, Rotation3, SymmetricEigen, UnitQuaternion, Vector3};

use super::bvh::{Bvh, BvhPose};
use crate::error::{Error, Result};
use crate::person::{BodyModel, JOINT_NAMES};

type Point = Vector3<f64>;
type Turn = UnitQuaternion<f64>;

/// Limbs whose rest direction is aligned: joint, and the joint at the limb's end. Spine, collar bones, feet and hands
/// differ between skeletons by anatomy, not by pose.
pub const LIMBS: [(usize, usize); 8] = [(1, 4), (2, 5), (4, 7), (5, 8), (16, 18), (17, 19), (18, 20), (19, 21)];

/// Bones along the trunk: they are vertical in a person who stands, whatever the curve of the spine.
const TRUNK: [(usize, usize); 3] = [(3, 6), (6, 9), (9, 12)];

/// Bones of anatomy, which rest as the file's rest pose has them unless that cannot be.
const ANATOMY: [(usize, usize); 5] = [(7, 10), (8, 11), (12, 15), (13, 16), (14, 17)];

/// Chains that a file may divide further (two necks, a twisting forearm): start and end.
pub const CHAINS: [(usize, usize); 13] =
    [(1, 4), (2, 5), (4, 7), (5, 8), (16, 18), (17, 19), (18, 20), (19, 21), (3, 6), (6, 9), (9, 12), (12, 15), (0, 3)];

/// A bone of anatomy that is farther from the body's own than this is a rest pose, not another anatomy: of CMU's skeletons
/// and three bodies in SMPL layout the farthest are collar bones, 33° apart (the test of the tried files reads them); a foot
/// that points straight down is 72° off.
const ANATOMY_DEG: f64 = 60.0;

const ANKLES: [usize; 2] = [7, 8];

/// A foot that moves less than this share of its speed in three quarters of the poses stands still.
const STILL: f64 = 0.1;

/// A foot stands for more than half of a walking cycle, and less in a run (Novacheck, 1998: 39 %); whoever moves and has
/// no foot on the ground in a quarter of the time takes no steps.
const STANCE: f64 = 0.25;

/// A file's skeleton and who is who in it.
pub struct Skeleton<'a> {
    pub bvh: &'a Bvh,
    /// `[SMPL joint]` → joint of the file.
    pub joints: &'a [Option<usize>],
    /// Places of the file's joints with all rotations zero.
    pub rest: Vec<Point>,
}

/// What is constant between the body and the file.
pub struct Neutral {
    /// `[SMPL joint]`: from the body's axes at rest to the axes of the file's joint.
    pub turns: Vec<Turn>,
    /// `[SMPL joint]`: to the end of its chain, in the axes of the file's joint.
    pub bones: Vec<Option<Point>>,
    /// How it was found, for people; none where the rest pose is the body's.
    pub note: Option<String>,
}

impl Skeleton<'_> {
    /// Where an SMPL joint is with all rotations zero.
    pub fn at_rest(&self, joint: usize) -> Option<Point> {
        self.joints[joint].map(|found| self.rest[found])
    }

    pub fn place(&self, joint: usize, pose: &BvhPose) -> Option<Point> {
        self.joints[joint].map(|found| pose.places[found])
    }

    fn turn(&self, joint: usize, pose: &BvhPose) -> Option<Turn> {
        self.joints[joint].map(|found| pose.turns[found])
    }

    /// From one joint to another at rest.
    fn rest_bone(&self, (start, end): (usize, usize)) -> Option<Point> {
        Some(self.at_rest(end)? - self.at_rest(start)?)
    }

    /// From one joint to another on average, in the axes of `frame`.
    fn posed_bone(&self, frame: usize, (start, end): (usize, usize), poses: &[BvhPose]) -> Option<Point> {
        let one = |pose: &BvhPose| Some(self.turn(frame, pose)?.inverse() * (self.place(end, pose)? - self.place(start, pose)?));
        let all: Option<Vec<Point>> = poses.iter().map(one).collect();
        all.map(|all| all.iter().sum::<Point>() / poses.len() as f64)
    }

    /// The turn from the body's axes (left, up, front) to those of a rest pose in which somebody stands.
    pub fn standing(&self) -> Option<Turn> {
        let hips = (self.at_rest(1)? + self.at_rest(2)?) * 0.5;
        let turn = frame(self.at_rest(1)? - self.at_rest(2)?, self.at_rest(12)? - hips)?;
        let (left, up) = (turn * Point::x(), turn * Point::y());
        // Within 45 degrees of where a person who stands has them.
        let along = |bone: (usize, usize), direction: Point| {
            let bone = self.rest_bone(bone).and_then(|bone| bone.try_normalize(1e-9));
            bone.is_some_and(|bone| bone.dot(&direction) > std::f64::consts::FRAC_1_SQRT_2)
        };
        (along((1, 7), -up) && along((2, 8), -up) && along((17, 16), left)).then_some(turn)
    }
}

/// The turns of all joints; `poses`: some of the file's, `up`: the world's, in the file's axes.
pub fn find(skeleton: &Skeleton, body: &[Point], model: &BodyModel, poses: &[BvhPose], up: Point) -> Result<Neutral> {
    let standing = skeleton.standing();
    let chain = |joint: usize| CHAINS.into_iter().find(|(start, _)| *start == joint);
    let bone = |joint: usize| {
        let chain = chain(joint)?;
        if standing.is_some() { skeleton.rest_bone(chain) } else { skeleton.posed_bone(joint, chain, poses) }
    };
    let bones: Vec<Option<Point>> = (0..body.len()).map(bone).collect();
    let mut turns: Vec<Turn> = Vec::new();
    let mut posed = Vec::new();
    for joint in 0..body.len() {
        let from_rest = standing.and_then(|standing| at_rest(joint, standing, &turns, skeleton, body, model));
        let turn = match from_rest {
            Some(turn) => turn,
            None => {
                posed.push(joint);
                from_poses(joint, &turns, &bones, skeleton, body, model, poses, up)?
            }
        };
        turns.push(turn);
    }
    let names = |joints: &[usize]| joints.iter().map(|&joint| JOINT_NAMES[joint]).collect::<Vec<_>>().join(", ");
    let note = match (standing, posed.as_slice()) {
        (None, _) => Some(format!(
            "rest pose: nobody stands in it, so up, front and twist of all joints are taken from {} posed frames",
            poses.len()
        )),
        (Some(_), []) => None,
        (Some(_), joints) => Some(format!(
            "rest pose: {} do not rest as a standing person's, so they are taken from {} posed frames",
            names(joints),
            poses.len()
        )),
    };
    Ok(Neutral { turns, bones, note })
}

/// From a rest pose in which somebody stands; none where this joint does not rest as a person's.
fn at_rest(joint: usize, standing: Turn, turns: &[Turn], skeleton: &Skeleton, body: &[Point], model: &BodyModel) -> Option<Turn> {
    let inherited = model.parents[joint].map_or(standing, |parent| turns[parent]);
    if let Some(&(start, end)) = LIMBS.iter().find(|(start, _)| *start == joint) {
        let bone = skeleton.rest_bone((start, end))?;
        return Some(arc(standing * (body[end] - body[start]), bone) * standing);
    }
    let Some(&(start, end)) = ANATOMY.iter().find(|(start, _)| *start == joint) else { return Some(inherited) };
    // What the file lacks, or has in one place, follows its parent.
    let Some(bone) = skeleton.rest_bone((start, end)).filter(|bone| bone.norm() > 1e-9) else { return Some(inherited) };
    let apart = (inherited * (body[end] - body[start])).angle(&bone);
    (apart.to_degrees() < ANATOMY_DEG).then_some(inherited)
}

/// From what the joint does in posed frames.
#[allow(clippy::too_many_arguments, reason = "one step of `find`, which owns all of it")]
fn from_poses(
    joint: usize,
    turns: &[Turn],
    bones: &[Option<Point>],
    skeleton: &Skeleton,
    body: &[Point],
    model: &BodyModel,
    poses: &[BvhPose],
    up: Point,
) -> Result<Turn> {
    let Some(parent) = model.parents[joint] else {
        return pelvis(skeleton, poses, up).ok_or_else(|| {
            Error::field(&skeleton.bvh.source, "skeleton", "without a left and an up", "hips side by side and a neck above them")
        });
    };
    // A joint that the file lacks turns with its parent, and so does its neutral.
    let (Some(_), Some(above)) = (skeleton.joints[joint], ancestor(parent, skeleton, model)) else { return Ok(turns[parent]) };
    if joint == 9
        && let Some(turn) = chest(skeleton, poses, bones[9])
    {
        return Ok(turn);
    }
    let nominal = match (LIMBS.iter().find(|(start, _)| *start == joint), TRUNK.iter().any(|(start, _)| *start == joint)) {
        (Some(&(start, end)), _) => Some(body[end] - body[start]),
        (None, true) => Some(Point::y()),
        (None, false) => None,
    };
    let one = |pose: &BvhPose| {
        let own = skeleton.turn(joint, pose)?;
        let inherited = skeleton.turn(above, pose)? * turns[above];
        let neutral = match (nominal, bones[joint]) {
            // The shortest way there leaves no twist.
            (Some(nominal), Some(bone)) => arc(inherited * nominal, own * bone) * inherited,
            _ => inherited,
        };
        Some(own.inverse() * neutral)
    };
    let all: Vec<Turn> = poses.iter().filter_map(one).collect();
    let turn = mean(&all).unwrap_or(turns[parent]);
    let level = ANKLES.contains(&joint).then(|| level(joint, skeleton, poses, up)).flatten();
    // The heading stays as it is against the shank; only the sole is levelled.
    Ok(level.map_or(turn, |level| arc(turn * Point::y(), level) * turn))
}

/// The world's up in the axes of an ankle whose foot stands still, averaged over the poses in which it does; none where
/// that is too seldom to be a step.
fn level(ankle: usize, skeleton: &Skeleton, poses: &[BvhPose], up: Point) -> Option<Point> {
    // The poses are evenly spaced, so distances between neighbours compare speeds.
    let steps: Option<Vec<f64>> =
        poses.windows(2).map(|pair| Some((skeleton.place(ankle, &pair[1])? - skeleton.place(ankle, &pair[0])?).norm())).collect();
    let steps = steps?;
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = *sorted.get(sorted.len() * 3 / 4)?;
    let still = steps.iter().zip(poses).filter(|(step, _)| **step < STILL * usual);
    let ups: Option<Vec<Point>> = still.map(|(_, pose)| Some(skeleton.turn(ankle, pose)?.inverse() * up)).collect();
    let ups = ups?;
    (ups.len() as f64 > STANCE * steps.len() as f64).then(|| ups.iter().sum())
}

/// The nearest joint at or above this one that the file has.
fn ancestor(mut joint: usize, skeleton: &Skeleton, model: &BodyModel) -> Option<usize> {
    while skeleton.joints[joint].is_none() {
        joint = model.parents[joint]?;
    }
    Some(joint)
}

/// Left from hip to hip, up as the world's on average.
fn pelvis(skeleton: &Skeleton, poses: &[BvhPose], up: Point) -> Option<Turn> {
    let left = skeleton.posed_bone(0, (2, 1), poses)?;
    let up = poses.iter().filter_map(|pose| Some(skeleton.turn(0, pose)?.inverse() * up)).sum::<Point>();
    frame(left, up)
}

/// Left from collar to collar, or from shoulder to shoulder where both collars are in one place; up to the neck.
fn chest(skeleton: &Skeleton, poses: &[BvhPose], neck: Option<Point>) -> Option<Turn> {
    let neck = neck?;
    let sides = [(14, 13), (17, 16)].into_iter().filter_map(|sides| skeleton.posed_bone(9, sides, poses));
    let left = sides.into_iter().find(|left| left.norm() > 0.05 * neck.norm())?;
    frame(left, neck)
}

/// The turn that takes x to `left` and y as near to `up` as it can be, along the axes where those are near: skeletons are
/// built along the axes, only their anatomy is not; a leaning neck is no leaning person.
pub fn frame(left: Point, up: Point) -> Option<Turn> {
    let (left, up) = (left.try_normalize(1e-9)?, up.try_normalize(1e-9)?);
    let front = left.cross(&up).try_normalize(0.3)?;
    let up = front.cross(&left);
    let axis = |direction: Point| {
        let axis = direction.iamax();
        Point::from_fn(|row, _| if row == axis { direction[axis].signum() } else { 0.0 })
    };
    let turn = |left: Point, up: Point| {
        let matrix = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[left, up, left.cross(&up)]));
        UnitQuaternion::from_rotation_matrix(&matrix)
    };
    let (exact, snapped) = (turn(left, up), (axis(left), axis(up)));
    if snapped.0.dot(&snapped.1).abs() < 0.5 {
        let snapped = turn(snapped.0, snapped.1);
        if snapped.angle_to(&exact).to_degrees() < 30.0 {
            return Some(snapped);
        }
    }
    Some(exact)
}

/// The shortest turn from one direction to another: none between equal ones, half a turn about any axis across between
/// opposite ones.
pub fn arc(from: Point, to: Point) -> Turn {
    let (Some(from), Some(to)) = (from.try_normalize(1e-12), to.try_normalize(1e-12)) else { return Turn::identity() };
    // Twice the cosine and sine of half the angle; the sum is exact where the difference cancels, and the other way.
    let half = (from + to).norm();
    if half < 1e-9 {
        let across = Point::from_fn(|row, _| if row == from.iamin() { 1.0 } else { 0.0 }).cross(&from);
        return UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(across), std::f64::consts::PI);
    }
    let sine = from.cross(&to) / half;
    UnitQuaternion::new_normalize(nalgebra::Quaternion::from_parts(0.5 * half, sine))
}

/// The turn that is nearest to all (the largest eigenvector of Σ q qᵀ; Markley et al., 2007).
fn mean(turns: &[Turn]) -> Option<Turn> {
    let sum: Matrix4<f64> = turns.iter().map(|turn| turn.coords * turn.coords.transpose()).sum();
    if turns.is_empty() {
        return None;
    }
    let eigen = SymmetricEigen::new(sum);
    let vector = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    Some(UnitQuaternion::new_normalize(nalgebra::Quaternion::from(vector)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_is_exact_from_no_turn_to_half_a_turn() {
        let from = Point::new(0.3, -1.0, 0.7);
        for angle in [0.0, 1e-12, 1e-8, 1e-3, 1.0, 3.0, std::f64::consts::PI - 1e-8, std::f64::consts::PI] {
            let axis = nalgebra::Unit::new_normalize(from.cross(&Point::x()));
            let to = UnitQuaternion::from_axis_angle(&axis, angle) * from;
            let found = arc(from, to * 3.0);
            assert!((found * from - to).norm() < 1e-8, "{angle}: {}", found * from);
            assert!((found.angle() - angle).abs() < 1e-8, "{angle}: {}", found.angle());
            assert!(found.scaled_axis().iter().all(|value| value.is_finite()));
        }
        assert_eq!(arc(Point::zeros(), from), Turn::identity());
    }

    #[test]
    fn the_mean_does_not_mind_signs() {
        let turn = UnitQuaternion::from_euler_angles(0.4, -1.0, 2.0);
        let other = UnitQuaternion::from_quaternion(-turn.into_inner());
        assert!(mean(&[turn, other, turn]).unwrap().angle_to(&turn) < 1e-7);
        assert!(mean(&[]).is_none());
    }
}
