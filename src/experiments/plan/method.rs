//! The methods that are compared.

use serde::Serialize;

use crate::experiments::config::BaselineName;
use crate::experiments::variants::Variant;

/// Who simulates; or, for comparison, measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    Baseline(BaselineName),
    /// A baseline with the noise that the training recordings' receiver has, in place of the paper's share of the signal.
    ReceiverNoise(BaselineName),
    Variant(Variant),
    /// The same truth recorded again with other noise: no simulator can do better.
    Again,
    /// The same with another draw of the mesh's error too: nobody who knows the body no better can predict how its returns
    /// interfere.
    OtherMesh,
    /// Ours brought to the second room by so many of its frames; with zero, as it was.
    Adapted(usize),
    /// Trained from the beginning on so many frames of the second room, as many steps long.
    FromScratch(usize),
    /// Trained on some actions of the second scene, used on others.
    SceneOurs,
    /// Used on them as the first site trained it.
    SceneUnadapted,
    /// As [`Method::Again`], in the second scene.
    SceneAgain,
}

/// A method as it was trained once; what does not learn has the draw 0 alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drawn {
    pub method: Method,
    pub draw: usize,
}

impl Drawn {
    /// As in folders: the first draw has the method's.
    pub fn id(self) -> String {
        match self.draw {
            0 => self.method.id(),
            draw => format!("{}/draw_{}", self.method.id(), draw + 1),
        }
    }

    /// The only one.
    pub fn first(method: Method) -> Self {
        Self { method, draw: 0 }
    }
}

impl Method {
    /// As in folders.
    pub fn id(self) -> String {
        match self {
            Self::Baseline(name) => name.id().into(),
            Self::ReceiverNoise(name) => format!("{}-receiver-noise", name.id()),
            Self::Variant(variant) => variant.id().into(),
            Self::Again => "again".into(),
            Self::OtherMesh => "other_mesh".into(),
            Self::Adapted(frames) => format!("adapted_{frames}"),
            Self::FromScratch(frames) => format!("from_scratch_{frames}"),
            Self::SceneOurs => "scene_ours".into(),
            Self::SceneUnadapted => "scene_unadapted".into(),
            Self::SceneAgain => "scene_again".into(),
        }
    }

    /// As in tables.
    pub fn title(self) -> String {
        match self {
            Self::Baseline(name) => name.title().into(),
            Self::ReceiverNoise(name) => format!("{}, receiver's noise", name.title()),
            Self::Variant(variant) => variant.title().into(),
            Self::Again => "measured again (ceiling)".into(),
            Self::OtherMesh => "measured with another mesh error".into(),
            Self::Adapted(frames) => format!("HybridSim, adapted to {frames} frames"),
            Self::FromScratch(frames) => format!("HybridSim, trained on {frames} frames only"),
            Self::SceneOurs => "HybridSim, trained there on other actions".into(),
            Self::SceneUnadapted => "HybridSim as the first site trained it".into(),
            Self::SceneAgain => "measured again there (ceiling)".into(),
        }
    }
}
