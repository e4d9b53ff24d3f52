//! Where a placed body is expected in range and velocity over time, and what the recording has there: for pictures.

use super::fit::Fitter;
use super::place::Place;
use super::readings::Readings;
use crate::diagnosis::prediction::range_and_velocity;
use crate::heatmap::{Axis, Map};

/// Shares of the visible surface, weighted as it returns power, that lie below each line.
pub const QUANTILES: [f64; 3] = [0.05, 0.5, 0.95];

/// Lines over the frames that the motion has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Track {
    /// Radar time of the frames' middles.
    pub time_s: Vec<f64>,
    /// `[time][quantile]`
    pub range_m: Vec<[f64; 3]>,
    /// `[time][quantile]`, positive when receding.
    pub velocity_mps: Vec<[f64; 3]>,
}

impl Track {
    pub(super) fn of(fitter: &Fitter, place: &Place) -> Self {
        let mut track = Self::default();
        let readings = fitter.readings;
        let centre = readings.radar.centre_m();
        for (frame, seen) in fitter.sight(place, 0.0).iter().enumerate() {
            let (Some(seen), Some(pose)) = (seen, fitter.pose(place, frame)) else { continue };
            let points: Vec<[f64; 3]> = seen
                .iter()
                .map(|&vertex| vertex as usize)
                .map(|vertex| {
                    let position = pose.position_m[vertex];
                    let (range, velocity) = range_and_velocity(&readings.radar, position, pose.velocity_mps[vertex]);
                    let facing: f64 = (0..3).map(|axis| (centre[axis] - position[axis]) * pose.normal[vertex][axis]).sum();
                    [range, velocity, pose.area_m2[vertex] * facing.max(0.0) / range.max(0.1).powi(5)]
                })
                .collect();
            track.time_s.push(readings.middle_s[frame]);
            track.range_m.push(quantiles(&points, 0));
            track.velocity_mps.push(quantiles(&points, 1));
        }
        track
    }
}

fn quantiles(points: &[[f64; 3]], axis: usize) -> [f64; 3] {
    let mut sorted: Vec<(f64, f64)> = points.iter().map(|point| (point[axis], point[2])).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = sorted.iter().map(|(_, weight)| weight).sum();
    QUANTILES.map(|quantile| {
        let mut below = 0.0;
        let at = sorted.iter().find(|(_, weight)| {
            below += weight;
            below >= quantile * all
        });
        at.or(sorted.last()).map_or(f64::NAN, |(value, _)| *value)
    })
}

/// Mean power of the moving cells over the noise, decibels: `[range, time]` and `[velocity, time]`.
pub(super) fn maps(readings: &Readings) -> [Map; 2] {
    let (loops, samples) = (readings.cells.loops, readings.cells.samples);
    let frames = readings.frames();
    let time = || Axis::new("time", "s", readings.middle_s.clone());
    let bins = ((readings.farthest_m() * readings.cells.bins_per_m).ceil() as usize).clamp(2, readings.cells.bins);
    let ranges = (0..bins).map(|bin| bin as f64 / readings.cells.bins_per_m).collect();
    let velocities = (0..loops).map(|row| (row as f64 - (loops / 2) as f64) / readings.cells.doppler_per_mps).collect();
    let mut over_range = vec![0.0; bins * frames];
    let mut over_velocity = vec![0.0; loops * frames];
    for frame in 0..frames {
        let power = readings.power(frame);
        for doppler in 0..loops {
            let row = (doppler + loops / 2) % loops;
            for bin in (0..bins).filter(|bin| readings.usable[doppler * samples + bin]) {
                let power = f64::from(power[doppler * samples + bin]);
                over_range[bin * frames + frame] += power / loops as f64;
                over_velocity[row * frames + frame] += power / bins as f64;
            }
        }
    }
    let db = |values: Vec<f64>| values.into_iter().map(|value| 10.0 * value.max(1e-2).log10()).collect();
    [
        Map::new(Axis::new("range", "m", ranges), time(), db(over_range)),
        Map::new(Axis::new("velocity", "m/s", velocities), time(), db(over_velocity)),
    ]
}
