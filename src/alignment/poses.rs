//! The motion as it is stated, ready to be shown at any time.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::place::{Pivot, Place};
use crate::body::{Interpolation, PosedBody, SurfaceConfig};
use crate::diagnosis::prediction::parts;
use crate::error::Result;
use crate::person::Person;

/// Vertices that are kept, evenly picked: their power is summed over cells of centimetres.
const MOST_VERTICES: usize = 1200;
/// Between poses that are kept; cubics through them are right to 0.1 mm at the accelerations of limbs (up to 100 m/s³ of jerk).
const STEP_S: f64 = 0.025;
/// Groups of parts that reflect with weights of their own.
pub const GROUPS: usize = 3;

/// Vertices at one time, radar frame.
#[derive(Clone, Debug, Default)]
pub struct Pose {
    /// `[vertex, xyz]`
    pub position_m: Vec<[f64; 3]>,
    pub velocity_mps: Vec<[f64; 3]>,
    /// Unit, out of the body.
    pub normal: Vec<[f64; 3]>,
    /// `[vertex]`, of the whole surface.
    pub area_m2: Vec<f64>,
}

/// Poses between two times.
pub struct Poses {
    first_s: f64,
    step_s: f64,
    poses: Vec<Pose>,
    /// `[vertex]`: 0 trunk and head, 1 arms, 2 legs.
    pub group: Vec<usize>,
}

impl Poses {
    /// Poses of a person between two radar times, as far as the motion goes; `None` where it has none there.
    ///
    /// # Errors
    /// A body that cannot be posed.
    pub fn new(person: &Person, from_s: f64, to_s: f64) -> Result<Option<Self>> {
        let surface = SurfaceConfig::vertices();
        // Smooth between poses, as the diagnosis has it: straight lines have the velocities of the middle between two poses.
        let body = PosedBody::new(person, &surface, Interpolation::Cubic)?;
        let (first, last) = body.span_s();
        let (from, to) = (from_s.max(first), to_s.min(last));
        if to <= from {
            return Ok(None);
        }
        let steps = ((to - from) / STEP_S).ceil().max(1.0);
        let step_s = (to - from) / steps;
        let poses: Vec<Pose> = (0..=steps as usize)
            .into_par_iter()
            .map(|step| Ok(kept(&body.frame(&[(from + step as f64 * step_s).min(to)])?)))
            .collect::<Result<_>>()?;
        let (names, of_vertex) = parts(person);
        let vertices = body.canonical_vertices().len();
        let group = picked(vertices).map(|vertex| of_vertex.get(vertex).map_or(0, |&part| group(&names[part]))).collect();
        Ok(Some(Self { first_s: from, step_s, poses, group }))
    }

    /// As stated at a radar time; none outside the motion.
    pub fn at(&self, time_s: f64) -> Option<Pose> {
        let (before, share) = self.around(time_s)?;
        let (a, b) = (&self.poses[before], &self.poses[before + 1]);
        let (s, step) = (share, self.step_s);
        // Cubic Hermite, and its derivative.
        let place = [(1.0 + 2.0 * s) * (1.0 - s).powi(2), s * (1.0 - s).powi(2), s * s * (3.0 - 2.0 * s), s * s * (s - 1.0)];
        let rate = [6.0 * s * (s - 1.0), (1.0 - s) * (1.0 - 3.0 * s), 6.0 * s * (1.0 - s), s * (3.0 * s - 2.0)];
        let blend = |vertex: usize, [p, m, q, n]: [f64; 4]| -> [f64; 3] {
            std::array::from_fn(|axis| {
                p * a.position_m[vertex][axis]
                    + m * step * a.velocity_mps[vertex][axis]
                    + q * b.position_m[vertex][axis]
                    + n * step * b.velocity_mps[vertex][axis]
            })
        };
        let vertices = 0..a.position_m.len();
        let normal = |vertex: usize| {
            let mixed = Vector3::from(a.normal[vertex]) * (1.0 - s) + Vector3::from(b.normal[vertex]) * s;
            mixed.try_normalize(1e-9).map_or(a.normal[vertex], Into::into)
        };
        Some(Pose {
            position_m: vertices.clone().map(|vertex| blend(vertex, place)).collect(),
            velocity_mps: vertices.clone().map(|vertex| blend(vertex, rate).map(|change| change / step)).collect(),
            normal: vertices.map(normal).collect(),
            area_m2: if s < 0.5 { a.area_m2.clone() } else { b.area_m2.clone() },
        })
    }

    /// The interval around a time, and how far in it.
    fn around(&self, time_s: f64) -> Option<(usize, f64)> {
        let place = (time_s - self.first_s) / self.step_s;
        let intervals = self.poses.len() - 1;
        if !(-1e-6..=intervals as f64 + 1e-6).contains(&place) {
            return None;
        }
        let before = (place.floor().max(0.0) as usize).min(intervals - 1);
        Some((before, (place - before as f64).clamp(0.0, 1.0)))
    }

    /// Whether the motion goes there.
    pub fn knows(&self, time_s: f64) -> bool {
        self.around(time_s).is_some()
    }

    /// Mean over the vertices and some times; of the nearest pose where the motion knows none of them.
    pub fn middle_m(&self, times_s: &[f64]) -> [f64; 3] {
        let mean = |positions: &[[f64; 3]]| -> Vector3<f64> {
            positions.iter().map(|&place| Vector3::from(place)).sum::<Vector3<f64>>() / positions.len().max(1) as f64
        };
        let known: Vec<Vector3<f64>> =
            times_s.iter().filter_map(|&time| self.at(time)).map(|pose| mean(&pose.position_m)).collect();
        if known.is_empty() {
            let early = times_s.first().is_some_and(|&time| time < self.first_s);
            let nearest = if early { self.poses.first() } else { self.poses.last() };
            return nearest.map_or([0.0; 3], |pose| mean(&pose.position_m).into());
        }
        (known.iter().sum::<Vector3<f64>>() / known.len() as f64).into()
    }
}

impl Pose {
    /// As it is at a place.
    pub fn placed(mut self, pivot: &Pivot, place: &Place) -> Self {
        let correction = pivot.correction(place);
        let (sine, cosine) = correction.heading_rad.sin_cos();
        let turned = |[x, y, z]: [f64; 3]| [cosine * x - sine * y, sine * x + cosine * y, z];
        for position in &mut self.position_m {
            let about = turned(std::array::from_fn(|axis| position[axis] - correction.pivot_m[axis]));
            *position = std::array::from_fn(|axis| about[axis] + correction.pivot_m[axis] + correction.shift_m[axis]);
        }
        self.velocity_mps.iter_mut().chain(&mut self.normal).for_each(|vector| *vector = turned(*vector));
        self
    }
}

fn picked(vertices: usize) -> impl Iterator<Item = usize> {
    let kept = vertices.min(MOST_VERTICES);
    (0..kept).map(move |index| index * vertices / kept)
}

fn kept(frame: &crate::body::BodyFrame) -> Pose {
    let picked: Vec<usize> = picked(frame.position_m.len()).collect();
    let pick = |values: &[[f64; 3]]| picked.iter().map(|&vertex| values[vertex]).collect();
    let all: f64 = frame.area_m2.iter().sum();
    let some: f64 = picked.iter().map(|&vertex| frame.area_m2[vertex]).sum();
    Pose {
        position_m: pick(&frame.position_m),
        velocity_mps: pick(&frame.velocity_mps),
        normal: pick(&frame.normal),
        area_m2: picked.iter().map(|&vertex| frame.area_m2[vertex] * all / some.max(1e-9)).collect(),
    }
}

fn group(joint: &str) -> usize {
    let is = |names: &[&str]| names.iter().any(|name| joint.ends_with(name));
    match joint {
        _ if is(&["shoulder", "elbow", "wrist", "hand"]) => 1,
        _ if is(&["_hip", "knee", "ankle", "foot"]) => 2,
        _ => 0,
    }
}
