//! Facts about triangle meshes.

use std::collections::HashMap;

/// Refuses a mesh that is not one closed, consistently oriented surface: every edge is used once in each direction, every
/// vertex is used, and the faces around a vertex form a single fan. The message says what was found.
pub fn check_closed(vertices: usize, faces: &[[usize; 3]]) -> Result<(), String> {
    // From vertex and its successor in a face to the third corner: walking around the vertex.
    let mut next = HashMap::new();
    let mut degree = vec![0; vertices];
    for (number, &[a, b, c]) in faces.iter().enumerate() {
        if let Some(&corner) = [a, b, c].iter().find(|&&corner| corner >= vertices) {
            return Err(format!("face {number} uses vertex {corner} of {vertices}"));
        }
        for [corner, from, to] in [[a, b, c], [b, c, a], [c, a, b]] {
            degree[corner] += 1;
            if corner == from || next.insert((corner, from), to).is_some() {
                return Err(format!("the edge from vertex {corner} to {from} belongs to more than one face on a side"));
            }
        }
    }
    if let Some(vertex) = degree.iter().position(|&degree| degree == 0) {
        return Err(format!("vertex {vertex} belongs to no face"));
    }
    let mut walked = vec![false; vertices];
    for &[a, b, c] in faces {
        for (vertex, start) in [(a, b), (b, c), (c, a)] {
            if std::mem::replace(&mut walked[vertex], true) {
                continue;
            }
            let (mut at, mut steps) = (start, 0);
            loop {
                at = *next
                    .get(&(vertex, at))
                    .ok_or_else(|| format!("the edge between vertices {vertex} and {at} has one face only"))?;
                steps += 1;
                if at == start {
                    break;
                }
            }
            if steps != degree[vertex] {
                return Err(format!("the surface touches itself at vertex {vertex}"));
            }
        }
    }
    Ok(())
}

/// Enclosed volume of a closed mesh, cubic metres; positive when the faces are counter-clockwise seen from outside.
pub fn volume(vertices: &[[f64; 3]], faces: &[[usize; 3]]) -> f64 {
    let signed = |face: &[usize; 3]| {
        let [a, b, c] = face.map(|vertex| nalgebra::Vector3::from(vertices[vertex]));
        a.dot(&b.cross(&c)) / 6.0
    };
    faces.iter().map(signed).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    #[test]
    fn a_tetrahedron_is_closed_and_has_a_sixth_of_the_cube() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(check_closed(4, &TETRAHEDRON), Ok(()));
        assert!((volume(&corners, &TETRAHEDRON) - 1.0 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn holes_flips_strays_and_pinches_are_named() {
        assert!(check_closed(4, &TETRAHEDRON[..3]).unwrap_err().contains("one face only"));
        let mut flipped = TETRAHEDRON;
        flipped[3] = [2, 1, 3];
        assert!(check_closed(4, &flipped).unwrap_err().contains("more than one face"));
        assert!(check_closed(5, &TETRAHEDRON).unwrap_err().contains("vertex 4 belongs to no face"));
        assert!(check_closed(3, &TETRAHEDRON).unwrap_err().contains("uses vertex 3 of 3"));
        // Two tetrahedra that share vertex 0 only.
        let other = TETRAHEDRON.map(|face| face.map(|vertex| if vertex == 0 { 0 } else { vertex + 3 }));
        assert!(check_closed(7, &[TETRAHEDRON, other].concat()).unwrap_err().contains("touches itself at vertex 0"));
    }
}
