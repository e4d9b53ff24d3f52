//! Persons that the checks' tests look at.

use super::Facts;
use crate::person::Person;
use crate::radar::Radar;
use crate::room::Room;

/// A box from `low` to `high`, its faces outwards.
pub fn cuboid(low: [f64; 3], size: [f64; 3]) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let corner = |index: usize| std::array::from_fn(|axis| low[axis] + if index >> axis & 1 == 1 { size[axis] } else { 0.0 });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    ((0..8).map(corner).collect(), faces)
}

/// A box of a person's size whose low corner goes from place to place, ten times a second.
pub fn walker(places: &[[f64; 3]]) -> Person {
    let meshes: Vec<_> = places.iter().map(|&place| cuboid(place, [0.5, 0.3, 1.7]).0).collect();
    Person::Meshes {
        faces: cuboid([0.0; 3], [1.0; 3]).1,
        pose_times_s: (0..places.len()).map(|pose| 0.1 * pose as f64).collect(),
        vertices: meshes,
    }
}

/// Facts of such a person before the small radar, with as many frames as the motion has.
pub fn facts(person: &Person, room: Room) -> Facts {
    let Person::Meshes { vertices, .. } = person else { unreachable!("a walker is a sequence of meshes") };
    let radar = Radar::small(vertices.len() - 1);
    Facts::new(Some(&radar), Some(&room), Some(person), &|pose| vertices[pose].clone())
}
