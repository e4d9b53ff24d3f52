//! `hybridsim evaluate`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{
    Common, Out, device,
    effects::WithoutEffects,
    plausible,
    progress::Progress,
    scores::{self, LpipsArguments},
};
use crate::{
    data::{Scratch, atomic},
    error::{Error, Result},
    evaluation::{self, Evaluation, FrameMaps, Simulation},
    lpips::Lpips,
    metrics::MetricsConfig,
    pictures::page::{self, Markup, html, picture},
    training::{LoadedRecording, checkpoint, refine},
    verbs::{claimed_for, heatmaps::same_radar, notes, report::draw_frame, scores::page_of_frames},
};

#[derive(Args)]
#[command(mut_arg("out", |out| out.help("Folder for metrics.json and report.html [default: nothing is written]")))]
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
    let _claim = arguments.out.out.as_ref().map(|out| claimed_for(out, "metrics.json")).transpose()?;
    let device = device(&common.device)?;
    let (mut simulator, state) = checkpoint::open(&arguments.checkpoint, &device)?;
    arguments.without.switch_off(&mut simulator)?;
    let lpips = arguments.lpips.config().map(|config| Lpips::open(&config, &device)).transpose()?;
    // Beside `best` and `last`, in the run folder.
    let poses = refine::read(&arguments.checkpoint.join(".."))?;
    let scratch = Scratch::new()?;
    let (mut evaluations, mut drawn) = (Vec::new(), Vec::new());
    for folder in &arguments.recordings {
        plausible::folder(folder, common)?;
        let (recording, moved) = refine::refined(LoadedRecording::open(folder, &state.simulator, false)?, &poses)?;
        if moved {
            remark!("note: {}: its motion as the training run refined it ({})", folder.display(), refine::FILE);
        }
        same_radar(folder, &recording.scene.radar, &state.site.radar)?;
        notes::of(&recording).iter().for_each(|note| remark!("note: {note}"));
        let frames = arguments.frames_of(folder, &recording)?;
        let simulation = Simulation::new(&simulator, &recording.scene, state.seed, true);
        let progress = Progress::new("evaluating", frames.len(), common.quiet);
        let mut done = 0;
        let mut pictures = Ok(html! {});
        let mut observe = |frame, all, moving| {
            done += 1;
            progress.set(done);
            // Near the middle, where the person is on the way.
            if done == frames.len().div_ceil(2) {
                pictures = of_frame(&scratch, frame, &all, &moving);
            }
        };
        let metrics = MetricsConfig::default();
        let evaluation =
            evaluation::evaluate(&recording, &simulation, &frames, &state.heatmap, &metrics, lpips.as_ref(), &mut observe)?;
        progress.finish();
        drawn.push(pictures?);
        say!("{}", folder.display());
        super::print(&scores::of_frames(&evaluation));
        evaluations.push((folder.display().to_string(), evaluation));
    }
    if let (true, Some(summary)) = (evaluations.len() > 1, scores::summary(&evaluations)) {
        say!("together");
        super::print(&scores::of_sequences(&summary));
    }
    if let Some(out) = &arguments.out.out {
        atomic::write_text(out.join("metrics.json"), &scores::json(&evaluations))?;
        let content = content(&arguments.checkpoint, &evaluations, &drawn);
        atomic::write_text(out.join("report.html"), &page::page("Simulation against recordings", &content))?;
        say!("report: {}", out.join("report.html").display());
    }
    Ok(())
}

impl Arguments {
    /// The frames of a recording that are compared.
    fn frames_of(&self, folder: &Path, recording: &LoadedRecording) -> Result<Vec<usize>> {
        let available = recording.scene.radar.frames;
        let (first, end) = self.frames.unwrap_or((0, available));
        if end > available {
            return Err(Error::Usage {
                message: format!("--frames {first}..{end}: {} has {available} frames", folder.display()),
                hint: None,
            });
        }
        Ok((first..end).collect())
    }
}

/// What the page says, recording by recording and of all together.
fn content(checkpoint: &Path, evaluations: &[(String, Evaluation)], drawn: &[Markup]) -> Markup {
    html! {
        h1 { "Simulation against recordings" }
        p.lead { "Of the checkpoint " code { (page::shown(&checkpoint.display().to_string())) } "." }
        @for ((name, evaluation), pictures) in evaluations.iter().zip(drawn) {
            h2 { (page::shown(name)) }
            (page_of_frames(evaluation))
            (pictures)
        }
        @if let (true, Some(summary)) = (evaluations.len() > 1, scores::summary(evaluations)) {
            h2 { "Together" }
            pre { (scores::of_sequences(&summary)) }
        }
    }
}

/// A frame's pictures, as they stand in a page.
fn of_frame(scratch: &Scratch, frame: usize, all: &FrameMaps, moving: &FrameMaps) -> Result<Markup> {
    let files = draw_frame(scratch.path(), &format!("frame {frame}"), all, moving)?;
    let pictures = files.iter().map(|file| picture(file, "range-Doppler")).collect::<Result<Vec<_>>>()?;
    Ok(html! { @for picture in &pictures { p { (picture) } } })
}
