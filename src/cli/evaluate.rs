//! `hybridsim evaluate`.

use std::path::PathBuf;

use clap::Args;

use super::{Common, Out, device, effects::WithoutEffects, progress::Progress, report};
use crate::{
    data::atomic,
    error::{Error, Result},
    evaluation::{self, Simulation},
    metrics::MetricsConfig,
    training::{LoadedRecording, checkpoint},
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Recording folders to compare with
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// A checkpoint folder, such as runs/x/best
    #[arg(long, value_name = "DIR")]
    checkpoint: PathBuf,
    /// Compare these frames only: FIRST..END, the end not included
    #[arg(long, value_name = "RANGE", value_parser = parse_range)]
    frames: Option<(usize, usize)>,
    #[command(flatten)]
    without: WithoutEffects,
    #[command(flatten)]
    out: Out,
}

fn parse_range(text: &str) -> std::result::Result<(usize, usize), String> {
    let parsed = text.split_once("..").and_then(|(first, end)| Some((first.parse().ok()?, end.parse().ok()?)));
    match parsed {
        Some((first, end)) if first < end => Ok((first, end)),
        _ => Err("expected FIRST..END with FIRST below END, such as 20..24".into()),
    }
}

pub(crate) fn run(arguments: &Arguments, common: &Common) -> Result<()> {
    let device = device(&common.device)?;
    let (mut simulator, state) = checkpoint::open(&arguments.checkpoint, &device)?;
    arguments.without.switch_off(&mut simulator)?;
    let mut results = serde_json::Map::new();
    for folder in &arguments.recordings {
        let recording = LoadedRecording::open(folder, &state.simulator, false)?;
        report::same_radar(folder, &recording.scene.radar, &state.site.radar)?;
        report::tell_notes(&recording);
        let available = recording.scene.radar.frames;
        let (first, end) = arguments.frames.unwrap_or((0, available));
        if end > available {
            return Err(Error::Usage {
                message: format!("--frames {first}..{end}: {} has {available} frames", folder.display()),
                hint: None,
            });
        }
        let frames: Vec<usize> = (first..end).collect();
        let simulation = Simulation::new(&simulator, &recording.scene, state.seed, true);
        let progress = Progress::new("evaluating", frames.len(), common.quiet);
        let mut done = 0;
        let evaluation =
            evaluation::evaluate(&recording, &simulation, &frames, &state.heatmap, &MetricsConfig::default(), &mut |_, _, _| {
                done += 1;
                progress.set(done);
            })?;
        progress.finish();
        println!("{}", folder.display());
        print!("{}", report::table(&evaluation));
        results.insert(folder.display().to_string(), serde_json::to_value(&evaluation).expect("plain data"));
    }
    if let Some(out) = &arguments.out.out {
        std::fs::create_dir_all(out).map_err(|error| Error::write(out, error))?;
        let text = serde_json::to_string_pretty(&results).expect("plain data");
        atomic::write_text(out.join("metrics.json"), &text)?;
    }
    Ok(())
}
