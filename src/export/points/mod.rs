//! `NAME_points.npz` and `NAME_points/frame_000000.ply`: what a constant false-alarm rate (CFAR) detector finds in every
//! frame's range-Doppler map, with its direction.
//!
//! The power of all antennas is averaged without their phases; [`cfar`] says which cells stand out, [`threshold`] by how much
//! they must; the direction is where a beam over the virtual array is strongest (`direction`).

pub mod cfar;
mod direction;
mod ply;
pub mod threshold;

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::beams::{self, angle, aperture_m, nearest};
use super::sink::{Layout, NpzSink, Sink};
use super::{Source, contents};
use crate::bounds;
use crate::data::arrays::Values;
use crate::error::{Error, Result};
use crate::heatmap::{Analysis, HeatmapConfig, mean_power};
use crate::radar::Radar;
use cfar::{Cfar, Detection};
use direction::Search;

/// How cells are detected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PointsConfig {
    pub method: Method,
    /// Chance that a cell of white noise is detected.
    pub false_alarm_rate: f64,
    /// Cells on either side that may hold the target itself, `[doppler, range]`. A Hann window needs two.
    pub guard: [usize; 2],
    /// Cells on either side, beyond the guard, that say how strong the noise is.
    pub training: [usize; 2],
    /// Which of the ordered training cells OS-CFAR takes, as a share; Rohling (1983) advises three quarters.
    pub rank: f64,
    /// Keep a detected cell only where none of its eight neighbours is stronger.
    pub peaks_only: bool,
    /// Whether every frame is freed of its mean over the loops first: walls and furniture give no points then.
    pub remove_static: bool,
    /// Nearer and farther cells are left out; absent: none is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub farthest_m: Option<f64>,
    pub azimuth_limit_deg: f64,
    pub elevation_limit_deg: f64,
}

/// How the noise is estimated from the training cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// By their mean (cell averaging).
    Ca,
    /// By an ordered one (order statistic; Rohling 1983), which other targets among them disturb less.
    Os,
}

impl Default for PointsConfig {
    fn default() -> Self {
        Self {
            method: Method::Ca,
            false_alarm_rate: 1e-5,
            guard: [2, 2],
            training: [4, 6],
            rank: 0.75,
            peaks_only: true,
            remove_static: false,
            nearest_m: None,
            farthest_m: None,
            azimuth_limit_deg: 75.0,
            elevation_limit_deg: 45.0,
        }
    }
}

impl PointsConfig {
    /// Refuses rates, counts of cells, angles and ranges outside their limits.
    pub fn check(&self) -> Result<()> {
        if !(1e-12..=0.5).contains(&self.false_alarm_rate) {
            return Err(Error::setting("points.false_alarm_rate", self.false_alarm_rate, "1e-12 to 0.5"));
        }
        if !(0.0..=1.0).contains(&self.rank) {
            return Err(Error::setting("points.rank", self.rank, "a share from 0 to 1"));
        }
        for (key, cells) in [("points.guard", self.guard), ("points.training", self.training)] {
            if cells.iter().any(|&count| count > 256) {
                return Err(Error::setting(key, format!("{cells:?}"), "at most 256 cells either side"));
            }
        }
        bounds::count("points.training", self.training[0] + self.training[1], 512)?;
        angle("points.azimuth_limit_deg", self.azimuth_limit_deg)?;
        angle("points.elevation_limit_deg", self.elevation_limit_deg)?;
        nearest("points.nearest_m", self.nearest_m)?;
        nearest("points.farthest_m", self.farthest_m)
    }
}

/// One point of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Radar frame: x to the right, y ahead, z up.
    pub position_m: [f64; 3],
    /// Radial, positive when receding.
    pub velocity_mps: f64,
    /// Power of the cell over that of the noise around it.
    pub snr_db: f64,
}

impl Point {
    /// x, y, z, velocity and signal-to-noise ratio, as files have them.
    fn numbers(&self) -> [f64; 5] {
        let [x, y, z] = self.position_m;
        [x, y, z, self.velocity_mps, self.snr_db]
    }
}

/// Finds the points of one frame after the other.
pub struct Finder {
    analysis: Analysis,
    cfar: Cfar,
    search: Search,
    /// From where ranges count: the middle between the transmitters' and the receivers' centres.
    origin_m: [f64; 3],
    ranges_m: Vec<f64>,
    velocities_mps: Vec<f64>,
}

impl Finder {
    /// # Errors
    /// A map that has no room for the training cells.
    pub fn new(radar: &Radar, config: &PointsConfig) -> Result<Self> {
        let heatmap = HeatmapConfig::default();
        let analysis = Analysis::new(radar, &heatmap);
        let [from, to] = radar.antenna_centres_m();
        Ok(Self {
            cfar: Cfar::new(radar, &heatmap, config)?,
            search: Search::new(radar, config),
            origin_m: std::array::from_fn(|axis| 0.5 * (from[axis] + to[axis])),
            ranges_m: analysis.range_axis().values,
            velocities_mps: analysis.velocity_axis().values,
            analysis,
        })
    }

    /// The points of a frame, `[tx, rx, loop, sample]`, in the order of velocity, then range.
    pub fn points(&self, frame: &[num_complex::Complex32], config: &PointsConfig) -> Vec<Point> {
        let maps = self.analysis.range_doppler_complex(frame);
        let power = mean_power(&maps);
        let mut found = self.cfar.detect(&power);
        let within = |cell: &Detection| {
            let range = self.ranges_m[cell.bin];
            config.nearest_m.is_none_or(|nearest| range >= nearest) && config.farthest_m.is_none_or(|farthest| range <= farthest)
        };
        found.retain(|cell| within(cell) && (!config.peaks_only || self.cfar.is_peak(&power, cell)));
        let point = |cell: Detection| {
            let direction = self.search.strongest(|direction| {
                let beam = self.analysis.beam(&maps, direction, cell.row, cell.bin..cell.bin + 1);
                beam[0].norm_sqr()
            });
            let range = self.ranges_m[cell.bin];
            Point {
                position_m: std::array::from_fn(|axis| self.origin_m[axis] + range * direction[axis]),
                velocity_mps: self.velocities_mps[cell.row],
                snr_db: 10.0 * (cell.power / cell.noise).log10(),
            }
        };
        found.into_iter().map(point).collect()
    }
}

/// Writes the points of all frames, and gives notes for people.
///
/// # Errors
/// A map without room for the training cells, a frame that cannot be read, a folder that cannot be written.
pub fn write(source: &mut Source, folder: &Path) -> Result<Vec<String>> {
    let config = &source.config.points;
    let radar = &source.recording.radar;
    let finder = Finder::new(radar, config)?;
    let clouds = folder.join(format!("{}_points", source.name));
    std::fs::create_dir_all(&clouds).map_err(|source| Error::write(&clouds, source))?;
    let (mut frames, mut points) = (Vec::new(), Vec::new());
    for frame in 0..radar.frames {
        let found = finder.points(&beams::samples(source, frame, config.remove_static)?, config);
        ply::write(&clouds.join(format!("frame_{frame:06}.ply")), &found)?;
        frames.extend(std::iter::repeat_n(frame as i32, found.len()));
        points.extend(found);
        source.done(frame + 1);
    }
    let mut sink: Box<dyn Sink> = Box::new(NpzSink::create(&folder.join(format!("{}_points.npz", source.name)))?);
    let shape = [points.len()];
    sink.array(Layout { name: "frame", axes: "point", unit: "", shape: &shape }, Values::I32(&frames))?;
    let columns = [("x_m", "m"), ("y_m", "m"), ("z_m", "m"), ("velocity_m_s", "m/s"), ("snr_db", "dB")];
    for (column, (name, unit)) in columns.into_iter().enumerate() {
        let values: Vec<f32> = points.iter().map(|point| point.numbers()[column] as f32).collect();
        sink.array(Layout { name, axes: "point", unit, shape: &shape }, Values::F32(&values))?;
    }
    let times: Vec<f64> = (0..radar.frames).map(|frame| radar.chirp_time_s(frame, 0, 0)).collect();
    contents::line(&mut *sink, "time_s", "time", "s", &times)?;
    contents::whole_frames(source.recording, "time", &mut *sink)?;
    sink.text("method", &serde_json::to_string(config).expect("settings are plain data"))?;
    contents::texts(source.recording, &mut *sink)?;
    sink.finish()?;
    let mut notes = vec![format!(
        "{} points in {} frames; of white noise {:.1} false cells a frame are expected before peaks are chosen",
        points.len(),
        radar.frames,
        config.false_alarm_rate * finder.cfar.tested() as f64
    )];
    for (axis, what) in [(0, "azimuth"), (2, "elevation")] {
        if aperture_m(radar, axis) == 0.0 {
            notes.push(format!("the antennas do not resolve {what}: it is taken to be 0"));
        }
    }
    if radar.loops_per_frame == 1 {
        notes.push("frames of one loop measure no velocity: it is taken to be 0".into());
    }
    Ok(notes)
}

#[cfg(test)]
mod tests;
