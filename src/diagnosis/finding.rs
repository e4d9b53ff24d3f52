//! What a detector says: which effect, how large, where, how sure, and how to take it into account.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::course::Course;
use super::cube::Cube;
use super::prediction::BodyPrediction;
use super::statistics::chi2_tail;
use super::tones::Tones;
use crate::diagnosis::behaviour::Behaviour;
use crate::effects::{self, EffectSetting, Stage};
use crate::radar::Radar;

/// Half of a 90 % interval, in standard deviations of an error. These know of the noise, not of what the laws themselves leave out, so
/// they have a reserve: of the 51 intervals of the eleventh sealed run 40 held the truth, and half of the others missed it by less
/// than a third of their half width.
pub const NINETY: f64 = 1.25 * 1.645;

/// A parameter of an effect, or a list of them, with 90 % intervals.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// As in the table of docs/report.md.
    pub name: &'static str,
    /// One, or as many as the list has.
    pub values: Vec<f64>,
    /// Lower and upper end of each.
    pub ci90: Vec<[f64; 2]>,
}

impl Estimate {
    /// A value with the standard deviation of its error.
    pub fn normal(name: &'static str, value: f64, deviation: f64) -> Self {
        Self::list(name, &[value], &[deviation])
    }

    /// A list with the 90 % intervals of normal laws about its values.
    pub fn list(name: &'static str, values: &[f64], deviations: &[f64]) -> Self {
        let ci90 = values.iter().zip(deviations).map(|(value, sigma)| [value - NINETY * sigma, value + NINETY * sigma]).collect();
        Self { name, values: values.to_vec(), ci90 }
    }

    /// Whether another one is the same within twice both 90 % intervals.
    pub fn agrees(&self, other: &Self) -> bool {
        let width = |[low, high]: &[f64; 2]| high - low;
        let apart = self.values.iter().zip(&other.values).map(|(own, other)| (own - other).abs());
        apart.zip(self.ci90.iter().zip(&other.ci90)).all(|(apart, (own, other))| apart <= width(own) + width(other))
    }
}

/// `where` of a report; what is absent was not localised along that axis: the effect acts everywhere on it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Empty where it was not asked.
    #[serde(with = "word")]
    pub stage: Option<Stage>,
    /// Nearest and farthest.
    pub range_m: Option<[f64; 2]>,
    /// Lowest and highest radial velocity.
    pub velocity_mps: Option<[f64; 2]>,
    /// From where to where.
    pub azimuth_deg: Option<[f64; 2]>,
    /// Radar frame.
    pub position_m: Option<[f64; 3]>,
    pub boundary: Option<String>,
    pub frames: Option<Vec<usize>>,
    pub chirps: Option<Vec<usize>>,
    pub samples: Option<Vec<usize>>,
    pub tx: Option<Vec<usize>>,
    pub rx: Option<Vec<usize>>,
    pub body_part: Option<String>,
}

/// A stage as reports write it.
mod word {
    use serde::de::IntoDeserializer;
    use serde::{Deserialize, Deserializer, Serializer};

    use crate::effects::Stage;

    pub fn serialize<S: Serializer>(stage: &Option<Stage>, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(stage.map_or("", Stage::name))
    }

    pub fn deserialize<'a, D: Deserializer<'a>>(deserializer: D) -> Result<Option<Stage>, D::Error> {
        let word = String::deserialize(deserializer)?;
        if word.is_empty() { Ok(None) } else { Stage::deserialize(word.into_deserializer()).map(Some) }
    }
}

impl Place {
    /// A stage, and no place in it.
    pub fn at(stage: Stage) -> Self {
        Self { stage: Some(stage), ..Self::default() }
    }

    /// Where some returns are, each of a range (m) and a velocity (m/s).
    pub fn spanning(stage: Stage, returns: impl Iterator<Item = (f64, f64)>) -> Self {
        let (mut low, mut high, mut slow, mut fast) = (f64::INFINITY, 0.0f64, f64::INFINITY, f64::NEG_INFINITY);
        for (range, velocity) in returns {
            (low, high) = (low.min(range), high.max(range));
            (slow, fast) = (slow.min(velocity), fast.max(velocity));
        }
        Self { range_m: Some([low, high]), velocity_mps: Some([slow, fast]), ..Self::at(stage) }
    }
}

/// Whether two intervals have nothing in common.
pub fn apart(a: [f64; 2], b: [f64; 2]) -> bool {
    a[1] < b[0] || b[1] < a[0]
}

/// What changes the samples of all frames.
pub type Undo = Arc<dyn Fn(&mut Cube) + Send + Sync>;

/// What inverting a law does to the density of what was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// Whether every sample is changed for itself, whatever the others are: how it is stretched follows from the change.
    pub by_sample: bool,
    /// Logarithm by which volumes are stretched besides, or the density is spread, per sample.
    pub alike: f64,
    /// And of single samples of the cube.
    pub of_samples: Option<Arc<Vec<OfSample>>>,
}

/// Logarithm by which the density of one sample is spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OfSample {
    /// Its place in the cube.
    pub index: usize,
    pub nats: f64,
}

impl Volume {
    /// It only turns and delays.
    pub const KEPT: Self = Self { by_sample: false, alike: 0.0, of_samples: None };
    /// It changes every sample for itself.
    pub const BY_SAMPLE: Self = Self { by_sample: true, alike: 0.0, of_samples: None };

    /// Of a law with a number that every chirp or frame of so many samples has for itself: the coding cost of these,
    /// nats each (Laplace's approximation).
    pub fn with_coding_cost(self, nats: f64, samples: usize) -> Self {
        Self { alike: self.alike - nats / samples.max(1) as f64, ..self }
    }
}

/// Whether a cell, Doppler and range, of a frame's maps is one of some.
pub type Cells = Arc<dyn Fn(usize, usize) -> bool + Send + Sync>;

/// How an accepted effect is taken into account.
#[derive(Clone)]
pub enum Correction {
    /// Undone in the samples, of all frames, by what the frames themselves hold: subtracted, for the most part.
    Samples(Undo),
    /// Undone in the samples by a law with numbers that the training frames gave, or with a prior for those that they did not: what is
    /// held out is predicted by it as it is.
    Inverse(Undo, Volume),
    /// Takes a region of the range-Doppler maps out of the samples, with all that were taken out before: of these cells there is not even
    /// noise left.
    Emptied(Arc<Tones>, Cells),
    /// Another correction, after which the phase over time of what it concerned is known.
    Followed(Box<Correction>, Arc<Course>),
    /// Changes what is predicted of the body.
    Body(Arc<dyn Fn(&mut BodyPrediction) + Send + Sync>),
    /// Explains power where it was not expected: (frame, doppler, range) masks are kept by whoever needs them.
    None,
}

impl Correction {
    /// [`Self::Samples`] with this change.
    pub fn samples(undo: impl Fn(&mut Cube) + Send + Sync + 'static) -> Self {
        Self::Samples(Arc::new(undo))
    }

    /// [`Self::Inverse`] with this change.
    pub fn inverse(volume: Volume, undo: impl Fn(&mut Cube) + Send + Sync + 'static) -> Self {
        Self::Inverse(Arc::new(undo), volume)
    }

    /// Whether it takes cells out of the samples, and nothing elsewhere.
    pub fn empties(&self) -> bool {
        match self {
            Self::Emptied(..) => true,
            Self::Followed(correction, _) => correction.empties(),
            _ => false,
        }
    }

    /// What it changes in the samples, whatever was taken out of them before.
    pub fn undo(&self) -> Option<&Undo> {
        match self {
            Self::Samples(undo) | Self::Inverse(undo, _) => Some(undo),
            Self::Followed(correction, _) => correction.undo(),
            Self::Emptied(..) | Self::Body(_) | Self::None => None,
        }
    }
}

/// A curve to draw, such as a filter's response.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    pub title: String,
    pub x_label: String,
    pub y_label: String,
    /// Name, x, y.
    pub series: Vec<(String, Vec<f64>, Vec<f64>)>,
}

impl Curve {
    /// A curve with its two axes' labels; every series is a name, x and y.
    pub fn new<'a>(
        title: impl Into<String>,
        [x_label, y_label]: [&str; 2],
        series: impl IntoIterator<Item = (&'a str, Vec<f64>, Vec<f64>)>,
    ) -> Self {
        let series = series.into_iter().map(|(name, x, y)| (name.into(), x, y)).collect();
        Self { title: title.into(), x_label: x_label.into(), y_label: y_label.into(), series }
    }
}

/// Chance above which numbers may as well be neutral.
const LIKELY: f64 = 0.05;

/// One thing that may have been left out.
#[derive(Clone)]
pub struct Candidate {
    /// As in docs/report.md; none: outside the library.
    pub id: Option<&'static str>,
    pub behaves_like: Behaviour,
    pub estimates: Vec<Estimate>,
    /// A boundary or a part of the body.
    pub choice: Option<String>,
    pub place: Place,
    /// Interval of the frequency of what oscillates over slow time, Hz.
    pub line_hz: Option<[f64; 2]>,
    /// Under the null, corrected for everything that this detector looked at.
    pub p_value: f64,
    /// Log-likelihood that held-out frames gain, nats.
    pub nats: f64,
    /// Whether what it rests on (where the motion puts the body, a mesh, a chest) may err in held-out frames as in the others: a gain
    /// beyond the least then says nothing more.
    pub errs_alike: bool,
    /// Effects that would do the same to this recording, as far as it distinguishes them.
    pub look_alikes: Vec<&'static str>,
    /// Plain words with numbers: what was left out, where, how large.
    pub statement: String,
    pub curve: Option<Curve>,
    /// Energy of the effect over all samples (of the kind the cube holds: sum of |sample|²).
    pub energy: f64,
    pub correction: Correction,
}

impl Candidate {
    /// Something without a name, numbers or a correction; what more a detector knows stands before it: `Self { statement, ..Self::new(…) }`.
    pub fn new(behaves_like: Behaviour, place: Place, p_value: f64, nats: f64) -> Self {
        Self {
            id: None,
            behaves_like,
            estimates: vec![],
            choice: None,
            place,
            line_hz: None,
            p_value,
            nats,
            errs_alike: false,
            look_alikes: vec![],
            statement: String::new(),
            curve: None,
            energy: 0.0,
            correction: Correction::None,
        }
    }

    /// Whether both oscillate at one frequency.
    pub fn is_at_the_line_of(&self, other: &Self) -> bool {
        self.line_hz.zip(other.line_hz).is_some_and(|(own, other)| !apart(own, other))
    }

    /// Without its name where all the numbers that it gives may as well be those at which the effect does nothing: something is
    /// there, but not surely this. For detectors whose p-value says that something is there, and not that these numbers are.
    pub fn named_if_sure(self) -> Self {
        let Some(info) = self.id.and_then(effects::info) else { return self };
        let (mut square, mut freedom) = (0.0, 0.0);
        for estimate in &self.estimates {
            let Some(parameter) = info.parameters.iter().find(|parameter| parameter.name == estimate.name) else { continue };
            for (value, [low, high]) in estimate.values.iter().zip(&estimate.ci90).filter(|(_, [low, high])| high > low) {
                square += ((value - parameter.neutral) / ((high - low) / (2.0 * NINETY))).powi(2);
                freedom += 1.0;
            }
        }
        if freedom == 0.0 || chi2_tail(square, freedom) < LIKELY {
            return self;
        }
        let statement = format!("{} But its size may as well be none, so something else is likely.", self.statement);
        Self { id: None, look_alikes: vec![], statement, ..self }
    }

    /// As the simulator takes it; `None` for what has no name, and for what its operator does not take: a value beyond its bounds is
    /// not moved to them.
    ///
    /// `reference`: the recording's peak sample, to which levels are relative; `body_rms`: of the body's moving return, to which
    /// amplitudes of reflectors are.
    pub fn setting(&self, reference: f64, body_rms: f64, radar: &Radar) -> Option<EffectSetting> {
        let info = effects::info(self.id?)?;
        let choice = self.choice.clone().or(self.place.boundary.clone()).or(self.place.body_part.clone());
        let mut setting = EffectSetting { id: info.id.into(), enabled: true, parameters: BTreeMap::new(), choice };
        for estimate in &self.estimates {
            let Some(parameter) = info.parameters.iter().find(|parameter| parameter.name == estimate.name) else { continue };
            let unit = match parameter.unit {
                // Offsets are found in the recording's codes.
                "of the reference" if info.id == effects::dc_offset::ID => reference,
                // Amplitudes of reflectors as they arrive, and the simulator wants them at one metre.
                "recording's unit·m²" => 1.0 / (body_rms * self.range_m(radar)?.powi(2)).max(f64::MIN_POSITIVE),
                _ => 1.0,
            };
            let mut values: Vec<f64> = estimate.values.iter().map(|value| value / unit).collect();
            if !parameter.is_relative() && values.iter().any(|value| !(parameter.least..=parameter.most).contains(value)) {
                return None;
            }
            if info.id == effects::antenna_position::ID {
                // Found of the receivers along x; the operator moves all antennas along all axes.
                let receivers = values.iter().flat_map(|&x| [x, 0.0, 0.0]);
                values = std::iter::repeat_n(0.0, 3 * radar.tx_m.len()).chain(receivers).collect();
            }
            setting.parameters.insert(estimate.name.into(), values);
        }
        if info.parameters.iter().any(|parameter| parameter.name == "reference") {
            setting.parameters.insert("reference".into(), vec![reference]);
        }
        setting.check("effect").is_ok().then_some(setting)
    }
}

impl Candidate {
    /// Of a thing that has a place.
    fn range_m(&self, radar: &Radar) -> Option<f64> {
        let centre = radar.centre_m();
        let of = |at: [f64; 3]| (0..3).map(|axis| (at[axis] - centre[axis]).powi(2)).sum::<f64>().sqrt();
        self.place.position_m.map(of).or(self.place.range_m.map(|[near, far]| 0.5 * (near + far)))
    }
}

impl std::fmt::Debug for Candidate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} p {:.1e} gain {:.1} {:?} {}",
            self.id.unwrap_or(self.behaves_like.words()),
            self.p_value,
            self.nats,
            self.estimates.iter().map(|e| (e.name, &e.values)).collect::<Vec<_>>(),
            self.statement
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(id: &'static str, estimates: Vec<Estimate>) -> Candidate {
        Candidate {
            id: Some(id),
            estimates,
            errs_alike: true,
            look_alikes: vec![effects::tx_leakage::ID],
            statement: "Something.".into(),
            energy: 1.0,
            ..Candidate::new(Behaviour::AdditiveFastTime, Place::at(Stage::Receiver), 1e-9, 30.0)
        }
    }

    #[test]
    fn a_value_beyond_its_operators_bounds_is_not_moved_to_them() {
        let most = effects::info(effects::clock_drift::ID).unwrap().parameters[0].most;
        let setting = |value: f64| {
            let found = candidate(effects::clock_drift::ID, vec![Estimate::normal("relative", value, 1e-3)]);
            found.setting(1.0, 1.0, &Radar::small(4)).map(|setting| setting.parameters["relative"].clone())
        };
        assert_eq!(setting(0.5 * most), Some(vec![0.5 * most]));
        assert_eq!(setting(1.5 * most), None);
    }

    #[test]
    fn what_may_be_of_no_size_has_no_name() {
        let of = |estimates: Vec<Estimate>| candidate(effects::dc_offset::ID, estimates);
        let i = |value: f64| Estimate::list("i", &[value, 0.1], &[1.0, 1.0]);
        let unsure = of(vec![i(0.5), Estimate::normal("q", -0.2, 1.0)]).named_if_sure();
        assert!(unsure.id.is_none() && unsure.look_alikes.is_empty() && unsure.statement.len() > 20);
        assert_eq!(of(vec![i(5.0), Estimate::normal("q", -0.2, 1.0)]).named_if_sure().id, Some(effects::dc_offset::ID));
        assert_eq!(of(vec![]).named_if_sure().id, Some(effects::dc_offset::ID));
    }
}
