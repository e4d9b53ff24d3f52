//! From the skeleton of a BVH file to poses of a body in SMPL layout.
//!
//! What is carried over is the orientation of every bone in space. The two rest poses differ (the file's legs may be
//! spread, say), so each limb first turns by the shortest way from the body's rest direction to the file's.

use std::{collections::BTreeMap, path::Path};

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use super::{
    bvh::{Bvh, BvhPose},
    joints,
};
use crate::error::{Error, Result};
use crate::person::{BodyModel, JOINT_NAMES, Motion};

type Point = Vector3<f64>;

/// The axis of a file that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    Y,
    Z,
}

/// What a BVH file does not say about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BvhConfig {
    /// Metres per unit of the file, exactly; absent: recognised from the length of the legs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale_m: Option<f64>,
    /// Absent: the direction from hips to neck in the rest pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub up: Option<UpAxis>,
    /// Names of the body's joints → names in the file, where the file uses others than the known dialects.
    pub joint_map: BTreeMap<String, String>,
    /// Instead of the file's frame time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_rate_hz: Option<f64>,
    /// Frames to leave out at the beginning, such as a T-pose.
    pub skip_frames: usize,
    /// Without `scale_m`: scales the path by the ratio of the legs, so that the feet of a taller body do not slide.
    pub fit_legs: bool,
    /// Shape of the body.
    pub betas: Vec<f64>,
}

impl Default for BvhConfig {
    fn default() -> Self {
        Self {
            scale_m: None,
            up: None,
            joint_map: BTreeMap::new(),
            frame_rate_hz: None,
            skip_frames: 0,
            fit_legs: true,
            betas: Vec::new(),
        }
    }
}

/// Units that BVH files come in: metres, centimetres, millimetres, inches, and CMU's (inches / 0.45).
const UNITS_M: [f64; 5] = [1.0, 0.01, 0.001, 0.0254, 0.0254 / 0.45];
/// Hip to ankle of anyone from a child of ten to a giant.
const LEGS_M: std::ops::RangeInclusive<f64> = 0.6..=1.15;

/// Limbs whose rest direction is aligned: joint, and the joint at the limb's end. Spine, collar bones, feet and hands
/// differ between skeletons by anatomy, not by pose, and follow their parents.
const LIMBS: [(usize, usize); 8] = [(1, 4), (2, 5), (4, 7), (5, 8), (16, 18), (17, 19), (18, 20), (19, 21)];

/// Chains that a file may divide further (two necks, a twisting forearm): start and end.
const CHAINS: [(usize, usize); 13] =
    [(1, 4), (2, 5), (4, 7), (5, 8), (16, 18), (17, 19), (18, 20), (19, 21), (3, 6), (6, 9), (9, 12), (12, 15), (0, 3)];

/// Reads a BVH file as a motion of `model`.
pub fn read_bvh_motion(path: &Path, model: &BodyModel, config: &BvhConfig) -> Result<Motion> {
    retarget(&Bvh::read(path)?, model, config)
}

/// The motion of `bvh` on `model`: y up, metres, at the file's frame rate.
pub fn retarget(bvh: &Bvh, model: &BodyModel, config: &BvhConfig) -> Result<Motion> {
    if model.joint_regressor.len() != JOINT_NAMES.len() {
        let found = format!("{} joints", model.joint_regressor.len());
        return Err(Error::setting("body", found, format!("the {} joints of SMPL for a BVH motion", JOINT_NAMES.len())));
    }
    if config.skip_frames >= bvh.frames.len() {
        let expected = format!("fewer than the {} frames of the file", bvh.frames.len());
        return Err(Error::setting("skip_frames", config.skip_frames, expected));
    }
    let rate_hz = rate(bvh, config)?;
    let assigned = joints::assign(bvh, config)?;
    let body: Vec<Point> = model.rest_joints(&config.betas).into_iter().map(Point::from).collect();
    let rest = bvh.rest();
    let file = |joint: usize| assigned[joint].map_or(Point::zeros(), |found| rest[found]);

    let file_from_body = alignment(&file, bvh)?;
    let y_up = match config.up.unwrap_or(if file_from_body[(2, 1)].abs() > 0.5 { UpAxis::Z } else { UpAxis::Y }) {
        UpAxis::Y => Rotation3::identity(),
        UpAxis::Z => Rotation3::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2),
    };
    let corrections = corrections(&body, &file, file_from_body, model);
    let scale = scale(bvh, config, &body, &file)?;
    let middle = (body[1] + body[2]) * 0.5 - body[0];

    // A joint's turn, and the turn of what lies between it and the end of its chain.
    let chain_turn = |joint: usize, found: usize, pose: &BvhPose| {
        let turn = pose.turns[found];
        let end = CHAINS.iter().find(|(start, _)| *start == joint).and_then(|&(_, end)| assigned[end]);
        end.map_or(turn, |end| arc(turn * (rest[end] - rest[found]), pose.places[end] - pose.places[found]) * turn)
    };

    let (mut poses, mut translations) = (Vec::new(), Vec::new());
    for frame in config.skip_frames..bvh.frames.len() {
        let pose = bvh.pose(frame);
        let mut turns: Vec<Rotation3<f64>> = Vec::new();
        let mut local = Vec::new();
        for joint in 0..body.len() {
            let parent = model.parents[joint].map_or(Rotation3::identity(), |parent| turns[parent]);
            let turn = assigned[joint].map_or(parent, |found| y_up * chain_turn(joint, found, &pose) * corrections[joint]);
            local.push((parent.inverse() * turn).scaled_axis().into());
            turns.push(turn);
        }
        // The hips carry the path: pelvis joints sit differently in different skeletons.
        let hips = [1, 2].map(|joint| assigned[joint].map_or(Point::zeros(), |found| pose.places[found]));
        let pelvis = y_up * (hips[0] + hips[1]) * (0.5 * scale) - turns[0] * middle;
        poses.push(local);
        translations.push((pelvis - body[0]).into());
    }
    Ok(Motion { poses, translations, betas: config.betas.clone(), rate_hz })
}

fn rate(bvh: &Bvh, config: &BvhConfig) -> Result<f64> {
    match config.frame_rate_hz {
        Some(rate) if rate.is_finite() && rate > 0.0 => Ok(rate),
        Some(rate) => Err(Error::setting("frame_rate_hz", rate, "frames per second above zero")),
        None => {
            // Frame times are written with few digits: 0.00833333 means 120 Hz.
            let rate = 1.0 / bvh.frame_time_s;
            Ok(if (rate / rate.round() - 1.0).abs() < 1e-4 { rate.round() } else { rate })
        }
    }
}

/// Metres on the body's path per unit of the file.
fn scale(bvh: &Bvh, config: &BvhConfig, body: &[Point], file: &impl Fn(usize) -> Point) -> Result<f64> {
    let leg = |place: &dyn Fn(usize) -> Point| (place(1) - place(4)).norm() + (place(4) - place(7)).norm();
    let (file_leg, body_leg) = (leg(&file), leg(&|joint| body[joint]));
    match config.scale_m {
        Some(scale) if scale.is_finite() && scale > 0.0 => return Ok(scale),
        Some(scale) => return Err(Error::setting("scale_m", scale, "metres per unit of the file, above zero")),
        None => {}
    }
    let unit = UNITS_M.into_iter().find(|unit| LEGS_M.contains(&(unit * file_leg))).ok_or_else(|| {
        let expected = "a person's in metres, centimetres, millimetres, inches or CMU units";
        Error::field(&bvh.source, "length of the legs", format!("{file_leg:.4} units"), expected)
            .with_hint("set scale_m, the metres per unit of the file")
    })?;
    Ok(if config.fit_legs { body_leg / file_leg } else { unit })
}

/// The turn from the body's axes (left, up, front) at rest to the file's.
fn alignment(file: &impl Fn(usize) -> Point, bvh: &Bvh) -> Result<Rotation3<f64>> {
    let (left, hips, neck) = (file(1) - file(2), (file(1) + file(2)) * 0.5, file(12));
    let (left, up) = (left.try_normalize(1e-9), (neck - hips).try_normalize(1e-9));
    let front = left.zip(up).and_then(|(left, up)| left.cross(&up).try_normalize(0.3));
    let (Some(left), Some(front)) = (left, front) else {
        return Err(Error::field(
            &bvh.source,
            "rest pose",
            "without a left and an up",
            "hips side by side and a neck above them",
        ));
    };
    let up = front.cross(&left);
    // Skeletons are built along the axes, only their anatomy is not: a leaning neck is no leaning person.
    let axis = |direction: Point| {
        let axis = direction.iamax();
        Point::from_fn(|row, _| if row == axis { direction[axis].signum() } else { 0.0 })
    };
    let matrix = |left: Point, up: Point| Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[left, up, left.cross(&up)]));
    let (exact, snapped) = (matrix(left, up), (axis(left), axis(up)));
    if snapped.0.dot(&snapped.1).abs() < 0.5 {
        let snapped = matrix(snapped.0, snapped.1);
        if snapped.angle_to(&exact).to_degrees() < 30.0 {
            return Ok(snapped);
        }
    }
    Ok(exact)
}

/// The shortest turn from one direction to another; none where there is no shortest one. (The one of nalgebra takes the
/// arc cosine of a rounded 1.)
fn arc(from: Point, to: Point) -> Rotation3<f64> {
    let axis = from.cross(&to);
    match axis.try_normalize(1e-12 * from.norm() * to.norm()) {
        Some(unit) => Rotation3::new(unit * axis.norm().atan2(from.dot(&to))),
        None => Rotation3::identity(),
    }
}

/// `[joint]`: the turn from the body's bone at rest to the file's.
fn corrections(
    body: &[Point],
    file: &impl Fn(usize) -> Point,
    file_from_body: Rotation3<f64>,
    model: &BodyModel,
) -> Vec<Rotation3<f64>> {
    let mut corrections: Vec<Rotation3<f64>> = Vec::new();
    for joint in 0..body.len() {
        let inherited = model.parents[joint].map_or(file_from_body, |parent| corrections[parent]);
        let limb = LIMBS.iter().find(|(start, _)| *start == joint);
        let aligned =
            limb.map(|&(start, end)| arc(file_from_body * (body[end] - body[start]), file(end) - file(start)) * file_from_body);
        corrections.push(aligned.unwrap_or(inherited));
    }
    corrections
}

#[cfg(test)]
#[path = "retarget_tests.rs"]
mod tests;
