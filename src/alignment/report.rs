//! What an alignment says: to programs (`align.json`), and in a sentence.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde::Serialize;

use super::tracks::Track;
use crate::heatmap::Map;
use crate::person::Placement;

/// Version of `align.json`.
pub const FORMAT: i64 = 1;

/// Whether the recording says where and when the motion took place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// One placement explains the recording.
    Aligned,
    /// Several explain it equally well.
    Ambiguous,
    CannotTell,
}

/// One number of the placement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    pub stated: f64,
    /// Best value; where it is not identified, what the other numbers were fitted with.
    pub value: f64,
    /// 90 % interval; none where the number is not identified.
    pub ci90: Option<[f64; 2]>,
    pub identified: bool,
    /// What is not identifiable from the recording, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
}

/// Log-likelihood of the moving cells, nats.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gain {
    /// Of the best placement over the one as stated, in the frames that were fitted and in those that were not.
    pub training_over_stated: f64,
    pub held_out_over_stated: f64,
    /// Of the best placement over a recording without the body, held-out frames.
    pub held_out_over_none: f64,
    /// Share of what the moving power could gain at most (were it predicted by itself) that the best placement gains.
    pub explained: f64,
    /// Chance that the placement as stated is as good (Student's t over frames).
    pub p_value_stated: f64,
    /// Of the grid's best place, and mean of the best places of frames in a wrong order.
    pub grid: f64,
    pub grid_shuffled: f64,
    /// Chance that frames in a wrong order fit as well as they do in theirs (Gumbel's law through the best of each order).
    pub p_value_chance: f64,
}

/// A placement of its own that is not worse beyond chance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Alternative {
    pub values: BTreeMap<&'static str, f64>,
    pub motion: Placement,
    /// Chance that it is as good as the best.
    pub p_value: f64,
    /// Frames of the recording that the motion has there; it is compared with the best in those.
    pub frames: usize,
}

/// `align.json`, and what its pictures are drawn from.
#[derive(Clone, Debug, Serialize)]
pub struct Alignment {
    pub format: i64,
    pub recording: String,
    pub verdict: Verdict,
    pub sentence: String,
    /// Whether all that is identified is where the recording states it.
    pub as_stated: bool,
    pub held_out_frames: Vec<usize>,
    pub stated: Placement,
    /// The best placement where the verdict is [`Verdict::Aligned`], else the one as stated.
    pub motion: Placement,
    /// `start_s`, `rotation_deg` (about the vertical, counter-clockwise seen from above, against what is stated), `origin_x_m`,
    /// `origin_y_m`, `origin_z_m`; and what the radar sees itself: `range_m` and `azimuth_deg` of the middle of the track (horizontal,
    /// from the antennas, positive to the right) and `facing_deg`, the turn against the line of sight.
    pub estimates: BTreeMap<&'static str, Estimate>,
    pub gain: Gain,
    pub alternatives: Vec<Alternative>,
    pub notes: Vec<String>,
    /// For pictures: moving power over time, and the body's track as stated and as found.
    #[serde(skip)]
    pub range_time_db: Map,
    #[serde(skip)]
    pub velocity_time_db: Map,
    #[serde(skip)]
    pub tracks: [Track; 2],
}

/// Names of the estimates, in the order in which they are reported, with unit and digits.
pub const ESTIMATES: [(&str, &str, usize); 8] = [
    ("start_s", "s", 3),
    ("rotation_deg", "degrees", 1),
    ("origin_x_m", "m", 3),
    ("origin_y_m", "m", 3),
    ("origin_z_m", "m", 3),
    ("range_m", "m", 3),
    ("azimuth_deg", "degrees", 1),
    ("facing_deg", "degrees", 1),
];

impl Alignment {
    /// A line for each number.
    pub fn lines(&self) -> String {
        let mut text = String::new();
        for (name, unit, digits) in ESTIMATES {
            let Some(estimate) = self.estimates.get(name) else { continue };
            let Estimate { stated, value, ci90, .. } = estimate;
            let _ = match (ci90, &estimate.why_not) {
                (Some([low, high]), _) => writeln!(
                    text,
                    "  {name:<13} {value:>8.digits$} {unit:<8} [{low:.digits$}, {high:.digits$}], stated {stated:.digits$}"
                ),
                (None, why) => writeln!(text, "  {name:<13} {:>8} {:<8} {}", "?", "", why.as_deref().unwrap_or("not identified")),
            };
        }
        text
    }
}
