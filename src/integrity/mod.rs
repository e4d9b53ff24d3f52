//! Whether a recording's samples are whole, before any physics is asked: packets of zeros, values that stand still, copies, a stream
//! that moved, transmitters that were not separated, words in the wrong order.
//!
//! The checks know the converter's stream and the radar's schedule, nothing of a body or a room. Each has a law that says how often
//! a whole recording would look so; a recording is called damaged where that is rarer than [`ALARM`]. One frame is in memory at a
//! time.

mod copies;
mod runs;
mod shift;
mod stream;
mod transmitters;
mod words;

use crate::data::Recording;
use crate::error::Result;
use stream::{Schedule, Stream};

/// Chance that one check calls a whole recording damaged, at most. Five checks at this level add at most half of the family-wise 1 % that
/// a diagnosis allows itself (`diagnosis.alarm`).
pub const ALARM: f64 = 1e-3;

/// What one check says.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    pub check: &'static str,
    pub expected: &'static str,
    /// Plain words: what, and in which frames, loops and samples.
    pub found: String,
    pub ok: bool,
    /// Frames that are damaged; empty where nothing is, or where all are.
    pub frames: Vec<usize>,
    /// A bound on the chance that a whole recording looks like this; none where nothing was found.
    pub p_value: Option<f64>,
}

impl Finding {
    fn whole(check: &'static str, expected: &'static str, found: impl Into<String>) -> Self {
        Self { check, expected, found: found.into(), ok: true, frames: vec![], p_value: None }
    }

    fn damaged(check: &'static str, expected: &'static str, found: String, frames: Vec<usize>, log_p: f64) -> Self {
        Self { check, expected, found, ok: false, frames, p_value: Some(log_p.min(0.0).exp()) }
    }
}

/// Sees every frame once, in order.
trait Inspector {
    fn see(&mut self, stream: &Stream);
    /// None where the recording has not what the check looks at.
    fn conclude(self: Box<Self>) -> Option<Finding>;
}

/// Looks at the first frames of a recording, at most so many.
///
/// # Errors
/// Samples that cannot be read.
pub fn inspect(recording: &Recording, most_frames: usize) -> Result<Vec<Finding>> {
    let schedule = Schedule::of(&recording.radar);
    let mut inspectors: [Box<dyn Inspector>; 5] = [
        Box::new(runs::Runs::new(schedule)),
        Box::new(copies::Copies::new(schedule)),
        Box::new(shift::Shift::new(schedule)),
        Box::new(transmitters::Transmitters::new(schedule)),
        Box::new(words::Words::new(schedule)),
    ];
    for index in 0..recording.frames().min(most_frames) {
        let stream = Stream::of(schedule, index, &recording.frame(index)?);
        inspectors.iter_mut().for_each(|inspector| inspector.see(&stream));
    }
    Ok(inspectors.into_iter().filter_map(Inspector::conclude).collect())
}

/// What is damaged, in one sentence; none where all is whole.
pub fn damage(findings: &[Finding]) -> Option<String> {
    let found: Vec<&str> = findings.iter().filter(|finding| !finding.ok).map(|finding| finding.found.as_str()).collect();
    (!found.is_empty()).then(|| found.join("; "))
}

/// `3, 4, 7 and 12 more`
fn listed(numbers: &[usize]) -> String {
    const SHOWN: usize = 8;
    let shown: Vec<String> = numbers.iter().take(SHOWN).map(usize::to_string).collect();
    let more = numbers.len().saturating_sub(SHOWN);
    if more == 0 { shown.join(", ") } else { format!("{} and {more} more", shown.join(", ")) }
}

/// `frame 3` or `frames 3, 4`
fn frames_listed(frames: &[usize]) -> String {
    format!("{} {}", if frames.len() == 1 { "frame" } else { "frames" }, listed(frames))
}
