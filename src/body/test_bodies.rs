//! Small bodies and meshes that the tests pose, and the shared ones where they are present.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::person::BodyModel;

/// A straight arm along x: joints at 0, 1 and 2, one vertex on each and a last one at 3 on the last joint.
pub fn arm() -> BodyModel {
    BodyModel {
        template: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]],
        shape_directions: vec![],
        pose_directions: vec![],
        joint_regressor: vec![vec![(0, 1.0)], vec![(1, 1.0)], vec![(2, 1.0)]],
        skinning: vec![vec![(0, 1.0)], vec![(0, 0.5), (1, 0.5)], vec![(1, 0.5), (2, 0.5)], vec![(2, 1.0)]],
        parents: vec![None, Some(0), Some(1)],
        faces: vec![[0, 1, 2], [1, 2, 3]],
    }
}

/// Random numbers in the layout of a body about a metre in size, with two shape parameters and pose blend shapes.
pub fn random_body(vertices: usize, joints: usize, seed: u64) -> BodyModel {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut points = |size: f64| -> Vec<[f64; 3]> {
        (0..vertices).map(|_| std::array::from_fn(|_| size * (rng.random::<f64>() - 0.5))).collect()
    };
    let template = points(1.5);
    let shape_directions = (0..2).map(|_| points(0.1)).collect();
    let pose_directions = (0..9 * (joints - 1)).map(|_| points(0.02)).collect();
    let mut weights = |count: usize, among: usize| -> Vec<(usize, f64)> {
        let raw: Vec<(usize, f64)> = (0..count).map(|_| (rng.random_range(0..among), rng.random::<f64>() + 0.1)).collect();
        let sum: f64 = raw.iter().map(|(_, weight)| weight).sum();
        raw.into_iter().map(|(index, weight)| (index, weight / sum)).collect()
    };
    BodyModel {
        template,
        shape_directions,
        pose_directions,
        joint_regressor: (0..joints).map(|_| weights(4, vertices)).collect(),
        skinning: (0..vertices).map(|_| weights(3, joints)).collect(),
        parents: (0..joints).map(|joint| (joint > 0).then(|| (joint - 1) / 2)).collect(),
        faces: (0..vertices - 2).map(|vertex| [vertex, vertex + 1, vertex + 2]).collect(),
    }
}

/// A sphere about the origin: an icosahedron split `level` times; vertices and outward faces.
pub fn sphere(level: usize, radius_m: f64) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let unit = |v: [f64; 3]| {
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        v.map(|x| x / length)
    };
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    for axis in 0..3 {
        for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            let mut vertex = [0.0; 3];
            vertex[axis] = a;
            vertex[(axis + 1) % 3] = b;
            vertices.push(unit(vertex));
        }
    }
    // The twenty faces are the triples of mutual nearest neighbours.
    let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
    let near = |a: usize, b: usize, vertices: &[[f64; 3]]| apart(vertices[a], vertices[b]) < 1.1;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b, &vertices) && near(b, c, &vertices) && near(a, c, &vertices) {
                    faces.push(outward(&vertices, [a, b, c]));
                }
            }
        }
    }
    for _ in 0..level {
        let mut middles = std::collections::HashMap::new();
        let mut split = Vec::with_capacity(4 * faces.len());
        for &[a, b, c] in &faces {
            let mut middle = |from: usize, to: usize| {
                *middles.entry((from.min(to), from.max(to))).or_insert_with(|| {
                    let (p, q) = (vertices[from], vertices[to]);
                    vertices.push(unit([p[0] + q[0], p[1] + q[1], p[2] + q[2]]));
                    vertices.len() - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            split.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        faces = split;
    }
    (vertices.into_iter().map(|vertex| vertex.map(|x| x * radius_m)).collect(), faces)
}

fn outward(vertices: &[[f64; 3]], [a, b, c]: [usize; 3]) -> [usize; 3] {
    let [p, q, r] = [a, b, c].map(|vertex| nalgebra::Vector3::from(vertices[vertex]));
    if (q - p).cross(&(r - p)).dot(&p) > 0.0 { [a, b, c] } else { [a, c, b] }
}

/// A body of the shared data, or `None` and a message where that is absent.
pub fn shared_body(name: &str) -> Option<BodyModel> {
    crate::support::shared(&format!("bodies/{name}.npz")).map(|path| crate::data::read_body(path).unwrap())
}
