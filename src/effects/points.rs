//! The body's points as effects see them, and points of their own that effects add.

use burn::tensor::Tensor;

use super::values::Values;
use crate::body::Displacement;

/// Joints whose points are the torso.
pub(super) const TORSO: [&str; 6] = ["spine1", "spine2", "spine3", "left_collar", "right_collar", "pelvis"];
/// The upper torso.
pub(super) const CHEST: [&str; 4] = ["spine2", "spine3", "left_collar", "right_collar"];

/// Points of the body that one viewpoint sees, in one frame and for the chirps of one transmitter.
#[derive(Clone, Copy, Debug)]
pub struct BodyPoints<'a> {
    /// `[point, xyz]`, metres, in the middle of the frame.
    pub reference_m: &'a [[f64; 3]],
    /// `[point, xyz]`, unit, out of the body.
    pub normal: &'a [[f64; 3]],
    /// `[point]`: the joint that moves it most; empty where the body has none.
    pub joints: &'a [&'static str],
    /// `[point, chirp]`, m/s; only where a clock's effect needs it.
    pub velocity: Option<&'a Displacement>,
    /// Radar times of the chirps.
    pub times_s: &'a [f64],
    pub tx: usize,
    /// Lowest and highest coordinate of the whole body.
    pub extent_m: [[f64; 3]; 2],
    /// Middle of the body.
    pub centre_m: [f64; 3],
    pub radar_m: [f64; 3],
}

impl BodyPoints<'_> {
    /// The points a moment later, to first order.
    pub(super) fn later(&self, displacement: Displacement, seconds: Tensor<2>) -> Displacement {
        let Some(velocity) = self.velocity else { return displacement };
        Displacement {
            x: displacement.x + velocity.x.clone() * seconds.clone(),
            y: displacement.y + velocity.y.clone() * seconds.clone(),
            z: displacement.z + velocity.z.clone() * seconds,
        }
    }

    /// 1 for points of these parts of the body, 0 for others, `[point, 1]`.
    ///
    /// A body without joints (a sequence of meshes) has only a torso: the points from a half to four fifths of its height.
    pub(super) fn mask(&self, parts: &[&str], values: &Values) -> Tensor<2> {
        let count = self.reference_m.len();
        let [low, high] = self.extent_m;
        let share = |point: &[f64; 3]| (point[2] - low[2]) / (high[2] - low[2]).max(1e-6);
        let inside = |point: usize| match self.joints.get(point) {
            Some(joint) => parts.contains(joint),
            None => parts.contains(&"spine2") && (0.5..0.8).contains(&share(&self.reference_m[point])),
        };
        values.tensor((0..count).map(|point| f64::from(u8::from(inside(point)))).collect(), [count, 1])
    }

    /// Moves points of these parts out along their normals by `distance`, which broadcasts with `[point, chirp]`.
    pub(super) fn along_normals(
        &self,
        displacement: Displacement,
        distance: Tensor<2>,
        parts: &[&str],
        values: &Values,
    ) -> Displacement {
        self.along(displacement, distance, |point| self.normal[point], parts, values)
    }

    /// Moves points of these parts away from the radar.
    pub(super) fn along_sight(
        &self,
        displacement: Displacement,
        distance: Tensor<2>,
        parts: &[&str],
        values: &Values,
    ) -> Displacement {
        self.along(displacement, distance, |point| self.sight(point), parts, values)
    }

    fn along(
        &self,
        displacement: Displacement,
        distance: Tensor<2>,
        direction: impl Fn(usize) -> [f64; 3],
        parts: &[&str],
        values: &Values,
    ) -> Displacement {
        let count = self.reference_m.len();
        let distance = self.mask(parts, values) * distance;
        let component = |axis: usize| {
            let values = values.tensor::<2>((0..count).map(|point| direction(point)[axis]).collect(), [count, 1]);
            values * distance.clone()
        };
        Displacement { x: displacement.x + component(0), y: displacement.y + component(1), z: displacement.z + component(2) }
    }

    /// Unit vector from the radar to a point.
    fn sight(&self, point: usize) -> [f64; 3] {
        let way: [f64; 3] = std::array::from_fn(|axis| self.reference_m[point][axis] - self.radar_m[axis]);
        let length = way.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9);
        way.map(|x| x / length)
    }

    /// Cosine between each point's normal and its direction to the radar.
    pub(super) fn facing(&self) -> Vec<f64> {
        let cosine = |point: usize| -(0..3).map(|axis| self.normal[point][axis] * self.sight(point)[axis]).sum::<f64>();
        (0..self.reference_m.len()).map(cosine).collect()
    }

    /// Cosine between each point's direction and the boresight.
    pub(super) fn off_boresight(&self) -> Vec<f64> {
        (0..self.reference_m.len()).map(|point| self.sight(point)[1]).collect()
    }
}

/// The first number of a tensor, in f64.
pub(super) fn host_value(tensor: &Tensor<1>) -> f64 {
    host_values(tensor)[0]
}

fn host_values(tensor: &Tensor<1>) -> Vec<f64> {
    tensor.clone().detach().into_data().convert::<f64>().try_into_vec::<f64>().expect("converted")
}

/// A point that learns where it is: the place as the host sees it, and a displacement of zero that carries the gradient.
pub(super) fn place(position: [Tensor<1>; 3]) -> ([f64; 3], Displacement) {
    let reference_m = [0, 1, 2].map(|axis| host_value(&position[axis]));
    let [x, y, z] = position.map(|part| (part.clone() - part.detach()).reshape([1, 1]));
    (reference_m, Displacement { x, y, z })
}
