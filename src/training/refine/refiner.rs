//! One recording's refinement under way.

use std::f64::consts::LN_2;

use burn::tensor::{Device, Tensor};

use super::{
    RefineConfig,
    expected::{self, Comparison, LOBES_A_PART, Noise, Sampled},
    gains::{self, Linear},
};
use crate::{
    error::{Error, Result},
    heatmap::{HeatmapConfig, RangeDoppler, remove_loop_mean},
    person::{Motion, Person},
    simulator::Scene,
    training::LoadedRecording,
};

pub struct Refiner<'a> {
    pub config: &'a RefineConfig,
    pub recording: &'a LoadedRecording,
    pub person: &'a Person,
    pub joints: usize,
    /// Those that are fitted.
    pub frames: Vec<usize>,
    pub transform: RangeDoppler,
    pub noise: Noise,
    /// Part of every point of the body.
    pub part: Vec<usize>,
    /// Logarithm of the power that brings the whole body to its level.
    pub level: f64,
    pub device: Device,
    pub threads: usize,
}

/// At most so many, evenly spaced.
pub fn spaced(frames: &[usize], most: usize) -> Vec<usize> {
    let count = frames.len().min(most);
    (0..count).map(|part| frames[(2 * part + 1) * frames.len() / (2 * count)]).collect()
}

impl<'a> Refiner<'a> {
    /// `frames`: those that are fitted.
    ///
    /// # Errors
    /// A recording that cannot be read, or holds nothing.
    pub fn new(
        recording: &'a LoadedRecording,
        (person, motion): (&'a Person, &Motion),
        frames: Vec<usize>,
        config: &'a RefineConfig,
        heatmap: &HeatmapConfig,
        device: &Device,
    ) -> Result<Self> {
        let radar = &recording.scene.radar;
        let mut refiner = Self {
            transform: RangeDoppler::new(radar.loops_per_frame, radar.samples_per_chirp, radar.sampling, heatmap, device),
            noise: Noise { floor: 0.0, cells_a_look: expected::cells_a_look(radar, heatmap) },
            joints: motion.poses[0].len(),
            part: recording.scene.body.as_ref().map(|body| body.joints()).unwrap_or_default(),
            level: 0.0,
            threads: std::thread::available_parallelism().map_or(1, usize::from).min(8),
            device: device.clone(),
            frames,
            config,
            recording,
            person,
        };
        refiner.measure()?;
        Ok(refiner)
    }

    pub fn comparison(&self, blur_cells: f64) -> Comparison<'_> {
        Comparison::new(&self.transform, self.noise, blur_cells, &self.device)
    }

    pub fn measured(&self, comparison: &Comparison<'_>, frame: usize) -> Result<Tensor<2>> {
        Ok(comparison.measured(self.recording.target(frame, &self.device)?))
    }

    /// Gains of the fitted frames, or of as many of them as the config has, where the body is as the scene has it; in standard deviations
    /// of their prior.
    pub fn gains(&self, scene: &Scene, blur_cells: f64, start: &[f64]) -> Result<Vec<f64>> {
        let comparison = self.comparison(blur_cells);
        let frames = spaced(&self.frames, self.config.frames).into_iter();
        let linear: Vec<Linear> = frames.map(|frame| self.linear(scene, frame, &comparison)).collect::<Result<_>>()?;
        Ok(gains::fit(&linear, start))
    }

    /// Nats lost in each of other frames.
    pub fn lost(&self, scene: &Scene, frames: &[usize], blur_cells: f64, gains: &[f64]) -> Result<Vec<f64>> {
        let comparison = self.comparison(blur_cells);
        frames.iter().map(|&frame| Ok(self.linear(scene, frame, &comparison)?.nats(gains))).collect()
    }

    fn linear(&self, scene: &Scene, frame: usize, comparison: &Comparison<'_>) -> Result<Linear> {
        let view = scene.view(frame)?;
        let sampled = Sampled::new(&view, &self.part, self.config.points);
        let basis = expected::basis(scene, &view, &sampled, self.joints, &self.transform, &self.device);
        Ok(Linear::new(comparison, basis, self.level, self.measured(comparison, frame)?))
    }

    /// Noise floor and level, from the frames that are looked at.
    fn measure(&mut self) -> Result<()> {
        let mut cells = Vec::new();
        let (mut measured, mut expected) = (0.0, 0.0);
        for &frame in &self.frames {
            let moving = remove_loop_mean(self.recording.target(frame, &self.device)?);
            cells.extend(self.transform.map(moving).power().into_data().iter::<f64>());
        }
        cells.sort_by(f64::total_cmp);
        let floor = cells[cells.len() / 2] / LN_2;
        if !(floor.is_finite() && floor > 0.0) {
            return Err(Error::Usage {
                message: format!("{}: the moving cells' power is {}", self.recording.folder.display(), floor),
                hint: Some("check that the recording holds a signal: `hybridsim check`".into()),
            });
        }
        self.noise.floor = floor;
        let comparison = self.comparison(0.0);
        let flat = Tensor::zeros([self.joints, LOBES_A_PART], &self.device);
        for &frame in &self.frames {
            let view = self.recording.scene.view(frame)?;
            let sampled = Sampled::new(&view, &self.part, self.config.points);
            let power = expected::power(&self.recording.scene, &view, &sampled, None, flat.clone(), &self.transform);
            expected += power.sum().into_scalar::<f64>();
            let found = self.measured(&comparison, frame)?;
            measured += (found - floor).sum().into_scalar::<f64>();
        }
        self.level = (measured.max(floor) / expected.max(f64::MIN_POSITIVE)).ln();
        Ok(())
    }

    /// The middle of the body over the frames that are looked at: turning about it moves the body least.
    pub fn pivot_m(&self) -> Result<[f64; 3]> {
        let mut sum = [0.0; 3];
        let mut count = 0.0;
        for &frame in &self.frames {
            let view = self.recording.scene.view(frame)?;
            for vertex in &view.body.as_ref().expect("it has a person").vertices_m {
                (0..3).for_each(|axis| sum[axis] += vertex[axis]);
                count += 1.0;
            }
        }
        Ok(sum.map(|sum| sum / count))
    }
}
