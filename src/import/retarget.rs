//! From the skeleton of a BVH file to poses of a body in SMPL layout.
//!
//! What is carried over is the orientation of every bone in space. How the axes of the file's joints lie in a person who
//! stands is found once (`neutral`); all rotations are unit quaternions, exact at no turn and at half a turn.

use std::path::Path;

use nalgebra::{UnitQuaternion, Vector3};

use super::{
    bvh::{Bvh, BvhPose},
    bvh_config::BvhConfig,
    joints,
    neutral::{self, Neutral, Skeleton, arc},
};
use crate::data::{Figure, UpAxis, find_up};
use crate::error::{Error, Result};
use crate::person::{BodyModel, JOINT_NAMES, Motion};

type Point = Vector3<f64>;

/// Units that BVH files come in: metres, centimetres, millimetres, inches, and CMU's (inches / 0.45).
const UNITS_M: [(f64, &str); 5] = [
    (1.0, "metres"),
    (0.01, "centimetres"),
    (0.001, "millimetres"),
    (0.0254, "inches"),
    (0.0254 / 0.45, "CMU units (inches / 0.45)"),
];
/// Hip to ankle of anyone from a child of ten to a giant.
const LEGS_M: std::ops::RangeInclusive<f64> = 0.6..=1.15;

/// Frames that up, front and twist are found from: evenly spread over the file.
const LOOKED_AT: usize = 1000;

/// Rates that cameras and motion capture run at; a rounded frame time means one of them.
const RATES_HZ: [f64; 13] = [24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 72.0, 90.0, 100.0, 120.0, 200.0, 240.0, 250.0];

/// Reads a BVH file as a motion of `model`, and notes of what was assumed.
pub fn read_bvh_motion(path: &Path, model: &BodyModel, config: &BvhConfig) -> Result<(Motion, Vec<String>)> {
    retarget(&Bvh::read(path)?, model, config)
}

/// The motion of `bvh` on `model`: y up, metres, at the file's frame rate; and what was assumed, a line each.
///
/// The body has the joints of SMPL, SMPL-H or SMPL-X; what it has beyond SMPL's first 22 (fingers, jaw, eyes) rests.
pub fn retarget(bvh: &Bvh, model: &BodyModel, config: &BvhConfig) -> Result<(Motion, Vec<String>)> {
    check(bvh, model, config)?;
    let mut notes = Vec::new();
    let rate_hz = rate(bvh, config, &mut notes)?;
    let assigned = joints::assign(bvh, config)?;
    notes.push(assigned.note);
    let skeleton = Skeleton { bvh, joints: &assigned.joints, rest: bvh.rest() };
    let mut body: Vec<Point> = model.rest_joints(&config.betas).into_iter().map(Point::from).collect();
    // Beyond these, SMPL has hands, SMPL-H fingers and SMPL-X a jaw.
    body.truncate(if body.len() == JOINT_NAMES.len() { body.len() } else { 22 });

    let frames = bvh.frames.len() - config.skip_frames;
    let looked_at = (config.skip_frames..bvh.frames.len()).step_by(frames.div_ceil(LOOKED_AT));
    let poses: Vec<BvhPose> = looked_at.map(|frame| bvh.pose(frame)).collect();
    let up = up_axis(&skeleton, &poses, config, &mut notes);
    let neutral = neutral::find(&skeleton, &body, model, &poses, up.direction())?;
    notes.extend(neutral.note.clone());
    let scale = scale(&skeleton, &poses, config, &body)?;

    let middle = (body[1] + body[2]) * 0.5 - body[0];
    let (mut placed, mut translations) = (Vec::new(), Vec::new());
    for frame in config.skip_frames..bvh.frames.len() {
        let pose = bvh.pose(frame);
        let turns = turns(&skeleton, &neutral, &pose, model, up.to_y());
        // The hips carry the path: pelvis joints sit differently in different skeletons.
        let hips = [1, 2].map(|joint| skeleton.place(joint, &pose).unwrap_or_default());
        let pelvis = up.to_y() * (hips[0] + hips[1]) * (0.5 * scale.path_m) - turns[0] * middle;
        let local = |joint: usize| -> [f64; 3] {
            let above = model.parents[joint].map_or(UnitQuaternion::identity(), |parent| turns[parent]);
            (above.inverse() * turns[joint]).scaled_axis().into()
        };
        let mut pose: Vec<[f64; 3]> = (0..body.len()).map(local).collect();
        pose.resize(model.parents.len(), [0.0; 3]);
        placed.push(pose);
        translations.push((pelvis - body[0]).into());
    }
    let motion = Motion { poses: placed, translations, betas: config.betas.clone(), rate_hz };
    notes.extend(scale.notes(&motion));
    finite(&motion)?;
    Ok((motion, notes))
}

fn check(bvh: &Bvh, model: &BodyModel, config: &BvhConfig) -> Result<()> {
    if ![24, 52, 55].contains(&model.parents.len()) {
        let found = format!("{} joints", model.parents.len());
        return Err(Error::setting("body", found, "the joints of SMPL (24), SMPL-H (52) or SMPL-X (55) for a BVH motion"));
    }
    if config.skip_frames >= bvh.frames.len() {
        let expected = format!("fewer than the {} frames of the file", bvh.frames.len());
        return Err(Error::setting("skip_frames", config.skip_frames, expected));
    }
    Ok(())
}

/// What comes out of finite numbers is finite; if not, it is a mistake here and not in the file.
fn finite(motion: &Motion) -> Result<()> {
    let finite = |pose: &Vec<[f64; 3]>| pose.iter().flatten().all(|value| value.is_finite());
    match motion.poses.iter().position(|pose| !finite(pose)) {
        Some(step) => Err(Error::NonFinite { stage: "retargeting".into(), step }),
        None => Ok(()),
    }
}

/// The turn of every joint in space, y up.
fn turns(
    skeleton: &Skeleton,
    neutral: &Neutral,
    pose: &BvhPose,
    model: &BodyModel,
    y_up: UnitQuaternion<f64>,
) -> Vec<UnitQuaternion<f64>> {
    let mut turns: Vec<UnitQuaternion<f64>> = Vec::new();
    for joint in 0..neutral.turns.len() {
        let above = model.parents[joint].map_or(UnitQuaternion::identity(), |parent| turns[parent]);
        // A joint's turn, and the turn of what lies between it and the end of its chain.
        let turn = |found: usize| {
            let turn = pose.turns[found];
            let end = neutral::CHAINS.iter().find(|(start, _)| *start == joint).and_then(|&(_, end)| skeleton.place(end, pose));
            let along = neutral.bones[joint].zip(end);
            along.map_or(turn, |(bone, end)| arc(turn * bone, end - pose.places[found]) * turn)
        };
        turns.push(skeleton.joints[joint].map_or(above, |found| y_up * turn(found) * neutral.turns[joint]));
    }
    turns
}

fn up_axis(skeleton: &Skeleton, poses: &[BvhPose], config: &BvhConfig, notes: &mut Vec<String>) -> UpAxis {
    if let Some(up) = config.up {
        return up;
    }
    let figure = |pose: &BvhPose| {
        let place = |joint: usize| skeleton.place(joint, pose).unwrap_or_default();
        let joints = skeleton.joints.iter().flatten().map(|&found| pose.places[found]).collect();
        Figure { head: place(12), feet: (place(7) + place(8)) * 0.5, joints }
    };
    let figures: Vec<Figure> = poses.iter().map(figure).collect();
    let expected = skeleton.standing().map_or(UpAxis::Y, |turn| UpAxis::nearest(turn * Point::y()));
    let (up, why) = find_up(&figures, expected);
    notes.push(format!("up axis: {up} ({why}); `up` names another"));
    up
}

/// The frame rate, and what is likely where the frame time is rounded.
fn rate(bvh: &Bvh, config: &BvhConfig, notes: &mut Vec<String>) -> Result<f64> {
    match config.frame_rate_hz {
        Some(rate) if rate.is_finite() && rate > 0.0 => return Ok(rate),
        Some(rate) => return Err(Error::setting("frame_rate_hz", rate, "frames per second above zero")),
        None => {}
    }
    let (time, half_digit) = (bvh.frame_time_s, 0.5 * bvh.frame_time_step_s);
    // Frame times are written with few digits: 0.00833333 means 120 Hz.
    let rate = 1.0 / time;
    let rate = if (rate / rate.round() - 1.0).abs() < 1e-4 { rate.round() } else { rate };
    let is = |known: &f64| (known / rate - 1.0).abs() <= 1e-4;
    let means = |likely: &f64| (1.0 / likely - time).abs() <= half_digit;
    let nearest = RATES_HZ.into_iter().filter(means).min_by(|a, b| (a - rate).abs().total_cmp(&(b - rate).abs()));
    let nearest = nearest.filter(|nearest| !is(nearest));
    let rounded = nearest.map_or(String::new(), |likely| {
        format!(", a rounded number: {likely} Hz is likely, `frame_rate_hz = {likely:.1}` says so")
    });
    notes.push(format!("frame rate: {} Hz (frame time {time} s{rounded})", (rate * 1e3).round() / 1e3));
    Ok(rate)
}

/// How far the body goes for a unit of the file.
struct Scale {
    /// Metres on the body's path per unit of the file.
    path_m: f64,
    /// Metres per unit of the file, as it is meant.
    unit_m: f64,
    note: String,
    file_leg_m: f64,
    body_leg_m: f64,
}

impl Scale {
    fn notes(&self, motion: &Motion) -> Vec<String> {
        let mut notes = vec![self.note.clone()];
        let ratio = self.path_m / self.unit_m;
        if (ratio - 1.0).abs() > 1e-3 {
            let speed = mean_speed_mps(motion);
            notes.push(format!(
                "path: legs of {:.3} m in the file and {:.3} m in the body, so fit_legs makes the path {ratio:.3} times as \
                 long: a mean speed of {:.2} m/s becomes {speed:.2} m/s; `fit_legs = false` keeps it",
                self.file_leg_m,
                self.body_leg_m,
                speed / ratio
            ));
        }
        notes
    }
}

/// Along the path of the pelvis, metres per second.
fn mean_speed_mps(motion: &Motion) -> f64 {
    let steps = motion.translations.windows(2).map(|pair| (Point::from(pair[1]) - Point::from(pair[0])).norm());
    let count = motion.translations.len().saturating_sub(1).max(1) as f64;
    steps.sum::<f64>() * motion.rate_hz / count
}

fn scale(skeleton: &Skeleton, poses: &[BvhPose], config: &BvhConfig, body: &[Point]) -> Result<Scale> {
    let leg = |place: &dyn Fn(usize) -> Point| (place(1) - place(4)).norm() + (place(4) - place(7)).norm();
    // Of the poses: in some files the offsets say nothing and position channels everything.
    let in_pose = |pose: &BvhPose| leg(&|joint| skeleton.place(joint, pose).unwrap_or_default());
    let file_leg = poses.iter().map(in_pose).sum::<f64>() / poses.len() as f64;
    let body_leg_m = leg(&|joint| body[joint]);
    match config.scale_m {
        Some(scale) if scale.is_finite() && scale > 0.0 => {
            let note = format!("units: {scale} m, by scale_m");
            return Ok(Scale { path_m: scale, unit_m: scale, note, file_leg_m: scale * file_leg, body_leg_m });
        }
        Some(scale) => return Err(Error::setting("scale_m", scale, "metres per unit of the file, above zero")),
        None => {}
    }
    let (unit_m, name) = UNITS_M.into_iter().find(|(unit, _)| LEGS_M.contains(&(unit * file_leg))).ok_or_else(|| {
        let expected = "a person's in metres, centimetres, millimetres, inches or CMU units";
        Error::field(&skeleton.bvh.source, "length of the legs", format!("{file_leg:.4} units"), expected)
            .with_hint("set scale_m, the metres per unit of the file")
    })?;
    let file_leg_m = unit_m * file_leg;
    let note = format!("units: {name} (legs of {file_leg:.4} units are {file_leg_m:.3} m); `scale_m` names another");
    let path_m = if config.fit_legs { body_leg_m / file_leg } else { unit_m };
    Ok(Scale { path_m, unit_m, note, file_leg_m, body_leg_m })
}

#[cfg(test)]
#[path = "retarget_tests.rs"]
mod tests;
