//! What is predicted of the body: where its visible points are in every frame, and how they move.
//!
//! Positions are good to millimetres only (errors of the mesh belong to the baseline), which is a whole wavelength of
//! the round trip: the prediction is for delays, velocities, directions and powers, never for carrier phases.

mod echo;
mod track;

use rayon::prelude::*;

pub use echo::{Echo, SIDE_SPREAD, mirror_id, mirrored_return, range_and_velocity};
pub use track::Track;

use crate::body::{Interpolation, PosedBody, SurfaceConfig};
use crate::error::Result;
use crate::person::{JOINT_NAMES, Person};
use crate::radar::Radar;
use crate::scatterers::visibility::{DEFAULT_FLIP_EXPONENT, frame_visibility};

/// Frames beyond the last one that are predicted: as many as may be lost at once.
pub const BEYOND: usize = 6;

/// A visible point of the body in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Radar frame.
    pub position_m: [f64; 3],
    /// Radar frame.
    pub velocity_mps: [f64; 3],
    /// Unit, out of the body.
    pub normal: [f64; 3],
    /// Share of the surface that it stands for.
    pub area_m2: f64,
    /// Index into [`BodyPrediction::parts`].
    pub part: usize,
}

/// The middle of a part of the body, over its whole surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Centre {
    /// Radar frame.
    pub position_m: [f64; 3],
    /// Radar frame.
    pub velocity_mps: [f64; 3],
}

/// Visible points of every frame.
#[derive(Clone, Debug, Default)]
pub struct BodyPrediction {
    /// SMPL joint names; one nameless part for a sequence of meshes.
    pub parts: Vec<String>,
    /// `[frame][point]`
    pub frames: Vec<Vec<Point>>,
    /// Middle of every part, seen or not, `[frame][part]`; empty for a sequence of meshes.
    pub centres: Vec<Vec<Centre>>,
    /// Radar time of the middle of every frame.
    pub middle_s: Vec<f64>,
    /// How the points of every frame go on, `[frame]`; may be empty: then they go straight on.
    pub tracks: Vec<Track>,
    /// The frames that would follow, as far as the motion goes: a recording that lost some shows them.
    pub beyond: Vec<(Vec<Point>, Track)>,
    /// Ways by which replicas of it are seen.
    pub echoes: Vec<Echo>,
}

impl BodyPrediction {
    /// `starts_s`: when each frame begins; `radar`: with the loops of such a frame.
    ///
    /// # Errors
    /// A frame outside the motion, a body that cannot be posed.
    pub fn new(person: &Person, radar: &Radar, starts_s: &[f64]) -> Result<Self> {
        // Smooth between poses: with straight lines, velocities are those of the middle between two poses, which at frames
        // and poses in step is a constant error of the clock.
        let body = PosedBody::new(person, &SurfaceConfig::vertices(), Interpolation::Cubic)?;
        let (parts, of_vertex) = parts(person);
        let duration_s = radar.frame_duration_s();
        let period_s = period(starts_s).unwrap_or(duration_s);
        let (last_s, end_s) = (starts_s.last().copied().unwrap_or(0.0), body.span_s().1);
        let following = (1..=BEYOND).map(|step| last_s + step as f64 * period_s).filter(|start| start + duration_s <= end_s);
        let shown: Vec<f64> = starts_s.iter().copied().chain(following).collect();
        let mut made: Vec<(Vec<Point>, Vec<Centre>, f64, Track)> = shown
            .into_par_iter()
            .map(|start| {
                let frame = body.frame(&[start, start + duration_s])?;
                let seen = frame_visibility(&frame.vertices_m, &[], &[], radar.centre_m(), &[], DEFAULT_FLIP_EXPONENT).direct;
                let vertices: Vec<usize> = (0..frame.position_m.len()).filter(|&vertex| seen[vertex]).collect();
                let point = |&vertex: &usize| Point {
                    position_m: frame.position_m[vertex],
                    velocity_mps: frame.velocity_mps[vertex],
                    normal: frame.normal[vertex],
                    area_m2: frame.area_m2[vertex],
                    part: of_vertex.get(vertex).copied().unwrap_or(0),
                };
                let track = track(&body, &frame.position_m, &vertices, frame.middle_s, period_s)?;
                let centres = centres(&frame.position_m, &frame.velocity_mps, &of_vertex, parts.len());
                Ok((vertices.iter().map(point).collect(), centres, frame.middle_s, track))
            })
            .collect::<Result<_>>()?;
        let beyond = made.split_off(starts_s.len()).into_iter().map(|(points, _, _, track)| (points, track)).collect();
        let mut prediction =
            Self { parts, frames: vec![], centres: vec![], middle_s: vec![], tracks: vec![], beyond, echoes: vec![] };
        for (points, centres, middle_s, track) in made {
            prediction.frames.push(points);
            prediction.centres.push(centres);
            prediction.middle_s.push(middle_s);
            prediction.tracks.push(track);
        }
        Ok(prediction)
    }

    /// Points with what is seen of them by longer ways.
    pub fn with_echoes(&self, radar: &Radar, mut points: Vec<Point>, more: Option<Echo>) -> Vec<Point> {
        let replicas: Vec<Point> = self.echoes.iter().chain(&more).flat_map(|echo| echo.points(radar, &points)).collect();
        points.extend(replicas);
        points
    }

    /// How the points of a frame go on, of the recording's or beyond them.
    pub fn track(&self, frame: usize) -> Option<&Track> {
        self.tracks.get(frame).or_else(|| self.beyond.get(frame.checked_sub(self.frames.len())?).map(|(_, track)| track))
    }

    /// The points of a frame, of the recording's or beyond them, so much later in the motion, and whether that is known; if not,
    /// they go straight on. Visibility and orientation stay those of the frame.
    pub fn later(&self, frame: usize, later_s: f64) -> (Vec<Point>, bool) {
        let points = self.frames.get(frame).unwrap_or_else(|| &self.beyond[frame - self.frames.len()].0);
        match self.track(frame).filter(|track| track.knows(later_s)) {
            Some(track) => {
                let steps = track.steps(later_s);
                let moved = |(index, point): (usize, &Point)| {
                    let (position, velocity) = steps(index);
                    point.carried(position, velocity)
                };
                (points.iter().enumerate().map(moved).collect(), true)
            }
            None => {
                (points.iter().map(|point| point.carried(point.velocity_mps.map(|v| later_s * v), [0.0; 3])).collect(), false)
            }
        }
    }
}

impl Point {
    fn carried(&self, step_m: [f64; 3], change_mps: [f64; 3]) -> Self {
        Self {
            position_m: std::array::from_fn(|axis| self.position_m[axis] + step_m[axis]),
            velocity_mps: std::array::from_fn(|axis| self.velocity_mps[axis] + change_mps[axis]),
            ..*self
        }
    }
}

/// Median step between frames; None for less than two.
fn period(starts_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = starts_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    (!steps.is_empty()).then(|| super::statistics::median(&mut steps)).filter(|&period| period > 0.0)
}

/// Half a period to both sides, as far as the motion goes.
fn track(body: &PosedBody, middle_m: &[[f64; 3]], vertices: &[usize], middle_s: f64, period_s: f64) -> Result<Track> {
    let (first, last) = body.span_s();
    let mut times_s = vec![];
    let mut displacement_m = vec![];
    for quarter in -2..=2 {
        let later_s = 0.25 * f64::from(quarter) * period_s;
        let time = middle_s + later_s;
        if quarter == 0 {
            displacement_m.push(vec![[0.0; 3]; vertices.len()]);
        } else if time < first || time > last {
            continue;
        } else {
            let there = body.frame(&[time])?.position_m;
            let step = |&vertex: &usize| std::array::from_fn(|axis| (there[vertex][axis] - middle_m[vertex][axis]) as f32);
            displacement_m.push(vertices.iter().map(step).collect());
        }
        times_s.push(later_s);
    }
    Ok(Track::new(middle_s, times_s, displacement_m))
}

/// Means over the vertices of every part; none where no vertex is stated to belong to a part.
fn centres(position_m: &[[f64; 3]], velocity_mps: &[[f64; 3]], of_vertex: &[usize], parts: usize) -> Vec<Centre> {
    if of_vertex.len() != position_m.len() {
        return vec![];
    }
    let mut sums = vec![([0.0; 3], [0.0; 3], 0.0f64); parts];
    for ((position, velocity), &part) in position_m.iter().zip(velocity_mps).zip(of_vertex) {
        let (place, speed, count) = &mut sums[part];
        for axis in 0..3 {
            place[axis] += position[axis];
            speed[axis] += velocity[axis];
        }
        *count += 1.0;
    }
    let mean = |(place, speed, count): ([f64; 3], [f64; 3], f64)| Centre {
        position_m: place.map(|sum| sum / count.max(1.0)),
        velocity_mps: speed.map(|sum| sum / count.max(1.0)),
    };
    sums.into_iter().map(mean).collect()
}

/// The parts' names, and the part of every vertex: the joint that moves it most.
pub fn parts(person: &Person) -> (Vec<String>, Vec<usize>) {
    match person {
        Person::Skinned { model, .. } => {
            let most =
                |weights: &Vec<(usize, f64)>| weights.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |&(joint, _)| joint);
            let joints = model.parents.len();
            let names =
                (0..joints).map(|joint| JOINT_NAMES.get(joint).map_or_else(|| format!("joint_{joint}"), |&name| name.into()));
            (names.collect(), model.skinning.iter().map(most).collect())
        }
        Person::Meshes { .. } => (vec!["body".into()], vec![]),
    }
}
