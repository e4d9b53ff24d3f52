//! A trained simulator's frames, held against a recording's.

use num_complex::Complex32;
use rand::RngExt;

use super::{
    Evaluation,
    frames::{FrameMaps, compare_with},
};
use crate::{
    error::Result,
    heatmap::HeatmapConfig,
    lpips::Lpips,
    metrics::MetricsConfig,
    simulator::{Mode, Part, Scene, Simulator, Surfaces},
    training::{LoadedRecording, step_rng},
};

/// Simulates frames as at inference, one at a time.
pub struct Simulation<'a> {
    simulator: &'a Simulator,
    scene: &'a Scene,
    surfaces: Surfaces,
    seed: u64,
    noise: bool,
    only: Option<Part>,
}

impl<'a> Simulation<'a> {
    /// `noise` off gives the clean signal.
    pub fn new(simulator: &'a Simulator, scene: &'a Scene, seed: u64, noise: bool) -> Self {
        let surfaces = simulator.surfaces(&simulator.constants(scene), Mode::Inference);
        Self { simulator, scene, surfaces, seed, noise, only: None }
    }

    /// The same, of one part of the signal alone; all parts of a frame add up to it with noise.
    ///
    /// # Panics
    /// With effects that are switched on: they act on the sum.
    pub fn only(self, part: Part) -> Self {
        assert!(self.simulator.effects.is_empty(), "one part of a simulation: effects act on the sum");
        Self { only: Some(part), ..self }
    }

    /// `[tx, rx, loop, sample]`, in the units of the recordings it was trained on.
    ///
    /// # Errors
    /// A frame outside the motion.
    pub fn frame(&self, frame: usize) -> Result<Vec<Complex32>> {
        let view = self.scene.view(frame)?;
        let seed = || step_rng(self.seed, frame, 0x51A1).random();
        if let Some(part) = self.only {
            return Ok(self.simulator.part_signal(part, self.scene, &view, &self.surfaces, seed()).to_host());
        }
        let clean = self.simulator.clean_signal(self.scene, &view, &self.surfaces);
        let signal = match self.noise {
            true => self.simulator.with_noise(&self.scene.radar, clean, seed()),
            false => clean,
        };
        Ok(signal.to_host())
    }
}

/// Compares a recording's frames with simulated ones, one by one.
///
/// `observe` sees the maps of every frame: all cells, then static-removed ones.
///
/// # Errors
/// Frames without a signal; a frame that cannot be read or lies outside the motion; maps too small for `lpips`.
pub fn evaluate(
    recording: &LoadedRecording,
    simulation: &Simulation<'_>,
    frames: &[usize],
    heatmap: &HeatmapConfig,
    metrics: &MetricsConfig,
    lpips: Option<&Lpips>,
    observe: &mut dyn FnMut(usize, FrameMaps, FrameMaps),
) -> Result<Evaluation> {
    compare_with(&recording.recording, &|frame| simulation.frame(frame), frames, heatmap, metrics, lpips, observe)
}
