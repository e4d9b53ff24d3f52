//! Images of the body as a camera at the radar sees it: for each pixel where a ray hits, how far and how bright.

use std::{collections::VecDeque, ops::Range, sync::Arc};

use parry3d_f64::{
    math::Vector3,
    query::{Ray, RayCast},
    shape::TriMesh,
};
use rayon::prelude::*;

use super::RfGenesisConfig;
use crate::{
    body::PosedBody,
    error::{Error, Result},
};

/// Where a ray meets the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub position_m: [f64; 3],
    /// From the camera.
    pub distance_m: f64,
    /// cos θ/d² of a diffuse surface that is lit from the camera.
    pub intensity: f64,
}

impl Hit {
    /// Between two images of one pixel; where only one has a hit, that one.
    pub fn between(from: Option<Self>, to: Option<Self>, share: f64) -> Option<Self> {
        let (a, b) = (from.or(to)?, to.or(from)?);
        let mix = |a: f64, b: f64| a * (1.0 - share) + b * share;
        Some(Self {
            position_m: std::array::from_fn(|axis| mix(a.position_m[axis], b.position_m[axis])),
            distance_m: mix(a.distance_m, b.distance_m),
            intensity: mix(a.intensity, b.intensity),
        })
    }
}

/// `[pixel]`, row by row.
pub type Image = Vec<Option<Hit>>;

/// A pinhole that looks along boresight (+y), with x to the right and z up.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    pub centre_m: [f64; 3],
    pixels: usize,
    /// Tangent of half the field of view.
    pub half_width: f64,
}

/// Poses that are looked at to size the field of view.
const POSES: usize = 50;

/// Tangent of half the widest field of view, 160°.
const WIDEST: f64 = 5.67;

impl Camera {
    /// The configured field of view, or the smallest one that holds the body throughout its motion.
    pub fn covering(centre_m: [f64; 3], body: &PosedBody, poses: usize, config: &RfGenesisConfig) -> Self {
        let step = poses.div_ceil(POSES).max(1);
        let needed = |vertex: [f64; 3]| {
            let [x, y, z] = std::array::from_fn(|axis| vertex[axis] - centre_m[axis]);
            // What is beside or behind the camera is in no picture.
            if y > 0.0 { x.abs().max(z.abs()) / y } else { 0.0 }
        };
        let body = (0..poses).step_by(step).flat_map(|pose| body.vertices_at_pose(pose)).map(needed).fold(0.0, f64::max);
        let half_width = (0.5 * config.fov_deg).to_radians().tan().max((1.05 * body).min(WIDEST));
        Self { centre_m, pixels: config.pixels, half_width }
    }

    /// Unit direction through the middle of a pixel.
    fn direction(&self, pixel: usize) -> Vector3 {
        let along = |index: usize| ((2 * index + 1) as f64 / self.pixels as f64 - 1.0) * self.half_width;
        Vector3::new(along(pixel % self.pixels), 1.0, -along(pixel / self.pixels)).normalize()
    }

    /// # Errors
    /// A mesh that no rays can be cast on.
    pub fn look(&self, vertices_m: &[[f64; 3]], faces: &[[usize; 3]]) -> Result<Image> {
        let vertices = vertices_m.iter().map(|&[x, y, z]| Vector3::new(x, y, z)).collect();
        let faces = faces.iter().map(|face| face.map(|vertex| vertex as u32)).collect();
        let mesh = TriMesh::new(vertices, faces).map_err(|error| Error::Usage {
            message: format!("no rays can be cast on the body: {error}"),
            hint: Some("check the body's faces".into()),
        })?;
        let [x, y, z] = self.centre_m;
        let origin = Vector3::new(x, y, z);
        let trace = |pixel: usize| {
            let ray = Ray::new(origin, self.direction(pixel));
            let found = mesh.cast_local_ray_and_get_normal(&ray, f64::MAX, false)?;
            let distance_m = found.time_of_impact;
            let cosine = found.normal.dot(ray.dir).abs();
            let place = ray.point_at(distance_m);
            // A camera inside the body sees nothing of use.
            (distance_m > 0.0).then(|| Hit {
                position_m: [place.x, place.y, place.z],
                distance_m,
                intensity: cosine / (distance_m * distance_m),
            })
        };
        Ok((0..self.pixels.pow(2)).into_par_iter().with_min_len(256).map(trace).collect())
    }
}

/// Images that are kept: a frame's, and those of the next.
const KEPT: usize = 16;

/// The images of a motion, traced when they are asked for.
pub struct Images {
    body: PosedBody,
    camera: Camera,
    rate_hz: f64,
    trails: bool,
    kept: VecDeque<(usize, Arc<Image>)>,
}

impl Images {
    pub fn new(body: PosedBody, camera: Camera, config: &RfGenesisConfig) -> Self {
        Self { body, camera, rate_hz: config.image_rate_hz, trails: config.trails, kept: VecDeque::new() }
    }

    #[cfg(test)]
    pub fn camera(&self) -> Camera {
        self.camera
    }

    /// Image `k` shows the body k/rate after the motion's start; after its end, as at its end.
    pub fn range(&mut self, images: Range<usize>) -> Result<Vec<Arc<Image>>> {
        images.map(|index| self.image(index)).collect()
    }

    fn image(&mut self, index: usize) -> Result<Arc<Image>> {
        let kept =
            |wanted: usize, images: &Self| images.kept.iter().find(|(kept, _)| *kept == wanted).map(|(_, image)| image.clone());
        if let Some(image) = kept(index, self) {
            return Ok(image);
        }
        // A trail begins with the first image: go on from the latest one known, or from there.
        let known = self.kept.iter().map(|(kept, _)| *kept).filter(|kept| *kept < index).max();
        let first = if self.trails { known.map_or(0, |known| known + 1) } else { index };
        for next in first..=index {
            let mut image = self.trace(next)?;
            if self.trails && next > 0 {
                let before = kept(next - 1, self).expect("just traced");
                image.iter_mut().zip(before.iter()).for_each(|(hit, last)| *hit = hit.or(*last));
            }
            if self.kept.len() == KEPT {
                self.kept.pop_front();
            }
            self.kept.push_back((next, Arc::new(image)));
        }
        Ok(kept(index, self).expect("just traced"))
    }

    fn trace(&self, index: usize) -> Result<Image> {
        let (start, end) = self.body.span_s();
        let posed = self.body.frame(&[(start + index as f64 / self.rate_hz).min(end)])?;
        self.camera.look(&posed.vertices_m, &self.body.surface().faces)
    }
}
