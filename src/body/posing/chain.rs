//! How the joints' motions change with their rotations and with the body's shape, as tensor operations without cancellation:
//! every product of changed factors is expanded, so that small changes keep all their digits in f32.

use burn::tensor::{Tensor, TensorData};

use super::On;
use crate::body::kinematics::{Matrix, Vector};

/// A skeleton at the poses of a frame's window, around which the joints change.
pub struct Chain<'a> {
    pub parents: &'a [Option<usize>],
    /// `[joint]`, metres: joints of the rest pose.
    pub rest_m: &'a [Vector],
    pub world_from_body: &'a Matrix,
    /// `[pose][joint]`: each joint's rotation relative to its parent.
    pub local: &'a [Vec<Matrix>],
    /// `[joint, pose]`: from the rest pose to the world.
    pub world: &'a [Matrix],
}

impl Chain<'_> {
    /// Change of what every joint does to points of the rest pose.
    ///
    /// # Shapes
    /// - `local`: `[pose, joint, row, column]`, change of the joints' rotations relative to their parents
    /// - `rest_m`: `[joint, xyz]`, change of the joints of the rest pose
    /// - result: `[joint, pose · 12]`: rotation by rows, then translation (metres)
    ///
    /// # Gradient
    /// Flows to both; smooth.
    pub fn change(&self, local: Tensor<4>, rest_m: Option<Tensor<2>>, on: &On) -> Tensor<2> {
        let poses = self.local.len();
        let matrices = |of: &dyn Fn(usize) -> Matrix| on.matrices((0..poses).map(of));
        let vector = |v: Vector| -> Tensor<3> { on.tensor(v.iter().copied().collect(), [1, 1, 3]) };
        let rest_change = |joint: usize| -> Option<Tensor<3>> {
            rest_m.as_ref().map(|rest| rest.clone().narrow(0, joint, 1).unsqueeze_dim::<3>(0))
        };
        let mut turns: Vec<Tensor<3>> = Vec::new();
        let mut places: Vec<Tensor<2>> = Vec::new();
        let mut rows = Vec::new();
        for (joint, parent) in self.parents.iter().enumerate() {
            let own: Tensor<3> = local.clone().narrow(1, joint, 1).squeeze_dim(1);
            let (turn, place) = match *parent {
                None => {
                    let world = matrices(&|_| *self.world_from_body);
                    let place = match rest_change(joint) {
                        Some(rest) => applied(world.clone(), rest),
                        None => on.tensor(vec![0.0; poses * 3], [poses, 3]),
                    };
                    (world.matmul(own), place)
                }
                Some(parent) => {
                    let (before, turned) = (matrices(&|pose| self.world[parent * poses + pose]), turns[parent].clone());
                    let now = matrices(&|pose| self.local[pose][joint]) + own.clone();
                    let mut bone = vector(self.rest_m[joint] - self.rest_m[parent]);
                    let mut place = places[parent].clone();
                    if let (Some(of_joint), Some(of_parent)) = (rest_change(joint), rest_change(parent)) {
                        let longer = of_joint - of_parent;
                        place = place + applied(before.clone(), longer.clone());
                        bone = bone + longer;
                    }
                    (turned.clone().matmul(now) + before.matmul(own), place + applied(turned, bone))
                }
            };
            let mut rest = vector(self.rest_m[joint]);
            let mut shift = place.clone();
            if let Some(moved) = rest_change(joint) {
                shift = shift - applied(matrices(&|pose| self.world[joint * poses + pose]), moved.clone());
                rest = rest + moved;
            }
            shift = shift - applied(turn.clone(), rest);
            rows.push(Tensor::cat(vec![turn.clone().reshape([poses, 9]), shift], 1).reshape([1, poses * 12]));
            turns.push(turn);
            places.push(place);
        }
        Tensor::cat(rows, 0)
    }
}

/// Matrices `[pose, row, column]` times a vector `[1, 1, xyz]`: `[pose, xyz]`.
fn applied(matrices: Tensor<3>, vector: Tensor<3>) -> Tensor<2> {
    (matrices * vector).sum_dim(2).squeeze_dim(2)
}

impl On {
    /// `[matrix, row, column]`.
    pub fn matrices(&self, all: impl Iterator<Item = Matrix>) -> Tensor<3> {
        let flat: Vec<f64> = all.flat_map(|matrix| (0..9).map(move |entry| matrix[(entry / 3, entry % 3)])).collect();
        let count = flat.len() / 9;
        self.tensor(flat, [count, 3, 3])
    }

    /// Host values as a constant of this kind and device; no gradient flows to them.
    pub fn tensor<const D: usize>(&self, values: Vec<f64>, shape: [usize; D]) -> Tensor<D> {
        Tensor::from_data(TensorData::new(values, shape), (&self.device, self.dtype))
    }
}
