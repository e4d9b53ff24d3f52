//! Two sources of frames, scored one frame at a time.

use num_complex::Complex32;

use super::{Evaluation, RegionScores, ScoreSummary};
use crate::{
    data::Recording,
    error::{Error, Result},
    heatmap::{Analysis, HeatmapConfig, Map, Samples, StaticRemoval, remove_static},
    lpips::Lpips,
    metrics::{DbWindow, MetricsConfig, bounding_box, crop, person_cells, scores},
    radar::Radar,
};

/// The measured samples of a frame, `[tx, rx, loop, sample]`.
pub fn measured_frame(recording: &Recording, frame: usize) -> Result<Vec<Complex32>> {
    Ok(recording.frame(frame)?.complex().collect())
}

/// Those of some frames that are whole: lost chirps are compared with nothing.
///
/// # Errors
/// None of them is.
fn whole(recording: &Recording, frames: &[usize]) -> Result<Vec<usize>> {
    let whole: Vec<usize> = frames.iter().copied().filter(|frame| recording.is_whole(*frame)).collect();
    if whole.is_empty() && !frames.is_empty() {
        let found = format!("lost chirps in all of {} frames", frames.len());
        return Err(Error::field(recording.folder.join("recording.toml"), "files.valid", found, "a frame that is whole"));
    }
    Ok(whole)
}

/// A frame's maps in decibels, measured and simulated.
pub struct FrameMaps {
    pub measured: Map,
    pub simulated: Map,
}

/// A frame's samples, `[tx, rx, loop, sample]`.
type FrameSource<'a> = &'a dyn Fn(usize) -> Result<Vec<Complex32>>;

/// What is measured and what is to equal it.
struct Pair<'a> {
    radar: &'a Radar,
    /// Whether the person's cells mean something.
    tracked: bool,
    measured: FrameSource<'a>,
    simulated: FrameSource<'a>,
}

/// Scores frames of a source, samples `[tx, rx, loop, sample]`, against a recording's, one by one.
///
/// `observe` sees the maps of every frame: all cells, then static-removed ones.
///
/// # Errors
/// Frames without a signal; a frame that cannot be read; whatever the source refuses; maps too small for `lpips`.
pub fn compare_with(
    measured: &Recording,
    simulated: FrameSource<'_>,
    frames: &[usize],
    heatmap: &HeatmapConfig,
    metrics: &MetricsConfig,
    lpips: Option<&Lpips>,
    observe: &mut dyn FnMut(usize, FrameMaps, FrameMaps),
) -> Result<Evaluation> {
    let frames = &whole(measured, frames)?[..];
    measured.refuse_dead(frames.iter().copied())?;
    let pair = Pair {
        radar: &measured.radar,
        tracked: measured.person().is_some(),
        measured: &|frame| measured_frame(measured, frame),
        simulated,
    };
    score(&pair, frames, heatmap, metrics, lpips, observe)
}

/// Mean scores of these frames.
fn score(
    pair: &Pair<'_>,
    frames: &[usize],
    heatmap: &HeatmapConfig,
    metrics: &MetricsConfig,
    lpips: Option<&Lpips>,
    observe: &mut dyn FnMut(usize, FrameMaps, FrameMaps),
) -> Result<Evaluation> {
    let analysis = Analysis::new(pair.radar, heatmap);
    if lpips.is_some() {
        Lpips::check_dims([analysis.velocity_axis().len(), analysis.range_axis().len()])?;
    }
    let [mut global, mut moving, mut person] = [const { Vec::new() }; 3];
    for &frame in frames {
        let [all, moved] = frame_maps(pair, &analysis, heatmap, frame)?;
        let window = DbWindow::below(all.measured.max(), metrics.span_db);
        global.extend(region(&all, &window, None, lpips));
        let window = DbWindow::below(moved.measured.max(), metrics.span_db);
        moving.extend(region(&moved, &window, None, lpips));
        if pair.tracked {
            let cells = person_cells(&moved.measured, metrics.person_db);
            person.extend(region(&moved, &window, Some(&cells), lpips));
        }
        observe(frame, all, moved);
    }
    Ok(Evaluation {
        frames: frames.len(),
        span_db: metrics.span_db,
        global: ScoreSummary::of_frames(&global),
        moving: ScoreSummary::of_frames(&moving),
        person: ScoreSummary::of_frames(&person),
        lpips: lpips.map(Lpips::network),
    })
}

/// All cells, and static removed.
fn frame_maps(pair: &Pair<'_>, analysis: &Analysis, heatmap: &HeatmapConfig, frame: usize) -> Result<[FrameMaps; 2]> {
    let [_, tx, rx, loops, samples] = pair.radar.dims();
    let (measured, simulated) = ((pair.measured)(frame)?, (pair.simulated)(frame)?);
    let moving = |signal: &[Complex32]| remove_static(Samples::new(signal, [1, tx, rx, loops, samples]), StaticRemoval::Loops);
    let maps = |measured: &[Complex32], simulated: &[Complex32]| {
        let (measured, simulated) = (analysis.range_doppler(measured), analysis.range_doppler(simulated));
        let floor = heatmap.floor_amplitude(measured.max().sqrt());
        FrameMaps { measured: measured.db(floor), simulated: simulated.db(floor) }
    };
    Ok([maps(&measured, &simulated), maps(&moving(&measured), &moving(&simulated))])
}

/// The scores of a map's cells; with a mask, of these only, and LPIPS of the box around them.
fn region(maps: &FrameMaps, window: &DbWindow, mask: Option<&[bool]>, lpips: Option<&Lpips>) -> Option<RegionScores> {
    let scores = scores(&maps.measured, &maps.simulated, window, mask)?;
    let distance = |lpips: &Lpips| {
        let dims = maps.measured.dims();
        let limits = match mask {
            Some(mask) => bounding_box(mask, dims, Lpips::SMALLEST)?,
            None => dims.map(|length| 0..length),
        };
        let [measured, simulated] = [&maps.measured, &maps.simulated].map(|map| crop(&window.image(map), dims, &limits));
        Some(lpips.distance(&measured, &simulated, limits.map(|limit| limit.len())))
    };
    Some(RegionScores { scores, lpips: lpips.and_then(distance) })
}
