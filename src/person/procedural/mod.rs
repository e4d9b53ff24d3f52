//! The embedded person: a watertight body generated from a few measures, in SMPL's layout, so that everything runs
//! without a download.
//!
//! A skeleton with anthropometric proportions carries an implicit surface (rounded cones, smoothly united), surface nets
//! turn it into triangles, and the skinning weights come from diffusing the nearest bone over the mesh.

mod flesh;
mod regressor;
mod skeleton;
mod skinning;
mod surface;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::BodyModel;
use crate::error::{Error, Result};
use flesh::Flesh;
use skeleton::Skeleton;

/// Measures of the generated person; the factors are relative to an average adult.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PersonConfig {
    /// Stature.
    pub height_m: f64,
    /// Girth of trunk and limbs: 0.8 is slim, 1 average, 1.3 heavy.
    pub build: f64,
    /// Length of the legs at the same stature.
    pub leg_length: f64,
    pub shoulder_width: f64,
    pub hip_width: f64,
    /// Spacing of the grid that the surface is extracted on; the mesh's edges are about as long.
    pub edge_m: f64,
}

impl Default for PersonConfig {
    fn default() -> Self {
        Self { height_m: 1.75, build: 1.0, leg_length: 1.0, shoulder_width: 1.0, hip_width: 1.0, edge_m: 0.028 }
    }
}

/// Names of the subjects that [`subject`] knows.
pub const SUBJECTS: [&str; 6] = ["s1", "s2", "s3", "s4", "s5", "s6"];

/// One of the embedded subjects; they differ in stature, girth and proportions.
pub fn subject(name: &str) -> Result<PersonConfig> {
    let (height_m, build, leg_length, shoulder_width, hip_width) = match name {
        "s1" => (1.75, 1.0, 1.0, 1.0, 1.0),
        "s2" => (1.64, 0.94, 1.01, 0.92, 1.06),
        "s3" => (1.86, 1.02, 1.03, 1.05, 0.98),
        "s4" => (1.72, 1.2, 0.98, 1.03, 1.05),
        "s5" => (1.80, 0.87, 1.02, 0.98, 0.96),
        "s6" => (1.58, 1.08, 0.97, 0.95, 1.04),
        _ => return Err(Error::setting("subject", name, format!("one of {}", SUBJECTS.join(", ")))),
    };
    Ok(PersonConfig { height_m, build, leg_length, shoulder_width, hip_width, ..PersonConfig::default() })
}

/// What the shape parameters mean, in order, and the change of the measures that one unit stands for.
pub const SHAPE_PARAMETERS: [&str; 5] = ["height", "girth", "leg_length", "shoulder_width", "hip_width"];

impl PersonConfig {
    /// Refuses measures that no person has and grids that cannot resolve one.
    pub fn check(&self) -> Result<()> {
        let limits = [
            ("height_m", self.height_m, 1.2, 2.2, "metres"),
            ("build", self.build, 0.75, 1.5, "times the average"),
            ("leg_length", self.leg_length, 0.9, 1.1, "times the average"),
            ("shoulder_width", self.shoulder_width, 0.8, 1.25, "times the average"),
            ("hip_width", self.hip_width, 0.85, 1.2, "times the average"),
            ("edge_m", self.edge_m, 0.006, 0.032, "metres"),
        ];
        for (key, value, low, high, unit) in limits {
            if !(low..=high).contains(&value) {
                return Err(Error::setting(format!("person.{key}"), value, format!("{low} to {high} {unit}")));
            }
        }
        Ok(())
    }

    /// The measures after one unit of a shape parameter.
    fn with_shape_unit(&self, parameter: usize) -> Self {
        let mut changed = self.clone();
        match parameter {
            0 => changed.height_m += 0.04,
            1 => changed.build += 0.06,
            2 => changed.leg_length += 0.02,
            3 => changed.shoulder_width += 0.05,
            _ => changed.hip_width += 0.05,
        }
        changed
    }
}

/// Generates the person: template in a T-pose with the pelvis at the origin, five shape directions
/// ([`SHAPE_PARAMETERS`]), no pose directions.
///
/// Deterministic: equal measures give equal bodies. Source: segment lengths after Drillis and Contini (1966).
pub fn person(config: &PersonConfig) -> Result<BodyModel> {
    config.check()?;
    let skeleton = Skeleton::new(config);
    let flesh = Flesh::new(config, &skeleton);
    let mesh = surface::extract(&flesh, config.edge_m);
    super::mesh::check_closed(mesh.vertices.len(), &mesh.faces).map_err(|found| {
        Error::setting("person.edge_m", config.edge_m, format!("a grid fine enough to close the surface ({found})"))
            .with_hint("a smaller edge_m resolves thinner limbs")
    })?;
    let skinning = skinning::weights(&mesh, &skeleton);

    let shape_directions: Vec<Vec<Vector3<f64>>> = (0..SHAPE_PARAMETERS.len())
        .map(|parameter| {
            let changed = config.with_shape_unit(parameter);
            let target = Skeleton::new(&changed);
            let flesh = Flesh::new(&changed, &target);
            let carried = skinning::carry(&mesh.vertices, &skinning, &skeleton, &target);
            let moved = carried.into_iter().map(|vertex| flesh.project(vertex, 8));
            moved.zip(&mesh.vertices).map(|(moved, vertex)| moved - vertex).collect()
        })
        .collect();
    let joint_directions: Vec<Vec<Vector3<f64>>> = (0..SHAPE_PARAMETERS.len())
        .map(|parameter| {
            let target = Skeleton::new(&config.with_shape_unit(parameter));
            target.joints.iter().zip(&skeleton.joints).map(|(moved, joint)| moved - joint).collect()
        })
        .collect();
    let joint_regressor = regressor::solve(&mesh.vertices, &shape_directions, &skeleton.joints, &joint_directions);

    let plain = |points: Vec<Vector3<f64>>| points.into_iter().map(<[f64; 3]>::from).collect::<Vec<_>>();
    Ok(BodyModel {
        template: plain(mesh.vertices),
        shape_directions: shape_directions.into_iter().map(plain).collect(),
        pose_directions: Vec::new(),
        joint_regressor,
        skinning,
        parents: skeleton::PARENTS.to_vec(),
        faces: mesh.faces,
    })
}

#[cfg(test)]
mod tests;
