//! What the body's surface does beside its motion.

use std::f64::consts::TAU;

use super::mesh::vertex_normals;
use super::vector::{Vector, add, rotate};

/// Displacements of the surface that the handed-out mesh does not know.
#[derive(Clone, Debug, Default)]
pub struct Physiology {
    pub(super) swells: Vec<Swell>,
    /// Rotation and translation in the radar frame (`pose_offset`).
    pub(super) stands: Option<([[f64; 3]; 3], Vector)>,
}

/// A part of the surface that moves along its normals.
#[derive(Clone, Debug)]
pub struct Swell {
    /// `[vertex]`, 0 to 1.
    pub(super) weights: Vec<f64>,
    pub(super) amplitude_m: f64,
    pub(super) rate_hz: f64,
    pub(super) phase_rad: f64,
    /// Strength of the second harmonic.
    pub(super) harmonic: f64,
}

impl Physiology {
    /// Moves the vertices of one pose, at its time in the motion.
    pub fn apply(&self, vertices: &mut [Vector], faces: &[[usize; 3]], time_s: f64) {
        if !self.swells.is_empty() {
            let normals = vertex_normals(vertices, faces);
            for swell in &self.swells {
                let angle = TAU * swell.rate_hz * time_s + swell.phase_rad;
                let step = swell.amplitude_m * (angle.sin() + swell.harmonic * (2.0 * angle).sin()) / (1.0 + swell.harmonic);
                for ((vertex, normal), weight) in vertices.iter_mut().zip(&normals).zip(&swell.weights) {
                    *vertex = add(*vertex, normal.map(|n| n * step * weight));
                }
            }
        }
        if let Some((rotation, offset)) = &self.stands {
            for vertex in vertices {
                *vertex = add(rotate(rotation, *vertex), *offset);
            }
        }
    }
}
