//! One step: the loss of a few frames and its gradients, on all devices.

use burn::module::Module;
use burn::optim::{GradientsAccumulator, GradientsParams};
use burn::tensor::{Device, Tensor};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{Learned, Trainer};
use crate::complex::Complex;
use crate::error::{Error, Result};
use crate::simulator::{Mode, Simulator, is_finite};
use crate::training::largest::largest_gradient;
use crate::training::prepared::Prepared;
use crate::training::{FrameId, checkpoint, step_rng};

/// A frame of a step, and the seed of its noise.
type Draw = (FrameId, u64);

impl Trainer<'_> {
    /// One step of the optimiser on a few frames; its loss, dB², and its largest gradient.
    ///
    /// `prepared`: for every device.
    pub(super) fn step(
        &self,
        mut learned: Learned,
        prepared: &[Vec<Prepared>],
        batch: &[FrameId],
        learning_rate: f64,
    ) -> Result<(Learned, f64, f64)> {
        let (simulator, step) = (&learned.simulator, learned.progress.steps_done);
        let mut rng = step_rng(self.seed, step, 0x57E9);
        let mode = Mode::Training { seed: rng.random() };
        let draws = draws(batch, &mut rng);
        // Frames of one recording stay together as far as they can: its surfaces are decoded once for all of them.
        let shares: Vec<&[Draw]> = draws.chunks(draws.len().div_ceil(prepared.len())).collect();
        let parts: Vec<(GradientsParams, f64)> = match shares.as_slice() {
            [all] => vec![self.gradients(simulator, &prepared[0], all, draws.len(), mode, self.device())?],
            _ => self.shared_gradients(simulator, prepared, &shares, draws.len(), mode)?,
        };
        let value: f64 = parts.iter().map(|(_, loss)| loss).sum();
        if !value.is_finite() {
            return Err(self.first_broken_stage(simulator, &prepared[0], batch, mode, step)?);
        }
        let mut sum = GradientsAccumulator::new();
        parts.into_iter().for_each(|(gradients, _)| sum.accumulate(simulator, gradients));
        let gradients = sum.grads();
        let gradient = largest_gradient(simulator, &gradients);
        learned.simulator = learned.optimizer.step(learning_rate, learned.simulator, gradients);
        match checkpoint::first_non_finite(&learned.simulator) {
            Some(name) => Err(Error::NonFinite { stage: format!("the gradient of `{name}`"), step }),
            None => Ok((learned, value, gradient)),
        }
    }

    /// All devices side by side, each with a copy of the weights; gradients come back to the first.
    fn shared_gradients(
        &self,
        simulator: &Simulator,
        prepared: &[Vec<Prepared>],
        shares: &[&[Draw]],
        of: usize,
        mode: Mode,
    ) -> Result<Vec<(GradientsParams, f64)>> {
        let copies: Vec<Simulator> =
            self.devices.iter().take(shares.len()).map(|device| simulator.clone().fork(&device.clone().autodiff())).collect();
        let of_device = |index: usize| -> Result<(GradientsParams, f64)> {
            let (device, copy) = (&self.devices[index], &copies[index]);
            let (gradients, loss) = self.gradients(copy, &prepared[index], shares[index], of, mode, device)?;
            Ok((gradients.to_device(self.device(), copy), loss))
        };
        (0..shares.len()).into_par_iter().map(of_device).collect()
    }

    /// Of the part that some frames have in the mean loss of `of` frames; and that part.
    fn gradients(
        &self,
        simulator: &Simulator,
        prepared: &[Prepared],
        frames: &[Draw],
        of: usize,
        mode: Mode,
        device: &Device,
    ) -> Result<(GradientsParams, f64)> {
        let loss = self.summed_loss(simulator, prepared, frames, mode, device)? / of as f64;
        let value: f64 = loss.clone().into_scalar::<f32>().into();
        let mut gradients = loss.backward();
        Ok((GradientsParams::from_module(&mut gradients, simulator), value))
    }

    /// Sum over frames, dB²; with the likelihood, nats a cell.
    pub(super) fn summed_loss(
        &self,
        simulator: &Simulator,
        prepared: &[Prepared],
        frames: &[Draw],
        mode: Mode,
        device: &Device,
    ) -> Result<Tensor<1>> {
        let mut sum: Option<Tensor<1>> = None;
        for frames in frames.chunk_by(|a, b| a.0.recording == b.0.recording) {
            let index = frames[0].0.recording;
            let recording = &self.recordings[index];
            let Prepared { loss, constants } = &prepared[index];
            let surfaces = simulator.surfaces(constants, mode);
            for (FrameId { frame, .. }, seed) in frames {
                let view = recording.scene.view(*frame)?;
                let clean = simulator.clean_signal(&recording.scene, &view, &surfaces);
                let measured = one_frame(recording.target(*frame, device)?);
                let value = if loss.is_likelihood() {
                    let variance = simulator.noise_variance(&clean);
                    loss.deviance(one_frame(clean), variance, measured)
                } else {
                    let signal = simulator.with_noise(&recording.scene.radar, clean, *seed);
                    loss.loss(one_frame(signal), loss.maps_db(measured))
                };
                sum = Some(match sum {
                    Some(sum) => sum + value,
                    None => value,
                });
            }
        }
        Ok(sum.expect("a batch has frames"))
    }

    /// Runs the journey once more and names the first stage whose result is not finite.
    fn first_broken_stage(
        &self,
        simulator: &Simulator,
        prepared: &[Prepared],
        batch: &[FrameId],
        mode: Mode,
        step: usize,
    ) -> Result<Error> {
        if let Some(name) = checkpoint::first_non_finite(simulator) {
            return Ok(Error::NonFinite { stage: format!("the parameter `{name}`"), step });
        }
        for (index, frames) in by_recording(batch) {
            let recording = &self.recordings[index];
            for frame in frames {
                if !is_finite(recording.target(frame, self.device())?.re) {
                    return Ok(Error::NonFinite { stage: format!("frame {frame} of the recording"), step });
                }
                let scene = &recording.scene;
                let constants = &prepared[index].constants;
                if let Some(stage) = simulator.first_non_finite_stage(scene, &*scene.view(frame)?, constants, mode) {
                    return Ok(Error::NonFinite { stage: stage.into(), step });
                }
            }
        }
        Ok(Error::NonFinite { stage: "the loss".into(), step })
    }
}

fn one_frame(signal: Complex<4>) -> Complex<5> {
    let [tx, rx, loops, samples] = signal.dims();
    signal.reshape([1, tx, rx, loops, samples])
}

/// Frames grouped by recording, each with a seed.
fn draws(batch: &[FrameId], rng: &mut ChaCha8Rng) -> Vec<Draw> {
    let grouped = by_recording(batch).into_iter();
    let frames = grouped.flat_map(|(recording, frames)| frames.into_iter().map(move |frame| FrameId { recording, frame }));
    frames.map(|frame| (frame, rng.random())).collect()
}

/// Frames of a batch, grouped by recording, each group in the batch's order.
fn by_recording(batch: &[FrameId]) -> Vec<(usize, Vec<usize>)> {
    let mut groups: Vec<(usize, Vec<usize>)> = Vec::new();
    for id in batch {
        match groups.iter_mut().find(|(recording, _)| *recording == id.recording) {
            Some((_, frames)) => frames.push(id.frame),
            None => groups.push((id.recording, vec![id.frame])),
        }
    }
    groups
}
