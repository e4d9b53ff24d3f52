//! What stages share while they run: devices, and recordings whose geometry is worked out already.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use burn::tensor::Device;
use sha2::{Digest, Sha256};

use crate::error::Result;
use crate::evaluation::ComparisonConfig;
use crate::lpips::{Lpips, LpipsConfig};
use crate::simulator::SimulatorConfig;
use crate::training::{LoadedRecording, load_recordings};

/// What a scene's geometry depends on, beside its recording.
type Geometry = String;

fn geometry(config: &SimulatorConfig) -> Geometry {
    let parts = (&config.surface, &config.room, config.flip_exponent, config.interpolation);
    serde_json::to_string(&parts).expect("settings are plain data")
}

/// Keeps the recordings of the last training, and the last simulated recording under every geometry asked for: who sees
/// whom in a frame is the same for most simulators, and dearer than the simulation itself.
pub struct Bench {
    /// All share the frames of a training; the first does the rest.
    pub devices: Vec<Device>,
    training: Option<(Vec<PathBuf>, Geometry, Rc<Vec<LoadedRecording>>)>,
    simulated: (PathBuf, HashMap<Geometry, Rc<LoadedRecording>>),
    /// What the geometry of the simulated recording took.
    geometry_s: HashMap<Geometry, f64>,
    lpips: Option<(LpipsConfig, Rc<Lpips>)>,
}

impl Bench {
    /// With these devices and nothing kept yet.
    pub fn new(devices: &[Device]) -> Self {
        Self { devices: devices.to_vec(), training: None, simulated: Default::default(), geometry_s: HashMap::new(), lpips: None }
    }

    /// # Panics
    /// Without any.
    pub fn device(&self) -> &Device {
        &self.devices[0]
    }

    /// Recordings to learn from, together.
    pub fn training(&mut self, folders: &[PathBuf], config: &SimulatorConfig) -> Result<Rc<Vec<LoadedRecording>>> {
        let wanted = geometry(config);
        if let Some((known, geometry, recordings)) = &self.training
            && known == folders
            && *geometry == wanted
        {
            return Ok(recordings.clone());
        }
        // The old ones first: both may not fit into memory.
        self.training = None;
        let recordings = Rc::new(load_recordings(folders, config)?);
        self.training = Some((folders.to_vec(), wanted, recordings.clone()));
        Ok(recordings)
    }

    /// The network behind LPIPS, where its files are given.
    pub fn lpips(&mut self, config: &ComparisonConfig) -> Result<Option<Rc<Lpips>>> {
        let Some(wanted) = &config.lpips else { return Ok(None) };
        if self.lpips.as_ref().is_none_or(|(known, _)| known != wanted) {
            self.lpips = Some((wanted.clone(), Rc::new(Lpips::open(wanted, self.device())?)));
        }
        Ok(self.lpips.as_ref().map(|(_, lpips)| lpips.clone()))
    }

    /// A recording to simulate.
    pub fn simulated(&mut self, folder: &Path, config: &SimulatorConfig) -> Result<Rc<LoadedRecording>> {
        self.training = None;
        if self.simulated.0 != folder {
            self.simulated = (folder.into(), HashMap::new());
            self.geometry_s.clear();
        }
        let wanted = geometry(config);
        if let Some(known) = self.simulated.1.get(&wanted) {
            return Ok(known.clone());
        }
        let loaded = Rc::new(LoadedRecording::open(folder, config, false)?);
        self.simulated.1.insert(wanted, loaded.clone());
        Ok(loaded)
    }
}

impl Bench {
    /// What the geometry of the simulated recording has taken so far, `seconds` more among it: every frame's is worked out once.
    pub fn charged_geometry_s(&mut self, config: &SimulatorConfig, seconds: f64) -> f64 {
        let known = self.geometry_s.entry(geometry(config)).or_default();
        *known += seconds;
        *known
    }
}

/// A seed of a recording's own, so that no two recordings have the same noise.
pub fn seed_of(seed: u64, name: &str) -> u64 {
    let digest = Sha256::digest(format!("{seed} {name}"));
    u64::from_le_bytes(digest[..8].try_into().expect("a digest has 32 bytes"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_differ_between_recordings_and_stay_the_same_for_each() {
        assert_eq!(seed_of(1, "s1_lunge_1"), seed_of(1, "s1_lunge_1"));
        assert_ne!(seed_of(1, "s1_lunge_1"), seed_of(1, "s1_lunge_2"));
        assert_ne!(seed_of(1, "s1_lunge_1"), seed_of(2, "s1_lunge_1"));
    }
}
