//! What is predicted of the body: where its visible points are in every frame, and how they move.
//!
//! Positions are good to millimetres only (errors of the mesh belong to the baseline), which is a whole wavelength of
//! the round trip: the prediction is for delays, velocities, directions and powers, never for carrier phases.

use crate::body::{Interpolation, PosedBody, Sampling, SurfaceConfig};
use crate::error::Result;
use crate::person::{JOINT_NAMES, Person};
use crate::radar::Radar;
use crate::scatterers::visibility::{DEFAULT_FLIP_EXPONENT, frame_visibility};

/// A visible point of the body in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Radar frame.
    pub position_m: [f64; 3],
    pub velocity_mps: [f64; 3],
    /// Unit, out of the body.
    pub normal: [f64; 3],
    /// Share of the surface that it stands for.
    pub area_m2: f64,
    /// Index into [`BodyPrediction::parts`].
    pub part: usize,
}

/// Visible points of every frame.
#[derive(Clone, Debug)]
pub struct BodyPrediction {
    /// SMPL joint names; one nameless part for a sequence of meshes.
    pub parts: Vec<String>,
    /// `[frame][point]`
    pub frames: Vec<Vec<Point>>,
    /// Radar time of the middle of every frame.
    pub middle_s: Vec<f64>,
}

impl BodyPrediction {
    /// `starts_s`: when each frame begins; `radar`: with the loops of such a frame.
    ///
    /// # Errors
    /// A frame outside the motion, a body that cannot be posed.
    pub fn new(person: &Person, radar: &Radar, starts_s: &[f64]) -> Result<Self> {
        // Straight lines between poses: a velocity within a frame is all that is needed.
        let body = PosedBody::new(
            person,
            &SurfaceConfig { sampling: Sampling::Vertices, ..SurfaceConfig::default() },
            Interpolation::Linear,
        )?;
        let (parts, of_vertex) = parts(person);
        let duration_s = radar.frame_duration_s();
        let mut middle_s = vec![];
        let mut frames = vec![];
        for &start in starts_s {
            let frame = body.frame(&[start, start + duration_s])?;
            let seen = frame_visibility(&frame.vertices_m, &[], &[], radar.centre_m(), &[], DEFAULT_FLIP_EXPONENT).direct;
            let points = (0..frame.position_m.len()).filter(|&vertex| seen[vertex]).map(|vertex| Point {
                position_m: frame.position_m[vertex],
                velocity_mps: frame.velocity_mps[vertex],
                normal: frame.normal[vertex],
                area_m2: frame.area_m2[vertex],
                part: of_vertex.get(vertex).copied().unwrap_or(0),
            });
            frames.push(points.collect());
            middle_s.push(frame.middle_s);
        }
        Ok(Self { parts, frames, middle_s })
    }
}

/// The parts' names, and the part of every vertex: the joint that moves it most.
fn parts(person: &Person) -> (Vec<String>, Vec<usize>) {
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
