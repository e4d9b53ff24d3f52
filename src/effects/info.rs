//! What the library says about an effect.

use serde::{Deserialize, Serialize};

use super::{
    operator::Operator,
    parameter::{ParameterInfo, named},
};

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

/// What an effect chooses beside its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    None,
    /// A wall, the floor or the ceiling; it has to be named.
    Boundary,
    /// The part of the body that a joint moves; all of the body where none is named.
    Part,
}

/// An effect as the library describes it.
#[derive(Clone, Copy, Debug)]
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
    pub choice: Choice,
    /// Ids of effects that leave nearly the same trace. A pair stands once, with either of the two:
    /// [`look_alikes`](super::look_alikes) has both directions.
    pub(crate) look_alikes: &'static [&'static str],
    /// The recording that would tell it from them.
    pub separate_by: &'static str,
    /// Where it enters the simulator, and its function.
    pub operator: Operator,
}

impl EffectInfo {
    /// A parameter by its name; none where the effect has no such one.
    pub fn parameter(&self, name: &str) -> Option<&'static ParameterInfo> {
        named(self.parameters, name)
    }
}
