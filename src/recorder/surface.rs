//! The surface as elements that are small enough to be summed: pieces of facets, vertices, or random points.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::mesh::vertex_normals;
use super::vector::{Vector, add_scaled, combine, cross, distance, dot, length, scale, subtract, unit};
use crate::error::{Error, Result};

/// Where the body's returns come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Returns {
    /// Tier A: the integral over the facets, each piece in closed form. Converged, so `edge_m` hardly matters.
    #[default]
    Facets,
    /// Tier A: the vertices themselves with a third of the area around them, as in the paper; not converged.
    Vertices,
    /// Tier B: a random point in every piece of a facet, lifted by a random height. Reproducible only from the seed.
    Random,
}

/// How the surface is cut up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfaceConfig {
    pub returns: Returns,
    /// Facets are cut until no edge is longer.
    pub edge_m: f64,
    /// 0: flat facets; 1: pulled onto the tangent planes of the vertices (Phong tessellation), which rounds the body.
    pub smoothing: f64,
    /// Root mean square height of the points of tier B, metres.
    pub height_m: f64,
    /// Spread of the reflectivity over the body, decibels, varying smoothly over `variation_scale_m`.
    pub variation_db: f64,
    pub variation_scale_m: f64,
}

impl Default for SurfaceConfig {
    fn default() -> Self {
        Self {
            returns: Returns::Facets,
            edge_m: 5.0e-3,
            smoothing: 0.0,
            height_m: 2.0e-4,
            variation_db: 2.0,
            variation_scale_m: 0.25,
        }
    }
}

impl SurfaceConfig {
    /// Refuses pieces and irregularities outside their limits; `key` names these settings in messages.
    pub fn check(&self, key: &str) -> Result<()> {
        if !(2.0e-4..=1.2e-2).contains(&self.edge_m) {
            return Err(Error::setting(format!("{key}.edge_m"), self.edge_m, "between 0.0002 and 0.012 metres")
                .with_hint("pieces longer than three wavelengths leave the closed form's range"));
        }
        for (name, value, most) in
            [("smoothing", self.smoothing, 1.0), ("height_m", self.height_m, 0.01), ("variation_db", self.variation_db, 40.0)]
        {
            if !(0.0..=most).contains(&value) {
                return Err(Error::setting(format!("{key}.{name}"), value, format!("between 0 and {most}")));
            }
        }
        if self.variation_scale_m.is_nan() || self.variation_scale_m <= 0.0 {
            return Err(Error::setting(format!("{key}.variation_scale_m"), self.variation_scale_m, "a positive number"));
        }
        Ok(())
    }
}

/// One piece of a facet, or one point on it, fixed to the material.
#[derive(Clone, Copy, Debug)]
pub struct Element {
    pub face: u32,
    /// Barycentric coordinates of the point whose phase stands for the element.
    pub point: Vector,
    /// Above the facet, metres.
    pub height_m: f64,
    /// Of the facet's area.
    pub share: f64,
    /// Amplitude relative to the material's.
    pub reflectivity: f64,
    /// One-way path beyond the geometric one, metres.
    pub extra_m: f64,
    /// `None`: a point without extent.
    pub cell: Option<Cell>,
}

/// One of the n² equal triangles of a facet.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    parts: u16,
    row: u16,
    column: u16,
    inverted: bool,
}

impl Cell {
    fn all(parts: usize) -> impl Iterator<Item = Self> {
        (0..parts).flat_map(move |row| {
            (0..2 * (parts - row) - 1).map(move |index| Self {
                parts: parts as u16,
                row: row as u16,
                column: (index / 2) as u16,
                inverted: index % 2 == 1,
            })
        })
    }

    /// Barycentric coordinates of the corners.
    pub fn corners(self) -> [Vector; 3] {
        let steps: [(u16, u16); 3] = if self.inverted { [(1, 1), (0, 1), (1, 0)] } else { [(0, 0), (1, 0), (0, 1)] };
        steps.map(|(right, up)| {
            let u = f64::from(self.column + right) / f64::from(self.parts);
            let v = f64::from(self.row + up) / f64::from(self.parts);
            [1.0 - u - v, u, v]
        })
    }

    fn at(self, barycentric: Vector) -> Vector {
        combine(&self.corners(), barycentric)
    }
}

/// Cuts every face. `vertices` fixes how finely, `reflectivity_db` is given per vertex. Sorted by face.
pub fn elements(
    vertices: &[Vector],
    faces: &[[usize; 3]],
    reflectivity_db: &[f64],
    config: &SurfaceConfig,
    rng: &mut ChaCha8Rng,
) -> Vec<Element> {
    let mut all = Vec::new();
    for (index, face) in faces.iter().enumerate() {
        let corners = face.map(|vertex| vertices[vertex]);
        let longest = (0..3).map(|i| distance(corners[i], corners[(i + 1) % 3])).fold(0.0, f64::max);
        let parts = ((longest / config.edge_m).ceil() as usize).clamp(1, 4096);
        let make = |point: Vector, height_m: f64, share: f64, cell: Option<Cell>| {
            let db: f64 = (0..3).map(|i| point[i] * reflectivity_db[face[i]]).sum();
            Element { face: index as u32, point, height_m, share, reflectivity: 10f64.powf(db / 20.0), extra_m: 0.0, cell }
        };
        let share = 1.0 / (parts * parts) as f64;
        match config.returns {
            Returns::Vertices => {
                let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                all.extend(corners.map(|corner| make(corner, 0.0, 1.0 / 3.0, None)));
            }
            Returns::Facets => all.extend(Cell::all(parts).map(|cell| make(cell.at([1.0 / 3.0; 3]), 0.0, share, Some(cell)))),
            Returns::Random => all.extend(Cell::all(parts).map(|cell| {
                let (mut u, mut v) = (rng.random::<f64>(), rng.random::<f64>());
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                let height: f64 = StandardNormal.sample(rng);
                make(cell.at([1.0 - u - v, u, v]), config.height_m * height, share, None)
            })),
        }
    }
    all
}

/// Vertices and, where the surface is smoothed, vertex normals of one instant.
pub struct Pose {
    /// `[vertex]`, metres, radar frame.
    pub vertices: Vec<Vector>,
    /// `[vertex]`, unit.
    pub normals: Option<Vec<Vector>>,
}

/// An element at one instant.
pub struct Patch {
    pub point: Vector,
    /// Unit, outward.
    pub normal: Vector,
    pub area_m2: f64,
    /// Of a piece of a facet, metres, radar frame.
    pub corners: Option<[Vector; 3]>,
}

impl Pose {
    /// Vertices (metres, radar frame), with vertex normals where `smoothing` is above zero.
    pub fn new(vertices: Vec<Vector>, faces: &[[usize; 3]], smoothing: f64) -> Self {
        let normals = (smoothing > 0.0).then(|| vertex_normals(&vertices, faces));
        Self { vertices, normals }
    }

    /// Place of barycentric coordinates on a face.
    fn place(&self, face: [usize; 3], barycentric: Vector, smoothing: f64) -> Vector {
        let flat = combine(&face.map(|vertex| self.vertices[vertex]), barycentric);
        let Some(normals) = &self.normals else { return flat };
        (0..3).fold(flat, |sum, i| {
            let normal = normals[face[i]];
            let height = dot(subtract(flat, self.vertices[face[i]]), normal);
            add_scaled(sum, normal, -smoothing * barycentric[i] * height)
        })
    }

    /// Where an element's phase is taken.
    pub fn point(&self, element: &Element, faces: &[[usize; 3]], smoothing: f64) -> Vector {
        let face = faces[element.face as usize];
        let point = self.place(face, element.point, smoothing);
        if element.height_m == 0.0 {
            return point;
        }
        let [a, b, c] = face.map(|vertex| self.vertices[vertex]);
        add_scaled(point, unit(cross(subtract(b, a), subtract(c, a))), element.height_m)
    }

    /// Where an element is now, which way it faces, and its area.
    pub fn patch(&self, element: &Element, faces: &[[usize; 3]], smoothing: f64) -> Patch {
        let face = faces[element.face as usize];
        let corners = match element.cell {
            Some(cell) if smoothing > 0.0 => cell.corners().map(|corner| self.place(face, corner, smoothing)),
            Some(cell) => {
                let whole = face.map(|vertex| self.vertices[vertex]);
                cell.corners().map(|corner| combine(&whole, corner))
            }
            None => face.map(|vertex| self.vertices[vertex]),
        };
        let doubled = cross(subtract(corners[1], corners[0]), subtract(corners[2], corners[0]));
        let doubled_area = length(doubled);
        let point = self.point(element, faces, smoothing);
        Patch {
            point,
            normal: scale(doubled, 1.0 / doubled_area.max(1e-300)),
            // A cell's own corners span its share already.
            area_m2: 0.5 * doubled_area * if element.cell.is_some() { 1.0 } else { element.share },
            corners: element.cell.map(|_| corners),
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn cut(returns: Returns, edge_m: f64) -> Vec<Element> {
        let config = SurfaceConfig { returns, edge_m, ..SurfaceConfig::default() };
        elements(&triangle(), &[[0, 1, 2]], &[0.0; 3], &config, &mut ChaCha8Rng::seed_from_u64(1))
    }

    fn triangle() -> Vec<Vector> {
        vec![[0.0, 0.0, 0.0], [0.03, 0.0, 0.0], [0.0, 0.02, 0.0]]
    }

    #[test]
    fn the_pieces_of_a_facet_have_its_area_and_its_normal() {
        for (returns, count) in [(Returns::Facets, 64), (Returns::Random, 64), (Returns::Vertices, 3)] {
            let elements = cut(returns, 4.9e-3);
            assert_eq!(elements.len(), count);
            let pose = Pose::new(triangle(), &[[0, 1, 2]], 0.0);
            let patches: Vec<_> = elements.iter().map(|element| pose.patch(element, &[[0, 1, 2]], 0.0)).collect();
            let area: f64 = patches.iter().map(|patch| patch.area_m2).sum();
            assert!((area - 3e-4).abs() < 1e-12, "{returns:?}: {area}");
            assert!(patches.iter().all(|patch| (patch.normal[2] - 1.0).abs() < 1e-12));
        }
    }

    #[test]
    fn a_centroid_is_the_mean_of_its_corners() {
        let pose = Pose::new(triangle(), &[[0, 1, 2]], 0.0);
        for element in cut(Returns::Facets, 4e-3) {
            let patch = pose.patch(&element, &[[0, 1, 2]], 0.0);
            let mean = combine(&patch.corners.unwrap(), [1.0 / 3.0; 3]);
            assert!(distance(mean, patch.point) < 1e-15);
        }
    }

    #[test]
    fn smoothing_rounds_an_octahedron_towards_its_sphere() {
        let vertices: Vec<Vector> =
            vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
        let faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]];
        let centre = [1.0 / 3.0; 3];
        let radius = |smoothing| length(Pose::new(vertices.clone(), &faces, smoothing).place(faces[0], centre, smoothing));
        assert!(radius(0.0) < 0.58 && radius(0.75) > 0.85 && radius(0.75) < 1.05);
    }
}
