//! The training loop.

use std::path::{Path, PathBuf};

use burn::{
    grad_clipping::GradientClipping,
    module::Module,
    optim::{AdamConfig, GradientsAccumulator, GradientsParams, ModuleOptimizer},
    tensor::{Device, Tensor},
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{
    EpochMetrics, FrameId, FrameSplit, LoadedRecording, RefinedPose, TrainingConfig, calibrate,
    checkpoint::{self, CheckpointState, Progress, Site},
    largest::largest_gradient,
    refine, step_rng,
};
use crate::{
    bounds,
    complex::Complex,
    error::{Error, Result},
    heatmap::RangeDoppler,
    loss::DbLoss,
    simulator::{Mode, SceneConstants, Simulator, SimulatorConfig, is_finite},
};

/// What happens in a run, for whoever shows it.
#[derive(Clone, Debug)]
pub enum Event {
    /// A recording's motion was refined, before the first step.
    Refined(RefinedPose),
    Started {
        steps: usize,
        first_step: usize,
        training_frames: usize,
        validation_frames: usize,
        /// Of the loss.
        unit: &'static str,
    },
    /// `gradient`: the largest absolute derivative of the loss by any number that learns, before clipping.
    Step {
        step: usize,
        loss: f64,
        gradient: f64,
    },
    Epoch(EpochMetrics),
    Saved(PathBuf),
    StoppedEarly {
        epoch: usize,
        best_epoch: usize,
    },
}

/// How a run ended.
pub struct Outcome {
    pub simulator: Simulator,
    pub progress: Progress,
}

/// What training keeps of each recording beside its scene.
pub(super) struct Prepared {
    pub loss: DbLoss,
    pub constants: SceneConstants,
}

/// Everything a run needs; `run` does it.
pub struct Trainer<'a> {
    pub config: &'a TrainingConfig,
    pub simulator_config: &'a SimulatorConfig,
    pub seed: u64,
    pub recordings: &'a [LoadedRecording],
    pub site: Site,
    /// The resolved configuration, kept beside every checkpoint.
    pub config_toml: &'a str,
    /// Where `best` and `last` are kept.
    pub folder: &'a Path,
    /// The first has the weights and the optimiser; all share the frames of every step. The gradient is the same but for
    /// rounding.
    pub devices: &'a [Device],
}

/// A frame of a step, and the seed of its noise.
type Draw = (FrameId, u64);

impl Trainer<'_> {
    /// Trains from the beginning, from the weights of `start_from`, or from `resume` (a checkpoint folder of the same
    /// configuration).
    ///
    /// A resumed run visits the same frames with the same noise as one that was never stopped.
    pub fn run(&self, resume: Option<&Path>, emit: &mut dyn FnMut(Event)) -> Result<Outcome> {
        self.config.check()?;
        if !self.config.refine_pose {
            return self.train(resume, emit);
        }
        let mut poses = if resume.is_some() { refine::read(self.folder)? } else { Vec::new() };
        if poses.is_empty() {
            poses = self.refine(emit)?;
            refine::write(self.folder, &poses)?;
        }
        let recordings: Vec<LoadedRecording> = self
            .recordings
            .iter()
            .map(|recording| Ok(refine::refined(recording.again(self.simulator_config)?, &poses)?.0))
            .collect::<Result<_>>()?;
        Trainer { recordings: &recordings, site: self.site.clone(), ..*self }.train(resume, emit)
    }

    fn split(&self) -> FrameSplit {
        FrameSplit::of(self.recordings, self.config, self.seed)
    }

    /// What every recording's motion lacks, from its training frames.
    fn refine(&self, emit: &mut dyn FnMut(Event)) -> Result<Vec<RefinedPose>> {
        let split = self.split();
        let one = |(index, recording): (usize, &LoadedRecording)| -> Result<RefinedPose> {
            let frames: Vec<usize> = split.training.iter().filter(|id| id.recording == index).map(|id| id.frame).collect();
            let correction = refine::refine(recording, &frames, &self.config.refine, &self.config.heatmap, self.device())?;
            let pose = RefinedPose { recording: recording.folder.clone(), correction };
            emit(Event::Refined(pose.clone()));
            Ok(pose)
        };
        self.recordings.iter().enumerate().map(one).collect()
    }

    fn train(&self, resume: Option<&Path>, emit: &mut dyn FnMut(Event)) -> Result<Outcome> {
        let split = self.split();
        if split.training.is_empty() {
            return Err(Error::setting(
                "training.validation_fraction",
                self.config.validation_fraction,
                "one whole frame to train on",
            )
            .with_hint("frames with lost chirps train nothing; hold fewer frames out, or record again"));
        }
        if let Some(frames) = self.config.frames.filter(|&frames| frames > split.training.len()) {
            return Err(Error::setting("training.frames", frames, format!("at most {}, all there are", split.training.len())));
        }
        let split = split.with_most(self.config.frames);
        bounds::numbers("training.repeats", "repeats x training frames", &[self.config.repeats, split.training.len()])?;
        let split = split.repeated(self.config.repeats);
        let steps_per_epoch = split.training.len().div_ceil(self.config.frames_per_step);
        let steps = self.config.epochs * steps_per_epoch;
        let device = self.device().clone().autodiff();

        let mut simulator = checkpoint::with_stable_ids(self.simulator_config.init(self.site.body_extent, self.seed, &device));
        let prepared = self.prepare(&simulator, &split, self.device())?;
        let mut optimizer = ModuleOptimizer::from(AdamConfig::new().with_epsilon(1e-8).build())
            .with_grad_clipping(GradientClipping::Norm(self.config.gradient_clip as f32));
        let mut progress =
            Progress { epochs_done: 0, steps_done: 0, best_epoch: 0, best_validation: f64::INFINITY, history: Vec::new() };
        match (resume, &self.config.start_from) {
            (Some(folder), _) => {
                let state = checkpoint::read_state(folder)?;
                if state.simulator != *self.simulator_config || state.seed != self.seed || state.site != self.site {
                    return Err(Error::Usage {
                        message: format!("{}: a checkpoint of another configuration", folder.display()),
                        hint: Some("resume with the config.toml of its run folder, or start a new run".into()),
                    });
                }
                simulator = checkpoint::load_weights(folder, simulator)?;
                optimizer = checkpoint::load_optimizer(folder, optimizer)?;
                progress = state.progress;
            }
            (None, Some(folder)) => {
                let state = checkpoint::read_state(folder)?;
                let plain = |config: &SimulatorConfig| SimulatorConfig { effects: vec![], ..config.clone() };
                let same = plain(&state.simulator) == plain(self.simulator_config);
                if !same || state.site.body_extent != self.site.body_extent {
                    return Err(Error::Usage {
                        message: format!("{}: a checkpoint of another simulator", folder.display()),
                        hint: Some(
                            "training.start_from needs the [simulator] settings that the checkpoint was trained with; only the \
                             effects may differ"
                                .into(),
                        ),
                    });
                }
                // Another room's gain is another one, and with it the noise over the amplitude; the receiver that set the
                // body's level is the same one.
                simulator = if state.simulator.effects == self.simulator_config.effects {
                    checkpoint::load_weights(folder, simulator)?
                } else {
                    // New effects start from their settings.
                    let effects = simulator.effects.clone();
                    let plain = state.simulator.init(state.site.body_extent, state.seed, &device);
                    let known = checkpoint::load_weights(folder, checkpoint::with_stable_ids(plain))?;
                    checkpoint::with_stable_ids(known.with_effects(self.simulator_config, effects))
                };
                simulator = self.levels(simulator, &prepared, &split, true)?;
            }
            (None, None) => {
                simulator = self.levels(simulator, &prepared, &split, false)?;
            }
        }
        if !self.config.learn_effects {
            simulator.effects = simulator.effects.no_grad();
        }

        let further: Vec<Vec<Prepared>> = self.devices[1..]
            .iter()
            .map(|device| self.prepare(&simulator.clone().fork(&device.clone().autodiff()), &split, device))
            .collect::<Result<_>>()?;
        emit(Event::Started {
            steps,
            first_step: progress.steps_done,
            training_frames: split.training.len(),
            validation_frames: split.validation.len(),
            unit: self.config.loss.scale.unit(),
        });
        for epoch in progress.epochs_done..self.config.epochs {
            let without_better = epoch.saturating_sub(progress.best_epoch + 1);
            if self.config.patience_epochs > 0 && without_better >= self.config.patience_epochs {
                emit(Event::StoppedEarly { epoch: epoch - 1, best_epoch: progress.best_epoch });
                break;
            }
            let order = split.epoch_order(self.seed, epoch);
            let (mut sum, mut largest) = (0.0, [0.0f64; 2]);
            let mut learning_rate = self.config.learning_rate;
            for batch in order.chunks(self.config.frames_per_step) {
                learning_rate = self.config.learning_rate_at(progress.steps_done, steps);
                let all: Vec<&[Prepared]> = std::iter::once(&prepared).chain(&further).map(Vec::as_slice).collect();
                let (stepped, loss, gradient) =
                    self.step(simulator, &mut optimizer, &all, batch, progress.steps_done, learning_rate)?;
                simulator = stepped;
                sum += loss * batch.len() as f64;
                largest = [largest[0].max(loss), largest[1].max(gradient)];
                progress.steps_done += 1;
                emit(Event::Step { step: progress.steps_done, loss, gradient });
            }
            let metrics = EpochMetrics {
                epoch,
                learning_rate,
                training_loss: sum / order.len() as f64,
                validation_loss: self.validate(&simulator, &prepared, &split.validation)?,
                noise_rate: simulator.noise_rate(),
                largest_loss: Some(largest[0]),
                largest_gradient: Some(largest[1]),
            };
            progress.epochs_done = epoch + 1;
            let better = metrics.score() < progress.best_validation;
            if better {
                progress.best_validation = metrics.score();
                progress.best_epoch = epoch;
            }
            progress.history.push(metrics.clone());
            emit(Event::Epoch(metrics));
            if better {
                self.save("best", &simulator, &optimizer, &progress, emit)?;
            }
            self.save("last", &simulator, &optimizer, &progress, emit)?;
        }
        Ok(Outcome { simulator, progress })
    }

    /// # Panics
    /// Without any.
    fn device(&self) -> &Device {
        &self.devices[0]
    }

    fn levels(&self, simulator: Simulator, prepared: &[Prepared], split: &FrameSplit, known_body: bool) -> Result<Simulator> {
        let heatmap = &self.config.heatmap;
        let fitted = calibrate::fit_levels(simulator, self.recordings, prepared, &split.training, heatmap, known_body)?;
        Ok(checkpoint::with_stable_ids(fitted))
    }

    fn save(
        &self,
        name: &str,
        simulator: &Simulator,
        optimizer: &ModuleOptimizer,
        progress: &Progress,
        emit: &mut dyn FnMut(Event),
    ) -> Result<()> {
        let state = CheckpointState {
            format: 1,
            version: env!("CARGO_PKG_VERSION").into(),
            seed: self.seed,
            simulator: self.simulator_config.clone(),
            heatmap: self.config.heatmap.clone(),
            site: self.site.clone(),
            progress: progress.clone(),
        };
        let folder = self.folder.join(name);
        checkpoint::save(&folder, simulator, Some(optimizer), &state, self.config_toml)?;
        emit(Event::Saved(folder));
        Ok(())
    }

    /// One step of the optimiser on a few frames; its loss, dB², and its largest gradient.
    ///
    /// `prepared`: for every device.
    fn step(
        &self,
        simulator: Simulator,
        optimizer: &mut ModuleOptimizer,
        prepared: &[&[Prepared]],
        batch: &[FrameId],
        step: usize,
        learning_rate: f64,
    ) -> Result<(Simulator, f64, f64)> {
        let mut rng = step_rng(self.seed, step, 0x57E9);
        let mode = Mode::Training { seed: rng.random() };
        let draws = draws(batch, &mut rng);
        // Frames of one recording stay together as far as they can: its surfaces are decoded once for all of them.
        let shares: Vec<&[Draw]> = draws.chunks(draws.len().div_ceil(prepared.len())).collect();
        let parts: Vec<(GradientsParams, f64)> = match shares.as_slice() {
            [all] => vec![self.gradients(&simulator, prepared[0], all, draws.len(), mode, self.device())?],
            _ => self.shared_gradients(&simulator, prepared, &shares, draws.len(), mode)?,
        };
        let value: f64 = parts.iter().map(|(_, loss)| loss).sum();
        if !value.is_finite() {
            return Err(self.first_broken_stage(&simulator, prepared[0], batch, mode, step)?);
        }
        let mut sum = GradientsAccumulator::new();
        parts.into_iter().for_each(|(gradients, _)| sum.accumulate(&simulator, gradients));
        let gradients = sum.grads();
        let gradient = largest_gradient(&simulator, &gradients);
        let simulator = optimizer.step(learning_rate, simulator, gradients);
        match checkpoint::first_non_finite(&simulator) {
            Some(name) => Err(Error::NonFinite { stage: format!("the gradient of `{name}`"), step }),
            None => Ok((simulator, value, gradient)),
        }
    }

    /// Every device on a thread of its own, with a copy of the weights; gradients come back to the first.
    fn shared_gradients(
        &self,
        simulator: &Simulator,
        prepared: &[&[Prepared]],
        shares: &[&[Draw]],
        of: usize,
        mode: Mode,
    ) -> Result<Vec<(GradientsParams, f64)>> {
        std::thread::scope(|scope| {
            let threads: Vec<_> = self
                .devices
                .iter()
                .zip(prepared)
                .zip(shares)
                .map(|((device, prepared), share)| {
                    let copy = simulator.clone().fork(&device.clone().autodiff());
                    scope.spawn(move || -> Result<(GradientsParams, f64)> {
                        let (gradients, loss) = self.gradients(&copy, prepared, share, of, mode, device)?;
                        Ok((gradients.to_device(self.device(), &copy), loss))
                    })
                })
                .collect();
            threads.into_iter().map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
        })
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
    fn summed_loss(
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
                let measured = loss.maps_db(one_frame(recording.target(*frame, device)?));
                let value = if loss.is_likelihood() {
                    let variance = simulator.noise_variance(&clean);
                    loss.deviance(one_frame(clean), variance, measured)
                } else {
                    let signal = simulator.with_noise(&recording.scene.radar, clean, *seed);
                    loss.loss(one_frame(signal), measured)
                };
                sum = Some(match sum {
                    Some(sum) => sum + value,
                    None => value,
                });
            }
        }
        Ok(sum.expect("a batch has frames"))
    }

    /// Loss and constants of every recording; the loss's floors refer to the recording's first training frame.
    fn prepare(&self, simulator: &Simulator, split: &FrameSplit, device: &Device) -> Result<Vec<Prepared>> {
        let mut prepared = Vec::new();
        for (index, recording) in self.recordings.iter().enumerate() {
            let radar = &recording.scene.radar;
            let frame = split.training.iter().find(|id| id.recording == index).map_or(0, |id| id.frame);
            let transform =
                RangeDoppler::new(radar.loops_per_frame, radar.samples_per_chirp, radar.sampling, &self.config.heatmap, device);
            let peak = transform.peak_amplitude(recording.target(frame, device)?);
            prepared.push(Prepared {
                loss: DbLoss::new(radar, &self.config.heatmap, &self.config.loss, peak, device)?,
                constants: simulator.constants(&recording.scene),
            });
        }
        Ok(prepared)
    }

    /// Loss on held-out frames as at inference, without gradients; the same noise in every epoch.
    fn validate(&self, simulator: &Simulator, prepared: &[Prepared], frames: &[FrameId]) -> Result<Option<f64>> {
        if frames.is_empty() {
            return Ok(None);
        }
        let simulator = simulator.clone().valid();
        let mut rng = step_rng(self.seed, 0, 0x7A11);
        let mut sum = 0.0;
        for frame in frames {
            // One frame at a time bounds the memory.
            let draw = (*frame, rng.random());
            let loss = self.summed_loss(&simulator, prepared, &[draw], Mode::Inference, self.device())?;
            sum += f64::from(loss.into_scalar::<f32>());
        }
        Ok(Some(sum / frames.len() as f64))
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
