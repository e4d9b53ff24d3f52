//! The person as data: a body in SMPL layout, a motion in AMASS layout, or a plain sequence of meshes.
//!
//! Nothing here poses a body; the simulator and the recorder each do that on their own.

pub mod actions;
pub mod mesh;
pub mod procedural;

use serde::{Deserialize, Serialize};

use crate::bounds;
use crate::error::{Error, Result};

/// Names of the 24 SMPL joints, in SMPL's order.
pub const JOINT_NAMES: [&str; 24] = [
    "pelvis",
    "left_hip",
    "right_hip",
    "spine1",
    "left_knee",
    "right_knee",
    "spine2",
    "left_ankle",
    "right_ankle",
    "spine3",
    "left_foot",
    "right_foot",
    "neck",
    "left_collar",
    "right_collar",
    "head",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_hand",
    "right_hand",
];

/// A body that skinning can pose. V vertices, J joints, B shape parameters; SMPL's frame: y up, the person faces +z,
/// the left hand is at +x; metres.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyModel {
    /// `[vertex, xyz]`, the rest pose (`v_template`).
    pub template: Vec<[f64; 3]>,
    /// `[shape][vertex, xyz]`, metres per unit of a shape parameter (`shapedirs`).
    pub shape_directions: Vec<Vec<[f64; 3]>>,
    /// `[9 (J − 1)][vertex, xyz]`, metres per entry of R − 1 (`posedirs`); may be empty.
    pub pose_directions: Vec<Vec<[f64; 3]>>,
    /// `[joint]` → (vertex, weight) pairs (`J_regressor`).
    pub joint_regressor: Vec<Vec<(usize, f64)>>,
    /// `[vertex]` → (joint, weight) pairs that sum to 1 (`weights`).
    pub skinning: Vec<Vec<(usize, f64)>>,
    /// `[joint]`; the root has none, and every parent comes before its child (`kintree_table`).
    pub parents: Vec<Option<usize>>,
    /// Counter-clockwise seen from outside (`f`).
    pub faces: Vec<[usize; 3]>,
}

impl BodyModel {
    /// `[vertex, xyz]`, metres: the rest pose of the body with these shape parameters; missing ones are zero, surplus ones
    /// ignored.
    pub fn shaped(&self, betas: &[f64]) -> Vec<[f64; 3]> {
        let mut vertices = self.template.clone();
        for (direction, &beta) in self.shape_directions.iter().zip(betas) {
            for (vertex, change) in vertices.iter_mut().zip(direction) {
                (0..3).for_each(|axis| vertex[axis] += beta * change[axis]);
            }
        }
        vertices
    }

    /// `[joint, xyz]`, metres: the joints of [`BodyModel::shaped`].
    pub fn rest_joints(&self, betas: &[f64]) -> Vec<[f64; 3]> {
        let vertices = self.shaped(betas);
        let joint = |weights: &Vec<(usize, f64)>| {
            let add = |sum: [f64; 3], &(vertex, weight): &(usize, f64)| {
                std::array::from_fn(|axis| sum[axis] + weight * vertices[vertex][axis])
            };
            weights.iter().fold([0.0; 3], add)
        };
        self.joint_regressor.iter().map(joint).collect()
    }
}

/// Poses of a body in time.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// `[pose][joint]` axis-angle, radians; as many joints as the body has.
    pub poses: Vec<Vec<[f64; 3]>>,
    /// `[pose]`, metres.
    pub translations: Vec<[f64; 3]>,
    /// SMPL's shape coefficients, `[shape direction]`.
    pub betas: Vec<f64>,
    pub rate_hz: f64,
}

/// Where and when in the radar frame a motion happens: `rotation · (LBS(betas, pose) + translation) + origin`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Placement {
    /// Radar time at which the first pose happens.
    #[serde(default)]
    pub start_s: f64,
    /// Rotation `[row][column]`: columns are the motion's axes in the radar frame.
    #[serde(default = "upright")]
    pub radar_from_motion: [[f64; 3]; 3],
    /// Where the motion's origin is in the radar frame.
    #[serde(default)]
    pub origin_m: [f64; 3],
}

/// From y-up with the person facing +z to z-up with the person facing the radar (−y).
fn upright() -> [[f64; 3]; 3] {
    [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
}

impl Placement {
    /// The same turned about the vertical through the motion's origin, counter-clockwise seen from above.
    #[must_use]
    pub fn turned(self, degrees: f64) -> Self {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let [x, y, z] = self.radar_from_motion;
        let mixed = |a: f64, b: f64| std::array::from_fn(|column| a * x[column] + b * y[column]);
        Self { radar_from_motion: [mixed(cosine, -sine), mixed(sine, cosine), z], ..self }
    }
}

impl Default for Placement {
    fn default() -> Self {
        Self { start_s: 0.0, radar_from_motion: upright(), origin_m: [0.0; 3] }
    }
}

/// A person who moves in front of the radar.
#[allow(clippy::large_enum_variant, reason = "there are a few persons, never many")]
#[derive(Clone, Debug, PartialEq)]
pub enum Person {
    Skinned {
        model: BodyModel,
        motion: Motion,
        placement: Placement,
    },
    /// Meshes that something else has posed, already in the radar frame.
    Meshes {
        /// `[pose][vertex, xyz]`, metres, radar frame.
        vertices: Vec<Vec<[f64; 3]>>,
        /// `[face]`, three vertices each, counter-clockwise from outside.
        faces: Vec<[usize; 3]>,
        /// `[pose]`, ascending.
        pose_times_s: Vec<f64>,
    },
}

impl Person {
    /// Vertices of every facet, `[face][corner]`.
    pub fn faces(&self) -> &[[usize; 3]] {
        match self {
            Self::Skinned { model, .. } => &model.faces,
            Self::Meshes { faces, .. } => faces,
        }
    }

    /// Refuses positions that no scene of a radar has and turns beyond counting, whatever they were read from.
    ///
    /// # Errors
    /// With what is where, and the bound.
    pub fn check(&self) -> Result<()> {
        let impossible = match self {
            Self::Meshes { vertices, .. } => farthest("pose", vertices.iter().map(Vec::as_slice)),
            Self::Skinned { model, motion, placement } => {
                let rest = [model.shaped(&motion.betas), model.rest_joints(&motion.betas)];
                farthest("the rest pose: vertices (0) and joints (1)", rest.iter().map(Vec::as_slice))
                    .or_else(|| farthest("the translation of pose", motion.translations.iter().map(std::slice::from_ref)))
                    .or_else(|| farthest("the placement's origin", [&placement.origin_m].map(std::slice::from_ref).into_iter()))
                    .or_else(|| widest(&motion.poses))
            }
        };
        match impossible {
            None => Ok(()),
            Some(message) => Err(Error::Usage {
                message: format!("the person cannot be posed: {message}"),
                hint: Some("lengths are in metres, angles in radians; check the body and motion files and their units".into()),
            }),
        }
    }

    /// Where the motion's origin is, in the radar frame; none for meshes, which have none.
    pub fn origin_m(&self) -> Option<[f64; 3]> {
        match self {
            Self::Skinned { placement, .. } => Some(placement.origin_m),
            Self::Meshes { .. } => None,
        }
    }

    /// Radar time of every pose, seconds, ascending.
    pub fn pose_times_s(&self) -> Vec<f64> {
        match self {
            Self::Skinned { motion, placement, .. } => {
                (0..motion.poses.len()).map(|pose| placement.start_s + pose as f64 / motion.rate_hz).collect()
            }
            Self::Meshes { pose_times_s, .. } => pose_times_s.clone(),
        }
    }
}

/// The first position that is farther from its origin than any scene reaches.
fn farthest<'a>(what: &str, places: impl Iterator<Item = &'a [[f64; 3]]>) -> Option<String> {
    let beyond = |position: &&[f64; 3]| !position.iter().all(|value| value.abs() <= bounds::LONGEST_M);
    places.enumerate().find_map(|(index, positions)| {
        let position = positions.iter().find(beyond)?;
        Some(format!("{what} {index} has a position of {position:?} m, expected at most {} m", bounds::LONGEST_M))
    })
}

/// The first turn about a joint that is wider than anybody counts.
fn widest(poses: &[Vec<[f64; 3]>]) -> Option<String> {
    let beyond = |turn: &[f64; 3]| !turn.iter().all(|value| value.abs() <= bounds::WIDEST_RAD);
    poses.iter().enumerate().find_map(|(pose, turns)| {
        let joint = turns.iter().position(beyond)?;
        Some(format!("pose {pose} turns joint {joint} by {:?} rad, expected at most {} rad", turns[joint], bounds::WIDEST_RAD))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn skinned() -> (BodyModel, Motion, Placement) {
        let model = procedural::person(&procedural::PersonConfig::default()).unwrap();
        let pose = vec![[0.0; 3]; model.parents.len()];
        let motion = Motion { poses: vec![pose; 2], translations: vec![[0.0; 3]; 2], betas: vec![0.0; 5], rate_hz: 60.0 };
        (model, motion, Placement::default())
    }

    #[test]
    fn who_is_turned_a_quarter_counter_clockwise_faces_the_radars_right() {
        // The file's +z faces the radar, −y; from above, −y turned counter-clockwise by a quarter is +x.
        let turned = Placement { origin_m: [1.0, 2.0, 3.0], ..Placement::default() }.turned(90.0);
        let faces: Vec<f64> = turned.radar_from_motion.iter().map(|row| row[2]).collect();
        assert!((faces[0] - 1.0).abs() < 1e-12 && faces[1].abs() < 1e-12 && faces[2].abs() < 1e-12, "{faces:?}");
        assert_eq!((turned.origin_m, turned.radar_from_motion[2]), ([1.0, 2.0, 3.0], [0.0, 1.0, 0.0]));
    }

    fn refused(change: impl FnOnce(&mut BodyModel, &mut Motion, &mut Placement)) -> String {
        let (mut model, mut motion, mut placement) = skinned();
        change(&mut model, &mut motion, &mut placement);
        Person::Skinned { model, motion, placement }.check().unwrap_err().to_string()
    }

    #[test]
    fn a_person_is_neither_as_large_as_a_galaxy_nor_turned_without_end() {
        let (model, motion, placement) = skinned();
        Person::Skinned { model, motion, placement }.check().unwrap();
        assert!(refused(|model, _, _| model.template[7][1] = 1e300).contains("the rest pose"));
        assert!(refused(|_, motion, _| motion.betas[0] = 1e9).contains("the rest pose"));
        assert!(refused(|model, _, _| model.joint_regressor[3][0].1 = 1e30).contains("joints (1) 1"));
        assert!(refused(|_, motion, _| motion.translations[1][2] = -1e6).contains("the translation of pose 1"));
        assert!(refused(|_, _, placement| placement.origin_m[1] = f64::NAN).contains("the placement's origin"));
        assert!(refused(|_, motion, _| motion.poses[1][4][0] = 1e7).contains("pose 1 turns joint 4"));
        let meshes = |far: f64| Person::Meshes {
            vertices: vec![vec![[0.0; 3]], vec![[far, 0.0, 0.0]]],
            faces: vec![],
            pose_times_s: vec![0.0, 1.0],
        };
        meshes(5.0).check().unwrap();
        assert!(meshes(1e300).check().unwrap_err().to_string().contains("pose 1 has a position of [1e300, 0.0, 0.0] m"));
    }
}
