//! The recorder's own moving mesh: any person, posed on demand in the radar frame.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, UnitSphere};

use super::mesh::vertex_normals;
use super::physiology::Physiology;
use super::skinning::Skinning;
use super::timeline::{Interpolation, Timeline, Weights};
use super::vector::{Vector, add, add_scaled, dot, rotate};
use crate::error::Result;
use crate::person::{Motion, Person, Placement};

/// A mesh that moves. Poses are computed when asked for, so that a long motion needs no more memory than a short one.
#[derive(Clone, Debug)]
pub struct MovingBody {
    source: Source,
    /// `[face]`, three vertices each.
    pub faces: Vec<[usize; 3]>,
    timeline: Timeline,
    /// `[vertex]`, metres along the vertex normal: how far the recorded surface is from the one that is handed out.
    displacement_m: Option<Vec<f64>>,
    /// What the handed-out mesh does not do.
    pub physiology: Physiology,
}

#[derive(Clone, Debug)]
enum Source {
    Skinned { skinning: Box<Skinning>, motion: Motion, placement: Placement },
    Meshes(Vec<Vec<Vector>>),
}

impl MovingBody {
    /// The mesh of a person, without a displacement, breathing or heartbeat.
    ///
    /// # Errors
    /// Pose times that do not ascend.
    pub fn new(person: &Person, interpolation: Interpolation) -> Result<Self> {
        let source = match person {
            Person::Skinned { model, motion, placement } => Source::Skinned {
                skinning: Box::new(Skinning::new(model, &motion.betas)),
                motion: motion.clone(),
                placement: placement.clone(),
            },
            Person::Meshes { vertices, .. } => Source::Meshes(vertices.clone()),
        };
        let timeline = Timeline::new(person.pose_times_s(), interpolation)?;
        Ok(Self { source, faces: person.faces().to_vec(), timeline, displacement_m: None, physiology: Physiology::default() })
    }

    /// Moves the surface along its normals by a smooth random field of `rms_m`, the same in every pose:
    /// the honest error of a body model.
    pub fn displace(&mut self, rms_m: f64, rng: &mut ChaCha8Rng) {
        if rms_m > 0.0 {
            let field = smooth_field(self.rest(), 0.3, rng);
            self.displacement_m = Some(field.into_iter().map(|value| value * rms_m).collect());
        }
    }

    /// The mesh that names material points: the rest pose, or the first mesh. `[vertex, xyz]`, metres.
    pub fn rest(&self) -> &[Vector] {
        match &self.source {
            Source::Skinned { skinning, .. } => skinning.rest(),
            Source::Meshes(meshes) => &meshes[0],
        }
    }

    /// Poses and weights of one time.
    pub fn weights(&self, time_s: f64) -> Result<Weights> {
        self.timeline.weights(time_s)
    }

    /// `[vertex, xyz]`, metres, radar frame.
    pub fn pose(&self, pose: usize) -> Vec<Vector> {
        let mut vertices = match &self.source {
            Source::Meshes(meshes) => meshes[pose].clone(),
            Source::Skinned { skinning, motion, placement } => skinning
                .pose(&motion.poses[pose], motion.translations[pose])
                .into_iter()
                .map(|vertex| add(rotate(&placement.radar_from_motion, vertex), placement.origin_m))
                .collect(),
        };
        if let Some(displacement) = &self.displacement_m {
            let normals = vertex_normals(&vertices, &self.faces);
            for ((vertex, normal), &step) in vertices.iter_mut().zip(normals).zip(displacement) {
                *vertex = add_scaled(*vertex, normal, step);
            }
        }
        self.physiology.apply(&mut vertices, &self.faces, self.timeline.time_s(pose));
        vertices
    }
}

/// A random field `[point]` of about unit variance that varies over `correlation_m`: a sum of random waves.
pub fn smooth_field(points: &[Vector], correlation_m: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    const WAVES: usize = 16;
    let waves: Vec<(Vector, f64)> = (0..WAVES)
        .map(|_| {
            let direction: Vector = UnitSphere.sample(rng);
            let stretch: f64 = StandardNormal.sample(rng);
            let phase: f64 = StandardNormal.sample(rng);
            let wavenumber = std::f64::consts::TAU / correlation_m * (0.75 + 0.25 * stretch.tanh());
            (direction.map(|component| component * wavenumber), 100.0 * phase)
        })
        .collect();
    let scale = (2.0 / WAVES as f64).sqrt();
    points.iter().map(|&point| waves.iter().map(|&(wave, phase)| (dot(wave, point) + phase).cos()).sum::<f64>() * scale).collect()
}
