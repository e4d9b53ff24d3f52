//! Steps downhill in what is lost by the law of power.

use std::f64::consts::PI;

use burn::tensor::Tensor;

use super::{
    expected::{self, Comparison, LOBES_A_PART, Sampled},
    parameters::{Layout, Leaves},
    refiner::Refiner,
};
use crate::{
    body::PoseCorrection,
    error::{Error, Result},
    simulator::Scene,
};

/// Steps after which the host poses the body anew and looks who is seen.
const STEPS_A_LOOK: usize = 8;

/// Adam's moments' decay (Kingma and Ba 2015).
const DECAY: [f64; 2] = [0.9, 0.999];

impl Refiner<'_> {
    /// Steps downhill at one width of the blur.
    pub fn descend(&self, layout: &Layout, values: &mut [f64], like: PoseCorrection, blur: f64) -> Result<PoseCorrection> {
        let comparison = self.comparison(blur);
        let measured: Vec<Tensor<2>> =
            self.frames.iter().map(|&frame| self.measured(&comparison, frame)).collect::<Result<_>>()?;
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
            for (at, gradient) in gradient.into_iter().enumerate().filter(|(at, _)| layout.moves(*at)) {
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
    pub fn scene(&self, correction: &mut PoseCorrection) -> Result<Scene> {
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
            let power = expected::power(scene, &view, &sampled, Some(&layout.pose(&leaves)), gain, &self.transform);
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
