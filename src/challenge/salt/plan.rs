//! Which copies are made: every effect at every grade, as often as is asked.

use serde::{Deserialize, Serialize};

use super::offered::chosen;
use crate::bounds;
use crate::challenge::commitment::hash_file;
use crate::challenge::library::{Graded, Surroundings};
use crate::challenge::secret::Secret;
use crate::data::Recording;
use crate::data::recording::SETTINGS_FILE;
use crate::error::{Error, Result};
use crate::recorder::EffectsConfig;

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct SaltConfig {
    /// Empty: all that the recording can be given.
    pub effects: Vec<String>,
    /// Strengths from the weakest to the strongest, in equal ratios; a single one is the strongest.
    pub grades: usize,
    /// Copies of each, that differ in all that is drawn.
    pub repeats: usize,
}

impl Default for SaltConfig {
    fn default() -> Self {
        Self { effects: vec![], grades: 4, repeats: 1 }
    }
}

/// What is done, kept beside the secret: a run that goes on must be of the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Resolved {
    /// SHA-256 of the samples and the settings of the recording.
    pub samples_sha256: String,
    pub settings_sha256: String,
    pub effects: Vec<String>,
    pub grades: usize,
    pub repeats: usize,
}

/// One copy.
#[derive(Clone, Copy)]
pub struct Plan {
    pub index: usize,
    pub graded: &'static Graded,
    /// From 0, the weakest.
    pub grade: usize,
    pub repeat: usize,
    pub strength: f64,
    /// Equal for all grades of an effect and repeat: they differ in their strength alone.
    draw: usize,
}

/// # Errors
/// Effects that cannot be, and numbers out of bounds.
pub fn plans(config: &SaltConfig, recording: &Recording) -> Result<(Resolved, Vec<Plan>)> {
    for (key, value) in [("grades", config.grades), ("repeats", config.repeats)] {
        if value == 0 {
            return Err(Error::setting(key, value, "1 or more"));
        }
    }
    let effects = chosen(&config.effects, &recording.radar, recording.holds_codes())?;
    let cases = effects.len().saturating_mul(config.grades).saturating_mul(config.repeats);
    bounds::count("effects × grades × repeats", cases, 100_000)?;
    let mut all = Vec::with_capacity(cases);
    for (effect, graded) in effects.iter().enumerate() {
        for grade in 0..config.grades {
            let level = if config.grades == 1 { 1.0 } else { grade as f64 / (config.grades - 1) as f64 };
            for repeat in 0..config.repeats {
                let (strength, draw) = (graded.strength(level), effect * config.repeats + repeat);
                all.push(Plan { index: all.len(), graded, grade, repeat, strength, draw });
            }
        }
    }
    let resolved = Resolved {
        samples_sha256: hash_file(&recording.folder.join(&recording.files.samples))?,
        settings_sha256: hash_file(&recording.folder.join(SETTINGS_FILE))?,
        effects: effects.iter().map(|graded| graded.id.to_string()).collect(),
        grades: config.grades,
        repeats: config.repeats,
    };
    Ok((resolved, all))
}

impl Plan {
    /// The recorder's seed.
    pub fn seed(&self, secret: &Secret) -> u64 {
        secret.world_seed(self.draw)
    }

    /// The effect at its strength.
    pub fn planted(&self, recording: &Recording, secret: &Secret) -> EffectsConfig {
        let radar = &recording.radar;
        // Only effects of the scene would ask for a distance.
        let at = Surroundings::new(radar, recording.room.clone().unwrap_or_default(), 0.0);
        let mut effects = EffectsConfig::default();
        (self.graded.add)(&mut effects, self.strength, &at, &mut secret.random("effect", self.draw));
        if let Some(lost) = &mut effects.frame_drop {
            // Frames must be left behind the gap, and some before it.
            lost.at = lost.at.min(radar.frames - 1 - lost.count).max(1);
        }
        if let Some(transient) = &mut effects.ramp_edge_transient {
            transient.samples = transient.samples.min(radar.samples_per_chirp);
        }
        effects
    }
}
