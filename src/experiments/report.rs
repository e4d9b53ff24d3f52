//! What a reproduction leaves at its top: `results.md`, `results.json` and `adaptation.png`.

use std::fmt::Write;
use std::path::Path;

use super::config::ReproduceConfig;
use super::plan::Method;
use super::results::{MethodResults, Results};
use super::tables::tables;
use crate::data::atomic;
use crate::error::Result;
use crate::pictures::{Chart, Series};
use crate::text::shown;

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
    if results.programs.len() > 1 {
        let builds: Vec<String> = results.programs.iter().map(|(build, stages)| format!("{build} ({stages})")).collect();
        writeln!(text, "The stages were done by several builds of the program: {}.\n", builds.join(", ")).expect("text grows");
    }
    text += &tables(results);
    atomic::write_text(folder.join("results.md"), &shown(&text))?;
    let json = serde_json::to_string_pretty(results).expect("plain data");
    atomic::write_text(folder.join("results.json"), &json)?;
    if let Some(chart) = adaptation(results) {
        chart.save(&folder.join("adaptation.png"))?;
    }
    Ok(())
}

/// Quality in the second room against the number of its frames.
fn adaptation(results: &Results) -> Option<Chart> {
    let psnr = |found: &MethodResults| Some(found.intra.as_ref()?.moving.as_ref()?.psnr_db.mean);
    let curve = |name: &str, frames: fn(Method) -> Option<usize>| Series {
        name: name.into(),
        points: results
            .methods
            .iter()
            .filter_map(|found| Some([(frames(found.method)? as f64 + 1.0).log2(), psnr(found)?]))
            .collect(),
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
        x_label: "log2(1 + frames learned from)".into(),
        y_label: "PSNR (dB)".into(),
        series,
    })
}
