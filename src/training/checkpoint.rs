//! Checkpoints: what is needed to infer (weights, settings, site) and to continue as if nothing had happened.
//!
//! A checkpoint is a folder, written under a temporary name and renamed when it is complete:
//! `weights.safetensors`, `optimizer.bpk`, `config.toml` (resolved), `checkpoint.toml` (progress and site).

use std::{io::Write, path::Path};

use burn::{
    module::{Module, ModuleMapper, ModuleVisitor, Param, ParamId},
    optim::{ModuleOptimizer, OptimizerRecord},
    store::{ModuleSnapshot, SafetensorsStore},
    tensor::{Device, Tensor},
};
use serde::{Deserialize, Serialize};

use super::metrics::EpochMetrics;
use crate::{
    data::{
        atomic::{self, AtomicFolder},
        files,
        recording::check_placement,
        settings,
    },
    error::{Error, Result},
    features::Extent,
    heatmap::HeatmapConfig,
    person::Placement,
    radar::Radar,
    room::Room,
    simulator::{Simulator, SimulatorConfig},
};

/// Name of the weights' file in a checkpoint.
pub const WEIGHTS: &str = "weights.safetensors";
const OPTIMIZER: &str = "optimizer.bpk";
const STATE: &str = "checkpoint.toml";

/// The place a simulator was trained for: what `infer` needs beside weights and a motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Site {
    pub radar: Radar,
    pub room: Option<Room>,
    /// Where the training person's motion stood; the default for new motions.
    pub placement: Option<Placement>,
    /// The box around the canonical body that the tri-plane covers, with its margin.
    pub body_extent: Extent,
}

/// How far training has come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Progress {
    pub epochs_done: usize,
    pub steps_done: usize,
    pub best_epoch: usize,
    pub best_validation: f64,
    pub history: Vec<EpochMetrics>,
}

/// `checkpoint.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckpointState {
    pub format: u32,
    pub version: String,
    pub seed: u64,
    pub simulator: SimulatorConfig,
    /// The maps that the loss compared.
    #[serde(default)]
    pub heatmap: HeatmapConfig,
    pub site: Site,
    pub progress: Progress,
}

/// Gives the parameters identities that depend on their order alone. Burn numbers them at random, but the
/// optimiser's saved state is found by these numbers when a run resumes.
pub fn with_stable_ids(simulator: Simulator) -> Simulator {
    struct Renumber(u64);
    impl ModuleMapper for Renumber {
        fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
            self.0 += 1;
            let (_, value, mapper) = param.consume();
            Param::from_mapped_value(ParamId::from(self.0), value, mapper)
        }
    }
    simulator.map(&mut Renumber(0))
}

/// Writes a checkpoint folder, replacing an older one of the same name.
pub fn save(
    folder: &Path,
    simulator: &Simulator,
    optimizer: Option<&ModuleOptimizer>,
    state: &CheckpointState,
    config_toml: &str,
) -> Result<()> {
    let partial = AtomicFolder::replacing(folder)?;
    let write_error = |name: &str, error: String| Error::write(partial.path().join(name), std::io::Error::other(error));
    // Through memory: files that Burn writes are private. One entry of metadata, for more stand in random order.
    let mut store = SafetensorsStore::from_bytes(None).clear_metadata().metadata("hybridsim", &state.version);
    let saved = simulator.save_into(&mut store).and_then(|()| store.get_bytes());
    let weights = saved.map_err(|error| write_error(WEIGHTS, error.to_string()))?;
    atomic::write_file(partial.path().join(WEIGHTS), |file| file.write_all(&weights))?;
    if let Some(optimizer) = optimizer {
        // Its tensors come in random order; who reads them back gets them by name.
        let bytes =
            optimizer.to_record().into_bytes().and_then(OptimizerRecord::from_bytes).and_then(|sorted| sorted.into_bytes());
        let bytes = bytes.map_err(|error| write_error(OPTIMIZER, error.to_string()))?;
        atomic::write_file(partial.path().join(OPTIMIZER), |file| file.write_all(&bytes))?;
    }
    let state = toml::to_string(state).expect("plain data");
    for (name, text) in [("config.toml", config_toml), (STATE, &state)] {
        atomic::write_text(partial.path().join(name), text)?;
    }
    partial.finish()
}

/// Reads what a checkpoint says about itself.
pub fn read_state(folder: &Path) -> Result<CheckpointState> {
    atomic::recover(folder)?;
    let path = folder.join(STATE);
    if !path.is_file() {
        return Err(Error::Usage {
            message: format!("{}: not a checkpoint: it holds no {STATE}", folder.display()),
            hint: Some("a run folder keeps its checkpoints in `best` and `last`".into()),
        });
    }
    let state: CheckpointState = settings::read_toml(&path)?;
    if state.format != 1 {
        return Err(Error::field(path, "format", state.format.to_string(), "1"));
    }
    state.check(&path)?;
    Ok(state)
}

impl CheckpointState {
    /// Refuses what a config or a recording with the same numbers would be refused for; `path` is the file they are in.
    fn check(&self, path: &Path) -> Result<()> {
        let Site { radar, room, placement, body_extent } = &self.site;
        let room = room.as_ref().map_or(Ok(()), |room| room.check("site.room"));
        self.simulator.check().and(radar.check("site.radar")).and(room).map_err(|error| error.in_file(path))?;
        if let Some(placement) = placement {
            check_placement(path, placement)?;
        }
        let Extent { low_m, high_m } = body_extent;
        if low_m.iter().zip(high_m).any(|(low, high)| low > high) {
            let found = format!("{low_m:?} to {high_m:?}");
            return Err(Error::field(path, "site.body_extent", found, "a box whose low corner comes first"));
        }
        Ok(())
    }
}

/// Loads the weights into a simulator that was initialised from the same settings.
pub fn load_weights(folder: &Path, mut simulator: Simulator) -> Result<Simulator> {
    let path = folder.join(WEIGHTS);
    files::require(&path)?;
    let mut store = SafetensorsStore::from_file(&path).allow_partial(true).validate(false);
    let result = simulator
        .load_from(&mut store)
        .map_err(|error| Error::Parse { path: path.clone(), message: format!("not a complete weights file: {error}") })?;
    let other = |found: String, expected: &str| {
        Error::field(&path, "weights", found, expected)
            .with_hint("this checkpoint belongs to another configuration; use the config.toml beside it")
    };
    if let Some(error) = result.errors.first() {
        return Err(other(error.to_string(), "the shapes of this configuration"));
    }
    if let Some((name, _)) = result.missing.first() {
        return Err(other(format!("without `{name}`"), "a tensor for each parameter of this configuration"));
    }
    if let Some(name) = result.unused.first() {
        return Err(other(format!("with an unknown tensor `{name}`"), "the parameters of this configuration alone"));
    }
    if let Some(name) = first_non_finite(&simulator) {
        return Err(Error::field(&path, name, "NaN or infinite", "finite weights"));
    }
    Ok(simulator)
}

/// Loads the optimiser's state.
pub fn load_optimizer(folder: &Path, optimizer: ModuleOptimizer) -> Result<ModuleOptimizer> {
    let path = folder.join(OPTIMIZER);
    files::require(&path)?;
    optimizer.load(&path).map_err(|error| Error::Parse { path, message: format!("not an optimiser's state: {error}") })
}

/// A simulator ready to infer, with the state of its checkpoint.
pub fn open(folder: &Path, device: &Device) -> Result<(Simulator, CheckpointState)> {
    let state = read_state(folder)?;
    let simulator = state.simulator.init(state.site.body_extent, state.seed, device);
    Ok((load_weights(folder, with_stable_ids(simulator))?, state))
}

/// Name of the first parameter with a value that is not finite.
pub fn first_non_finite(simulator: &Simulator) -> Option<String> {
    struct Finder {
        path: Vec<String>,
        found: Option<String>,
    }
    impl ModuleVisitor for Finder {
        fn enter_module(&mut self, name: &str, _: &str) {
            self.path.push(name.into());
        }
        fn exit_module(&mut self, _: &str, _: &str) {
            self.path.pop();
        }
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            if self.found.is_none() && !crate::simulator::is_finite(param.val()) {
                self.found = Some(self.path.join("."));
            }
        }
    }
    let mut finder = Finder { path: Vec::new(), found: None };
    simulator.visit(&mut finder);
    finder.found
}
