//! How well simulated recordings agree with measured ones.

use num_complex::Complex32;
use rand::RngExt;
use serde::Serialize;

use crate::{
    data::Recording,
    error::Result,
    heatmap::{Analysis, HeatmapConfig, Map, Samples, StaticRemoval, remove_static},
    metrics::{DbWindow, MetricsConfig, Scores, Spread, person_cells, scores},
    simulator::{Mode, Scene, Simulator, Surfaces},
    training::{LoadedRecording, step_rng},
};

/// Simulates frames as at inference, one at a time.
pub struct Simulation<'a> {
    simulator: &'a Simulator,
    scene: &'a Scene,
    surfaces: Surfaces,
    seed: u64,
    noise: bool,
}

impl<'a> Simulation<'a> {
    /// `noise` off gives the clean signal.
    pub fn new(simulator: &'a Simulator, scene: &'a Scene, seed: u64, noise: bool) -> Self {
        Self { simulator, scene, surfaces: simulator.surfaces(&simulator.constants(scene), Mode::Inference), seed, noise }
    }

    /// `[tx, rx, loop, sample]`, in the units of the recordings it was trained on.
    ///
    /// # Errors
    /// A frame outside the motion.
    pub fn frame(&self, frame: usize) -> Result<Vec<Complex32>> {
        let view = self.scene.view(frame)?;
        let clean = self.simulator.clean_signal(self.scene, &view, &self.surfaces);
        let signal = match self.noise {
            true => self.simulator.with_noise(&self.scene.radar, clean, step_rng(self.seed, frame, 0x51A1).random()),
            false => clean,
        };
        Ok(signal.to_host())
    }
}

/// The measured samples of a frame, `[tx, rx, loop, sample]`.
pub fn measured_frame(recording: &Recording, frame: usize) -> Result<Vec<Complex32>> {
    let samples = recording.frame(frame)?;
    let im = samples.im.iter().flatten().copied().chain(std::iter::repeat(0.0));
    Ok(samples.re.iter().copied().zip(im).map(|(re, im)| Complex32::new(re, im)).collect())
}

/// Mean scores over frames.
#[derive(Clone, Debug, Serialize)]
pub struct ScoreSummary {
    pub psnr_db: Spread,
    pub ssim: Spread,
    pub mean_absolute_error_db: Spread,
}

impl ScoreSummary {
    fn of(scores: &[Scores]) -> Option<Self> {
        Some(Self {
            psnr_db: Spread::of(scores.iter().map(|score| score.psnr_db))?,
            ssim: Spread::of(scores.iter().map(|score| score.ssim))?,
            mean_absolute_error_db: Spread::of(scores.iter().map(|score| score.mean_absolute_error_db))?,
        })
    }
}

/// What an evaluation found. Images map `span_db` below the recording's strongest cell to 0 … 1.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluation {
    pub frames: usize,
    pub span_db: f64,
    /// All cells.
    pub global: Option<ScoreSummary>,
    /// All cells after the mean over each frame's loops is removed.
    pub moving: Option<ScoreSummary>,
    /// The static-removed cells that hold the person, as measured.
    pub person: Option<ScoreSummary>,
    /// LPIPS needs backbone weights that only the user may have.
    pub lpips: Option<f64>,
}

/// A frame's maps in decibels, measured and simulated.
pub struct FrameMaps {
    pub measured: Map,
    pub simulated: Map,
}

/// Compares frames one by one.
///
/// `observe` sees the maps of every frame: all cells, then static-removed ones.
pub fn evaluate(
    recording: &LoadedRecording,
    simulation: &Simulation<'_>,
    frames: &[usize],
    heatmap: &HeatmapConfig,
    metrics: &MetricsConfig,
    observe: &mut dyn FnMut(usize, FrameMaps, FrameMaps),
) -> Result<Evaluation> {
    let radar = &recording.scene.radar;
    let analysis = Analysis::new(radar, heatmap);
    let [_, tx, rx, loops, samples] = radar.dims();
    let dims = [1, tx, rx, loops, samples];
    let mut found: [Vec<Scores>; 3] = Default::default();
    for &frame in frames {
        let (measured, simulated) = (measured_frame(&recording.recording, frame)?, simulation.frame(frame)?);
        let moving = |signal: &[Complex32]| remove_static(Samples::new(signal, dims), StaticRemoval::Loops);
        let maps = [
            [analysis.range_doppler(&measured), analysis.range_doppler(&simulated)],
            [analysis.range_doppler(&moving(&measured)), analysis.range_doppler(&moving(&simulated))],
        ];
        let [all, moved] = maps.map(|[measured, simulated]| {
            let floor = heatmap.floor_amplitude(measured.max().sqrt());
            FrameMaps { measured: measured.db(floor), simulated: simulated.db(floor) }
        });
        for (kind, maps) in [&all, &moved].into_iter().enumerate() {
            let window = DbWindow::below(maps.measured.max(), metrics.span_db);
            found[kind].extend(scores(&maps.measured, &maps.simulated, &window, None));
            if kind == 1 {
                let person = person_cells(&maps.measured, metrics.person_db);
                found[2].extend(scores(&maps.measured, &maps.simulated, &window, Some(&person)));
            }
        }
        observe(frame, all, moved);
    }
    Ok(Evaluation {
        frames: frames.len(),
        span_db: metrics.span_db,
        global: ScoreSummary::of(&found[0]),
        moving: ScoreSummary::of(&found[1]),
        person: if recording.recording.person().is_some() { ScoreSummary::of(&found[2]) } else { None },
        lpips: None,
    })
}
