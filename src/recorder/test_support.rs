//! Small scenes for the recorder's tests.

use super::vector::{Vector, add, scale, unit};
use super::world::World;
use crate::person::Person;
use crate::radar::Radar;

/// A square of `side` metres facing the radar (−y), cut into 2 n² triangles.
pub fn plate(centre: Vector, side: f64, n: usize) -> (Vec<Vector>, Vec<[usize; 3]>) {
    let mut vertices = vec![];
    for row in 0..=n {
        for column in 0..=n {
            let at = |index: usize| side * (index as f64 / n as f64 - 0.5);
            vertices.push(add(centre, [at(column), 0.0, at(row)]));
        }
    }
    let mut faces = vec![];
    for row in 0..n {
        for column in 0..n {
            let a = row * (n + 1) + column;
            let (b, c, d) = (a + 1, a + n + 1, a + n + 2);
            faces.extend([[a, b, d], [a, d, c]]);
        }
    }
    (vertices, faces)
}

/// An icosahedron whose faces are halved `levels` times, on a sphere.
pub fn sphere(centre: Vector, radius: f64, levels: usize) -> (Vec<Vector>, Vec<[usize; 3]>) {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut directions: Vec<Vector> = vec![];
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        directions.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]]);
    }
    let mut directions: Vec<Vector> = directions.into_iter().map(unit).collect();
    let edge = 1.06;
    let near = |a: Vector, b: Vector| super::vector::distance(a, b) < edge;
    let mut faces: Vec<[usize; 3]> = vec![];
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [a, b, c] = [i, j, k].map(|v| directions[v]);
                if near(a, b) && near(b, c) && near(a, c) {
                    let normal = super::vector::cross(super::vector::subtract(b, a), super::vector::subtract(c, a));
                    faces.push(if super::vector::dot(normal, a) > 0.0 { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut finer = vec![];
        for [a, b, c] in faces {
            let mut middle = |p: usize, q: usize| {
                *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                    directions.push(unit(add(directions[p], directions[q])));
                    directions.len() - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = finer;
    }
    (directions.into_iter().map(|direction| add(centre, scale(direction, radius))).collect(), faces)
}

/// A mesh that moves with a constant velocity from 0 to 1 s.
pub fn gliding(mesh: (Vec<Vector>, Vec<[usize; 3]>), velocity: Vector) -> Person {
    let (vertices, faces) = mesh;
    let later = vertices.iter().map(|&vertex| add(vertex, velocity)).collect();
    Person::Meshes { vertices: vec![vertices, later], faces, pose_times_s: vec![0.0, 1.0] }
}

/// A mesh that glides and turns about a vertical axis through `pivot`, 1000 poses per second for 10 ms.
pub fn turning(mesh: (Vec<Vector>, Vec<[usize; 3]>), pivot: Vector, velocity: Vector, turn_rad_per_s: f64) -> Person {
    let (vertices, faces) = mesh;
    let pose_times_s: Vec<f64> = (0..=10).map(|pose| 1.0e-3 * pose as f64).collect();
    let at = |time: f64| {
        let rotation = super::skinning::rodrigues([0.0, 0.0, turn_rad_per_s * time]);
        let place = |&vertex: &Vector| {
            let turned = super::vector::rotate(&rotation, super::vector::subtract(vertex, pivot));
            add(add(pivot, turned), scale(velocity, time))
        };
        vertices.iter().map(place).collect()
    };
    Person::Meshes { vertices: pose_times_s.iter().map(|&time| at(time)).collect(), faces, pose_times_s }
}

/// A world with nothing but this body: no room, no noise, no unknown gain.
pub fn bare_world(radar: Radar, person: Person) -> World {
    World { radar, person: Some(person), ..World::empty() }
}
