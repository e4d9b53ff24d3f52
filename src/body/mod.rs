//! The person as moving scatterers: which points the surface has, and where each of them is at every chirp.
//!
//! Precision: a frame's positions are computed on the host in f64, and the device receives only the *displacement*
//! of each point from where it is in the middle of the frame, a few centimetres, in which f32 is exact to 1e-8 m.

pub mod correction;
pub mod facets;
pub mod kinematics;
pub mod motion;
pub mod posing;
pub mod skinning;
pub mod surface;
mod surface_config;
pub mod tensors;

mod attitude;
mod frame;
#[cfg(test)]
mod golden;
#[cfg(test)]
pub(crate) mod test_bodies;

use std::ops::Range;

use burn::tensor::{DType, Device, Tensor};

pub use correction::{PoseCorrection, PoseTensors};
pub use facets::{FacetEdges, facet_integral};
pub use frame::BodyFrame;
pub use motion::Interpolation;
pub use posing::PosedFrame;
pub use surface::Surface;
pub use surface_config::{Posing, Sampling, SurfaceConfig};

use kinematics::{Matrix, Vector};
use posing::DeviceBodies;
use skinning::SkinnedBody;

use crate::error::{Error, Result};
use crate::person::{BodyModel, Motion, Person, Placement};

/// A vector per point and chirp, by components; each `[point, chirp]`. As a displacement: metres from the
/// reference position, radar frame.
#[derive(Clone, Debug)]
pub struct Displacement {
    pub x: Tensor<2>,
    pub y: Tensor<2>,
    pub z: Tensor<2>,
}

impl Displacement {
    /// Points that stay where they are: a chirp axis of length 1, to be broadcast after the sum.
    pub fn still(points: usize, device: &Device, dtype: DType) -> Self {
        let zero = || Tensor::zeros([points, 1], (device, dtype));
        Self { x: zero(), y: zero(), z: zero() }
    }

    /// `[point, chirp]`.
    pub fn dims(&self) -> [usize; 2] {
        self.x.dims()
    }

    /// Of some of the points.
    pub fn rows(&self, rows: Range<usize>) -> Self {
        self.clone().map(|axis| axis.slice_dim(0, rows.clone()))
    }

    /// The same done to all three components.
    pub fn map(self, f: impl Fn(Tensor<2>) -> Tensor<2>) -> Self {
        Self { x: f(self.x), y: f(self.y), z: f(self.z) }
    }
}

/// What moves the mesh.
#[derive(Clone, Debug)]
enum Source {
    Skinned { body: Box<SkinnedBody>, poses: Vec<Vec<[f64; 3]>>, shifts_m: Vec<Vector>, world_from_body: Matrix },
    Meshes { vertices_m: Vec<Vec<[f64; 3]>> },
}

/// A person ready to be placed at any time.
#[derive(Clone, Debug)]
pub struct PosedBody {
    source: Source,
    pose_times_s: Vec<f64>,
    interpolation: Interpolation,
    surface: Surface,
    canonical_m: Vec<[f64; 3]>,
    canonical_vertices_m: Vec<[f64; 3]>,
    /// What devices keep of it; absent where the host poses it.
    device_bodies: Option<DeviceBodies>,
    correction: PoseCorrection,
}

impl PosedBody {
    /// # Errors
    /// When the person cannot be posed: lengths that disagree, indices out of range, numbers that are not finite,
    /// times that do not ascend; or when the surface's settings cannot work.
    pub fn new(person: &Person, surface: &SurfaceConfig, interpolation: Interpolation) -> Result<Self> {
        let (source, pose_times_s) = source(person)?;
        let (rest_m, canonical_vertices_m) = match (&source, person) {
            (Source::Skinned { body, .. }, Person::Skinned { model, .. }) => (body.rest_m(), model.template.clone()),
            (_, person) => (first_mesh(person), centred(&first_mesh(person))),
        };
        person.check()?;
        if let Some(face) = person.faces().iter().find(|face| face.iter().any(|&vertex| vertex >= rest_m.len())) {
            return Err(unusable(format!("a face has the vertices {face:?}, but there are only {}", rest_m.len())));
        }
        let device_bodies = (surface.posing == Posing::Tensor).then(|| match person {
            Person::Skinned { model, .. } => DeviceBodies::new(Some(model)),
            Person::Meshes { .. } => DeviceBodies::new(None),
        });
        let surface = surface.init(&rest_m, person.faces())?;
        let canonical_m = surface.interpolate(&canonical_vertices_m);
        let correction = PoseCorrection::default();
        Ok(Self { source, pose_times_s, interpolation, surface, canonical_m, canonical_vertices_m, device_bodies, correction })
    }

    /// The same scatterers on the same body, moved as `person` (the one it was made of) with a correction moves.
    ///
    /// # Errors
    /// As [`Self::new`], of the corrected motion.
    pub fn corrected(&self, person: &Person, correction: PoseCorrection) -> Result<Self> {
        let (source, pose_times_s) = source(&correction.apply(person))?;
        Ok(Self { source, pose_times_s, correction, ..self.clone() })
    }

    /// By how much it moves otherwise than the person it was made of.
    pub fn correction(&self) -> &PoseCorrection {
        &self.correction
    }

    /// Where frames are posed.
    pub fn posing(&self) -> Posing {
        if self.device_bodies.is_some() { Posing::Tensor } else { Posing::Host }
    }

    /// Rest positions of the points, `[point, xyz]`, metres: the same place of the body for every pose *and every
    /// shape* (the template without shape parameters), so that learned features carry over to other people.
    /// Of a sequence of meshes: the first one, about the centre of its bounding box.
    pub fn canonical(&self) -> &[[f64; 3]] {
        &self.canonical_m
    }

    /// The same of the mesh's vertices, `[vertex, xyz]`, metres.
    pub fn canonical_vertices(&self) -> &[[f64; 3]] {
        &self.canonical_vertices_m
    }

    /// Which points of the mesh the scatterers are, and the mesh's edges.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The joint that moves each point most, `[point]`; nothing where meshes move them.
    pub fn joints(&self) -> Vec<usize> {
        let Source::Skinned { body, .. } = &self.source else { return Vec::new() };
        let nearest = |(corners, weights): (&[usize; 3], &[f64; 3])| {
            let largest = (0..3).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0);
            body.joint(corners[largest])
        };
        self.surface.corners.iter().zip(&self.surface.weights).map(nearest).collect()
    }

    /// The mesh at one pose of the motion, `[vertex, xyz]`, metres, radar frame.
    pub fn vertices_at_pose(&self, pose: usize) -> Vec<[f64; 3]> {
        match &self.source {
            Source::Meshes { vertices_m } => vertices_m[pose].clone(),
            Source::Skinned { body, poses, shifts_m, world_from_body } => {
                body.pose(&[&poses[pose]], world_from_body, &shifts_m[pose..=pose]).vertices_m
            }
        }
    }

    /// Radar time of the motion's first and last pose, seconds.
    pub fn span_s(&self) -> (f64, f64) {
        (self.pose_times_s.first().copied().unwrap_or(0.0), self.pose_times_s.last().copied().unwrap_or(0.0))
    }

    /// Everything about one frame, from the radar times of its chirps (seconds).
    ///
    /// # Errors
    /// When a chirp lies outside the motion.
    pub fn frame(&self, chirp_times_s: &[f64]) -> Result<BodyFrame> {
        let basis = motion::basis(&self.pose_times_s, chirp_times_s, self.interpolation)?;
        let middle_s = match chirp_times_s {
            [first, .., last] => 0.5 * (first + last),
            [only] => *only,
            [] => panic!("body: a frame needs at least one chirp"),
        };
        let middle = motion::basis(&self.pose_times_s, &[middle_s], self.interpolation)?;
        Ok(frame::build(self, middle_s, basis, &middle))
    }
}

/// What moves the mesh, and the times of its poses.
fn source(person: &Person) -> Result<(Source, Vec<f64>)> {
    let pose_times_s = person.pose_times_s();
    if !pose_times_s.windows(2).all(|pair| pair[0] < pair[1]) {
        return Err(unusable("the poses' times do not ascend".into()));
    }
    let source = match person {
        Person::Skinned { model, motion, placement } => {
            check_skinned(model, motion)?;
            place(SkinnedBody::new(model, &motion.betas), motion, placement)
        }
        Person::Meshes { vertices, .. } => {
            check_meshes(vertices)?;
            Source::Meshes { vertices_m: vertices.clone() }
        }
    };
    Ok((source, pose_times_s))
}

fn first_mesh(person: &Person) -> Vec<[f64; 3]> {
    match person {
        Person::Meshes { vertices, .. } => vertices[0].clone(),
        Person::Skinned { model, .. } => model.template.clone(),
    }
}

fn place(body: SkinnedBody, motion: &Motion, placement: &Placement) -> Source {
    let rows = placement.radar_from_motion;
    let world_from_body = Matrix::from_fn(|row, column| rows[row][column]);
    let shift = |&translation: &[f64; 3]| world_from_body * Vector::from(translation) + Vector::from(placement.origin_m);
    let shifts_m = motion.translations.iter().map(shift).collect();
    Source::Skinned { body: Box::new(body), poses: motion.poses.clone(), shifts_m, world_from_body }
}

/// About the centre of the bounding box.
fn centred(vertices_m: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let centre: [f64; 3] = std::array::from_fn(|axis| {
        let along = vertices_m.iter().map(|vertex| vertex[axis]);
        0.5 * (along.clone().fold(f64::INFINITY, f64::min) + along.fold(f64::NEG_INFINITY, f64::max))
    });
    vertices_m.iter().map(|vertex| std::array::from_fn(|axis| vertex[axis] - centre[axis])).collect()
}

fn unusable(message: String) -> Error {
    Error::Usage {
        message: format!("the person cannot be posed: {message}"),
        hint: Some("check the body and motion files".into()),
    }
}

fn check_skinned(model: &BodyModel, motion: &Motion) -> Result<()> {
    let (vertices, joints) = (model.template.len(), model.parents.len());
    let lengths = [
        ("skinning weights", model.skinning.len(), vertices),
        ("joint regressor rows", model.joint_regressor.len(), joints),
        ("translations", motion.translations.len(), motion.poses.len()),
    ];
    for (what, found, wanted) in lengths {
        if found != wanted {
            return Err(unusable(format!("{found} {what}, expected {wanted}")));
        }
    }
    if vertices == 0 || joints == 0 {
        return Err(unusable(format!("the body has {vertices} vertices and {joints} joints")));
    }
    let blends = model.shape_directions.iter().chain(&model.pose_directions);
    if blends.clone().any(|direction| direction.len() != vertices) {
        return Err(unusable(format!("a blend shape does not have {vertices} vertices")));
    }
    if !model.pose_directions.is_empty() && model.pose_directions.len() != 9 * (joints - 1) {
        return Err(unusable(format!(
            "{} pose blend shapes, expected {} or none",
            model.pose_directions.len(),
            9 * (joints - 1)
        )));
    }
    if model.parents.iter().enumerate().any(|(joint, parent)| parent.map_or(joint != 0, |parent| parent >= joint)) {
        return Err(unusable("a joint comes before its parent, or there are two roots".into()));
    }
    let out_of_range = |rows: &[Vec<(usize, f64)>], limit: usize| rows.iter().flatten().any(|&(index, _)| index >= limit);
    if out_of_range(&model.skinning, joints) || out_of_range(&model.joint_regressor, vertices) {
        return Err(unusable("a skinning or regressor weight names a joint or vertex that does not exist".into()));
    }
    let is_finite = |vector: &[f64; 3]| vector.iter().all(|value| value.is_finite());
    if !model.template.iter().chain(blends.flatten()).all(is_finite) {
        return Err(unusable("the body holds numbers that are not finite".into()));
    }
    for (pose, (angles, translation)) in motion.poses.iter().zip(&motion.translations).enumerate() {
        if angles.len() != joints {
            return Err(unusable(format!("pose {pose} has {} joints, the body {joints}", angles.len())));
        }
        if !angles.iter().chain([translation]).all(is_finite) {
            return Err(unusable(format!("pose {pose} of the motion holds numbers that are not finite")));
        }
    }
    Ok(())
}

fn check_meshes(vertices: &[Vec<[f64; 3]>]) -> Result<()> {
    let first = vertices.first().ok_or_else(|| unusable("the sequence holds no mesh".into()))?;
    for (pose, mesh) in vertices.iter().enumerate() {
        if mesh.len() != first.len() {
            return Err(unusable(format!("mesh {pose} has {} vertices, the first one {}", mesh.len(), first.len())));
        }
        if !mesh.iter().flatten().all(|value| value.is_finite()) {
            return Err(unusable(format!("mesh {pose} holds numbers that are not finite")));
        }
    }
    Ok(())
}

#[cfg(test)]
pub(crate) mod tests;
