//! The body's points as the effects see them, and objects that it carries.

use burn::tensor::{DType, Device, Tensor};

use super::{
    FrameView, Scene, Simulator,
    groups::{Group, Kind},
};
use crate::{
    body::{Displacement, PosedBody},
    complex::Complex,
    effects::{BodyPoints, Chirps},
};

impl Simulator {
    /// Where a group's points are for the chirps of a transmitter, and how strong, with the effects that act on them one
    /// by one. `amplitude` finds the strength of displaced points.
    pub(super) fn as_seen(
        &self,
        group: &Group<'_>,
        tx: usize,
        device: &Device,
        amplitude: impl Fn(&Displacement) -> Tensor<2>,
    ) -> (Displacement, Tensor<2>) {
        let displacement = group.displacement(tx, device);
        let visible = &group.visible;
        let (true, Kind::Body, Some(body), Some(frame)) =
            (self.effects.acts_on_points(), visible.kind, &visible.scene.body, &visible.view.body)
        else {
            let amplitude = amplitude(&displacement);
            return (displacement, amplitude);
        };
        let scene = visible.scene;
        let chirps = chirps(scene, tx);
        let velocity = self.effects.needs_velocity().then(|| body.velocity(frame, visible.points, chirps.clone(), device));
        let joints: Vec<&'static str> = visible.points.iter().filter_map(|&point| scene.joints.get(point).copied()).collect();
        let extent_m = extent(&frame.vertices_m);
        let points = BodyPoints {
            reference_m: &visible.reference_m,
            normal: &visible.normals(),
            joints: &joints,
            velocity: velocity.as_ref(),
            times_s: &scene.chirp_times_s(visible.view.frame)[chirps],
            tx,
            extent_m,
            centre_m: std::array::from_fn(|axis| 0.5 * (extent_m[0][axis] + extent_m[1][axis])),
            radar_m: scene.radar.centre_m(),
        };
        let displacement = self.effects.displace(displacement, &points);
        let amplitude = self.effects.weigh(amplitude(&displacement), &points);
        (displacement, amplitude)
    }

    /// Echoes of objects that are not in the scene, `[tx, rx, loop, sample]`: those on their own as of this frame, those
    /// that the body carries as it is seen.
    pub(super) fn reflectors_signal(&self, scene: &Scene, frame: usize, seen: &FrameView) -> Option<Complex<4>> {
        if !self.effects.has_reflectors() {
            return None;
        }
        let times_s = scene.chirp_times_s(frame);
        let (dechirp, form) = (self.config.dechirp, self.config.sum);
        Some(self.transmitters(scene, |tx, device| {
            let of = Chirps { radar: &scene.radar, tx, dechirp, form };
            let placed = self.effects.reflectors(&times_s[chirps(scene, tx)], &of, (device, DType::F32));
            let carried = self.effects.carried(&of, (device, DType::F32), |part| {
                let (body, posed) = (scene.body.as_ref()?, seen.body.as_ref()?);
                let point = middle_point(body, &scene.joints, part)?;
                let displacement = body.displacement(posed, &[point], chirps(scene, tx), None, device);
                Some((posed.position_m[point], displacement))
            });
            placed.into_iter().chain(carried).reduce(Complex::add)
        }))
    }
}

/// The chirps of a transmitter among those of a frame.
fn chirps(scene: &Scene, tx: usize) -> std::ops::Range<usize> {
    let loops = scene.radar.loops_per_frame;
    tx * loops..(tx + 1) * loops
}

/// Lowest and highest coordinates.
fn extent(points: &[[f64; 3]]) -> [[f64; 3]; 2] {
    let fold = |start: f64, pick: fn(f64, f64) -> f64| {
        std::array::from_fn(|axis| points.iter().map(|point| point[axis]).fold(start, pick))
    };
    [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)]
}

/// The point in the middle of a part of the body at rest, the same in all frames; of the whole body where it has no such
/// part.
fn middle_point(body: &PosedBody, joints: &[&'static str], part: Option<&str>) -> Option<usize> {
    let all = body.canonical();
    let of_part: Vec<usize> = (0..joints.len()).filter(|&point| Some(joints[point]) == part).collect();
    let points = if of_part.is_empty() { (0..all.len()).collect() } else { of_part };
    let count = points.len() as f64;
    let middle: [f64; 3] = std::array::from_fn(|axis| points.iter().map(|&point| all[point][axis]).sum::<f64>() / count);
    let distance = |point: usize| (0..3).map(|axis| (all[point][axis] - middle[axis]).powi(2)).sum::<f64>();
    points.into_iter().min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
}
