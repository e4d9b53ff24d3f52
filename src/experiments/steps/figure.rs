//! Draws one of the paper's figures.

use std::path::Path;

use num_complex::Complex32;

use super::bench::{Bench, seed_of};
use super::measure::write_json;
use crate::data::Recording;
use crate::error::Result;
use crate::evaluation::{Simulation, measured_frame};
use crate::experiments::figures::{FigureTask, Levels, Panel};
use crate::heatmap::{Analysis, HeatmapConfig, Map, Samples, StaticRemoval, remove_static};
use crate::pictures::Grid;
use crate::radar::Radar;
use crate::training::checkpoint;

/// Decibels that are shown below the strongest cell of the measured map.
const SHOWN_DB: f64 = 60.0;

/// The middle frame of every row's recording, in every column's way.
pub fn figure(task: &FigureTask, folder: &Path, bench: &mut Bench, step: &mut dyn FnMut(usize, usize)) -> Result<()> {
    let titles: Vec<String> = task.columns.iter().map(|column| column.title.clone()).collect();
    let mut levels = Levels { columns: titles.clone(), rows: task.actions.clone(), all_db: vec![], moving_db: vec![] };
    let mut maps = vec![];
    for (row, path) in task.measured.iter().enumerate() {
        let recording = Recording::open(path)?;
        let frame = recording.frames() / 2;
        let frames: Vec<Vec<Complex32>> = task
            .columns
            .iter()
            .map(|column| match &column.panel {
                Panel::Measured | Panel::MeasuredLinear => measured_frame(&recording, frame),
                Panel::Simulated(folders) => measured_frame(&Recording::open(&folders[row])?, frame),
                Panel::Part(_) | Panel::Whole => simulated(task, row, &column.panel, frame, bench),
            })
            .collect::<Result<_>>()?;
        let radar = &recording.radar;
        let measured = measured_frame(&recording, frame)?;
        let still = |signal: &[Complex32]| signal.to_vec();
        let moving = |signal: &[Complex32]| remove_static(frame_of(radar, signal), StaticRemoval::Loops);
        let level = |of: &dyn Fn(&[Complex32]) -> Vec<Complex32>| -> Vec<Option<f64>> {
            frames.iter().map(|signal| relative_db(&of(signal), &of(&measured))).collect()
        };
        levels.all_db.push(level(&still));
        levels.moving_db.push(level(&moving));
        let shown: Vec<Vec<Complex32>> =
            frames.iter().map(|signal| if task.static_removed { moving(signal) } else { still(signal) }).collect();
        let reference = if task.static_removed { moving(&measured) } else { measured };
        maps.push(row_of_maps(task, radar, &shown, &reference));
        step(row + 1, task.measured.len());
    }
    let linear = task.columns.iter().any(|column| column.panel == Panel::MeasuredLinear);
    let grid = Grid {
        title: &task.title,
        columns: &titles,
        rows: &task.actions,
        low: -SHOWN_DB,
        high: 0.0,
        unit: (!linear).then_some("dB of the strongest measured cell"),
    };
    grid.save(&folder.join(format!("{}.png", task.figure)), &maps)?;
    write_json(&folder.join("figure.json"), &levels)
}

fn frame_of<'a>(radar: &Radar, signal: &'a [Complex32]) -> Samples<'a> {
    let [_, tx, rx, loops, samples] = radar.dims();
    Samples::new(signal, [1, tx, rx, loops, samples])
}

/// Samples of a frame, with the noise that the simulated recording of that name has.
fn simulated(task: &FigureTask, row: usize, panel: &Panel, frame: usize, bench: &mut Bench) -> Result<Vec<Complex32>> {
    let (simulator, state) = checkpoint::open(&task.checkpoint, bench.device())?;
    let loaded = bench.simulated(&task.measured[row], &state.simulator)?;
    let simulation = Simulation::new(&simulator, &loaded.scene, seed_of(task.seed, &task.names[row]), true);
    match panel {
        Panel::Part(part) => simulation.only(*part).frame(frame),
        _ => simulation.frame(frame),
    }
}

/// Maps from −[`SHOWN_DB`] to 0, whatever a column's scale.
fn row_of_maps(task: &FigureTask, radar: &Radar, shown: &[Vec<Complex32>], reference: &[Complex32]) -> Vec<Map> {
    let analysis = Analysis::new(radar, &HeatmapConfig::default());
    let peak = analysis.range_doppler(reference).max();
    let map = |(signal, panel): (&Vec<Complex32>, &Panel)| {
        let power = analysis.range_doppler(signal);
        let value = |power: f64| match panel {
            Panel::MeasuredLinear => SHOWN_DB * ((power / peak).sqrt() - 1.0),
            _ => 10.0 * (power / peak).max(1e-30).log10(),
        };
        power.with_values(power.values.iter().map(|&power| value(power)).collect())
    };
    shown.iter().zip(task.columns.iter().map(|column| &column.panel)).map(map).collect()
}

fn relative_db(signal: &[Complex32], reference: &[Complex32]) -> Option<f64> {
    let power = |signal: &[Complex32]| signal.iter().map(|value| f64::from(value.norm_sqr())).sum::<f64>();
    let ratio = power(signal) / power(reference);
    (ratio.is_finite() && ratio > 0.0).then(|| 10.0 * ratio.log10())
}
