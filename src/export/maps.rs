//! `NAME_maps.npz`: power `[frame, doppler, elevation, azimuth, range]` with its axes.
//!
//! Range and Doppler by windowed DFTs, angles by a beam that is steered over the virtual array wherever its antennas are
//! (`heatmap`), after the phase that a velocity gathers between the transmitters' turns is taken away. A path of amplitude 1,
//! in the unit of the recording, peaks at 0 dB.

use std::path::Path;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::beams::{angle, aperture_m, directions_deg, nearest, samples, unit};
use super::sink::{Layout, NpzSink, Sink};
use super::{Source, contents};
use crate::bounds;
use crate::data::arrays::Values;
use crate::error::Result;
use crate::heatmap::{Analysis, HeatmapConfig};

/// Which cells, in which scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MapsConfig {
    pub scale: Scale,
    /// Directions from −`azimuth_limit_deg` to `azimuth_limit_deg`, evenly spaced in the sine, as an FFT over a uniform array
    /// has them.
    pub azimuths: usize,
    pub azimuth_limit_deg: f64,
    pub elevations: usize,
    pub elevation_limit_deg: f64,
    /// Ranges beyond are left out; absent: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub farthest_m: Option<f64>,
    /// Whether every frame is freed of its mean over the loops first.
    pub remove_static: bool,
}

/// In what a map's power is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    Db,
    Power,
}

impl Default for MapsConfig {
    fn default() -> Self {
        Self {
            scale: Scale::Db,
            azimuths: 61,
            azimuth_limit_deg: 75.0,
            elevations: 1,
            elevation_limit_deg: 45.0,
            farthest_m: None,
            remove_static: false,
        }
    }
}

impl MapsConfig {
    /// Refuses counts of directions, angles and ranges outside their limits.
    pub fn check(&self) -> Result<()> {
        bounds::count("maps.azimuths", self.azimuths, 4096)?;
        bounds::count("maps.elevations", self.elevations, 4096)?;
        angle("maps.azimuth_limit_deg", self.azimuth_limit_deg)?;
        angle("maps.elevation_limit_deg", self.elevation_limit_deg)?;
        nearest("maps.farthest_m", self.farthest_m)
    }
}

/// Writes the maps of all frames, and gives notes for people.
///
/// # Errors
/// More cells in a frame than an export may have, a frame that cannot be read, a folder that cannot be written.
pub fn write(source: &mut Source, folder: &Path) -> Result<Vec<String>> {
    let config = &source.config.maps;
    let radar = &source.recording.radar;
    let analysis = Analysis::new(radar, &HeatmapConfig::default());
    let ranges: Vec<f64> = analysis.range_axis().values;
    let bins = config.farthest_m.map_or(ranges.len(), |farthest| ranges.partition_point(|&range| range <= farthest)).max(1);
    let azimuths = directions_deg(config.azimuths, config.azimuth_limit_deg);
    let elevations = directions_deg(config.elevations, config.elevation_limit_deg);
    let directions: Vec<[f64; 3]> =
        elevations.iter().flat_map(|&elevation| azimuths.iter().map(move |&azimuth| unit(azimuth, elevation))).collect();
    let loops = radar.loops_per_frame;
    let frame_shape = [loops, elevations.len(), azimuths.len(), bins];
    bounds::numbers("maps.azimuths", "doppler x elevation x azimuth x range of a frame", &frame_shape)?;
    let mut sink: Box<dyn Sink> = Box::new(NpzSink::create(&folder.join(format!("{}_maps.npz", source.name)))?);
    let starts: Vec<f64> = (0..radar.frames).map(|frame| radar.chirp_time_s(frame, 0, 0)).collect();
    contents::line(&mut *sink, "time_s", "frame", "s", &starts)?;
    contents::whole_frames(source.recording, "frame", &mut *sink)?;
    contents::line(&mut *sink, "velocity_m_s", "doppler", "m/s", &analysis.velocity_axis().values)?;
    contents::line(&mut *sink, "elevation_deg", "elevation", "deg", &elevations)?;
    contents::line(&mut *sink, "azimuth_deg", "azimuth", "deg", &azimuths)?;
    contents::line(&mut *sink, "range_m", "range", "m", &ranges[..bins])?;
    contents::texts(source.recording, &mut *sink)?;
    let (name, unit) = if config.scale == Scale::Db { ("power_db", "dB") } else { ("power", "") };
    let shape: Vec<usize> = std::iter::once(radar.frames).chain(frame_shape).collect();
    sink.begin(Layout { name, axes: "frame doppler elevation azimuth range", unit, shape: &shape }, Values::F32(&[]))?;
    for frame in 0..radar.frames {
        let maps = analysis.range_doppler_complex(&samples(source, frame, config.remove_static)?);
        let power: Vec<f32> = (0..loops)
            .into_par_iter()
            .flat_map_iter(|doppler| {
                let beam = |&direction: &[f64; 3]| analysis.beam(&maps, direction, doppler, 0..bins);
                directions.iter().flat_map(beam).map(|value| scaled(value.norm_sqr(), config.scale)).collect::<Vec<_>>()
            })
            .collect();
        sink.push(Values::F32(&power))?;
        source.done(frame + 1);
    }
    sink.finish()?;
    let mut notes = Vec::new();
    if radar.tx_m.len() > 1 {
        notes
            .push("velocities beyond the unambiguous ones appear folded, and so at wrong angles: transmitters take turns".into());
    }
    for (axis, what, count) in [(0, "azimuth", azimuths.len()), (2, "elevation", elevations.len())] {
        if count > 1 && aperture_m(radar, axis) == 0.0 {
            notes.push(format!("the antennas do not resolve {what}: all of its cells are equal"));
        }
    }
    Ok(notes)
}

/// Decibels of an empty cell are those of the smallest number that is kept.
fn scaled(power: f64, scale: Scale) -> f32 {
    match scale {
        Scale::Db => (10.0 * power.max(f64::from(f32::MIN_POSITIVE)).log10()) as f32,
        Scale::Power => power as f32,
    }
}
