//! Recordings as maps over time, and windows of them.

use num_complex::Complex32;
use rayon::prelude::*;

use super::config::RecognitionConfig;
use crate::data::Recording;
use crate::error::{Error, Result};
use crate::evaluation::measured_frame;
use crate::heatmap::{Analysis, Gate, Samples, Scan, StaticRemoval, remove_static};

/// Names of the three maps, in order.
pub const MAPS: [&str; 3] = ["time-Doppler", "time-range", "time-angle"];

/// One recording as three maps over time.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// For messages: where the recording lies.
    pub name: String,
    pub class: usize,
    pub frames: usize,
    /// Rows of each map: velocities, ranges, azimuths.
    pub rows: [usize; 3],
    /// `[map][row, frame]`, 1 at the sequence's strongest cell of that map, 0 at the floor and below, linear in decibels.
    pub values: [Vec<f32>; 3],
}

/// A stretch of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    pub sequence: usize,
    pub start: usize,
}

/// The maps of a recording: power over velocity, range and azimuth, frame by frame, without static clutter within
/// a frame, in decibels below the recording's own strongest cell. One frame is in memory per thread.
///
/// # Errors
/// A recording whose samples cannot be read, whose longest stretch of whole frames is shorter than a window, or in which nothing moves.
pub fn sequence(recording: &Recording, class: usize, config: &RecognitionConfig) -> Result<Sequence> {
    let (radar, stretch) = (&recording.radar, recording.whole_stretch()?);
    let (name, frames) = (recording.folder.display().to_string(), stretch.len());
    if frames < config.window_frames {
        let expected = format!("at least the {} of a window", config.window_frames);
        return Err(Error::field(recording.folder.join("recording.toml"), "radar.frames", frames.to_string(), expected)
            .with_hint("set window_frames lower, or record longer"));
    }
    let analysis = Analysis::new(radar, &config.heatmap);
    let scan = Scan::azimuth(config.azimuth_deg, config.azimuth_step_deg);
    let gate = Gate::range(config.range_m[0], config.range_m[1]);
    let [_, tx, rx, loops, samples] = radar.dims();
    let dims = [1, tx, rx, loops, samples];
    let columns: Vec<[Vec<f64>; 3]> = (0..frames)
        .into_par_iter()
        .map(|frame| {
            let measured: Vec<Complex32> = measured_frame(recording, stretch.start + frame)?;
            let moving = remove_static(Samples::new(&measured, dims), StaticRemoval::Loops);
            let moving = Samples::new(&moving, dims);
            let range = analysis.time_range(moving, &Gate::default());
            let kept = range.values.iter().zip(&range.rows.values).filter(|(_, range)| gate.holds_range(**range));
            Ok([
                analysis.time_doppler(moving, &gate).values,
                kept.map(|(power, _)| *power).collect(),
                analysis.time_angle(moving, &scan, &gate).values,
            ])
        })
        .collect::<Result<_>>()?;
    let rows: [usize; 3] = std::array::from_fn(|map| columns[0][map].len());
    if rows[1] == 0 {
        return Err(Error::setting("range_m", format!("{:?}", config.range_m), format!("ranges that {name} resolves")));
    }
    let mut values: [Vec<f32>; 3] = Default::default();
    for map in 0..3 {
        let peak = columns.iter().flat_map(|column| &column[map]).copied().fold(0.0, f64::max);
        if peak <= 0.0 {
            return Err(Error::field(&recording.folder, "the samples", "without anything that moves", "a moving person"));
        }
        let level = |power: f64| {
            let db = 10.0 * (power / peak).max(1e-30).log10();
            (1.0 - db / config.floor_db).clamp(0.0, 1.0) as f32
        };
        values[map] = (0..rows[map]).flat_map(|row| columns.iter().map(move |column| level(column[map][row]))).collect();
    }
    Ok(Sequence { name, class, frames, rows, values })
}

/// Windows of all sequences, a stride apart.
pub fn windows(sequences: &[Sequence], config: &RecognitionConfig) -> Vec<Window> {
    let of = |(sequence, frames): (usize, usize)| {
        (0..=frames - config.window_frames).step_by(config.stride_frames).map(move |start| Window { sequence, start })
    };
    sequences.iter().map(|sequence| sequence.frames).enumerate().flat_map(of).collect()
}

/// One map of a window, `[row, frame]`; `gain` is added before clipping (1 is the whole span down to the floor).
pub fn cut(sequence: &Sequence, map: usize, start: usize, frames: usize, gain: f32) -> impl Iterator<Item = f32> + '_ {
    sequence.values[map]
        .chunks_exact(sequence.frames)
        .flat_map(move |row| row[start..start + frames].iter().map(move |value| (value + gain).clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_cover_a_sequence_and_are_cut_row_by_row() {
        let config = RecognitionConfig { window_frames: 4, stride_frames: 2, ..RecognitionConfig::default() };
        let values = |rows: usize| (0..rows * 7).map(|index| index as f32 / 20.0).collect::<Vec<_>>();
        let sequence =
            Sequence { name: "s".into(), class: 0, frames: 7, rows: [2, 1, 1], values: [values(2), values(1), values(1)] };
        let found = windows(&[sequence.clone(), sequence.clone()], &config);
        let starts: Vec<(usize, usize)> = found.iter().map(|window| (window.sequence, window.start)).collect();
        assert_eq!(starts, [(0, 0), (0, 2), (1, 0), (1, 2)]);
        let cut: Vec<f32> = cut(&sequence, 0, 2, 4, 0.5).collect();
        let wanted = [0.6, 0.65, 0.7, 0.75, 0.95, 1.0, 1.0, 1.0];
        assert!(cut.iter().zip(wanted).all(|(found, wanted): (&f32, f32)| (found - wanted).abs() < 1e-6), "{cut:?}");
    }
}
