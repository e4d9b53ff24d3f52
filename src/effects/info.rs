//! What the library says about an effect.

use serde::{Deserialize, Serialize};

/// A parameter of an effect: a single number, or a list with one for each channel, axis or order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    pub name: &'static str,
    pub unit: &'static str,
    /// The value at which the effect does nothing. Parameters that only shape an effect have no such value; theirs is
    /// where a search starts.
    pub neutral: f64,
    /// Prior: nothing below this is believed.
    pub least: f64,
    /// Prior: nothing above this is believed.
    pub most: f64,
}

impl ParameterInfo {
    /// Whether it is in a unit that only the recording knows, so that its prior says nothing about its size.
    pub fn is_relative(&self) -> bool {
        self.unit.contains("reference") || self.unit.contains("recording")
    }
}

pub(super) const fn parameter(name: &'static str, unit: &'static str, neutral: f64, least: f64, most: f64) -> ParameterInfo {
    ParameterInfo { name, unit, neutral, least, most }
}

/// Where in the signal's way an effect acts, in the order of that way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    Timing,
    Scene,
    Body,
    Propagation,
    Waveform,
    Antenna,
    Receiver,
    Noise,
}

impl Stage {
    /// As reports write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Timing => "timing",
            Self::Scene => "scene",
            Self::Body => "body",
            Self::Propagation => "propagation",
            Self::Waveform => "waveform",
            Self::Antenna => "antenna",
            Self::Receiver => "receiver",
            Self::Noise => "noise",
        }
    }
}

/// An effect as the library describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectInfo {
    pub id: &'static str,
    /// Of the catalogue of effects; empty where there is none.
    pub card: &'static str,
    pub stage: Stage,
    /// Whether it changes the person's returns alone: a recording without a person cannot have it.
    pub needs_person: bool,
    /// With its article: "the receiver's IF high-pass filter".
    pub title: &'static str,
    /// One plain sentence: what it is and what it does to the data.
    pub explanation: &'static str,
    /// The term as it enters the IF signal; p counts paths, m chirps, n samples, T is the chirp's time.
    pub equation: &'static str,
    pub parameters: &'static [ParameterInfo],
    /// Ids of effects that leave nearly the same trace. A pair stands once, with either of the two:
    /// [`look_alikes`](super::look_alikes) has both directions.
    pub(super) look_alikes: &'static [&'static str],
    /// The recording that would tell it from them.
    pub separate_by: &'static str,
}

impl EffectInfo {
    pub fn parameter(&self, name: &str) -> Option<&'static ParameterInfo> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }
}
