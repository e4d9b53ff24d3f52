//! How the posed surface is turned at every chirp of a frame. On the host, in f64; no gradient.

use std::ops::Range;

use rayon::prelude::*;

use super::kinematics::Vector;
use super::{BodyFrame, PosedBody};

impl PosedBody {
    /// Unit normals of the posed mesh, `[point, chirp]` one point after the other: those of the mesh as it is at every chirp.
    ///
    /// `points`: which points, in any order; `chirps`: of those the frame was made for.
    pub fn normals_at(&self, frame: &BodyFrame, points: &[usize], chirps: Range<usize>) -> Vec<[f64; 3]> {
        let of_chirp = |chirp: usize| {
            let all = self.surface().normals(&frame.vertices_at(chirp));
            points.iter().map(|&point| all[point]).collect()
        };
        point_by_point(points.len(), chirps.into_par_iter().map(of_chirp).collect())
    }

    /// Canonical axes (0 x, 1 y, 2 z; one for each of `points`) turned with the body, as in [`Self::normals_at`]: blended as
    /// positions are, so of length about one.
    pub fn axes_at(&self, frame: &BodyFrame, points: &[usize], axes: &[usize], chirps: Range<usize>) -> Vec<[f64; 3]> {
        let poses = frame.basis.poses.len();
        let of_point = |(&point, &axis): (&usize, &usize)| {
            let turned: Vec<Vector> =
                (0..poses).map(|pose| self.rotation(frame, point, pose).column(axis).into_owned()).collect();
            let at = move |chirp: usize| -> [f64; 3] {
                let weights = frame.basis.row(chirp);
                turned.iter().zip(weights).map(|(axis, &weight)| axis * weight).sum::<Vector>().into()
            };
            chirps.clone().map(at).collect::<Vec<_>>()
        };
        points.par_iter().zip(axes).flat_map_iter(of_point).collect()
    }
}

/// `[chirp][point]` to `[point, chirp]`.
fn point_by_point(points: usize, chirps: Vec<Vec<[f64; 3]>>) -> Vec<[f64; 3]> {
    (0..points).flat_map(|point| chirps.iter().map(move |chirp| chirp[point])).collect()
}
