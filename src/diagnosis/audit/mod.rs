//! Conventions and the scene as stated, checked before any physics is named, one file for each audit. A wrong
//! convention is reported as that.

mod antennas;
mod body_direction;
mod body_in_room;
mod body_place;
mod cells;
mod channels;
mod doppler_sign;
mod energy;
mod frame_period;
mod heading;
mod placement;
mod room_ranges;
mod surface_sampling;

use serde::{Deserialize, Serialize};

use channels::{clipped_share, strongest_clutter};
pub use placement::body_place;

use super::cube::Loaded;
use super::evidence::Evidence;
use crate::integrity::Finding;

/// One thing that was checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    pub check: String,
    pub expected: String,
    pub found: String,
    pub ok: bool,
    /// Frames that are concerned, where not all are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<Vec<usize>>,
    /// A bound on the chance of what was found where nothing is wrong, where the check has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
}

impl Check {
    fn new(check: &str, expected: impl Into<String>, found: impl Into<String>, ok: bool) -> Self {
        Self { check: check.into(), expected: expected.into(), found: found.into(), ok, frames: None, p_value: None }
    }
}

impl From<Finding> for Check {
    fn from(finding: Finding) -> Self {
        Self {
            frames: (!finding.frames.is_empty()).then_some(finding.frames),
            p_value: finding.p_value,
            ..Self::new(finding.check, finding.expected, finding.found, finding.ok)
        }
    }
}

/// A cell counts as a return above this many times the noise.
const RETURN: f64 = 20.0;
/// Share of the samples at the ends of the range from which on nothing can be restored.
const SATURATED: f64 = 0.3;
/// Fewest samples of a chirp that say anything.
const FEWEST_SAMPLES: usize = 16;

/// All checks. `origin_m`: of the motion, where it has one.
pub fn audit(evidence: &Evidence, origin_m: Option<[f64; 3]>) -> Vec<Check> {
    let mut checks = channels::channels(evidence);
    checks.push(channels::clipping(evidence));
    checks.extend(body_in_room::body_in_room(evidence));
    checks.extend(placement::placement(evidence, origin_m));
    if !checks.iter().any(|check| !check.ok && is_convention(check)) {
        // Phases predict nothing where the body is not where it is said to be.
        checks.extend(body_direction::body_direction(evidence));
        checks.extend(antennas::sides(evidence));
        checks.extend(antennas::transmitter_order(evidence));
    }
    checks.extend(room_ranges::room_ranges(evidence));
    checks.extend(surface_sampling::surface_sampling(evidence));
    checks
}

/// Checks about a convention, or the scene as stated, that must hold before physics is looked for.
const CONVENTIONS: [&str; 10] = [
    "iq_order",
    "doppler_sign",
    "tx_order",
    "sides",
    "body_in_room",
    "body_place",
    "heading",
    "frame_period",
    "body_direction",
    "room",
];

/// Whether a check is about such a convention.
pub fn is_convention(check: &Check) -> bool {
    CONVENTIONS.contains(&check.check.as_str())
}

/// What a wrong convention of the motion or the radar breaks, too: a person who walks the other way may walk through a wall.
const BROKEN_BY_OTHERS: [&str; 2] = ["body_in_room", "room"];

/// The conventions that are wrong, those first that may have broken the others.
pub fn wrong_conventions(checks: &[Check]) -> Vec<&Check> {
    let mut wrong: Vec<&Check> = checks.iter().filter(|check| !check.ok && is_convention(check)).collect();
    wrong.sort_by_key(|check| BROKEN_BY_OTHERS.contains(&check.check.as_str()));
    wrong
}

/// Whether a body was expected and is observed nowhere.
pub fn is_silent(check: &Check) -> bool {
    check.check == "body_place" && check.found.contains(placement::SILENT)
}

/// Why nothing can be said about a recording, if so.
pub fn undecidable(evidence: &Evidence, checks: &[Check]) -> Option<String> {
    let samples = evidence.cube.dims[4];
    if samples < FEWEST_SAMPLES {
        return Some(format!("too little: {samples} samples a chirp, where {FEWEST_SAMPLES} are the least that say anything"));
    }
    if let Some(bad) = checks.iter().find(|check| check.check == "channels" && !check.ok) {
        return Some(format!("a channel holds no signal: {}", bad.found));
    }
    let clipped = clipped_share(evidence);
    if clipped > SATURATED {
        return Some(format!("saturated: {:.0} % of the samples lie at the ends of the converter's range", 100.0 * clipped));
    }
    let strongest = (0..evidence.cube.channels()).map(|channel| strongest_clutter(evidence, channel)).fold(0.0, f64::max);
    let moving = evidence.maps().values().iter().copied().fold(0.0, f32::max);
    // The mean of many cells' strongest noise value is about its logarithm.
    if strongest < RETURN && moving < RETURN as f32 {
        return Some(format!(
            "too noisy: neither a static nor a moving return stands out (strongest {:.0} dB over the noise)",
            10.0 * strongest.max(f64::from(moving)).log10()
        ));
    }
    None
}

/// What could not be looked for, and why.
pub fn limits(loaded: &Loaded, body: bool, room: bool) -> Vec<String> {
    let mut notes = vec![];
    if !body {
        notes.push("no tracked body: pose, timing and body effects and multiples of the body were not looked for".into());
    }
    if !room {
        notes.push(
            "the room's size is unknown: wall images were not looked for, and echoes of any range (with I and Q, up to half the \
             unambiguous one) count as the room"
                .into(),
        );
    }
    if loaded.is_real() {
        notes.push("no quadrature receiver: the negative half of the spectrum and I/Q imbalance cannot be looked at".into());
    }
    if let Some(loops) = loaded.split.block_loops {
        notes.push(format!("few frames: blocks of {loops} loops take their place, and some are held out"));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_wrong_convention_breaks_comes_after_it() {
        let check = |name: &str, ok: bool| Check::new(name, "expected", format!("{name} found"), ok);
        let wrong = |checks: &[Check]| wrong_conventions(checks).iter().map(|check| check.check.clone()).collect::<Vec<_>>();
        let turned = [check("body_in_room", false), check("doppler_sign", true), check("heading", false)];
        assert_eq!(wrong(&turned), ["heading", "body_in_room"]);
        assert_eq!(wrong(&[check("body_in_room", false), check("heading", true)]), ["body_in_room"]);
        assert!(wrong(&[check("rail", false), check("room", true)]).is_empty());
    }
}
