//! Refinement of a motion that is off by centimetres, degrees and milliseconds, from the recording alone.
//!
//! Before the simulator learns, each recording's place, heading and clock (and on request the poses of single frames) are moved
//! until the power that the body is expected to return lies in the cells in which it was measured. The priors of
//! [`RefineConfig`] hold what the recording does not show.

mod config;
mod expected;
mod parameters;
mod saved;

pub use config::RefineConfig;
pub use saved::{FILE, RefinedPose, read, refined, write};

use std::f64::consts::{LN_2, PI};

use burn::tensor::{Device, Tensor};

use super::LoadedRecording;
use crate::{
    body::{PoseCorrection, Posing},
    error::{Error, Result},
    heatmap::{HeatmapConfig, RangeDoppler, remove_loop_mean},
    person::Person,
    simulator::Scene,
};
use expected::{Comparison, LOBES_A_PART, Sampled};
use parameters::{Layout, Leaves};

/// Steps after which the host poses the body anew and looks who is seen.
const STEPS_A_LOOK: usize = 8;

/// Adam's moments' decay (Kingma and Ba 2015).
const DECAY: [f64; 2] = [0.9, 0.999];

/// One recording's refinement under way.
struct Refiner<'a> {
    config: &'a RefineConfig,
    recording: &'a LoadedRecording,
    person: &'a Person,
    frames: Vec<usize>,
    transform: RangeDoppler,
    floor: f64,
    /// Part of every point of the body.
    part: Vec<usize>,
    /// Logarithm of the power that brings the whole body to its level.
    level: f64,
    device: Device,
    threads: usize,
}

/// The correction of a recording's motion that explains best where its power lies.
///
/// `frames`: those that may be looked at; held-out frames are not among them.
///
/// # Errors
/// A recording without a skinned person, one that cannot be read, or a simulator that poses on the host.
pub fn refine(
    recording: &LoadedRecording,
    frames: &[usize],
    config: &RefineConfig,
    heatmap: &HeatmapConfig,
    device: &Device,
) -> Result<PoseCorrection> {
    let Some(person @ Person::Skinned { motion, .. }) = recording.recording.person() else {
        return Err(Error::field(recording.folder.join("recording.toml"), "files.motion", "no motion of a skinned body", "one")
            .with_hint("training.refine_pose moves joints; leave it out for meshes and empty rooms"));
    };
    if recording.scene.body.as_ref().is_none_or(|body| body.posing() == Posing::Host) {
        return Err(Error::setting("simulator.surface.posing", "host", "tensor with training.refine_pose = true")
            .with_hint("gradients reach a pose only through tensor operations"));
    }
    let joints = motion.poses[0].len();
    let radar = &recording.scene.radar;
    let few: Vec<usize> = spaced(frames, config.frames);
    let mut refiner = Refiner {
        transform: RangeDoppler::new(radar.loops_per_frame, radar.samples_per_chirp, radar.sampling, heatmap, device),
        floor: 0.0,
        part: recording.scene.body.as_ref().map(|body| body.joints()).unwrap_or_default(),
        level: 0.0,
        threads: std::thread::available_parallelism().map_or(1, usize::from).min(8),
        device: device.clone(),
        frames: few,
        config,
        recording,
        person,
    };
    refiner.measure()?;
    let gains = joints * LOBES_A_PART;
    let pivot_m = refiner.pivot_m()?;
    let mut correction = PoseCorrection { pivot_m, ..Default::default() };
    let layout = Layout::new(config, &[], joints, gains);
    let mut values = vec![0.0; layout.len()];
    for &blur in &config.blur_cells {
        correction = refiner.descend(&layout, &mut values, correction, blur)?;
    }
    if config.per_frame {
        let first_s = person.pose_times_s()[0];
        let time = |&frame: &usize| radar.chirp_time_s(frame, 0, radar.loops_per_frame / 2) - first_s - correction.clock_s;
        correction.knots_s = frames.iter().map(time).collect();
        correction.turns_rad = vec![vec![[0.0; 3]; joints]; frames.len()];
        correction.shifts_m = vec![[0.0; 3]; frames.len()];
        let layout = Layout::new(config, &correction.knots_s, joints, gains);
        values.resize(layout.len(), 0.0);
        refiner.frames = frames.to_vec();
        let finest = config.blur_cells.last().copied().unwrap_or(1.0);
        correction = refiner.descend(&layout, &mut values, correction, finest)?;
    }
    Ok(correction)
}

/// At most so many, evenly spaced.
fn spaced(frames: &[usize], most: usize) -> Vec<usize> {
    let count = frames.len().min(most);
    (0..count).map(|part| frames[(2 * part + 1) * frames.len() / (2 * count)]).collect()
}

impl Refiner<'_> {
    /// Noise floor and level, from the frames that are looked at.
    fn measure(&mut self) -> Result<()> {
        let mut cells = Vec::new();
        let (mut measured, mut expected) = (0.0, 0.0);
        for &frame in &self.frames {
            let moving = remove_loop_mean(self.recording.target(frame, &self.device)?);
            cells.extend(self.transform.map(moving).power().into_data().iter::<f64>());
        }
        cells.sort_by(f64::total_cmp);
        self.floor = cells[cells.len() / 2] / LN_2;
        if !(self.floor.is_finite() && self.floor > 0.0) {
            return Err(Error::Usage {
                message: format!("{}: the moving cells' power is {}", self.recording.folder.display(), self.floor),
                hint: Some("check that the recording holds a signal: `hybridsim check`".into()),
            });
        }
        let comparison = Comparison::new(&self.transform, self.floor, 0.0, &self.device);
        let parts = self.part.iter().max().map_or(1, |last| last + 1);
        let flat = Tensor::zeros([parts, LOBES_A_PART], &self.device);
        for &frame in &self.frames {
            let view = self.recording.scene.view(frame)?;
            let sampled = Sampled::new(&view, &self.part, self.config.points);
            let power = expected::power(&self.recording.scene, &view, &sampled, None, flat.clone(), &self.transform)?;
            expected += power.sum().into_scalar::<f64>();
            let found = comparison.measured(self.recording.target(frame, &self.device)?);
            measured += (found - self.floor).sum().into_scalar::<f64>();
        }
        self.level = (measured.max(self.floor) / expected.max(f64::MIN_POSITIVE)).ln();
        Ok(())
    }

    /// The middle of the body over the frames that are looked at: turning about it moves the body least.
    fn pivot_m(&self) -> Result<[f64; 3]> {
        let mut sum = [0.0; 3];
        let mut count = 0.0;
        for &frame in &self.frames {
            let view = self.recording.scene.view(frame)?;
            for vertex in &view.body.as_ref().expect("it has a person").vertices_m {
                (0..3).for_each(|axis| sum[axis] += vertex[axis]);
                count += 1.0;
            }
        }
        Ok(sum.map(|sum| sum / count))
    }

    /// Steps downhill at one width of the blur.
    fn descend(&self, layout: &Layout, values: &mut [f64], like: PoseCorrection, blur: f64) -> Result<PoseCorrection> {
        let comparison = Comparison::new(&self.transform, self.floor, blur, &self.device);
        let measured: Vec<Tensor<2>> = self
            .frames
            .iter()
            .map(|&frame| Ok(comparison.measured(self.recording.target(frame, &self.device)?)))
            .collect::<Result<_>>()?;
        let (mut mean, mut square) = (vec![0.0; values.len()], vec![0.0; values.len()]);
        let mut correction = layout.correction(values, &like);
        let mut scene = self.scene(&mut correction)?;
        for step in 0..self.config.steps {
            if step > 0 && step % STEPS_A_LOOK == 0 {
                correction = layout.correction(values, &like);
                scene = self.scene(&mut correction)?;
            }
            let mut gradient = self.gradient(layout, values, &scene, &comparison, &measured)?;
            gradient.iter_mut().zip(layout.prior_gradient(values)).for_each(|(sum, prior)| *sum += prior);
            if !gradient.iter().all(|value| value.is_finite()) {
                return Err(Error::NonFinite { stage: "the refinement of the pose".into(), step });
            }
            let progress = step as f64 / self.config.steps as f64;
            let rate = self.config.learning_rate * (0.1 + 0.45 * (1.0 + (PI * progress).cos()));
            for (at, gradient) in gradient.into_iter().enumerate() {
                mean[at] = DECAY[0] * mean[at] + (1.0 - DECAY[0]) * gradient;
                square[at] = DECAY[1] * square[at] + (1.0 - DECAY[1]) * gradient * gradient;
                let unbiased = |moment: f64, decay: f64| moment / (1.0 - decay.powi(step as i32 + 1));
                values[at] -= rate * unbiased(mean[at], DECAY[0]) / (unbiased(square[at], DECAY[1]).sqrt() + 1e-9);
            }
        }
        correction = layout.correction(values, &like);
        self.scene(&mut correction)?;
        Ok(correction)
    }

    /// The scene of a correction, whose clock is kept where all frames lie within the motion.
    fn scene(&self, correction: &mut PoseCorrection) -> Result<Scene> {
        let times = self.person.pose_times_s();
        let radar = &self.recording.scene.radar;
        let at = |frame: usize| self.recording.scene.chirp_times_s(frame);
        let first_s = at(0).into_iter().fold(f64::INFINITY, f64::min);
        let last_s = at(radar.frames - 1).into_iter().fold(f64::NEG_INFINITY, f64::max);
        let (earliest, latest) = (last_s - times[times.len() - 1], first_s - times[0]);
        correction.clock_s = correction.clock_s.max(earliest).min(latest);
        self.recording.scene.corrected(self.person, correction.clone())
    }

    /// Gradient of the nats of all frames, shared among threads.
    fn gradient(
        &self,
        layout: &Layout,
        values: &[f64],
        scene: &Scene,
        comparison: &Comparison<'_>,
        measured: &[Tensor<2>],
    ) -> Result<Vec<f64>> {
        let pairs: Vec<(usize, &Tensor<2>)> = self.frames.iter().copied().zip(measured).collect();
        let share = pairs.len().div_ceil(self.threads).max(1);
        let parts: Vec<Result<Vec<f64>>> = std::thread::scope(|scope| {
            let threads: Vec<_> = pairs
                .chunks(share)
                .map(|pairs| scope.spawn(move || self.gradient_of(layout, values, scene, comparison, pairs)))
                .collect();
            threads.into_iter().map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
        });
        let mut sum = vec![0.0; values.len()];
        for part in parts {
            sum.iter_mut().zip(part?).for_each(|(sum, value)| *sum += value);
        }
        Ok(sum)
    }

    fn gradient_of(
        &self,
        layout: &Layout,
        values: &[f64],
        scene: &Scene,
        comparison: &Comparison<'_>,
        frames: &[(usize, &Tensor<2>)],
    ) -> Result<Vec<f64>> {
        let device = self.device.clone().autodiff();
        let mut sum = vec![0.0; values.len()];
        for (frame, measured) in frames {
            let leaves = layout.leaves(values, &device);
            let view = scene.view(*frame)?;
            let sampled = Sampled::new(&view, &self.part, self.config.points);
            let gain = layout.log_gain(&leaves, LOBES_A_PART, self.level);
            let power = expected::power(scene, &view, &sampled, Some(&layout.pose(&leaves)), gain, &self.transform)?;
            let gradients = comparison.nats(power, (*measured).clone()).backward();
            let Leaves { whole, gains, knots } = leaves;
            let flat = [Some(whole), Some(gains), knots].into_iter().flatten().flat_map(|leaf| {
                let count = leaf.dims()[0];
                let found: Option<Tensor<1>> = leaf.grad(&gradients);
                found.map_or(vec![0.0; count], |gradient| gradient.into_data().iter::<f64>().collect())
            });
            sum.iter_mut().zip(flat).for_each(|(sum, value)| *sum += value);
        }
        Ok(sum)
    }
}
