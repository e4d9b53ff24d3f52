//! Where a tracked body is in the radar's frame, and when: origin, turn about the vertical and start of a recording's motion, from the
//! recording itself, with intervals, or that it cannot be determined.
//!
//! A body's motion says how ranges and velocities change, the radar saw them change; a placement is judged by how likely the moving cells
//! of the recording are under the power that the placed body would send (`likelihood`: the law by which the diagnosis compares displaced
//! bodies, with the phases between channels). `coarse` looks everywhere on a grid, `climb` goes to the maximum, `chance` says how
//! well frames in a wrong order fit, and `verdict` what may be said.

mod chance;
mod climb;
mod coarse;
mod estimates;
mod fit;
mod likelihood;
mod place;
mod poses;
mod readings;
pub mod report;
pub mod tracks;
mod verdict;

pub use report::{Alignment, Estimate, Verdict};

use std::f64::consts::PI;

use chance::Chance;
use climb::{Maximum, active};
use coarse::Grid;
use fit::{COHERENCE, Fitter};
use place::{Pivot, Place};
use poses::Poses;
use readings::Readings;

use crate::data::Recording;
use crate::diagnosis::Evidence;
use crate::diagnosis::cube::Loaded;
use crate::error::{Error, Result};
use crate::integrity;

/// How far is looked.
#[derive(Clone, Debug)]
pub struct Search {
    /// Largest error of the clock that is tried, seconds.
    pub lag_s: f64,
    /// Most frames of the recording that are looked at, from its beginning.
    pub frames: usize,
}

impl Default for Search {
    fn default() -> Self {
        Self { lag_s: 2.0, frames: 64 }
    }
}

/// Most samples in memory (24 bytes each), as many as the diagnosis'.
const MOST_SAMPLES: usize = 40_000_000;
/// Places of the grid that are climbed from, and those of them that are climbed to the end.
const STARTS: usize = 6;
const ENDS: usize = 3;
/// Rounds of the climb.
const FIRST_ROUNDS: usize = 2;
const ROUNDS: usize = 10;
/// Widest azimuth that is tried, and the step: a third of what four receivers half a wavelength apart resolve at their best.
const WIDEST_RAD: f64 = 72.0 * PI / 180.0;
const AZIMUTH_STEP_RAD: f64 = 4.0 * PI / 180.0;
/// Where the recording puts its motion; `progress` receives what happens, in plain words.
///
/// # Errors
/// A recording that cannot be read, is too short or damaged, or has no body with a motion; a motion that has no pose in all of the
/// recording, however late it starts within `search.lag_s`.
pub fn align(recording: &Recording, search: &Search, progress: &mut dyn FnMut(&str)) -> Result<Alignment> {
    let settings = recording.folder.join("recording.toml");
    recording.radar.refuse_falling("radar", "align knows no falling ones").map_err(|error| error.in_file(&settings))?;
    let person = recording.person().ok_or_else(|| {
        Error::field(&settings, "files", "no body with a motion", "a body and its motion, or meshes")
            .with_hint("without a tracked body there is nothing to align; `hybridsim check` shows what the recording has")
    })?;
    if !(search.lag_s.is_finite() && search.lag_s > 0.0) {
        return Err(Error::setting("lag_s", search.lag_s, "seconds above zero"));
    }
    let per_frame: usize = recording.radar.dims()[1..].iter().product();
    let frames = search.frames.min((MOST_SAMPLES / per_frame.max(1)).max(1)).max(1);
    let mut notes = recording.notes.clone();
    if recording.radar.frames > frames {
        notes.push(format!("the first {frames} of {} frames were looked at", recording.radar.frames));
    }
    progress("reading");
    if let Some(damage) = integrity::damage(&integrity::inspect(recording, frames)?) {
        return Err(Error::field(&settings, "files.if", format!("damaged: {damage}"), "whole samples"));
    }
    let readings = Readings::new(&Evidence::new(Loaded::read(recording, frames)?, recording.room.clone(), None));
    let (first, last) = (readings.middle_s[0], readings.middle_s[readings.frames() - 1]);
    let margin = search.lag_s + climb::UNIT[place::CLOCK];
    let poses = Poses::new(person, first - margin, last + margin)?.ok_or_else(|| {
        let times = person.pose_times_s();
        let found = format!("from {:.3} s to {:.3} s", times[0], times[times.len() - 1]);
        let wanted = format!("a motion within {:.3} s of the frames, which last from {first:.3} s to {last:.3} s", search.lag_s);
        Error::field(&settings, "motion", found, wanted).with_hint("look farther with --lag, or correct motion.start_s roughly")
    })?;
    progress("looking for the body on a grid");
    let pivot = Pivot { stated_m: poses.middle_m(&readings.middle_s), centre_m: readings.radar.centre_m() };
    let grid = Grid::new(&readings, &poses, &pivot, search.lag_s);
    let chance = Chance::of(&grid);
    progress("climbing");
    let maxima = maxima(&readings, &poses, &pivot, &grid.peaks(&pivot, STARTS));
    progress("judging");
    let found = verdict::Found { person, readings: &readings, poses: &poses, maxima, chance, lag_s: search.lag_s, notes };
    let folder = recording.folder.display().to_string();
    Ok(verdict::alignment(&found, folder))
}

/// Climbs from the grid's peaks; best first.
fn maxima<'a>(readings: &'a Readings, poses: &'a Poses, pivot: &Pivot, peaks: &[Place]) -> Vec<Maximum<'a>> {
    let active = active(readings);
    let training = &readings.split.training;
    let steps = (WIDEST_RAD / AZIMUTH_STEP_RAD) as i32;
    let azimuths: Vec<f64> = (-steps..=steps).map(|step| f64::from(step) * AZIMUTH_STEP_RAD).collect();
    let mut begun: Vec<Maximum> = vec![];
    for peak in peaks {
        // About the middle of the track that this clock shows, so that turns and shifts are not mixed.
        let times: Vec<f64> = readings.middle_s.iter().map(|middle| middle - peak.clock_s).collect();
        let (pivot, mut place) = pivot.restated(peak, poses.middle_m(&times));
        let mut fitter = Fitter { readings, poses, pivot, coherence: COHERENCE };
        if active.contains(&place::AZIMUTH) {
            let gains = fitter.over_azimuths(&place, &azimuths);
            let best = (0..azimuths.len()).max_by(|&a, &b| gains[a].total_cmp(&gains[b])).unwrap_or(0);
            place.azimuth_rad = azimuths[best];
            fitter = fitter.with_best_coherence(&place);
        }
        begun.push(fitter.climb(place, &active, FIRST_ROUNDS));
    }
    let by_gain = |a: &Maximum, b: &Maximum| b.score.over(training).total_cmp(&a.score.over(training));
    begun.sort_by(by_gain);
    let mut ended: Vec<Maximum> = begun
        .into_iter()
        .take(ENDS)
        .map(|begun| begun.fitter.with_best_coherence(&begun.place).climb(begun.place, &active, ROUNDS))
        .collect();
    ended.sort_by(by_gain);
    ended
}
