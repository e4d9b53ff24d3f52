//! What the tests of this layer share.

use std::path::Path;

use crate::person::{BodyModel, Motion};

/// Names of everything in a folder, hidden ones included, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

pub use crate::support::shared;

/// Two joints, four vertices, one shape, no symmetry that could hide a mistake.
pub fn small_body() -> BodyModel {
    let wave =
        |seed: usize| (0..4).map(|v| std::array::from_fn(|axis| (((seed + v) * 3 + axis) as f64 * 0.25).fract() - 0.5)).collect();
    BodyModel {
        template: wave(1),
        shape_directions: vec![wave(2)],
        pose_directions: (0..9).map(|entry| wave(3 + entry)).collect(),
        joint_regressor: vec![vec![(0, 0.5), (1, 0.5)], vec![(3, 1.0)]],
        skinning: vec![vec![(0, 1.0)], vec![(0, 0.5), (1, 0.5)], vec![(0, 0.25), (1, 0.75)], vec![(1, 1.0)]],
        parents: vec![None, Some(0)],
        faces: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// Poses at 10 per second for `small_body`.
pub fn small_motion(poses: usize) -> Motion {
    let pose = |index: usize| vec![[0.0, 0.1 * index as f64, 0.0], [0.3, 0.0, 0.01 * index as f64]];
    Motion {
        poses: (0..poses).map(pose).collect(),
        translations: (0..poses).map(|index| [0.0, 0.9, 0.05 * index as f64]).collect(),
        betas: vec![0.5],
        rate_hz: 10.0,
    }
}
