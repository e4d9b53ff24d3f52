//! What a run leaves behind: pictures, numbers and a short report, all from the same evaluation.

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
};

use burn::tensor::Device;
use serde_json::json;

use super::{heatmaps::Pictures, scores};
use crate::{
    config::Config,
    data::atomic,
    error::Result,
    evaluation::{self, Evaluation, FrameMaps, Simulation, measured_frame},
    metrics::MetricsConfig,
    pictures::{
        self, Chart, Series,
        page::{self, html, picture},
    },
    text::shown,
    training::{FrameSplit, LoadedRecording, RefinedPose, checkpoint, checkpoint::Progress},
};

/// Everything the report of a training run is made of.
pub struct RunReport<'a> {
    /// What was refined of the recordings' motions.
    pub refined: &'a [RefinedPose],
    /// What the run's own diagnosis found; none without one.
    pub found: Option<&'a str>,
    pub folder: &'a Path,
    pub config: &'a Config,
    pub recordings: &'a [LoadedRecording],
    pub progress: &'a Progress,
    pub device: &'a Device,
    pub seconds: f64,
}

impl RunReport<'_> {
    /// Evaluates the best checkpoint on held-out frames and writes everything into the run folder; the scores by recording.
    pub fn write(&self) -> Result<Vec<(PathBuf, Evaluation)>> {
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
                        drawn = draw_frame(self.folder, &format!("held-out frame {frame}"), &all, &moving).map(drop);
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
        Ok(evaluations)
    }

    /// Time-Doppler needs all frames at once; a long recording shows its first minute or so.
    fn draw_over_time(&self, recording: &LoadedRecording, simulation: &Simulation<'_>) -> Result<()> {
        let stretch = recording.recording.whole_stretch()?;
        let frames = stretch.len().min(600);
        if frames < 2 {
            return Ok(());
        }
        let shown = || stretch.clone().take(frames);
        let measured = shown().map(|frame| measured_frame(&recording.recording, frame)).collect::<Result<Vec<_>>>()?.concat();
        let simulated = shown().map(|frame| simulation.frame(frame)).collect::<Result<Vec<_>>>()?.concat();
        let pictures = Pictures::new(&recording.scene.radar, &self.config.training.heatmap);
        pictures.compare_time_doppler(self.folder, &measured, &simulated).map(drop)
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
            y_label: format!("loss ({})", self.config.training.loss.scale.unit()),
            series: vec![
                series("training", &|metrics| Some(metrics.training_loss)),
                series("held out", &|metrics| metrics.validation_loss),
            ],
            ..Chart::default()
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

    /// The same twice: for a terminal, and for a browser.
    fn write_report(&self, evaluations: &[(PathBuf, Evaluation)], held_out: bool) -> Result<()> {
        let history = &self.progress.history;
        let (first, best) = (&history[0], &history[self.progress.best_epoch]);
        let scale = self.config.training.loss.scale;
        let lead = format!(
            "{} epochs; the best was epoch {}: loss {} after {} in the first{}.",
            self.progress.epochs_done,
            best.epoch + 1,
            scale.with_unit(best.score()),
            scale.with_unit(first.score()),
            if held_out { ", on held-out frames" } else { " (no frames were held out)" }
        );
        let which = if held_out { "held-out" } else { "training" };
        let mut text = format!("# Training run\n\n{lead}\n\n");
        if let Some(found) = self.found {
            writeln!(text, "{found} (`diagnosis/report.html`).\n").expect("text grows");
        }
        for pose in self.refined {
            writeln!(text, "{} (`pose.toml`).\n", pose.line()).expect("text grows");
        }
        for (folder, evaluation) in evaluations {
            writeln!(text, "`{}`, {which} frames:\n\n```\n{}```\n", folder.display(), scores::of_frames(evaluation))
                .expect("text grows");
        }
        let pictures = PICTURES.map(|(name, says)| (self.folder.join(name), name, says));
        let pictures: Vec<_> = pictures.iter().filter(|(file, ..)| file.is_file()).collect();
        for (_, name, says) in &pictures {
            writeln!(text, "![{says}]({name})").expect("text grows");
        }
        text.push_str(
            "\nSettings: `config.toml`. Numbers: `metrics.json`. Time and command: `run.json`. Weights: `best/`, `last/`.\n",
        );
        atomic::write_text(self.folder.join("report.md"), &shown(&text))?;

        let drawn = pictures.iter().map(|(file, _, says)| picture(file, says)).collect::<Result<Vec<_>>>()?;
        let content = html! {
            h1 { "Training run" }
            p.lead { (lead) }
            @if let Some(found) = self.found { p { (page::shown(found)) " (" a href="diagnosis/report.html" { "why" } ")." } }
            @for pose in self.refined { p { (page::shown(&pose.line())) " (" code { "pose.toml" } ")." } }
            @for (folder, evaluation) in evaluations {
                h2 { (page::shown(&folder.display().to_string())) ", " (which) " frames" }
                (scores::page_of_frames(evaluation))
            }
            @for picture in &drawn { p { (picture) } }
            p.small {
                "Settings: " code { "config.toml" } ". Numbers: " code { "metrics.json" } ". Time and command: " code { "run.json" }
                ". Weights: " code { "best/" } ", " code { "last/" } "."
            }
        };
        atomic::write_text(self.folder.join("report.html"), &page::page("Training run", &content))
    }
}

/// The pictures of a run, those that are there, and what they show.
const PICTURES: [(&str, &str); 4] = [
    ("loss.png", "loss"),
    ("range_doppler.png", "range-Doppler"),
    ("range_doppler_moving.png", "range-Doppler, static removed"),
    ("time_doppler.png", "time-Doppler"),
];

/// `range_doppler.png` and `range_doppler_moving.png` of one frame: measured, simulated, and their difference.
pub(crate) fn draw_frame(folder: &Path, which: &str, all: &FrameMaps, moving: &FrameMaps) -> Result<[PathBuf; 2]> {
    let draw = |name: &str, what: &str, maps: &FrameMaps| {
        let (file, title) = (folder.join(name), format!("Range-Doppler, {which}{what}"));
        pictures::comparison(
            &file,
            pictures::Captions::simulated(&title),
            &maps.measured,
            &maps.simulated,
            pictures::window(&maps.measured),
        )?;
        Ok(file)
    };
    Ok([draw("range_doppler.png", "", all)?, draw("range_doppler_moving.png", ", static removed", moving)?])
}
