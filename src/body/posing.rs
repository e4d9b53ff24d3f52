//! The posed body as tensor operations: positions, normals and areas of a frame, with gradients to the pose.
//!
//! The host's f64 frame is the reference, and the device holds what differs from it: joints' motions minus those of the middle
//! of the frame (subtracted in f64), and changes of the pose as expanded products. So f32 keeps the carrier's phase.

mod area;
mod chain;
mod mover;

use std::ops::Range;
use std::sync::{Arc, Mutex};

use burn::tensor::{DType, Device, Int, Tensor, TensorData};

use super::correction::PoseTensors;
use super::facets::FacetEdges;
use super::kinematics::Vector;
use super::surface::Shares;
use super::tensors::BodyTensors;
use super::{BodyFrame, Displacement, PosedBody};
use crate::person::BodyModel;
use mover::Mover;

/// A device without its autodiff, and a number type: constants are made there, gradients come from what they meet.
pub struct On {
    device: Device,
    dtype: DType,
}

/// What a device keeps of a body; made once.
#[derive(Debug)]
struct DeviceBody {
    /// Absent where meshes move the body.
    model: Option<BodyTensors>,
    corners: area::Corners,
}

type Made = (Device, DType, Arc<DeviceBody>);

/// The device bodies made so far, shared by the clones of a [`PosedBody`].
#[derive(Clone, Debug)]
pub(super) struct DeviceBodies {
    model: Option<Arc<BodyModel>>,
    made: Arc<Mutex<Vec<Made>>>,
}

impl DeviceBodies {
    pub fn new(model: Option<&BodyModel>) -> Self {
        Self { model: model.cloned().map(Arc::new), made: Arc::default() }
    }

    fn on(&self, on: &On, faces: &[[usize; 3]]) -> Arc<DeviceBody> {
        let mut made = self.made.lock().expect("no panic while locked");
        if let Some((_, _, body)) = made.iter().find(|(device, dtype, _)| *device == on.device && *dtype == on.dtype) {
            return body.clone();
        }
        let corners = std::array::from_fn(|corner| on.ids(faces.iter().map(|face| face[corner])));
        let model = self.model.as_ref().map(|model| BodyTensors::new(model, (&on.device, on.dtype)));
        let body = Arc::new(DeviceBody { model, corners });
        made.push((on.device.clone(), on.dtype, body.clone()));
        body
    }
}

impl On {
    fn ids(&self, ids: impl Iterator<Item = usize>) -> Tensor<1, Int> {
        let ids: Vec<i64> = ids.map(|id| id as i64).collect();
        let count = ids.len();
        Tensor::from_data(TensorData::new(ids, [count]), &self.device)
    }
}

/// One frame of a body on a device.
pub struct PosedFrame<'a> {
    body: &'a PosedBody,
    frame: &'a BodyFrame,
    on: On,
    /// Whether results must join a graph of gradients.
    autodiff: bool,
    /// `[vertex, pose, xyz]`, metres from the reference.
    change_m: Tensor<3>,
    /// `[vertex, pose · row · column]`: from the rest pose to the radar frame, before the heading's change.
    rotation: Tensor<2>,
    /// Transpose of the heading's rotation minus one.
    heading: Option<Tensor<2>>,
    /// Change of the clock, `[1, 1]`, seconds.
    clock_s: Option<Tensor<2>>,
    /// `[vertex, xyz]`, metres from the reference, in the middle of the frame.
    middle_m: Tensor<2>,
    /// `[facet, xyz]`, m².
    doubled_areas: Tensor<2>,
    /// `[vertex, xyz]`: unit, or zero where there is no area.
    normals: Tensor<2>,
    corners: area::Corners,
}

impl<'a> PosedFrame<'a> {
    /// # Shapes
    /// - `pose`: what learns of the pose; without it all is constant
    /// - `device`: with autodiff where gradients are wanted
    ///
    /// # Gradient
    /// Of everything below flows to each part of `pose`; smooth, but for normals of facets without area.
    ///
    /// # Panics
    /// When the body is one that the host poses, or `frame` is another body's.
    pub fn new(body: &'a PosedBody, frame: &'a BodyFrame, pose: Option<&PoseTensors>, device: &Device, dtype: DType) -> Self {
        let on = On { device: device.clone().without_autodiff(), dtype };
        let bodies = body.device_bodies.as_ref().expect("posing: this body is posed on the host");
        let on_device = bodies.on(&on, &body.surface.faces);
        let nothing = PoseTensors::default();
        let pose = pose.unwrap_or(&nothing);
        let mover = Mover { body, frame, on: &on, device: &on_device, pose };
        let (own_m, rotation) = mover.before_heading();
        let (change_m, heading) = mover.placed(own_m);
        let clock_s = pose.clock_s.clone().map(|clock| (clock - body.correction.clock_s).reshape([1, 1]));
        let [vertices, _, _] = change_m.dims();
        let mut posed = Self {
            middle_m: on.tensor(vec![0.0; vertices * 3], [vertices, 3]),
            doubled_areas: on.tensor(vec![], [0, 3]),
            normals: on.tensor(vec![], [0, 3]),
            corners: on_device.corners.clone(),
            autodiff: device.is_autodiff(),
            body,
            frame,
            on,
            change_m,
            rotation,
            heading,
            clock_s,
        };
        posed.look_at_middle();
        posed
    }

    fn look_at_middle(&mut self) {
        let (on, frame) = (&self.on, self.frame);
        let (poses, vertices) = (frame.basis.poses.len(), frame.vertices_m.len());
        let weights = self.basis(&frame.middle.weights, &frame.middle.rates);
        let parts: Vec<Tensor<2>> = (0..3).map(|axis| part(&self.change_m, axis).matmul(weights.clone())).collect();
        debug_assert_eq!(parts[0].dims(), [vertices, 1], "{poses} poses");
        self.middle_m = Tensor::cat(parts, 1);
        let faces = &self.body.surface.faces;
        let edge = |corner: usize| {
            let at = |vertex: usize| Vector::from(frame.vertices_m[vertex]);
            let flat = faces.iter().flat_map(|face| (at(face[corner]) - at(face[0])).data.0[0]).collect();
            let rest: Tensor<2> = on.tensor(flat, [faces.len(), 3]);
            let moved = |corner: usize| self.middle_m.clone().select(0, self.corners[corner].clone());
            rest + moved(corner) - moved(0)
        };
        self.doubled_areas = area::doubled_areas(edge(1), edge(2));
        let sums = area::around(self.doubled_areas.clone(), &self.corners, vertices);
        self.normals = area::unit(sums, [0.0; 3]);
    }

    /// As [`PosedBody::displacement`], `[point, chirp]`, metres.
    pub fn displacement(&self, points: &[usize], chirps: Range<usize>, offset: Option<Tensor<2>>) -> Displacement {
        let poses = self.frame.basis.poses.len();
        let table = self.change_m.clone().reshape([self.frame.vertices_m.len(), poses * 3]);
        let mut window: Tensor<3> = self.at_points(table, points).reshape([points.len(), poses, 3]);
        if let Some(offset) = offset {
            let rotation: Tensor<4> = self.at_points(self.rotation.clone(), points).reshape([points.len(), poses, 3, 3]);
            let turned = (rotation * offset.reshape([points.len(), 1, 1, 3])).sum_dim(3).squeeze_dim::<3>(3);
            window = window + self.spun(turned);
        }
        let weights = self.chirps(&chirps);
        self.joined(std::array::from_fn(|axis| part(&window, axis).matmul(weights.clone())))
    }

    /// As [`PosedBody::facet_edges`].
    pub fn facet_edges(&self, points: &[usize], chirps: Range<usize>) -> FacetEdges {
        let weights = self.chirps(&chirps);
        let corners = &self.body.surface.corners;
        let moved = |corner: usize| {
            let ids = self.on.ids(points.iter().map(|&point| corners[point][corner]));
            self.change_m.clone().select(0, ids)
        };
        let first = moved(0);
        let edge = |corner: usize| {
            let window = moved(corner) - first.clone();
            self.joined(std::array::from_fn(|axis| {
                let at = |vertex: usize| self.frame.vertices_m[vertex][axis];
                let rest = points.iter().map(|&point| at(corners[point][corner]) - at(corners[point][0])).collect();
                part(&window, axis).matmul(weights.clone()) + self.on.tensor(rest, [points.len(), 1])
            }))
        };
        FacetEdges { second: edge(1), third: edge(2) }
    }

    /// Unit normals of chosen points in the middle of the frame, `[point, xyz]`.
    pub fn normals(&self, points: &[usize]) -> Tensor<2> {
        area::unit(self.at_points(self.normals.clone(), points), [0.0, 0.0, 1.0])
    }

    /// `[point, 1]`, m², in the middle of the frame.
    pub fn areas_m2(&self, points: &[usize]) -> Tensor<2> {
        let doubled = area::lengths(self.doubled_areas.clone());
        match &self.body.surface.shares {
            Shares::Vertex => {
                let of_vertices = area::around(doubled / 6.0, &self.corners, self.frame.vertices_m.len());
                of_vertices.select(0, self.on.ids(points.iter().copied()))
            }
            Shares::Facet(shares) => {
                let facets = self.on.ids(points.iter().map(|&point| shares[point].0));
                let share = points.iter().map(|&point| 0.5 * shares[point].1).collect();
                doubled.select(0, facets) * self.on.tensor(share, [points.len(), 1])
            }
        }
    }

    /// Where chosen points are in the middle of the frame, `[point, xyz]`, metres from their references.
    pub fn middle_m(&self, points: &[usize]) -> Tensor<2> {
        self.at_points(self.middle_m.clone(), points)
    }

    /// A canonical axis of each chosen point (0, 1 or 2), turned with the body, `[point, xyz]`.
    pub fn turned_axes(&self, points: &[usize], axes: &[usize]) -> Tensor<2> {
        let pose = self.frame.basis.poses.len() / 2;
        let rotation = self.at_points(self.rotation.clone().narrow(1, 9 * pose, 9), points).reshape([points.len(), 3, 3]);
        let one_hot = axes.iter().flat_map(|&axis| (0..3).map(move |column| if column == axis { 1.0 } else { 0.0 })).collect();
        let one_hot: Tensor<3> = self.on.tensor(one_hot, [points.len(), 1, 3]);
        let turned: Tensor<2> = (rotation * one_hot).sum_dim(2).squeeze_dim(2);
        self.spun(turned.unsqueeze_dim(1)).squeeze_dim(1)
    }

    /// Vectors `[point, pose, xyz]` after the heading's change.
    fn spun(&self, vectors: Tensor<3>) -> Tensor<3> {
        match &self.heading {
            Some(heading) => vectors.clone() + times(vectors, heading.clone()),
            None => vectors,
        }
    }

    /// A quantity of the vertices at chosen points, `[vertex, feature]` to `[point, feature]`.
    fn at_points(&self, table: Tensor<2>, points: &[usize]) -> Tensor<2> {
        let surface = &self.body.surface;
        if surface.is_vertices() {
            return table.select(0, self.on.ids(points.iter().copied()));
        }
        let corner = |corner: usize| {
            let share = points.iter().map(|&point| surface.weights[point][corner]).collect();
            let ids = self.on.ids(points.iter().map(|&point| surface.corners[point][corner]));
            table.clone().select(0, ids) * self.on.tensor(share, [points.len(), 1])
        };
        corner(0) + corner(1) + corner(2)
    }

    fn chirps(&self, chirps: &Range<usize>) -> Tensor<2> {
        let poses = self.frame.basis.poses.len();
        let rows = chirps.start * poses..chirps.end * poses;
        self.basis(&self.frame.basis.weights[rows.clone()], &self.frame.basis.rates[rows])
    }

    /// `[pose, time]` from weights and rates `[time, pose]`: a later motion is seen at an earlier pose.
    fn basis(&self, weights: &[f64], rates: &[f64]) -> Tensor<2> {
        let poses = self.frame.basis.poses.len();
        let times = weights.len() / poses;
        let rows = |values: &[f64]| self.on.tensor(values.to_vec(), [times, poses]).transpose();
        match &self.clock_s {
            Some(clock) => rows(weights) - rows(rates) * clock.clone(),
            None => rows(weights),
        }
    }

    fn joined(&self, parts: [Tensor<2>; 3]) -> Displacement {
        let [x, y, z] = parts.map(|part| if self.autodiff { part.autodiff() } else { part });
        Displacement { x, y, z }
    }
}

/// Component of vectors `[row, pose, xyz]`, `[row, pose]`.
fn part(vectors: &Tensor<3>, axis: usize) -> Tensor<2> {
    vectors.clone().narrow(2, axis, 1).squeeze_dim(2)
}

/// Vectors `[a, b, xyz]` times a matrix from the right.
fn times(vectors: Tensor<3>, matrix: Tensor<2>) -> Tensor<3> {
    let [a, b, _] = vectors.dims();
    vectors.reshape([a * b, 3]).matmul(matrix).reshape([a, b, 3])
}

#[cfg(test)]
#[path = "posing/tests.rs"]
pub(crate) mod tests;
