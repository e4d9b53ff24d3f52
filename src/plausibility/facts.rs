//! What the checks look at: the settings, the body, and the course of its motion seen at moments close enough together.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::CodeFacts;
use crate::person::{Motion, Person, Placement, mesh};
use crate::radar::Radar;
use crate::room::Room;

/// Moments of a motion that are looked at, per second: a walker moves 10 cm between them.
const LOOKS_HZ: f64 = 15.0;
/// And at most: a minute of them. Longer motions are looked at less often.
const MOST_LOOKS: usize = 900;
/// Joints of SMPL, in all its sizes: the root, and the head at the other end of the trunk.
const TRUNK: [usize; 2] = [0, 15];
/// Numbers of joints of SMPL without hands, SMPL, SMPL-H and SMPL-X.
const SMPL_JOINTS: [usize; 4] = [22, 24, 52, 55];

type Point = [f64; 3];

/// A scene as far as it is known. What is absent is not checked.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    pub radar: Option<Radar>,
    pub room: Option<Room>,
    pub codes: Option<CodeFacts>,
    pub body: Option<BodyFacts>,
    pub motion: Option<Motion>,
    pub placement: Option<Placement>,
    pub root: Option<RootPath>,
    /// Between two poses of the whole motion, median, where it has more than two.
    pub pose_interval_s: Option<f64>,
    pub course: Option<Course>,
    /// The user keeps his word: a refusal does not keep later checks from looking.
    pub as_stated: bool,
}

/// The body itself.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyFacts {
    /// Largest side of the box around it, metres: of the rest pose, or the least and the largest of a sequence of meshes.
    pub length_m: [f64; 2],
    /// Signed volume, cubic metres: positive when the faces look outwards.
    pub volume_m3: f64,
    /// Why the mesh is no closed surface, if it is none.
    pub open: Option<String>,
    /// Whether it is a sequence of meshes, not a skinned body.
    pub meshes: bool,
    /// Of a sequence of meshes: cosine between z and the axis along which the surface is longest, in the median pose. Which end is
    /// the head is not known: 0 to 1.
    pub longest_along_z: Option<f64>,
}

/// The way of the root, pose by pose.
#[derive(Clone, Debug, PartialEq)]
pub struct RootPath {
    pub times_s: Vec<f64>,
    /// Radar frame, metres; of meshes, the mean of the vertices.
    pub positions_m: Vec<Point>,
}

/// The body at one moment, radar frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    pub time_s: f64,
    /// Corners of the box around it, metres.
    pub low_m: Point,
    pub high_m: Point,
    /// From the radar to the nearest and the farthest vertex, metres.
    pub nearest_m: f64,
    pub farthest_m: f64,
    /// Whether the radar is inside the body.
    pub encloses_radar: bool,
    /// Cosine between pelvis to head and up; absent for meshes, whose joints nobody knows.
    pub upright: Option<f64>,
    /// Of the fastest vertex until the next pose, m/s: in all, and along the line of sight. Absent at the last pose.
    pub speed_mps: Option<[f64; 2]>,
}

/// The motion, moment by moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Course {
    pub looks: Vec<Look>,
}

impl Facts {
    /// Of a person in front of a radar. `pose` gives the mesh of one pose, `[vertex, xyz]`, metres, in the radar frame; whoever
    /// asks brings the skinning.
    pub fn new(
        radar: Option<&Radar>,
        room: Option<&Room>,
        person: Option<&Person>,
        pose: &(dyn Fn(usize) -> Vec<Point> + Sync),
    ) -> Self {
        let mut facts = Self { radar: radar.cloned(), room: room.cloned(), ..Self::default() };
        let Some(person) = person else { return facts };
        facts.body = Some(BodyFacts::new(person));
        if let Person::Skinned { motion, placement, .. } = person {
            facts.motion = Some(motion.clone());
            facts.placement = Some(placement.clone());
        }
        let times_s = person.pose_times_s();
        facts.pose_interval_s = interval_s(&times_s);
        let poses = poses_of_frames(&times_s, radar);
        facts.root = Some(RootPath::new(person, &times_s, poses.clone()));
        facts.course = Some(Course::new(person, &times_s, poses, radar.map_or([0.0; 3], Radar::centre_m), pose));
        facts
    }

    /// Of the fastest part of the body along the line of sight, where somebody is there.
    pub fn fastest_radial_mps(&self) -> Option<f64> {
        let looks = self.course.iter().flat_map(|course| &course.looks);
        looks.filter_map(|look| Some(look.speed_mps?[1])).reduce(f64::max)
    }
}

/// Median step of more than two times.
fn interval_s(times_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().filter(|_| steps.len() > 1)
}

/// The poses that the radar's frames need; all without a radar.
fn poses_of_frames(times_s: &[f64], radar: Option<&Radar>) -> std::ops::Range<usize> {
    let Some(radar) = radar else { return 0..times_s.len() };
    let end_s = (radar.frames.max(1) - 1) as f64 * radar.frame_period_s + radar.frame_duration_s();
    let first = times_s.partition_point(|&time| time <= 0.0).saturating_sub(1);
    let last = (times_s.partition_point(|&time| time < end_s) + 1).min(times_s.len());
    first..last.max(first)
}

impl BodyFacts {
    fn new(person: &Person) -> Self {
        match person {
            Person::Skinned { model, motion, .. } => Self::of_mesh(&model.shaped(&motion.betas), &model.faces),
            Person::Meshes { vertices, faces, .. } => Self::of_meshes(vertices, faces),
        }
    }

    /// Of a body in its rest pose.
    pub fn of_mesh(vertices: &[Point], faces: &[[usize; 3]]) -> Self {
        let length = longest(vertices);
        // About the middle, so that what is missing of an open mesh counts little.
        let count = vertices.len().max(1) as f64;
        let middle: Point = std::array::from_fn(|axis| vertices.iter().map(|vertex| vertex[axis]).sum::<f64>() / count);
        let about: Vec<Point> = vertices.iter().map(|vertex| minus(*vertex, middle)).collect();
        Self {
            length_m: [length; 2],
            volume_m3: mesh::volume(&about, faces),
            open: mesh::check_closed(vertices.len(), faces).err(),
            meshes: false,
            longest_along_z: None,
        }
    }

    /// Of a sequence of meshes, `[pose][vertex]`.
    pub fn of_meshes(vertices: &[Vec<Point>], faces: &[[usize; 3]]) -> Self {
        let lengths = vertices.iter().map(|mesh| longest(mesh));
        let [least, most] =
            lengths.fold([f64::INFINITY, 0.0], |[least, most], length| [least.min(length), f64::max(most, length)]);
        let first = vertices.first().map_or(&[][..], Vec::as_slice);
        let mut along_z: Vec<f64> = vertices.par_iter().filter_map(|mesh| longest_along_z(mesh, faces)).collect();
        along_z.sort_by(f64::total_cmp);
        let longest_along_z = along_z.get(along_z.len() / 2).copied();
        Self { length_m: [least, most], meshes: true, longest_along_z, ..Self::of_mesh(first, faces) }
    }
}

impl RootPath {
    fn new(person: &Person, times_s: &[f64], poses: std::ops::Range<usize>) -> Self {
        let positions_m = match person {
            Person::Skinned { motion, placement, .. } => {
                let root = motion.translations[poses.clone()].iter();
                root.map(|&translation| placed(placement, translation)).collect()
            }
            Person::Meshes { vertices, .. } => vertices[poses.clone()].iter().map(|mesh| mean(mesh)).collect(),
        };
        Self { times_s: times_s[poses].to_vec(), positions_m }
    }
}

impl Course {
    fn new(
        person: &Person,
        times_s: &[f64],
        poses: std::ops::Range<usize>,
        radar_m: Point,
        pose: &(dyn Fn(usize) -> Vec<Point> + Sync),
    ) -> Self {
        let looked: Vec<usize> = moments(&times_s[poses.clone()]).into_iter().map(|moment| poses.start + moment).collect();
        let look = |&at: &usize| {
            let vertices = pose(at);
            let next = (at + 1 < poses.end).then(|| (pose(at + 1), times_s[at + 1] - times_s[at]));
            Look::new(person, times_s[at], &vertices, next, radar_m)
        };
        Self { looks: looked.par_iter().map(look).collect() }
    }
}

/// Which of the poses are looked at: the first, the last, and those between that keep the distance.
fn moments(times_s: &[f64]) -> Vec<usize> {
    let [first, .., last] = times_s else { return (0..times_s.len()).collect() };
    let apart_s = (1.0 / LOOKS_HZ).max((last - first) / MOST_LOOKS as f64);
    let mut moments = vec![0];
    let mut latest = *first;
    for (pose, &time) in times_s.iter().enumerate().skip(1) {
        if time - latest > apart_s * (1.0 - 1e-9) || pose + 1 == times_s.len() {
            moments.push(pose);
            latest = time;
        }
    }
    moments
}

impl Look {
    fn new(person: &Person, time_s: f64, vertices: &[Point], next: Option<(Vec<Point>, f64)>, radar_m: Point) -> Self {
        let (low_m, high_m) = extent(vertices);
        let ranges = || vertices.iter().map(|vertex| norm(minus(*vertex, radar_m)));
        let boxed = (0..3).all(|axis| (low_m[axis]..=high_m[axis]).contains(&radar_m[axis]));
        Self {
            time_s,
            low_m,
            high_m,
            nearest_m: ranges().fold(f64::INFINITY, f64::min),
            farthest_m: ranges().fold(0.0, f64::max),
            encloses_radar: boxed && winding_number(vertices, person.faces(), radar_m).abs() > 0.5,
            upright: upright(person, vertices),
            speed_mps: next.map(|(later, after_s)| fastest(vertices, &later, after_s, radar_m)),
        }
    }
}

/// Cosine between z and the first principal axis of a surface.
fn longest_along_z(vertices: &[Point], faces: &[[usize; 3]]) -> Option<f64> {
    let origin = Vector3::from(vertices[faces.first()?[0]]);
    let (mut whole, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for face in faces {
        let [a, b, c] = face.map(|vertex| Vector3::from(vertices[vertex]) - origin);
        let area = (b - a).cross(&(c - a)).norm() / 2.0;
        let sum = a + b + c;
        whole += area;
        first += sum * (area / 3.0);
        // Of a triangle: A/12 · (Σ vvᵀ + (Σ v)(Σ v)ᵀ).
        second += [a, b, c, sum].iter().map(|v| v * v.transpose()).sum::<Matrix3<f64>>() * (area / 12.0);
    }
    let spread = second - first * first.transpose() / whole;
    if !(whole > 0.0 && spread.iter().all(|value| value.is_finite())) {
        return None;
    }
    let axes = spread.symmetric_eigen();
    Some(axes.eigenvectors[(2, axes.eigenvalues.imax())].abs())
}

/// Cosine between pelvis to head and up, of a body with SMPL's joints.
fn upright(person: &Person, vertices: &[Point]) -> Option<f64> {
    let Person::Skinned { model, .. } = person else { return None };
    if !SMPL_JOINTS.contains(&model.parents.len()) {
        return None;
    }
    let [pelvis, head] = TRUNK.map(|joint| {
        let regressor = model.joint_regressor.get(joint)?;
        Some(regressor.iter().fold([0.0; 3], |sum, &(vertex, weight)| plus(sum, vertices[vertex].map(|x| x * weight))))
    });
    let trunk = minus(head?, pelvis?);
    let length = norm(trunk);
    (length > 0.0).then(|| trunk[2] / length)
}

/// Speed of the fastest vertex, and of the one that changes its range most, m/s.
fn fastest(now: &[Point], later: &[Point], after_s: f64, radar_m: Point) -> [f64; 2] {
    now.iter().zip(later).fold([0.0, 0.0], |[speed, radial], (&from, &to)| {
        let range = norm(minus(to, radar_m)) - norm(minus(from, radar_m));
        [f64::max(speed, norm(minus(to, from)) / after_s), f64::max(radial, range.abs() / after_s)]
    })
}

/// How often the surface goes around a point: ±1 inside of a closed surface, 0 outside (Jacobson et al. 2013, "Robust
/// inside-outside segmentation using generalized winding numbers"; solid angle by Van Oosterom and Strackee 1983).
fn winding_number(vertices: &[Point], faces: &[[usize; 3]], point: Point) -> f64 {
    let solid_angle = |face: &[usize; 3]| {
        let [a, b, c] = face.map(|vertex| Vector3::from(minus(vertices[vertex], point)));
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        2.0 * a.dot(&b.cross(&c)).atan2(la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb)
    };
    faces.iter().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Corners of the box around points.
pub(super) fn extent(vertices: &[Point]) -> (Point, Point) {
    vertices.iter().fold(([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]), |(low, high), vertex| {
        (
            std::array::from_fn(|axis| f64::min(low[axis], vertex[axis])),
            std::array::from_fn(|axis| f64::max(high[axis], vertex[axis])),
        )
    })
}

fn longest(vertices: &[Point]) -> f64 {
    let (low, high) = extent(vertices);
    minus(high, low).into_iter().fold(0.0, f64::max)
}

fn placed(placement: &Placement, point: Point) -> Point {
    std::array::from_fn(|axis| {
        let row = placement.radar_from_motion[axis];
        (0..3).map(|column| row[column] * point[column]).sum::<f64>() + placement.origin_m[axis]
    })
}

fn mean(points: &[Point]) -> Point {
    let count = points.len().max(1) as f64;
    std::array::from_fn(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / count)
}

fn plus(a: Point, b: Point) -> Point {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

pub(super) fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

pub(super) fn norm(a: Point) -> f64 {
    a[0].hypot(a[1]).hypot(a[2])
}
