//! The training loop.

mod begin;
mod step;

use std::path::{Path, PathBuf};

use burn::{module::Module, optim::ModuleOptimizer, tensor::Device};
use rand::RngExt;

use super::{
    EpochMetrics, FrameId, FrameSplit, LoadedRecording, RefinedPose, TrainingConfig,
    checkpoint::{self, CheckpointState, Progress, Site},
    prepared::Prepared,
    refine, step_rng,
};
use crate::{
    bounds,
    error::{Error, Result},
    heatmap::RangeDoppler,
    loss::{DbLoss, Scale},
    simulator::{Mode, Simulator, SimulatorConfig},
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
        scale: Scale,
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

/// What training changes.
struct Learned {
    simulator: Simulator,
    optimizer: ModuleOptimizer,
    progress: Progress,
}

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
            let pose = refine::refine(recording, &frames, &self.config.refine, &self.config.heatmap, self.device())?;
            emit(Event::Refined(pose.clone()));
            Ok(pose)
        };
        self.recordings.iter().enumerate().map(one).collect()
    }

    fn train(&self, resume: Option<&Path>, emit: &mut dyn FnMut(Event)) -> Result<Outcome> {
        let split = self.learned_frames()?;
        let steps = self.config.epochs * split.training.len().div_ceil(self.config.frames_per_step);
        let device = self.device().clone().autodiff();
        let simulator = checkpoint::with_stable_ids(self.simulator_config.init(self.site.body_extent, self.seed, &device));
        let prepared = self.prepare(&simulator, &split, self.device())?;
        let mut learned = self.begun(resume, simulator, &prepared, &split)?;
        if !self.config.learn_effects {
            learned.simulator.effects = learned.simulator.effects.no_grad();
        }

        let further = self.devices[1..]
            .iter()
            .map(|device| self.prepare(&learned.simulator.clone().fork(&device.clone().autodiff()), &split, device));
        let prepared: Vec<Vec<Prepared>> = std::iter::once(Ok(prepared)).chain(further).collect::<Result<_>>()?;
        emit(Event::Started {
            steps,
            first_step: learned.progress.steps_done,
            training_frames: split.training.len(),
            validation_frames: split.validation.len(),
            scale: self.config.loss.scale,
        });
        for epoch in learned.progress.epochs_done..self.config.epochs {
            let best_epoch = learned.progress.best_epoch;
            let without_better = epoch.saturating_sub(best_epoch + 1);
            if self.config.patience_epochs > 0 && without_better >= self.config.patience_epochs {
                emit(Event::StoppedEarly { epoch: epoch - 1, best_epoch });
                break;
            }
            learned = self.epoch(epoch, learned, &prepared, &split, steps, emit)?;
        }
        Ok(Outcome { simulator: learned.simulator, progress: learned.progress })
    }

    /// The frames of a run, once they are enough: those of training as often as an epoch visits them.
    fn learned_frames(&self) -> Result<FrameSplit> {
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
        Ok(split.repeated(self.config.repeats))
    }

    /// Visits every training frame once more and keeps the checkpoints; `steps`: of the whole run.
    fn epoch(
        &self,
        epoch: usize,
        mut learned: Learned,
        prepared: &[Vec<Prepared>],
        split: &FrameSplit,
        steps: usize,
        emit: &mut dyn FnMut(Event),
    ) -> Result<Learned> {
        let order = split.epoch_order(self.seed, epoch);
        let (mut sum, mut largest) = (0.0, [0.0f64; 2]);
        let mut learning_rate = self.config.learning_rate;
        for batch in order.chunks(self.config.frames_per_step) {
            learning_rate = self.config.learning_rate_at(learned.progress.steps_done, steps);
            let (stepped, loss, gradient) = self.step(learned, prepared, batch, learning_rate)?;
            learned = stepped;
            sum += loss * batch.len() as f64;
            largest = [largest[0].max(loss), largest[1].max(gradient)];
            learned.progress.steps_done += 1;
            emit(Event::Step { step: learned.progress.steps_done, loss, gradient });
        }
        let metrics = EpochMetrics {
            epoch,
            learning_rate,
            training_loss: sum / order.len() as f64,
            validation_loss: self.validate(&learned.simulator, &prepared[0], &split.validation)?,
            noise_rate: learned.simulator.noise_rate(),
            largest_loss: Some(largest[0]),
            largest_gradient: Some(largest[1]),
        };
        let progress = &mut learned.progress;
        progress.epochs_done = epoch + 1;
        let better = metrics.score() < progress.best_validation;
        if better {
            progress.best_validation = metrics.score();
            progress.best_epoch = epoch;
        }
        progress.history.push(metrics.clone());
        emit(Event::Epoch(metrics));
        if better {
            self.save("best", &learned, emit)?;
        }
        self.save("last", &learned, emit)?;
        Ok(learned)
    }

    /// # Panics
    /// Without any.
    fn device(&self) -> &Device {
        &self.devices[0]
    }

    fn save(&self, name: &str, learned: &Learned, emit: &mut dyn FnMut(Event)) -> Result<()> {
        let state = CheckpointState {
            format: 1,
            version: env!("CARGO_PKG_VERSION").into(),
            seed: self.seed,
            simulator: self.simulator_config.clone(),
            heatmap: self.config.heatmap.clone(),
            site: self.site.clone(),
            progress: learned.progress.clone(),
        };
        let folder = self.folder.join(name);
        checkpoint::save(&folder, &learned.simulator, Some(&learned.optimizer), &state, self.config_toml)?;
        emit(Event::Saved(folder));
        Ok(())
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
}
