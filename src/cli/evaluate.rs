//! `hybridsim evaluate`.

use std::path::PathBuf;

use clap::Args;

use super::{
    Common, Out, device,
    effects::WithoutEffects,
    plausible,
    progress::Progress,
    scores::{self, LpipsArguments},
};
use crate::{
    data::atomic,
    error::{Error, Result},
    evaluation::{self, Simulation},
    lpips::Lpips,
    metrics::MetricsConfig,
    training::{LoadedRecording, checkpoint, refine},
    verbs::{heatmaps::same_radar, notes},
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
    lpips: LpipsArguments,
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
    let _claim = arguments.out.out.as_ref().map(|out| super::claimed(out)).transpose()?;
    let device = device(&common.device)?;
    let (mut simulator, state) = checkpoint::open(&arguments.checkpoint, &device)?;
    arguments.without.switch_off(&mut simulator)?;
    let lpips = arguments.lpips.config().map(|config| Lpips::open(&config, &device)).transpose()?;
    let metrics = MetricsConfig::default();
    // Beside `best` and `last`, in the run folder.
    let run_folder = arguments.checkpoint.join("..");
    let poses = refine::read(&run_folder)?;
    let mut evaluations = Vec::new();
    for folder in &arguments.recordings {
        plausible::folder(folder, common)?;
        let recording = LoadedRecording::open(folder, &state.simulator, false)?;
        let (recording, moved) = refine::refined(recording, &poses)?;
        if moved {
            remark!("note: {}: its motion as the training run refined it ({})", folder.display(), refine::FILE);
        }
        same_radar(folder, &recording.scene.radar, &state.site.radar)?;
        notes::of(&recording).iter().for_each(|note| remark!("note: {note}"));
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
        let mut observe = |_, _, _| {
            done += 1;
            progress.set(done);
        };
        let evaluation =
            evaluation::evaluate(&recording, &simulation, &frames, &state.heatmap, &metrics, lpips.as_ref(), &mut observe)?;
        progress.finish();
        say!("{}", folder.display());
        super::tell(&scores::of_frames(&evaluation));
        evaluations.push((folder.display().to_string(), evaluation));
    }
    if let (true, Some(summary)) = (evaluations.len() > 1, scores::summary(&evaluations)) {
        say!("together");
        super::tell(&scores::of_sequences(&summary));
    }
    if let Some(out) = &arguments.out.out {
        atomic::write_text(out.join("metrics.json"), &scores::json(&evaluations))?;
    }
    Ok(())
}
