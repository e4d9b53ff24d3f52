//! Who is seen: rays from the viewpoint against the mesh.

use parry3d_f64::math::Vector as ParryVector;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::TriMesh;
use rayon::prelude::*;

use super::surface::{Element, Pose};
use super::vector::{Vector, combine, cross, distance, dot, subtract, unit};
use crate::error::{Error, Result};

/// The mesh of one instant as an obstacle.
pub struct Obstacle<'a> {
    mesh: TriMesh,
    pose: &'a Pose,
    faces: &'a [[usize; 3]],
    smoothing: f64,
    /// An element does not hide behind what is closer to it than this.
    margin_m: f64,
}

/// Facets up to this size are judged by their corners when those agree.
const SMALL_FACET_M: f64 = 0.025;

impl<'a> Obstacle<'a> {
    /// The mesh of a pose.
    ///
    /// # Errors
    /// Faces that make no mesh of triangles.
    pub fn new(pose: &'a Pose, faces: &'a [[usize; 3]], smoothing: f64) -> Result<Self> {
        let vertices = pose.vertices.iter().map(|v| ParryVector::new(v[0], v[1], v[2])).collect();
        let mesh = TriMesh::new(vertices, faces.iter().map(|face| face.map(|vertex| vertex as u32)).collect())
            .map_err(|error| Error::setting("person.faces", error, "a mesh of triangles"))?;
        // A smoothed surface lies up to some millimetres inside or outside of the facets that cast the shadow.
        let margin_m = if smoothing > 0.0 { 6.0e-3 } else { 1.0e-3 };
        Ok(Self { mesh, pose, faces, smoothing, margin_m })
    }

    /// Whether the straight line from `viewpoint` to `point` is free.
    pub fn sees(&self, viewpoint: Vector, point: Vector) -> bool {
        let direction = unit(subtract(point, viewpoint));
        let reach = distance(point, viewpoint) - self.margin_m;
        let ray = Ray::new(
            ParryVector::new(viewpoint[0], viewpoint[1], viewpoint[2]),
            ParryVector::new(direction[0], direction[1], direction[2]),
        );
        reach <= 0.0 || !self.mesh.intersects_local_ray(&ray, reach)
    }

    /// `[element]`: faces the viewpoint and is not hidden. `elements` must be sorted by face.
    pub fn visible(&self, elements: &[Element], viewpoint: Vector) -> Vec<bool> {
        let groups: Vec<&[Element]> = elements.chunk_by(|a, b| a.face == b.face).collect();
        let judged: Vec<Vec<bool>> = groups.into_par_iter().map(|group| self.visible_on_face(group, viewpoint)).collect();
        judged.concat()
    }

    fn visible_on_face(&self, group: &[Element], viewpoint: Vector) -> Vec<bool> {
        let corners = self.faces[group[0].face as usize].map(|vertex| self.pose.vertices[vertex]);
        let normal = cross(subtract(corners[1], corners[0]), subtract(corners[2], corners[0]));
        if self.smoothing == 0.0 && dot(normal, subtract(viewpoint, corners[0])) <= 0.0 {
            return vec![false; group.len()];
        }
        let longest = (0..3).map(|i| distance(corners[i], corners[(i + 1) % 3])).fold(0.0, f64::max);
        if self.smoothing == 0.0 && longest <= SMALL_FACET_M && group.len() > 4 {
            let probes = [[1.0 / 3.0; 3], [0.96, 0.02, 0.02], [0.02, 0.96, 0.02], [0.02, 0.02, 0.96]];
            let seen = probes.map(|probe| self.sees(viewpoint, combine(&corners, probe)));
            if seen.iter().all(|&s| s == seen[0]) {
                return vec![seen[0]; group.len()];
            }
        }
        let seen = |element: &Element| {
            let patch = self.pose.patch(element, self.faces, self.smoothing);
            dot(patch.normal, subtract(viewpoint, patch.point)) > 0.0 && self.sees(viewpoint, patch.point)
        };
        group.iter().map(seen).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recorder::test_support::{plate, sphere};

    #[test]
    fn a_plate_hides_what_is_behind_it_and_nothing_else() {
        // A small plate in front of a large one, the radar at the origin.
        let (mut vertices, mut faces) = plate([0.0, 2.0, 0.0], 0.2, 4);
        let (far, far_faces) = plate([0.0, 3.0, 0.0], 1.0, 24);
        let offset = vertices.len();
        vertices.extend(far);
        faces.extend(far_faces.iter().map(|face| face.map(|vertex| vertex + offset)));
        let pose = Pose::new(vertices, &faces, 0.0);
        let obstacle = Obstacle::new(&pose, &faces, 0.0).unwrap();
        for (x, seen) in [(0.0, false), (0.1, false), (0.14, false), (0.16, true), (0.4, true)] {
            assert_eq!(obstacle.sees([0.0; 3], [x, 3.0, 0.0]), seen, "at {x}");
        }
    }

    #[test]
    fn of_a_sphere_the_cap_up_to_the_tangent_is_seen() {
        let (vertices, faces) = sphere([0.0, 2.0, 0.0], 0.5, 4);
        let pose = Pose::new(vertices, &faces, 0.0);
        let obstacle = Obstacle::new(&pose, &faces, 0.0).unwrap();
        let elements: Vec<Element> = (0..faces.len() as u32)
            .map(|face| Element {
                face,
                point: [1.0 / 3.0; 3],
                height_m: 0.0,
                share: 1.0,
                reflectivity: 1.0,
                extra_m: 0.0,
                cell: None,
            })
            .collect();
        let visible = obstacle.visible(&elements, [0.0; 3]).iter().filter(|&&v| v).count() as f64 / faces.len() as f64;
        // A cap of height a (1 − a/d) over a sphere of height 2a.
        assert!((visible - 0.5 * (1.0 - 0.5 / 2.0)).abs() < 0.02, "{visible}");
    }
}
