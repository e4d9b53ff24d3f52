//! What a reproduction leaves at its top: `results.md`, `results.json`, and the pictures that it names.

use std::fmt::Write;
use std::io::Write as _;
use std::path::Path;

use super::config::ReproduceConfig;
use super::few::Material;
use super::plan::Method;
use super::results::{MethodResults, Results};
use super::tables::tables;
use super::variants::Variant;
use crate::data::{atomic, files};
use crate::error::Result;
use crate::pictures::{Chart, Scale, Series};
use crate::text::shown;
use crate::training::EpochMetrics;

/// Writes all of it. `command`: what was typed.
pub fn write(folder: &Path, config: &ReproduceConfig, results: &Results, command: &str) -> Result<()> {
    let mut text = String::from("## Reproduction\n\n");
    let seconds: f64 = results.seconds.values().sum();
    writeln!(
        text,
        "`{command}`, seed {}, version {}, device {}, {:.0} minutes of stages. Trained on {}, unseen is {}.\n",
        config.seed,
        env!("CARGO_PKG_VERSION"),
        results.device,
        seconds / 60.0,
        config.split.training,
        config.split.unseen,
    )
    .expect("text grows");
    if config.seeds > 1 {
        let said = "What learns was drawn (trained, scored, recognised) several times; intervals are over recordings and draws.";
        writeln!(text, "{said} Draws: {}.\n", config.seeds).expect("text grows");
    }
    if results.programs.len() > 1 {
        let builds: Vec<String> = results.programs.iter().map(|(build, stages)| format!("{build} ({stages})")).collect();
        writeln!(text, "The stages were done by several builds of the program: {}.\n", builds.join(", ")).expect("text grows");
    }
    text += &tables(results);
    atomic::write_text(folder.join("results.md"), &shown(&text))?;
    let json = serde_json::to_string_pretty(results).expect("plain data");
    atomic::write_text(folder.join("results.json"), &json)?;
    for figure in &results.figures {
        let target = folder.join(format!("{}.png", figure.name));
        let picture = files::read(&figure.picture)?;
        atomic::write_file(&target, |file| file.write_all(&picture))?;
    }
    if !results.stability.is_empty() {
        atomic::write_text(folder.join("stability.csv"), &stability_csv(results))?;
        let [loss, gradient] = stability(results);
        loss.save(&folder.join("stability_loss.png"))?;
        gradient.save(&folder.join("stability_gradient.png"))?;
    }
    if !results.few.is_empty() {
        few(results).save(&folder.join("few_measured.png"))?;
    }
    if let Some(chart) = adaptation(results) {
        chart.save(&folder.join("adaptation.png"))?;
    }
    Ok(())
}

/// One line for each epoch of each long training.
fn stability_csv(results: &Results) -> String {
    let mut text = String::from("run,epoch,mean_loss_db2,largest_loss_db2,largest_gradient\n");
    for found in &results.stability {
        for epoch in &found.run.history {
            let number = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
            let (loss, gradient) = (number(epoch.largest_loss), number(epoch.largest_gradient));
            let line = format!("{},{},{},{loss},{gradient}", found.variant.id(), epoch.epoch + 1, epoch.training_loss);
            writeln!(text, "{line}").expect("text grows");
        }
    }
    text
}

/// Largest loss and largest gradient of a step in every epoch, on a logarithmic scale.
fn stability(results: &Results) -> [Chart; 2] {
    let chart = |what: &str, unit: &str, value: fn(&EpochMetrics) -> Option<f64>| Chart {
        title: format!("Largest {what} of a step"),
        x_label: "epoch".into(),
        y_label: format!("largest {what}{unit}"),
        y_scale: Scale::Log,
        series: results
            .stability
            .iter()
            .map(|found| Series {
                name: if found.variant == Variant::WithoutGcn { "without GCN" } else { "with GCN" }.into(),
                points: found.run.history.iter().filter_map(|epoch| Some([(epoch.epoch + 1) as f64, value(epoch)?])).collect(),
            })
            .collect(),
        ..Chart::default()
    };
    [chart("loss", " (dB²)", |epoch| epoch.largest_loss), chart("gradient", "", |epoch| epoch.largest_gradient)]
}

/// Accuracy against the number of recordings of each action.
fn few(results: &Results) -> Chart {
    let curve = |material: Material| Series {
        name: material.title().into(),
        points: results
            .few
            .iter()
            .filter(|found| found.material == material)
            .map(|found| [found.recordings as f64, 100.0 * found.recognised.accuracy.value])
            .collect(),
    };
    Chart {
        title: "Recognition from few recordings".into(),
        x_label: "recordings of each action".into(),
        y_label: "accuracy (%)".into(),
        x_scale: Scale::Log,
        series: Material::ALL.map(curve).to_vec(),
        ..Chart::default()
    }
}

/// Quality in the second room against the number of its frames.
fn adaptation(results: &Results) -> Option<Chart> {
    let psnr = |found: &MethodResults| Some(found.intra.as_ref()?.moving.as_ref()?.psnr_db.mean);
    let curve = |name: &str, frames: fn(Method) -> Option<usize>| Series {
        name: name.into(),
        points: results.methods.iter().filter_map(|found| Some([frames(found.method)? as f64, psnr(found)?])).collect(),
    };
    let series = vec![
        curve("adapted from the first room", |method| match method {
            Method::Adapted(frames) => Some(frames),
            _ => None,
        }),
        curve("from the beginning", |method| match method {
            Method::FromScratch(frames) => Some(frames),
            _ => None,
        }),
    ];
    series.iter().any(|series| series.points.len() > 1).then(|| Chart {
        title: "Second room, held-out frames, static removed".into(),
        x_label: "frames learned from".into(),
        y_label: "PSNR (dB)".into(),
        x_scale: Scale::LogOfCounts,
        series,
        ..Chart::default()
    })
}
