//! Simulates one recording by a trained simulator.

use std::path::Path;
use std::time::Instant;

use burn::tensor::Device;
use num_complex::Complex32;

use super::bench::{Bench, seed_of};
use super::measure::{Speed, write_json};
use crate::data::{IfFrame, IfLayout, Recording, RecordingContents, write_recording};
use crate::error::Result;
use crate::evaluation::Simulation;
use crate::radar::Sampling;
use crate::simulator::{Simulator, SimulatorConfig};
use crate::training::checkpoint::{load_weights, read_state, with_stable_ids};

pub struct Task<'a> {
    pub checkpoint: &'a Path,
    pub recording: &'a Path,
    pub name: &'a str,
    pub graph_at_inference: bool,
    pub seed: u64,
}

pub fn simulate(task: &Task, folder: &Path, bench: &mut Bench, step: &mut dyn FnMut(usize, usize)) -> Result<()> {
    let (simulator, config) = open(task.checkpoint, task.graph_at_inference, bench.device())?;
    let loaded = bench.simulated(task.recording, &config)?;
    let simulation = Simulation::new(&simulator, &loaded.scene, seed_of(task.seed, task.name), true);
    // Where everything is and who is seen; kept for the next method.
    let look = |frame| loaded.scene.view(frame).map(drop);
    let speed = write_frames(folder, &loaded.recording, &look, &mut |frame| simulation.frame(frame), step)?;
    // Whoever comes first works it out; the others are charged as much.
    let speed = Speed { geometry_s: bench.charged_geometry_s(&config, speed.geometry_s), ..speed };
    write_json(&folder.join("speed.json"), &speed)
}

/// A trained simulator, with the graph convolution kept on at inference or not.
fn open(checkpoint: &Path, graph_at_inference: bool, device: &Device) -> Result<(Simulator, SimulatorConfig)> {
    let state = read_state(checkpoint)?;
    let mut config = state.simulator;
    config.graph.at_inference = graph_at_inference;
    let simulator = config.init(state.site.body_extent, state.seed, device);
    Ok((load_weights(checkpoint, with_stable_ids(simulator))?, config))
}

/// Writes `recording/`, the same scene as the measured one with simulated samples; the time of `look` counts as that of the
/// geometry.
pub fn write_frames(
    folder: &Path,
    recording: &Recording,
    look: &dyn Fn(usize) -> Result<()>,
    simulated: &mut dyn FnMut(usize) -> Result<Vec<Complex32>>,
    step: &mut dyn FnMut(usize, usize),
) -> Result<Speed> {
    let radar = &recording.radar;
    let complex = radar.sampling == Sampling::Complex;
    let contents = RecordingContents {
        radar,
        room: recording.room.as_ref(),
        person: recording.person(),
        body_file: None,
        labels: recording.labels.clone(),
        layout: if complex { IfLayout::Complex } else { IfLayout::Real },
        truth: None,
    };
    let [_, tx, rx, loops, samples] = radar.dims();
    let mut speed = Speed { frames: radar.frames, ..Default::default() };
    // An earlier attempt may have come as far as this.
    let _ = std::fs::remove_dir_all(folder.join("recording"));
    write_recording(folder.join("recording"), &contents, &mut |frame| {
        let started = Instant::now();
        look(frame)?;
        let seen = Instant::now();
        let signal = simulated(frame)?;
        speed.geometry_s += (seen - started).as_secs_f64();
        speed.signal_s += seen.elapsed().as_secs_f64();
        step(frame + 1, radar.frames);
        let im = complex.then(|| signal.iter().map(|value| value.im).collect());
        Ok(IfFrame::new([tx, rx, loops, samples], signal.iter().map(|value| value.re).collect(), im))
    })?;
    Ok(speed)
}
