//! One frame of a posed body: where its points are in the middle, and how they move around that from chirp to chirp.

use std::ops::Range;

use burn::tensor::{Tensor, TensorCreationOptions, TensorData};
use rayon::prelude::*;

use super::facets::FacetEdges;
use super::kinematics::{Matrix, Vector};
use super::motion::Basis;
use super::skinning::Poses;
use super::surface::vertex_normals;
use super::{Displacement, PosedBody, Source};

/// A frame of a [`PosedBody`]: the host's part in f64, and what the device's displacements are made of.
#[derive(Clone, Debug)]
pub struct BodyFrame {
    /// Radar time halfway between the first chirp and the last.
    pub middle_s: f64,
    /// `[point, xyz]` in the middle of the frame, metres, radar frame: the reference of every displacement.
    pub position_m: Vec<[f64; 3]>,
    /// `[point, xyz]` in the middle of the frame.
    pub velocity_mps: Vec<[f64; 3]>,
    /// `[point, xyz]`, unit, out of the body.
    pub normal: Vec<[f64; 3]>,
    /// `[point]`.
    pub area_m2: Vec<f64>,
    /// `[vertex, xyz]` of the mesh in the middle of the frame, metres: what visibility looks at.
    pub vertices_m: Vec<[f64; 3]>,
    /// Weights of the poses around the frame, `[chirp, pose]`.
    pub basis: Basis,
    /// The same for the one time in the middle, of the same poses.
    pub(super) middle: Basis,
    /// `[vertex, pose]`: position at each pose minus that in the middle, metres; the difference is taken in f64.
    pub(super) change_m: Vec<[f64; 3]>,
    pub(super) rotations: Rotations,
}

/// What turns a canonical offset into the radar frame.
#[derive(Clone, Debug)]
pub(super) enum Rotations {
    /// The joints', blended by the skinning weights.
    Joints(Poses),
    /// `[vertex, pose]`, from the mesh itself.
    Vertices(Vec<Matrix>),
}

/// `basis` for all chirps, `middle` for the one time in between.
pub(super) fn build(body: &PosedBody, middle_s: f64, basis: Basis, middle: &Basis) -> BodyFrame {
    let window = basis.poses.clone();
    let count = window.len();
    let (positions_m, rotations) = match &body.source {
        Source::Skinned { body, poses, shifts_m, world_from_body } => {
            let angles: Vec<&[[f64; 3]]> = poses[window.clone()].iter().map(Vec::as_slice).collect();
            let mut posed = body.pose(&angles, world_from_body, &shifts_m[window.clone()]);
            (std::mem::take(&mut posed.vertices_m), Rotations::Joints(posed))
        }
        Source::Meshes { vertices_m } => {
            let meshes = &vertices_m[window.clone()];
            let positions_m = (0..vertices_m[0].len()).flat_map(|vertex| meshes.iter().map(move |mesh| mesh[vertex])).collect();
            (positions_m, Rotations::Vertices(mesh_rotations(&vertices_m[0], meshes, body.surface())))
        }
    };
    // The middle lies between the first and the last chirp, so the frame's window holds all poses it needs.
    let weights = |row: &[f64]| -> Vec<f64> {
        window.clone().map(|pose| if middle.poses.contains(&pose) { row[pose - middle.poses.start] } else { 0.0 }).collect()
    };
    let blend = |weights: &[f64], values: &[[f64; 3]]| -> [f64; 3] {
        std::array::from_fn(|axis| values.iter().zip(weights).map(|(value, weight)| weight * value[axis]).sum())
    };
    let (weight, rate) = (weights(middle.row(0)), weights(middle.rate_row(0)));
    let vertices_m: Vec<[f64; 3]> = positions_m.chunks_exact(count).map(|poses| blend(&weight, poses)).collect();
    let change_m: Vec<[f64; 3]> = positions_m
        .chunks_exact(count)
        .zip(&vertices_m)
        .flat_map(|(poses, middle)| poses.iter().map(move |pose| std::array::from_fn(|axis| pose[axis] - middle[axis])))
        .collect();
    // The rates sum to zero, so velocities may come from the differences.
    let velocities: Vec<[f64; 3]> = change_m.chunks_exact(count).map(|poses| blend(&rate, poses)).collect();
    let surface = body.surface();
    BodyFrame {
        middle_s,
        position_m: surface.interpolate(&vertices_m),
        velocity_mps: surface.interpolate(&velocities),
        normal: surface.normals(&vertices_m),
        area_m2: surface.areas_m2(&vertices_m),
        vertices_m,
        middle: Basis { poses: window, weights: weight, rates: rate },
        basis,
        change_m,
        rotations,
    }
}

impl BodyFrame {
    /// The mesh at one of the frame's chirps, `[vertex, xyz]`, metres.
    pub fn vertices_at(&self, chirp: usize) -> Vec<[f64; 3]> {
        let weights = self.basis.row(chirp);
        self.vertices_m
            .iter()
            .zip(self.change_m.chunks_exact(weights.len()))
            .map(|(middle, changes)| {
                let change = |axis: usize| changes.iter().zip(weights).map(|(change, weight)| weight * change[axis]).sum::<f64>();
                std::array::from_fn(|axis| middle[axis] + change(axis))
            })
            .collect()
    }
}

impl PosedBody {
    /// Displacement of chosen points from their reference positions, `[point, chirp]`, metres.
    ///
    /// The difference form of skinning: Σ_pose basis[chirp, pose] (Σ_joint w G_pose − reference), taken in f64, then
    /// cast. A learned canonical offset moves along through the blended rotation: + Σ_pose basis (Σ_joint w R_pose) δ.
    ///
    /// # Shapes
    /// - `points`: which points, in any order; `chirps`: of those the frame was made for
    /// - `offset`: `[point, xyz]`, metres, in the rest pose's frame, one row per entry of `points`
    /// - `options`: the device, or the device and the number type; an offset must live there too
    ///
    /// # Gradient
    /// Flows to `offset`; linear.
    pub fn displacement(
        &self,
        frame: &BodyFrame,
        points: &[usize],
        chirps: Range<usize>,
        offset: Option<Tensor<2>>,
        options: impl Into<TensorCreationOptions>,
    ) -> Displacement {
        let options = options.into();
        let weights = basis_tensor(&frame.basis.weights, frame.basis.poses.len(), &chirps, &options);
        let changes = self.changes_m(frame, points);
        let mut window = changes.map(|values| window_tensor(values, points.len(), &options));
        if let Some(offset) = offset {
            assert_eq!(offset.dims(), [points.len(), 3], "body: offset {:?}, points {}", offset.dims(), points.len());
            let turned = self.turned(frame, points, offset, &options);
            for (part, turned) in window.iter_mut().zip(turned) {
                *part = part.clone() + turned;
            }
        }
        let [x, y, z] = window.map(|part| part.matmul(weights.clone()));
        Displacement { x, y, z }
    }

    /// Velocity of chosen points at every chirp, `[point, chirp]`, m/s; arguments as in [`Self::displacement`].
    pub fn velocity(
        &self,
        frame: &BodyFrame,
        points: &[usize],
        chirps: Range<usize>,
        options: impl Into<TensorCreationOptions>,
    ) -> Displacement {
        let options = options.into();
        let rates = basis_tensor(&frame.basis.rates, frame.basis.poses.len(), &chirps, &options);
        let changes = self.changes_m(frame, points);
        let [x, y, z] = changes.map(|values| window_tensor(values, points.len(), &options).matmul(rates.clone()));
        Displacement { x, y, z }
    }

    /// Two edges of the facet under each chosen point, at every chirp; for [`super::facet_integral`].
    pub fn facet_edges(
        &self,
        frame: &BodyFrame,
        points: &[usize],
        chirps: Range<usize>,
        options: impl Into<TensorCreationOptions>,
    ) -> FacetEdges {
        let options = options.into();
        let count = frame.basis.poses.len();
        let weights = basis_tensor(&frame.basis.weights, count, &chirps, &options);
        let edge = |corner: usize| {
            let mut parts: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::with_capacity(points.len() * count));
            for &point in points {
                let corners = self.surface.corners[point];
                let (from, to) = (corners[0], corners[corner]);
                for pose in 0..count {
                    for (axis, part) in parts.iter_mut().enumerate() {
                        let at = |vertex: usize| frame.vertices_m[vertex][axis] + frame.change_m[vertex * count + pose][axis];
                        part.push(at(to) - at(from));
                    }
                }
            }
            let [x, y, z] = parts.map(|values| window_tensor(values, points.len(), &options).matmul(weights.clone()));
            Displacement { x, y, z }
        };
        FacetEdges { second: edge(1), third: edge(2) }
    }

    /// Change of the points at every pose of the window: three components, each `[point, pose]`, metres.
    fn changes_m(&self, frame: &BodyFrame, points: &[usize]) -> [Vec<f64>; 3] {
        let count = frame.basis.poses.len();
        let mut parts: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::with_capacity(points.len() * count));
        for &point in points {
            let (corners, weights) = (&self.surface.corners[point], &self.surface.weights[point]);
            for pose in 0..count {
                for (axis, part) in parts.iter_mut().enumerate() {
                    let corner = |(&vertex, &weight): (&usize, &f64)| weight * frame.change_m[vertex * count + pose][axis];
                    part.push(corners.iter().zip(weights).map(corner).sum());
                }
            }
        }
        parts
    }

    /// A canonical offset in the radar frame at every pose: three components, each `[point, pose]`.
    fn turned(&self, frame: &BodyFrame, points: &[usize], offset: Tensor<2>, options: &TensorCreationOptions) -> [Tensor<2>; 3] {
        let count = frame.basis.poses.len();
        // [point, pose, row, column]
        let rotations: Vec<f64> = points
            .par_iter()
            .with_min_len(64)
            .flat_map_iter(|&point| {
                (0..count).flat_map(move |pose| {
                    let rotation = self.rotation(frame, point, pose);
                    (0..9).map(move |entry| rotation[(entry / 3, entry % 3)])
                })
            })
            .collect();
        let rotations = Tensor::<4>::from_data(TensorData::new(rotations, [points.len(), count, 3, 3]), options.clone());
        let offset: Tensor<4> = offset.reshape([points.len(), 1, 1, 3]);
        let turned: Tensor<3> = (rotations * offset).sum_dim(3).squeeze_dim(3);
        std::array::from_fn(|axis| turned.clone().narrow(2, axis, 1).squeeze_dim(2))
    }

    /// Blended rotation at a point: from the rest pose to the radar frame.
    pub fn rotation(&self, frame: &BodyFrame, point: usize, pose: usize) -> Matrix {
        let at_vertex = |vertex: usize| match (&frame.rotations, &self.source) {
            (Rotations::Joints(poses), Source::Skinned { body, .. }) => body.blended_rotation(vertex, pose, poses),
            (Rotations::Vertices(rotations), _) => rotations[vertex * frame.basis.poses.len() + pose],
            (Rotations::Joints(_), Source::Meshes { .. }) => panic!("body: this frame belongs to another body"),
        };
        let (corners, weights) = (&self.surface.corners[point], &self.surface.weights[point]);
        corners
            .iter()
            .zip(weights)
            .filter(|(_, weight)| **weight != 0.0)
            .map(|(&vertex, &weight)| at_vertex(vertex) * weight)
            .sum()
    }
}

/// `[point, pose]` on the device.
fn window_tensor(values: Vec<f64>, points: usize, options: &TensorCreationOptions) -> Tensor<2> {
    let poses = values.len().checked_div(points).unwrap_or(0);
    Tensor::from_data(TensorData::new(values, [points, poses]), options.clone())
}

/// `[pose, chirp]` on the device.
fn basis_tensor(rows: &[f64], poses: usize, chirps: &Range<usize>, options: &TensorCreationOptions) -> Tensor<2> {
    let rows = rows[chirps.start * poses..chirps.end * poses].to_vec();
    Tensor::<2>::from_data(TensorData::new(rows, [chirps.len(), poses]), options.clone()).transpose()
}

/// How each vertex of a mesh has turned since the first mesh, `[vertex, pose]`: the frame of its normal and its first
/// edge. The identity where a vertex has neither.
fn mesh_rotations(first_m: &[[f64; 3]], meshes: &[Vec<[f64; 3]>], surface: &super::Surface) -> Vec<Matrix> {
    let mut neighbours = vec![None; first_m.len()];
    for &[a, b] in &surface.edges {
        neighbours[a].get_or_insert(b);
        neighbours[b].get_or_insert(a);
    }
    let frames = |mesh: &[[f64; 3]]| -> Vec<Option<Matrix>> {
        let normals = vertex_normals(mesh, &surface.faces);
        neighbours
            .iter()
            .enumerate()
            .map(|(vertex, neighbour)| {
                let normal = Vector::from(normals[vertex]);
                let edge = Vector::from(mesh[(*neighbour)?]) - Vector::from(mesh[vertex]);
                let tangent = (edge - normal * normal.dot(&edge)).try_normalize(1e-12)?;
                (normal.norm() > 0.5).then(|| Matrix::from_columns(&[normal, tangent, normal.cross(&tangent)]))
            })
            .collect()
    };
    let rest = frames(first_m);
    let posed: Vec<Vec<Option<Matrix>>> = meshes.par_iter().map(|mesh| frames(mesh)).collect();
    let turn = |vertex: usize, pose: &Vec<Option<Matrix>>| match (pose[vertex], rest[vertex]) {
        (Some(now), Some(then)) => now * then.transpose(),
        _ => Matrix::identity(),
    };
    (0..first_m.len())
        .flat_map(|vertex| posed.iter().map(move |pose| (vertex, pose)))
        .map(|(vertex, pose)| turn(vertex, pose))
        .collect()
}
