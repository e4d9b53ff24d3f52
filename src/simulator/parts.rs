//! A frame's signal taken apart (paper, supplement 13).

use serde::{Deserialize, Serialize};

use super::{FrameView, Scene, Simulator, Surfaces};
use crate::complex::Complex;

/// What a signal is the sum of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    Direct,
    Indirect,
    /// What the noise adds; its level is a share of the whole signal.
    Noise,
}

impl Part {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Direct, Self::Indirect, Self::Noise];

    /// The word of settings and reports, such as `direct`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Noise => "noise",
        }
    }
}

impl Simulator {
    /// One part of a frame; all three add up to [`Self::with_noise`] of [`Self::clean_signal`]. A path that the settings leave
    /// out is silence.
    ///
    /// # Shapes
    /// - result: `[tx, rx, loop, sample]`, in the units of the recordings it was trained on
    ///
    /// # Gradient
    /// Flows to what the part depends on.
    ///
    /// # Panics
    /// With effects that are switched on: they act on the sum.
    pub fn part_signal(&self, part: Part, scene: &Scene, view: &FrameView, surfaces: &Surfaces, noise_seed: u64) -> Complex<4> {
        assert!(self.effects.is_empty(), "the parts of a signal: effects act on their sum");
        let paths = self.config.paths;
        // Without a pose of its own the person moves as the scene says.
        let posed = scene.posed(view, None, &self.device());
        let posed = posed.as_ref();
        match part {
            Part::Direct if paths.has_direct() => self.direct_signal(scene, view, surfaces, posed),
            Part::Indirect if paths.has_indirect() && !scene.proxies.is_empty() => {
                self.indirect_signal(scene, view, surfaces, posed)
            }
            Part::Direct | Part::Indirect => {
                let [_, tx, rx, loops, samples] = scene.radar.dims();
                Complex::zeros([tx, rx, loops, samples], &self.device())
            }
            Part::Noise => {
                let clean = self.clean_signal(scene, view, surfaces);
                self.with_noise(&scene.radar, clean.clone(), noise_seed).sub(clean)
            }
        }
    }
}
