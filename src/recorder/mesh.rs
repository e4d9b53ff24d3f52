//! The normals of a mesh.

use super::vector::{Vector, add, cross, subtract, unit};

/// Unit normals `[vertex, xyz]`, area-weighted; outward where the faces are counter-clockwise seen from outside.
pub fn vertex_normals(vertices: &[Vector], faces: &[[usize; 3]]) -> Vec<Vector> {
    let mut normals = vec![[0.0; 3]; vertices.len()];
    for face in faces {
        let [a, b, c] = face.map(|vertex| vertices[vertex]);
        let doubled_area = cross(subtract(b, a), subtract(c, a));
        for &vertex in face {
            normals[vertex] = add(normals[vertex], doubled_area);
        }
    }
    normals.into_iter().map(unit).collect()
}
