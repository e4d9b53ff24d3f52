//! The joint regressor of the generated person.

use nalgebra::{DMatrix, DVector, Vector3};

/// Vertices that a joint is computed from.
const SUPPORT: usize = 96;

/// `[joint]` → (vertex, weight): the weights nearest to a plain mean of the vertices around the joint that sum to 1,
/// reproduce the joint, and reproduce its displacement under every shape direction.
///
/// `shape_directions` is `[shape][vertex]` and `joint_directions` `[shape][joint]`, metres per unit.
pub fn solve(
    vertices: &[Vector3<f64>],
    shape_directions: &[Vec<Vector3<f64>>],
    joints: &[Vector3<f64>],
    joint_directions: &[Vec<Vector3<f64>>],
) -> Vec<Vec<(usize, f64)>> {
    joints
        .iter()
        .enumerate()
        .map(|(joint, position)| {
            let support = nearest(vertices, position);
            let rows = 4 + 3 * shape_directions.len();
            // Each equation in units of the error it may have: 1 µm in the rest pose, 0.1 mm per unit of a shape parameter.
            let scale = |row: usize| if row < 4 { 1e6 } else { 1e4 };
            let constraints = DMatrix::from_fn(rows, support.len(), |row, column| {
                let vertex = support[column];
                scale(row)
                    * match row {
                        0 => 1.0,
                        1..4 => vertices[vertex][row - 1] - position[row - 1],
                        _ => shape_directions[(row - 4) / 3][vertex][(row - 4) % 3],
                    }
            });
            let wanted = DVector::from_fn(rows, |row, _| match row {
                0 => scale(row),
                1..4 => 0.0,
                _ => scale(row) * joint_directions[(row - 4) / 3][joint][(row - 4) % 3],
            });
            let even = DVector::from_element(support.len(), 1.0 / support.len() as f64);
            let missing = wanted - &constraints * &even;
            // The smallest correction that meets the equations, each to about its error.
            let gram = &constraints * constraints.transpose() + DMatrix::identity(rows, rows);
            let correction =
                gram.lu().solve(&missing).map_or(DVector::zeros(support.len()), |found| constraints.transpose() * found);
            let mut weights: Vec<(usize, f64)> = support.into_iter().zip((even + correction).iter().copied()).collect();
            weights.sort_by_key(|&(vertex, _)| vertex);
            weights
        })
        .collect()
}

fn nearest(vertices: &[Vector3<f64>], joint: &Vector3<f64>) -> Vec<usize> {
    let mut order: Vec<usize> = (0..vertices.len()).collect();
    order.sort_by(|&a, &b| (vertices[a] - joint).norm_squared().total_cmp(&(vertices[b] - joint).norm_squared()));
    order.truncate(SUPPORT);
    order
}
