//! Settings of a site.

use std::collections::BTreeSet;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::bounds;
use crate::data::read_settings;
use crate::error::{Error, Result};
use crate::person::actions::Action;
use crate::recorder::RecorderConfig;

/// Who does what in which room. `record` holds what all sequences share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SiteConfig {
    pub seed: u64,
    /// Embedded subjects.
    pub subjects: Vec<String>,
    /// Those among `subjects` that nothing may be trained on.
    pub unseen: Vec<String>,
    pub actions: Vec<Action>,
    /// Of every action by every subject.
    pub repetitions: usize,
    /// Subjects whose sequences are recorded a second time with independent noise: what no simulator can surpass.
    pub again: Vec<String>,
    /// Least distance between the body and a boundary other than the floor, and between furniture and boundaries.
    pub margin_m: f64,
    pub style: StyleRanges,
    /// The recorder's settings; its person's subject, action, style and placement are the sequences'.
    pub record: RecorderConfig,
}

/// From where to where each property of a repetition is drawn, uniformly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StyleRanges {
    pub tempo: [f64; 2],
    pub amplitude: [f64; 2],
    pub path_scale: [f64; 2],
    /// Irregularity of the motion.
    pub variation: [f64; 2],
    /// Horizontal distance of the motion's origin, straight ahead.
    pub distance_m: [f64; 2],
    /// Of the motion's origin, to the right.
    pub sideways_m: [f64; 2],
    /// Of the whole motion about its vertical axis.
    pub turn_deg: [f64; 2],
    /// How long the person has been at it when the recording begins.
    pub begun_s: [f64; 2],
    /// Walks back and forth go back backwards; not drawn.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub backward: bool,
}

impl Default for StyleRanges {
    fn default() -> Self {
        Self {
            tempo: [0.85, 1.15],
            amplitude: [0.85, 1.15],
            path_scale: [0.75, 0.95],
            variation: [0.7, 1.3],
            distance_m: [2.8, 3.2],
            sideways_m: [-0.15, 0.15],
            turn_deg: [-10.0, 10.0],
            begun_s: [0.0, 4.0],
            backward: false,
        }
    }
}

impl Default for SiteConfig {
    fn default() -> Self {
        let names = |names: &[&str]| names.iter().map(ToString::to_string).collect();
        Self {
            seed: 1,
            subjects: names(&["s1", "s2", "s3", "s4"]),
            unseen: names(&["s4"]),
            actions: Action::ALL.to_vec(),
            repetitions: 1,
            again: vec![],
            margin_m: 0.05,
            style: StyleRanges::default(),
            record: RecorderConfig::default(),
        }
    }
}

impl SiteConfig {
    /// Reads a config file with its `extends` parents, changed by `--set key=value`.
    pub fn read(path: &Path, sets: &[String]) -> Result<Self> {
        let config: Self = read_settings(path, sets)?;
        config.check()?;
        Ok(config)
    }

    /// The resolved configuration, as kept beside the recordings.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("settings are plain data")
    }

    /// Refuses what cannot be a site, as far as it can be seen without posing anybody.
    pub fn check(&self) -> Result<()> {
        self.record.room.check("record.room")?;
        let subjects = unique("subjects", &self.subjects)?;
        for (key, names) in [("unseen", &self.unseen), ("again", &self.again)] {
            let chosen = unique(key, names)?;
            if let Some(stranger) = chosen.difference(&subjects).next() {
                let known = format!("one of `subjects`: {}", self.subjects.join(", "));
                return Err(Error::setting(key, stranger, known).with_hint("labels of the split must be those of the site"));
            }
        }
        if self.unseen.len() >= self.subjects.len() {
            let expected =
                format!("at least {} subjects, {} unseen and one to train on", self.unseen.len() + 1, self.unseen.len());
            return Err(Error::setting("subjects", self.subjects.len(), expected));
        }
        unique("actions", &self.actions.iter().map(|action| action.name().to_string()).collect::<Vec<_>>())?;
        for (key, count) in [("actions", self.actions.len()), ("repetitions", self.repetitions)] {
            // A hundred thousand repetitions of an action of ten seconds take twelve days to show.
            bounds::count(key, count, 100_000)?;
        }
        if !(self.margin_m.is_finite() && self.margin_m >= 0.0) {
            return Err(Error::setting("margin_m", self.margin_m, "a distance of at least zero in metres"));
        }
        let (record, person) = (&self.record, &self.record.person);
        for (key, given) in [
            ("record.empty", record.empty),
            ("record.person.body", person.body.is_some()),
            ("record.person.motion", person.motion.is_some()),
            ("record.person.placement", person.placement.is_some()),
            ("record.noise_seed", record.noise_seed.is_some()),
        ] {
            if given {
                return Err(Error::setting(key, "given", "absent: the sequences of a site have their own"));
            }
        }
        self.style.check()?;
        self.check_furniture()
    }

    fn check_furniture(&self) -> Result<()> {
        let (low, high) = self.record.room.extent_m(f64::INFINITY);
        for (index, thing) in self.record.furniture.iter().enumerate() {
            let inside = |axis: usize| (low[axis] + self.margin_m..=high[axis] - self.margin_m).contains(&thing.position_m[axis]);
            if !(0..3).all(inside) {
                let key = format!("record.furniture[{index}].position_m");
                return Err(Error::setting(key, format!("{:?}", thing.position_m), "a place within the room")
                    .with_hint(format!("margin_m = {} is kept to every boundary", self.margin_m)));
            }
        }
        Ok(())
    }
}

impl StyleRanges {
    fn check(&self) -> Result<()> {
        for (key, [low, high]) in [
            ("tempo", self.tempo),
            ("amplitude", self.amplitude),
            ("path_scale", self.path_scale),
            ("variation", self.variation),
            ("distance_m", self.distance_m),
            ("sideways_m", self.sideways_m),
            ("turn_deg", self.turn_deg),
            ("begun_s", self.begun_s),
        ] {
            if !(low.is_finite() && high.is_finite() && low <= high) {
                return Err(Error::setting(
                    format!("style.{key}"),
                    format!("[{low}, {high}]"),
                    "two numbers, the lower one first",
                ));
            }
        }
        if self.begun_s[0] < 0.0 {
            return Err(Error::setting("style.begun_s", self.begun_s[0], "at least 0 seconds"));
        }
        Ok(())
    }
}

/// The names as a set; a repeated one is refused.
fn unique<'a>(key: &str, names: &'a [String]) -> Result<BTreeSet<&'a str>> {
    let mut set = BTreeSet::new();
    match names.iter().find(|name| !set.insert(name.as_str())) {
        Some(twice) => Err(Error::setting(key, format!("{twice} more than once"), "each name once")),
        None => Ok(set),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_a_site_is_refused_by_name() {
        let refused = |toml: &str| {
            let config: SiteConfig = crate::data::settings::read_text(toml).unwrap();
            config.check().unwrap_err().to_string()
        };
        for (toml, told) in [
            ("unseen = ['s6']", "`unseen` is s6, expected one of `subjects`: s1, s2, s3, s4"),
            ("unseen = ['s1', 's2', 's3', 's4']", "at least 5 subjects, 4 unseen and one to train on"),
            ("subjects = ['s1', 's4', 's1']", "s1 more than once"),
            ("repetitions = 0", "`repetitions` is 0"),
            ("actions = []", "`actions` is 0"),
            ("[record.room]\nfront_m = 0.0", "`record.room.front_m` is 0"),
            ("[record.room]\nleft_m = -1.0", "`record.room.left_m` is -1"),
            ("[record]\nempty = true", "`record.empty` is given"),
            ("[style]\ntempo = [1.2, 0.8]", "`style.tempo` is [1.2, 0.8]"),
            ("[[record.furniture]]\nposition_m = [0.0, 9.0, 0.0]\nrcs_m2 = 1.0", "a place within the room"),
        ] {
            let message = refused(toml);
            assert!(message.contains(told), "{toml}: {message}");
        }
        SiteConfig::default().check().unwrap();
    }
}
