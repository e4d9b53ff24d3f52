//! From the implicit surface to triangles: surface nets, then relaxation along the surface.
//!
//! Written here rather than taken from a crate: the grid must mirror at x = 0 so that the gap between the legs is sampled
//! where it is widest, and vertices move in double precision.

use std::collections::HashMap;

use nalgebra::{Vector3, vector};

use super::flesh::Flesh;

pub struct Mesh {
    pub vertices: Vec<Vector3<f64>>,
    /// Counter-clockwise seen from outside.
    pub faces: Vec<[usize; 3]>,
}

impl Mesh {
    /// The vertices that share an edge with each vertex, ascending.
    pub fn neighbours(&self) -> Vec<Vec<usize>> {
        let mut neighbours = vec![Vec::new(); self.vertices.len()];
        for face in &self.faces {
            for corner in 0..3 {
                neighbours[face[corner]].push(face[(corner + 1) % 3]);
            }
        }
        // In a closed mesh every edge is met once in each direction, so nothing is listed twice.
        neighbours.iter_mut().for_each(|list| list.sort_unstable());
        neighbours
    }
}

/// A regular grid of signed values, x fastest.
struct Grid {
    size: [usize; 3],
    low: Vector3<f64>,
    spacing_m: f64,
    values: Vec<f64>,
}

impl Grid {
    fn sample(flesh: &Flesh, spacing_m: f64) -> Self {
        let (low, high) = flesh.extent();
        // Whole multiples of the spacing, so that one plane of nodes lies at x = 0.
        let first = low.map(|value| (value / spacing_m).floor() - 1.0);
        let last = high.map(|value| (value / spacing_m).ceil() + 1.0);
        let size = std::array::from_fn(|axis| (last[axis] - first[axis]) as usize + 1);
        let mut grid = Self { size, low: first * spacing_m, spacing_m, values: Vec::new() };
        grid.values = (0..size.iter().product()).map(|node| flesh.value(&grid.position(node))).collect();
        grid
    }

    fn coordinates(&self, node: usize) -> [usize; 3] {
        [node % self.size[0], node / self.size[0] % self.size[1], node / (self.size[0] * self.size[1])]
    }

    fn position(&self, node: usize) -> Vector3<f64> {
        let [x, y, z] = self.coordinates(node).map(|index| index as f64);
        self.low + vector![x, y, z] * self.spacing_m
    }

    fn stride(&self, axis: usize) -> usize {
        [1, self.size[0], self.size[0] * self.size[1]][axis]
    }

    fn crosses(&self, start: usize, axis: usize) -> bool {
        (self.values[start] < 0.0) != (self.values[start + self.stride(axis)] < 0.0)
    }

    fn crossing(&self, start: usize, axis: usize) -> Vector3<f64> {
        let end = start + self.stride(axis);
        let (from, to) = (self.values[start], self.values[end]);
        self.position(start).lerp(&self.position(end), from / (from - to))
    }

    /// The closed curves that the surface cuts into the faces of the cell whose lowest corner is `node`, each as the list
    /// of crossed edges (lowest node, axis). Nearly always there is one; two sheets in a cell must not share a vertex.
    fn sheets(&self, node: usize) -> Vec<Vec<(usize, usize)>> {
        let mut sheets: Vec<Vec<(usize, usize)>> = Vec::new();
        for axis in 0..3 {
            let (first, second) = (self.stride((axis + 1) % 3), self.stride((axis + 2) % 3));
            for start in [node, node + first, node + second, node + first + second] {
                if self.crosses(start, axis) {
                    sheets.push(vec![(start, axis)]);
                }
            }
        }
        for axis in 0..3 {
            let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
            let (a, b) = (self.stride(first), self.stride(second));
            for corner in [node, node + self.stride(axis)] {
                // The edges around this face of the cell, in turn; number n and n + 1 meet at `meets[n]`.
                let edges = [(corner, first), (corner + a, second), (corner + b, first), (corner, second)];
                let meets = [corner + a, corner + a + b, corner + b, corner];
                let crossed: Vec<(usize, usize)> =
                    edges.into_iter().filter(|&(start, along)| self.crosses(start, along)).collect();
                match crossed[..] {
                    [one, other] => join(&mut sheets, one, other),
                    // Both diagonals differ: cut off the two corners that are inside.
                    [_, _, _, _] => (0..4)
                        .filter(|&turn| self.values[meets[turn]] < 0.0)
                        .for_each(|turn| join(&mut sheets, edges[turn], edges[(turn + 1) % 4])),
                    _ => {}
                }
            }
        }
        sheets
    }
}

/// Unites the two sheets that hold these edges.
fn join(sheets: &mut Vec<Vec<(usize, usize)>>, one: (usize, usize), other: (usize, usize)) {
    let holding = |edge| sheets.iter().position(|sheet| sheet.contains(&edge));
    if let (Some(low), Some(high)) = (holding(one), holding(other))
        && low != high
    {
        let moved = sheets.swap_remove(low.max(high));
        sheets[low.min(high)].extend(moved);
    }
}

/// A mesh of the surface whose edges are about `spacing_m` long.
pub fn extract(flesh: &Flesh, spacing_m: f64) -> Mesh {
    let grid = Grid::sample(flesh, spacing_m);
    let mut mesh = Mesh { vertices: Vec::new(), faces: Vec::new() };
    // A vertex for every sheet of the surface in a cell, found again by the cell and any edge that the sheet crosses.
    let mut vertex_at = HashMap::new();
    // Every grid edge that the surface crosses becomes a quad between the four cells around it.
    for node in 0..grid.values.len() {
        let place = grid.coordinates(node);
        for axis in 0..3 {
            let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
            // The grid's outermost nodes are outside, so the surface crosses no edge of its border.
            let inner = place[axis] + 1 < grid.size[axis] && place[first] > 0 && place[second] > 0;
            if !inner || !grid.crosses(node, axis) {
                continue;
            }
            let (a, b) = (grid.stride(first), grid.stride(second));
            let mut quad = [node - a - b, node - b, node, node - a].map(|cell| {
                if !vertex_at.contains_key(&(cell, node, axis)) {
                    for sheet in grid.sheets(cell) {
                        let sum: Vector3<f64> = sheet.iter().map(|&(start, axis)| grid.crossing(start, axis)).sum();
                        sheet.iter().for_each(|&(start, axis)| {
                            vertex_at.insert((cell, start, axis), mesh.vertices.len());
                        });
                        mesh.vertices.push(sum / sheet.len() as f64);
                    }
                }
                vertex_at[&(cell, node, axis)]
            });
            if grid.values[node] >= 0.0 {
                quad.reverse();
            }
            mesh.faces.extend(split(quad, &mesh.vertices));
        }
    }
    relax(&mut mesh, flesh);
    mesh
}

/// Two triangles with the shorter diagonal between them.
fn split([a, b, c, d]: [usize; 4], vertices: &[Vector3<f64>]) -> [[usize; 3]; 2] {
    let length = |from: usize, to: usize| (vertices[from] - vertices[to]).norm_squared();
    if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
}

/// Evens out the edges: every vertex moves towards the middle of its neighbours, then back onto the surface.
fn relax(mesh: &mut Mesh, flesh: &Flesh) {
    let neighbours = mesh.neighbours();
    for _ in 0..10 {
        mesh.vertices = mesh
            .vertices
            .iter()
            .zip(&neighbours)
            .map(|(vertex, around)| {
                let middle = around.iter().map(|&other| mesh.vertices[other]).sum::<Vector3<f64>>() / around.len() as f64;
                flesh.project(vertex.lerp(&middle, 0.5), 2)
            })
            .collect();
    }
    for vertex in &mut mesh.vertices {
        *vertex = flesh.project(*vertex, 8);
    }
}
