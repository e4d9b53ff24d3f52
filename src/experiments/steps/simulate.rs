//! A trained simulator's frames of one recording, and what is done with anybody's: they are kept, or scored.

use std::path::Path;
use std::time::Instant;

use burn::tensor::Device;
use num_complex::Complex32;

use super::bench::{Bench, seed_of};
use super::measure::{Speed, held_out, write_json};
use crate::data::{IfFrame, IfLayout, Recording, RecordingContents, write_recording};
use crate::error::Result;
use crate::evaluation::{ComparisonConfig, Simulation, compare_with};
use crate::lpips::Lpips;
use crate::radar::{Radar, Sampling};
use crate::simulator::{Simulator, SimulatorConfig};
use crate::training::checkpoint::{load_weights, read_state, with_stable_ids};

/// One recording to simulate with a trained checkpoint.
pub struct Task<'a> {
    pub checkpoint: &'a Path,
    pub recording: &'a Path,
    pub name: &'a str,
    pub graph_at_inference: bool,
    pub seed: u64,
}

/// A method's frames of a measured recording.
pub struct Source<'a> {
    pub recording: &'a Recording,
    /// Works out where everything is and who is seen, for [`Self::frame`].
    pub look: &'a dyn Fn(usize) -> Result<()>,
    /// `[tx, rx, loop, sample]`.
    pub frame: &'a dyn Fn(usize) -> Result<Vec<Complex32>>,
}

/// What becomes of a method's frames.
pub type Use<'a> = &'a mut dyn FnMut(&Source<'_>) -> Result<Speed>;

/// Hands the frames of a trained simulator, with its noise, to `then`.
///
/// # Errors
/// A checkpoint or recording that cannot be read, and whatever `then` refuses.
pub fn simulate(task: &Task, bench: &mut Bench, then: Use<'_>) -> Result<Speed> {
    let (simulator, config) = open(task.checkpoint, task.graph_at_inference, bench.device())?;
    let loaded = bench.simulated(task.recording, &config)?;
    let simulation = Simulation::new(&simulator, &loaded.scene, seed_of(task.seed, task.name), true);
    // Kept for the next method.
    let look = |frame| loaded.scene.view(frame).map(drop);
    let speed = then(&Source { recording: &loaded.recording, look: &look, frame: &|frame| simulation.frame(frame) })?;
    // Whoever comes first works the geometry out; the others are charged as much.
    Ok(Speed { geometry_s: bench.charged_geometry_s(&config, speed.geometry_s), ..speed })
}

/// A trained simulator, with the graph convolution kept on at inference or not.
fn open(checkpoint: &Path, graph_at_inference: bool, device: &Device) -> Result<(Simulator, SimulatorConfig)> {
    let state = read_state(checkpoint)?;
    let mut config = state.simulator;
    config.graph.at_inference = graph_at_inference;
    let simulator = config.init(state.site.body_extent, state.seed, device);
    Ok((load_weights(checkpoint, with_stable_ids(simulator))?, config))
}

/// Writes `recording/`, the same scene as the measured one with simulated samples.
pub fn keep(source: &Source<'_>, folder: &Path, step: &mut dyn FnMut(usize, usize)) -> Result<Speed> {
    let recording = source.recording;
    let radar = &recording.radar;
    let contents = RecordingContents {
        radar,
        room: recording.room.as_ref(),
        person: recording.person(),
        body_file: None,
        labels: recording.labels.clone(),
        layout: if radar.sampling == Sampling::Complex { IfLayout::Complex } else { IfLayout::Real },
        truth: None,
    };
    let mut speed = Speed { frames: radar.frames, ..Default::default() };
    // An earlier attempt may have come as far as this.
    let _ = std::fs::remove_dir_all(folder.join("recording"));
    write_recording(folder.join("recording"), &contents, &mut |frame| {
        let started = Instant::now();
        (source.look)(frame)?;
        let seen = Instant::now();
        let signal = (source.frame)(frame)?;
        speed.geometry_s += (seen - started).as_secs_f64();
        speed.signal_s += seen.elapsed().as_secs_f64();
        step(frame + 1, radar.frames);
        Ok(sampled(radar, &signal))
    })?;
    Ok(speed)
}

/// Writes `scores.json` of the frames that training held out, so large a part of the recording; no other is simulated, and none
/// is kept.
pub fn score_held_out(
    source: &Source<'_>,
    fraction: f64,
    config: &ComparisonConfig,
    lpips: Option<&Lpips>,
    folder: &Path,
) -> Result<Speed> {
    let recording = source.recording;
    let frames = held_out(recording.frames(), fraction);
    let started = Instant::now();
    frames.iter().try_for_each(|&frame| (source.look)(frame))?;
    let seen = Instant::now();
    let simulated = |frame| Ok(sampled(&recording.radar, &(source.frame)(frame)?).complex().collect());
    let found = compare_with(recording, &simulated, &frames, &config.heatmap, &config.metrics, lpips, &mut |_, _, _| {})?;
    write_json(&folder.join("scores.json"), &found)?;
    let (geometry_s, signal_s) = ((seen - started).as_secs_f64(), seen.elapsed().as_secs_f64());
    Ok(Speed { frames: frames.len(), geometry_s, signal_s })
}

/// What the radar's converter takes of a signal: a real one's has no imaginary part.
fn sampled(radar: &Radar, signal: &[Complex32]) -> IfFrame {
    let [_, tx, rx, loops, samples] = radar.dims();
    let im = (radar.sampling == Sampling::Complex).then(|| signal.iter().map(|value| value.im).collect());
    IfFrame::new([tx, rx, loops, samples], signal.iter().map(|value| value.re).collect(), im)
}
