//! What a run begins with: new weights at the recordings' levels, those of another run, or where this one was stopped.

use std::path::Path;

use burn::grad_clipping::GradientClipping;
use burn::optim::{AdamConfig, ModuleOptimizer};

use super::{Learned, Trainer};
use crate::error::{Error, Result};
use crate::simulator::{Simulator, SimulatorConfig};
use crate::training::checkpoint::{self, Progress};
use crate::training::prepared::Prepared;
use crate::training::{FrameSplit, calibrate};

impl Trainer<'_> {
    /// From `simulator`, as it is drawn.
    pub(super) fn begun(
        &self,
        resume: Option<&Path>,
        simulator: Simulator,
        prepared: &[Prepared],
        split: &FrameSplit,
    ) -> Result<Learned> {
        let optimizer = ModuleOptimizer::from(AdamConfig::new().with_epsilon(1e-8).build())
            .with_grad_clipping(GradientClipping::Norm(self.config.gradient_clip as f32));
        let progress =
            Progress { epochs_done: 0, steps_done: 0, best_epoch: 0, best_validation: f64::INFINITY, history: Vec::new() };
        match (resume, &self.config.start_from) {
            (Some(folder), _) => self.resumed(folder, simulator, optimizer),
            (None, Some(folder)) => {
                let simulator = self.levels(self.known(folder, simulator)?, prepared, split, true)?;
                Ok(Learned { simulator, optimizer, progress })
            }
            (None, None) => {
                let simulator = self.levels(simulator, prepared, split, false)?;
                Ok(Learned { simulator, optimizer, progress })
            }
        }
    }

    fn resumed(&self, folder: &Path, simulator: Simulator, optimizer: ModuleOptimizer) -> Result<Learned> {
        let state = checkpoint::read_state(folder)?;
        if state.simulator != *self.simulator_config || state.seed != self.seed || state.site != self.site {
            return Err(Error::Usage {
                message: format!("{}: a checkpoint of another configuration", folder.display()),
                hint: Some("resume with the config.toml of its run folder, or start a new run".into()),
            });
        }
        let simulator = checkpoint::load_weights(folder, simulator)?;
        let optimizer = checkpoint::load_optimizer(folder, optimizer)?;
        Ok(Learned { simulator, optimizer, progress: state.progress })
    }

    /// With the weights of another run's checkpoint.
    fn known(&self, folder: &Path, simulator: Simulator) -> Result<Simulator> {
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
        if state.simulator.effects == self.simulator_config.effects {
            return checkpoint::load_weights(folder, simulator);
        }
        // New effects start from their settings.
        let effects = simulator.effects.clone();
        let plain = state.simulator.init(state.site.body_extent, state.seed, &self.device().clone().autodiff());
        let known = checkpoint::load_weights(folder, checkpoint::with_stable_ids(plain))?;
        Ok(checkpoint::with_stable_ids(known.with_effects(self.simulator_config, effects)))
    }

    fn levels(&self, simulator: Simulator, prepared: &[Prepared], split: &FrameSplit, known_body: bool) -> Result<Simulator> {
        let heatmap = &self.config.heatmap;
        let fitted = calibrate::fit_levels(simulator, self.recordings, prepared, &split.training, heatmap, known_body)?;
        Ok(checkpoint::with_stable_ids(fitted))
    }
}
