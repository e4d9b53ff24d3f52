//! Which joints move each vertex, and how the vertices follow a changed skeleton.

use nalgebra::Vector3;

use super::{
    skeleton::{Bone, Skeleton},
    surface::Mesh,
};

/// SMPL's limit of joints per vertex.
const MOST_JOINTS: usize = 4;
/// How far a joint's influence reaches over its neighbour, as a fraction of the skeleton's pelvis height.
const REACH: f64 = 0.040;

/// `[vertex]` → (joint, weight), at most four, positive, sum 1.
///
/// Each vertex starts with its nearest bone, and the assignment diffuses over the mesh: along the surface, so that nothing
/// leaks from one leg to the other.
pub fn weights(mesh: &Mesh, skeleton: &Skeleton) -> Vec<Vec<(usize, f64)>> {
    let joints = skeleton.joints.len();
    let mut dense: Vec<Vec<f64>> = mesh
        .vertices
        .iter()
        .map(|vertex| {
            let distance = |bone: &Bone| bone.relative_distance(vertex);
            let nearest = skeleton.bones.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let mut row = vec![0.0; joints];
            row[nearest.map_or(0, |bone| bone.joint)] = 1.0;
            row
        })
        .collect();
    let neighbours = mesh.neighbours();
    for _ in 0..diffusion_steps(mesh, skeleton, &neighbours) {
        dense = dense
            .iter()
            .zip(&neighbours)
            .map(|(row, around)| {
                let share = 0.5 / around.len() as f64;
                let spread = |joint: usize| around.iter().map(|&other| dense[other][joint]).sum::<f64>();
                row.iter().enumerate().map(|(joint, weight)| 0.5 * weight + share * spread(joint)).collect()
            })
            .collect();
    }
    dense.into_iter().map(sparse).collect()
}

/// A step with half the neighbours' mean spreads by about half an edge's length squared.
fn diffusion_steps(mesh: &Mesh, skeleton: &Skeleton, neighbours: &[Vec<usize>]) -> usize {
    let lengths = neighbours.iter().enumerate().flat_map(|(vertex, around)| {
        around.iter().map(move |&other| (mesh.vertices[vertex] - mesh.vertices[other]).norm_squared())
    });
    let (sum, count) = lengths.fold((0.0, 0.0), |(sum, count), squared| (sum + squared, count + 1.0));
    let reach = REACH * skeleton.floor_m / 0.94;
    (2.0 * reach * reach / (sum / count)).round().max(1.0) as usize
}

/// The largest weights, renormalised.
fn sparse(row: Vec<f64>) -> Vec<(usize, f64)> {
    let mut weights: Vec<(usize, f64)> = row.into_iter().enumerate().filter(|&(_, weight)| weight > 1e-4).collect();
    weights.sort_by(|a, b| b.1.total_cmp(&a.1));
    weights.truncate(MOST_JOINTS);
    let sum: f64 = weights.iter().map(|&(_, weight)| weight).sum();
    weights.iter_mut().for_each(|(_, weight)| *weight /= sum);
    weights.sort_by_key(|&(joint, _)| joint);
    weights
}

/// The vertices after the bones moved from one skeleton to another of the same kind: each keeps its offset from the
/// places on the bones that it belongs to.
pub fn carry(vertices: &[Vector3<f64>], skinning: &[Vec<(usize, f64)>], from: &Skeleton, to: &Skeleton) -> Vec<Vector3<f64>> {
    vertices
        .iter()
        .zip(skinning)
        .map(|(vertex, weights)| {
            let (mut moved, mut total) = (Vector3::zeros(), 0.0);
            for &(joint, weight) in weights {
                let own = from.bones.iter().zip(&to.bones).filter(|(bone, _)| bone.joint == joint);
                for (old, new) in own {
                    let fraction = old.nearest(vertex);
                    // Where several bones belong to one joint, the nearer ones count more, without a jump.
                    let share = weight * (old.relative_distance(vertex) + 0.05).powi(-4);
                    moved += (new.at(fraction) - old.at(fraction)) * share;
                    total += share;
                }
            }
            vertex + moved / total
        })
        .collect()
}
