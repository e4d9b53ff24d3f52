//! What a run leaves behind: pictures, numbers and a short report, all from the same evaluation.

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
};

use burn::tensor::Device;
use num_complex::Complex32;
use serde_json::json;

use super::scores;
use crate::{
    config::Config,
    data::atomic,
    error::{Error, Result},
    evaluation::{self, Evaluation, FrameMaps, Simulation, measured_frame},
    heatmap::{Analysis, Gate, HeatmapConfig, Map, Samples, Scan, StaticRemoval, remove_static},
    metrics::{DbWindow, MetricsConfig},
    pictures::{self, Chart, Series},
    radar::Radar,
    text::shown,
    training::{FrameSplit, LoadedRecording, RefinedPose, checkpoint, checkpoint::Progress},
};

/// Decibels that a picture shows below its strongest cell.
const SHOWN_DB: f64 = 60.0;

/// `runs/<config>`, or the next `runs/<config>-N` that is free.
pub(super) fn fresh_run_folder(config: &Path) -> PathBuf {
    let stem = config.file_stem().map_or("run".into(), |stem| stem.to_string_lossy().into_owned());
    std::iter::once(stem.clone())
        .chain((2..).map(|count| format!("{stem}-{count}")))
        .map(|name| Path::new("runs").join(name))
        .find(|folder| !folder.exists())
        .expect("one of endlessly many names is free")
}

/// What had to be fitted when a recording was read, on standard error.
pub(super) fn tell_notes(loaded: &LoadedRecording) {
    for note in &loaded.recording.notes {
        remark!("note: {}: {note}", loaded.folder.display());
    }
    if loaded.recording.person().is_none() {
        remark!("note: {}: no person: only the room is simulated", loaded.folder.display());
    }
    if loaded.recording.room.is_none() {
        remark!("note: {}: no room: only the person is simulated, without indirect path", loaded.folder.display());
    }
}

/// A trained simulator speaks for one radar; the number of frames is free.
pub(super) fn same_radar(folder: &Path, found: &Radar, trained: &Radar) -> Result<()> {
    if found.is_same_board(trained) {
        return Ok(());
    }
    Err(Error::field(folder.join("recording.toml"), "radar", "another radar", "that of the checkpoint")
        .with_hint("train on a recording of this radar first; `hybridsim check` shows both"))
}

/// Draws heatmaps of recordings of one radar.
pub(super) struct Pictures {
    radar: Radar,
    analysis: Analysis,
    heatmap: HeatmapConfig,
}

impl Pictures {
    pub fn new(radar: &Radar, heatmap: &HeatmapConfig) -> Self {
        Self { radar: radar.clone(), analysis: Analysis::new(radar, heatmap), heatmap: heatmap.clone() }
    }

    /// Pictures of one recording, `[frame, tx, rx, loop, sample]`.
    pub fn show(&mut self, folder: &Path, samples: &[Complex32]) -> Result<()> {
        for (name, title, map) in self.maps(samples) {
            let map = self.db(&map, &map);
            pictures::heatmap(&folder.join(name), title, &map, window(&map))?;
        }
        Ok(())
    }

    /// Pictures of a measured recording, its simulation and their difference.
    pub fn compare(&mut self, folder: &Path, measured: &[Complex32], simulated: &[Complex32]) -> Result<()> {
        for ((name, title, measured), (_, _, simulated)) in self.maps(measured).into_iter().zip(self.maps(simulated)) {
            let (measured, simulated) = (self.db(&measured, &measured), self.db(&simulated, &measured));
            pictures::comparison(&folder.join(name), title, &measured, &simulated, window(&measured))?;
        }
        Ok(())
    }

    fn db(&self, map: &Map, reference: &Map) -> Map {
        map.db(self.heatmap.floor_amplitude(reference.max().sqrt()))
    }

    /// (file, title, power) of every picture.
    fn maps(&self, samples: &[Complex32]) -> Vec<(&'static str, &'static str, Map)> {
        let [_, tx, rx, loops, length] = self.radar.dims();
        let frames = samples.len() / (tx * rx * loops * length);
        let dims = [frames, tx, rx, loops, length];
        let still = Samples::new(samples, dims);
        let moving = remove_static(still, StaticRemoval::Loops);
        let moving = Samples::new(&moving, dims);
        let middle = frames / 2;
        let everywhere = Gate::default();
        let scan = Scan::azimuth(60.0, 2.0);
        let mut maps = vec![
            ("range_doppler.png", "Range-Doppler, middle frame", self.analysis.range_doppler(still.frame(middle))),
            (
                "range_doppler_moving.png",
                "Range-Doppler, middle frame, static removed",
                self.analysis.range_doppler(moving.frame(middle)),
            ),
        ];
        if tx * rx > 1 {
            maps.push((
                "range_azimuth.png",
                "Range-azimuth, middle frame, static removed",
                self.analysis.range_angle(moving.frame(middle), &scan, &everywhere),
            ));
        }
        if frames > 1 {
            maps.push(("time_doppler.png", "Time-Doppler, static removed", self.analysis.time_doppler(moving, &everywhere)));
            maps.push(("time_range.png", "Time-range, static removed", self.analysis.time_range(moving, &everywhere)));
            if tx * rx > 1 {
                let map = self.analysis.time_angle(moving, &scan, &everywhere);
                maps.push(("time_azimuth.png", "Time-azimuth, static removed", map));
            }
        }
        maps
    }
}

fn window(map_db: &Map) -> DbWindow {
    DbWindow::below(map_db.max(), SHOWN_DB)
}

/// Everything the report of a training run is made of.
pub(super) struct RunReport<'a> {
    /// What was refined of the recordings' motions.
    pub refined: &'a [RefinedPose],
    pub folder: &'a Path,
    pub config: &'a Config,
    pub recordings: &'a [LoadedRecording],
    pub progress: &'a Progress,
    pub device: &'a Device,
    pub seconds: f64,
}

impl RunReport<'_> {
    /// Evaluates the best checkpoint on held-out frames and writes everything into the run folder.
    pub fn write(&self) -> Result<()> {
        let best = self.folder.join("best");
        let (simulator, _) = checkpoint::open(&best, self.device)?;
        let training = &self.config.training;
        let split = FrameSplit::of(self.recordings, training, self.config.seed);
        let held_out = if split.validation.is_empty() { &split.training } else { &split.validation };

        let mut evaluations = Vec::new();
        for (index, recording) in self.recordings.iter().enumerate() {
            let frames: Vec<usize> = held_out.iter().filter(|id| id.recording == index).map(|id| id.frame).collect();
            if frames.is_empty() {
                continue;
            }
            let simulation = Simulation::new(&simulator, &recording.scene, self.config.seed, true);
            let metrics = MetricsConfig::default();
            let middle = frames[frames.len() / 2];
            let mut drawn = Ok(());
            let evaluation = evaluation::evaluate(
                recording,
                &simulation,
                &frames,
                &training.heatmap,
                &metrics,
                None,
                &mut |frame, all, moving| {
                    if index == 0 && frame == middle {
                        drawn = self.draw_held_out(frame, &all, &moving);
                    }
                },
            )?;
            drawn?;
            if index == 0 {
                self.draw_over_time(recording, &simulation)?;
            }
            evaluations.push((recording.folder.clone(), evaluation));
        }
        self.draw_loss()?;
        self.write_numbers(&evaluations)?;
        self.write_report(&evaluations, !split.validation.is_empty())?;
        for (folder, evaluation) in &evaluations {
            say!("{}", folder.display());
            super::tell(&scores::of_frames(evaluation));
        }
        say!("report: {}", self.folder.join("report.md").display());
        Ok(())
    }

    fn draw_held_out(&self, frame: usize, all: &FrameMaps, moving: &FrameMaps) -> Result<()> {
        for (name, what, maps) in [("range_doppler.png", "", all), ("range_doppler_moving.png", ", static removed", moving)] {
            let title = format!("Range-Doppler, held-out frame {frame}{what}");
            pictures::comparison(&self.folder.join(name), &title, &maps.measured, &maps.simulated, window(&maps.measured))?;
        }
        Ok(())
    }

    /// Time-Doppler needs all frames at once; a long recording shows its first minute or so.
    fn draw_over_time(&self, recording: &LoadedRecording, simulation: &Simulation<'_>) -> Result<()> {
        let radar = &recording.scene.radar;
        let stretch = recording.recording.whole_stretch()?;
        let frames = stretch.len().min(600);
        if frames < 2 {
            return Ok(());
        }
        let shown = || stretch.clone().take(frames);
        let analysis = Analysis::new(radar, &self.config.training.heatmap);
        let [_, tx, rx, loops, samples] = radar.dims();
        let map = |signal: Vec<Complex32>| {
            let dims = [frames, tx, rx, loops, samples];
            let moving = remove_static(Samples::new(&signal, dims), StaticRemoval::Loops);
            analysis.time_doppler(Samples::new(&moving, dims), &Gate::default())
        };
        let measured =
            map(shown().map(|frame| measured_frame(&recording.recording, frame)).collect::<Result<Vec<_>>>()?.concat());
        let simulated = map(shown().map(|frame| simulation.frame(frame)).collect::<Result<Vec<_>>>()?.concat());
        let floor = self.config.training.heatmap.floor_amplitude(measured.max().sqrt());
        let (measured, simulated) = (measured.db(floor), simulated.db(floor));
        pictures::comparison(
            &self.folder.join("time_doppler.png"),
            "Time-Doppler, static removed",
            &measured,
            &simulated,
            window(&measured),
        )
    }

    fn draw_loss(&self) -> Result<()> {
        let series = |name: &str, value: &dyn Fn(&crate::training::EpochMetrics) -> Option<f64>| Series {
            name: name.into(),
            points: self
                .progress
                .history
                .iter()
                .filter_map(|metrics| Some([(metrics.epoch + 1) as f64, value(metrics)?]))
                .collect(),
        };
        let chart = Chart {
            title: "Loss".into(),
            x_label: "epoch".into(),
            y_label: "mean squared difference (dB²)".into(),
            series: vec![
                series("training", &|metrics| Some(metrics.training_loss)),
                series("held out", &|metrics| metrics.validation_loss),
            ],
        };
        chart.save(&self.folder.join("loss.png"))
    }

    fn write_numbers(&self, evaluations: &[(PathBuf, Evaluation)]) -> Result<()> {
        let scores: serde_json::Map<String, serde_json::Value> = evaluations
            .iter()
            .map(|(folder, evaluation)| (folder.display().to_string(), serde_json::to_value(evaluation).expect("plain data")))
            .collect();
        let metrics = json!({ "held_out": scores, "history": self.progress.history });
        let run = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "seed": self.config.seed,
            "device": format!("{:?}", self.device),
            "seconds": self.seconds,
            "epochs": self.progress.epochs_done,
            "best_epoch": self.progress.best_epoch + 1,
            "command": std::env::args().collect::<Vec<_>>(),
        });
        for (name, value) in [("metrics.json", metrics), ("run.json", run)] {
            let text = serde_json::to_string_pretty(&value).expect("plain data");
            atomic::write_text(self.folder.join(name), &text)?;
        }
        Ok(())
    }

    fn write_report(&self, evaluations: &[(PathBuf, Evaluation)], held_out: bool) -> Result<()> {
        let history = &self.progress.history;
        let (first, best) = (&history[0], &history[self.progress.best_epoch]);
        let mut text = format!(
            "# Training run\n\n{} epochs; the best was epoch {}: loss {:.2} dB² after {:.2} dB² in the first{}.\n\n",
            self.progress.epochs_done,
            best.epoch + 1,
            best.score(),
            first.score(),
            if held_out { ", on held-out frames" } else { " (no frames were held out)" }
        );
        for pose in self.refined {
            writeln!(text, "{} (`pose.toml`).\n", pose.line()).expect("text grows");
        }
        for (folder, evaluation) in evaluations {
            let which = if held_out { "held-out" } else { "training" };
            writeln!(text, "`{}`, {which} frames:\n\n```\n{}```\n", folder.display(), scores::of_frames(evaluation))
                .expect("text grows");
        }
        text.push_str("![loss](loss.png)\n![range-Doppler](range_doppler.png)\n");
        text.push_str("![range-Doppler, static removed](range_doppler_moving.png)\n![time-Doppler](time_doppler.png)\n\n");
        text.push_str(
            "Settings: `config.toml`. Numbers: `metrics.json`. Time and command: `run.json`. Weights: `best/`, `last/`.\n",
        );
        atomic::write_text(self.folder.join("report.md"), &shown(&text))
    }
}
