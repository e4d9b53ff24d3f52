//! The body's surface as scatterers: which points of the mesh, and how much area each of them stands for.

use std::collections::BTreeSet;

use super::kinematics::Vector;
use super::surface_config::{Sampling, SurfaceConfig};
use crate::error::{Error, Result};

/// More scatterers than this cannot be meant (they would not fit into memory).
const MOST_POINTS: usize = 20_000_000;

impl SurfaceConfig {
    /// The surface of a mesh; the rest pose alone decides where it is split.
    ///
    /// `rest_m`: `[vertex, xyz]`, metres.
    pub fn init(&self, rest_m: &[[f64; 3]], faces: &[[usize; 3]]) -> Result<Surface> {
        self.check("surface")?;
        let mut surface = Surface {
            faces: faces.to_vec(),
            edges: edges(faces),
            corners: Vec::new(),
            weights: Vec::new(),
            shares: match self.sampling {
                Sampling::Vertices => Shares::Vertex,
                _ => Shares::Facet(Vec::new()),
            },
        };
        match self.sampling {
            Sampling::Vertices => {
                surface.corners = (0..rest_m.len()).map(|vertex| [vertex; 3]).collect();
                surface.weights = vec![[1.0, 0.0, 0.0]; rest_m.len()];
            }
            Sampling::Facets => {
                for facet in 0..faces.len() {
                    surface.push(facet, [1.0 / 3.0; 3], 1.0);
                }
            }
            Sampling::Subdivided => {
                let splits: Vec<usize> = faces.iter().map(|&face| splits(rest_m, face, self.edge_m)).collect();
                let points = splits.iter().map(|&n| 3.0 * n as f64 * (n as f64 + 1.0) / 2.0).sum::<f64>();
                if points > MOST_POINTS as f64 {
                    return Err(Error::setting(
                        "surface.edge_m",
                        self.edge_m,
                        format!("an edge that leaves at most {MOST_POINTS} points"),
                    )
                    .with_hint(format!(
                        "this one asks for {points:.1e}; half a wavelength is enough, and `facets` needs no splitting"
                    )));
                }
                for (facet, &n) in splits.iter().enumerate() {
                    for (weights, share) in edge_middles(n) {
                        surface.push(facet, weights, share);
                    }
                }
            }
        }
        Ok(surface)
    }
}

/// What a point's area is made of.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shares {
    /// Point = vertex: one third of each facet around it.
    Vertex,
    /// `[point]`: its facet and the part of it.
    Facet(Vec<(usize, f64)>),
}

/// The scatterers of a mesh, fixed once for all poses.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// `[face, 3]` vertices, counter-clockwise from outside.
    pub faces: Vec<[usize; 3]>,
    /// `[edge, 2]` vertices, each edge once, the lower vertex first: the graph for the graph convolution.
    pub edges: Vec<[usize; 2]>,
    /// `[point, 3]`: the vertices a point lies between.
    pub corners: Vec<[usize; 3]>,
    /// `[point, 3]`: its barycentric weights there; they sum to 1.
    pub weights: Vec<[f64; 3]>,
    pub(super) shares: Shares,
}

impl Surface {
    /// How many points there are.
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Whether the points are the vertices themselves.
    pub fn is_vertices(&self) -> bool {
        self.shares == Shares::Vertex
    }

    fn push(&mut self, facet: usize, weights: [f64; 3], share: f64) {
        self.corners.push(self.faces[facet]);
        self.weights.push(weights);
        if let Shares::Facet(shares) = &mut self.shares {
            shares.push((facet, share));
        }
    }

    /// A quantity of the vertices at the points, `[point, xyz]`.
    pub fn interpolate(&self, vertices: &[[f64; 3]]) -> Vec<[f64; 3]> {
        if self.is_vertices() {
            return vertices.to_vec();
        }
        self.corners
            .iter()
            .zip(&self.weights)
            .map(|(corners, weights)| {
                std::array::from_fn(|axis| {
                    corners.iter().zip(weights).map(|(&vertex, weight)| weight * vertices[vertex][axis]).sum()
                })
            })
            .collect()
    }

    /// Unit normals, `[point, xyz]`: the vertices' smooth normals, interpolated.
    pub fn normals(&self, vertices_m: &[[f64; 3]]) -> Vec<[f64; 3]> {
        self.interpolate(&vertex_normals(vertices_m, &self.faces)).into_iter().map(unit_or_up).collect()
    }

    /// `[point]`, m²; they sum to the area of the mesh, however fine the points are.
    pub fn areas_m2(&self, vertices_m: &[[f64; 3]]) -> Vec<f64> {
        let facet_m2: Vec<f64> = self.faces.iter().map(|&face| 0.5 * doubled_area(vertices_m, face).norm()).collect();
        match &self.shares {
            Shares::Vertex => {
                let mut areas = vec![0.0; vertices_m.len()];
                for (face, area) in self.faces.iter().zip(&facet_m2) {
                    for &vertex in face {
                        areas[vertex] += area / 3.0;
                    }
                }
                areas
            }
            Shares::Facet(shares) => shares.iter().map(|&(facet, share)| share * facet_m2[facet]).collect(),
        }
    }

    /// Carries a yes or no of the vertices (such as visibility) to the points: yes where the corners that say yes
    /// hold at least half of the weight.
    pub fn decide(&self, vertices: &[bool]) -> Vec<bool> {
        let yes = |(corners, weights): (&[usize; 3], &[f64; 3])| {
            corners.iter().zip(weights).filter(|(vertex, _)| vertices[**vertex]).map(|(_, weight)| weight).sum::<f64>()
                >= 0.5 - 1e-12
        };
        self.corners.iter().zip(&self.weights).map(yes).collect()
    }
}

/// Smooth unit normals, `[vertex, xyz]`: the normals of the facets around a vertex, weighted by area.
/// A vertex without any area gets a normal of zero.
pub fn vertex_normals(vertices_m: &[[f64; 3]], faces: &[[usize; 3]]) -> Vec<[f64; 3]> {
    let mut sums = vec![Vector::zeros(); vertices_m.len()];
    for &face in faces {
        let normal = doubled_area(vertices_m, face);
        for vertex in face {
            sums[vertex] += normal;
        }
    }
    sums.into_iter().map(|sum| sum.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector::zeros).into()).collect()
}

/// A direction of length one; up, where there is none (a degenerate facet has no area, so nothing comes of it).
fn unit_or_up(direction: [f64; 3]) -> [f64; 3] {
    Vector::from(direction).try_normalize(1e-12).unwrap_or_else(Vector::z).into()
}

/// Normal of a facet, twice as long as its area.
fn doubled_area(vertices_m: &[[f64; 3]], [a, b, c]: [usize; 3]) -> Vector {
    let corner = Vector::from(vertices_m[a]);
    (Vector::from(vertices_m[b]) - corner).cross(&(Vector::from(vertices_m[c]) - corner))
}

fn edges(faces: &[[usize; 3]]) -> Vec<[usize; 2]> {
    let mut unique = BTreeSet::new();
    for &[a, b, c] in faces {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if from != to {
                unique.insert([from.min(to), from.max(to)]);
            }
        }
    }
    unique.into_iter().collect()
}

/// Into how many parts each edge of a facet is split.
fn splits(rest_m: &[[f64; 3]], [a, b, c]: [usize; 3], edge_m: f64) -> usize {
    let length = |from: usize, to: usize| (Vector::from(rest_m[from]) - Vector::from(rest_m[to])).norm();
    let longest = length(a, b).max(length(b, c)).max(length(c, a));
    ((longest / edge_m).ceil() as usize).max(1)
}

/// The middles of all edges of a triangle split into n² equal ones: barycentric weights and part of the area.
///
/// The three edge middles of a triangle integrate second-order polynomials exactly, so this converges faster than
/// the triangles' centres or corners do, with 1.5 points per triangle.
fn edge_middles(n: usize) -> impl Iterator<Item = ([f64; 3], f64)> {
    let share = 1.0 / (3.0 * (n * n) as f64);
    // In half steps of the lattice: edge middles are where exactly one of three coordinates that sum to 2n is even.
    (0..=2 * n).flat_map(move |i| (0..=2 * n - i).map(move |j| [i, j, 2 * n - i - j])).filter_map(move |halves| {
        if halves.iter().filter(|&&half| half % 2 == 0).count() != 1 {
            return None;
        }
        // An edge on the border belongs to one small triangle, an inner one to two.
        let triangles = if halves.contains(&0) { 1.0 } else { 2.0 };
        Some((halves.map(|half| half as f64 / (2 * n) as f64), share * triangles))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::test_bodies::sphere;

    const WAVELENGTH_M: f64 = 3.8e-3;
    const CENTRE: [f64; 3] = [0.1, 2.0, 0.05];

    fn config(sampling: Sampling, edge_m: f64) -> SurfaceConfig {
        SurfaceConfig { sampling, edge_m, ..Default::default() }
    }

    /// Coherent return of the lit side, with the cosine of incidence as amplitude.
    fn coherent_return(surface: &Surface, vertices: &[[f64; 3]]) -> (f64, f64) {
        let k = std::f64::consts::TAU / WAVELENGTH_M;
        let points = surface.interpolate(vertices);
        let (normals, areas) = (surface.normals(vertices), surface.areas_m2(vertices));
        let (mut re, mut im) = (0.0, 0.0);
        for ((point, normal), area) in points.iter().zip(&normals).zip(&areas) {
            let position = Vector::from(*point) + Vector::from(CENTRE);
            let distance = position.norm();
            let cosine = (-Vector::from(*normal).dot(&position) / distance).max(0.0);
            let phase = 2.0 * k * distance;
            re += area * cosine * phase.cos();
            im += area * cosine * phase.sin();
        }
        (re, im)
    }

    fn relative_db(a: (f64, f64), reference: (f64, f64)) -> f64 {
        let change = (a.0 - reference.0).hypot(a.1 - reference.1);
        20.0 * (change / reference.0.hypot(reference.1)).log10()
    }

    #[test]
    fn refining_below_half_a_wavelength_no_longer_changes_the_return() {
        let (vertices, faces) = sphere(3, 0.15);
        let at = |edge: f64| coherent_return(&config(Sampling::Subdivided, edge).init(&vertices, &faces).unwrap(), &vertices);
        let (fine, finer) = (at(0.3 * WAVELENGTH_M), at(0.15 * WAVELENGTH_M));
        let change = relative_db(fine, finer);
        println!("λ/2: {:.1} dB, 0.3 λ: {change:.1} dB against 0.15 λ", relative_db(at(0.5 * WAVELENGTH_M), finer));
        assert!(change < -60.0, "{change} dB");
        assert!(relative_db(at(0.5 * WAVELENGTH_M), finer) < -38.0);
    }

    #[test]
    fn vertices_far_apart_are_many_decibels_off() {
        let (vertices, faces) = sphere(3, 0.15);
        let size = |surface: Surface| {
            let (re, im) = coherent_return(&surface, &vertices);
            20.0 * re.hypot(im).log10()
        };
        let excess = size(config(Sampling::Vertices, 1.0).init(&vertices, &faces).unwrap())
            - size(config(Sampling::Subdivided, 1.1e-3).init(&vertices, &faces).unwrap());
        // Vertices some 20 mm apart add up with unrelated phases; on this mesh to 12.8 dB (what this test prints).
        println!("vertices: {excess} dB too much");
        assert!((excess - 12.8).abs() < 0.1, "{excess} dB");
    }

    #[test]
    fn areas_always_sum_to_the_mesh() {
        let (vertices, faces) = sphere(2, 0.3);
        let whole: f64 = faces.iter().map(|&face| 0.5 * doubled_area(&vertices, face).norm()).sum();
        for (sampling, edge) in
            [(Sampling::Vertices, 1.0), (Sampling::Facets, 1.0), (Sampling::Subdivided, 0.05), (Sampling::Subdivided, 0.011)]
        {
            let surface = config(sampling, edge).init(&vertices, &faces).unwrap();
            assert!((surface.areas_m2(&vertices).iter().sum::<f64>() / whole - 1.0).abs() < 1e-12, "{sampling:?} {edge}");
            assert!(surface.weights.iter().all(|weights| (weights.iter().sum::<f64>() - 1.0).abs() < 1e-12));
        }
    }

    #[test]
    fn edge_middles_integrate_second_order_polynomials() {
        for n in 1..6 {
            let all: Vec<_> = edge_middles(n).collect();
            assert_eq!(all.len(), 3 * n * (n + 1) / 2);
            let mean = |f: fn([f64; 3]) -> f64| all.iter().map(|&(weights, share)| share * f(weights)).sum::<f64>();
            assert!((mean(|_| 1.0) - 1.0).abs() < 1e-12);
            assert!((mean(|[a, _, _]| a) - 1.0 / 3.0).abs() < 1e-12);
            assert!((mean(|[a, _, _]| a * a) - 1.0 / 6.0).abs() < 1e-12, "{n}");
            assert!((mean(|[a, b, _]| a * b) - 1.0 / 12.0).abs() < 1e-12, "{n}");
        }
    }

    #[test]
    fn normals_point_outwards_and_a_degenerate_facet_is_harmless() {
        let (mut vertices, mut faces) = sphere(2, 1.0);
        for (normal, vertex) in vertex_normals(&vertices, &faces).iter().zip(&vertices) {
            assert!(Vector::from(*normal).dot(&Vector::from(*vertex)) > 0.99);
        }
        vertices.push([2.0, 2.0, 2.0]);
        let lonely = vertices.len() - 1;
        faces.push([lonely, lonely, 0]);
        for sampling in [Sampling::Vertices, Sampling::Subdivided, Sampling::Facets] {
            let surface = config(sampling, 0.1).init(&vertices, &faces).unwrap();
            for normal in surface.normals(&vertices) {
                assert!((Vector::from(normal).norm() - 1.0).abs() < 1e-12);
            }
            assert!(surface.areas_m2(&vertices).iter().all(|area| area.is_finite()));
        }
    }

    #[test]
    fn the_graph_has_each_edge_once() {
        let (vertices, faces) = sphere(1, 1.0);
        // Euler: V − E + F = 2.
        assert_eq!(vertices.len() + faces.len() - edges(&faces).len(), 2);
    }

    #[test]
    fn an_edge_of_zero_or_of_a_micrometre_is_refused() {
        let (vertices, faces) = sphere(1, 1.0);
        let error = config(Sampling::Subdivided, 0.0).init(&vertices, &faces).unwrap_err();
        assert!(error.to_string().starts_with("`surface.edge_m` is 0, expected a length above zero"), "{error}");
        let error = config(Sampling::Subdivided, 1e-6).init(&vertices, &faces).unwrap_err();
        assert!(error.to_string().contains("at most 20000000 points"), "{error}");
    }

    #[test]
    fn a_point_follows_the_majority_of_its_corners() {
        let surface =
            config(Sampling::Subdivided, 10.0).init(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]]).unwrap();
        let seen = surface.decide(&[true, false, false]);
        // The middles of the two edges at vertex 0 are seen, the middle of the far edge is not.
        assert_eq!(seen.iter().filter(|&&seen| seen).count(), 2);
        assert!(surface.decide(&[false; 3]).iter().all(|&seen| !seen));
    }
}
