//! Scales of axes, and the numbers that stand at them.

use std::ops::Range;

use plotters::coord::ranged1d::{BoldPoints, DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;

use super::tick;

/// How an axis maps its values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    #[default]
    Linear,
    /// Equal steps for equal ratios; only positive values have a place.
    Log,
    /// The same for counts that begin at zero: the place of n is log(1 + n).
    LogOfCounts,
}

/// Steps of a linear axis, at most.
const MOST_TICKS: usize = 11;
/// Fewer than these say too little: linear steps take their place.
const FEWEST_TICKS: usize = 3;
/// Decades up to which 2 and 5 are written, too.
const FEW_DECADES: f64 = 2.0;

impl Scale {
    /// Along the axis; not finite where the scale has no place.
    pub fn place(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log => value.log10(),
            Self::LogOfCounts => value.ln_1p() / std::f64::consts::LN_10,
        }
    }

    fn value(self, place: f64) -> f64 {
        match self {
            Self::Linear => place,
            Self::Log => 10f64.powf(place),
            Self::LogOfCounts => 10f64.powf(place) - 1.0,
        }
    }

    /// Places between two others at which a number stands.
    fn ticks(self, span: &Range<f64>) -> Vec<f64> {
        let inside = |place: &f64| (span.start - 1e-9..=span.end + 1e-9).contains(place);
        let decades = span.start.floor() as i32..=span.end.ceil() as i32;
        let within = |factors: &[f64]| -> Vec<f64> {
            let of = |decade: i32| factors.iter().map(move |factor| f64::from(decade) + factor.log10());
            decades.clone().flat_map(of).filter(inside).collect()
        };
        let ticks = match self {
            Self::Linear => vec![],
            Self::Log if span.end - span.start <= FEW_DECADES => within(&[1.0, 2.0, 5.0]),
            Self::Log => within(&[1.0]),
            Self::LogOfCounts => {
                let doubled = std::iter::successors(Some(1.0), |count| Some(2.0 * count));
                let counts = std::iter::once(0.0).chain(doubled).map(|count| self.place(count));
                counts.take_while(|place| *place <= span.end + 1e-9).filter(inside).collect()
            }
        };
        if ticks.len() >= FEWEST_TICKS {
            return ticks;
        }
        let values = self.value(span.start)..self.value(span.end);
        let steps = RangedCoordf64::from(values).key_points(BoldPoints(MOST_TICKS));
        steps.into_iter().map(|value| self.place(value)).filter(inside).collect()
    }

    /// An axis between two places, with its ticks.
    pub(super) fn axis(self, span: Range<f64>) -> Ticked {
        Ticked { ticks: self.ticks(&span), places: span.into() }
    }

    /// What is written at a place.
    pub(super) fn label(self, place: f64) -> String {
        let value = self.value(place);
        match self {
            Self::Linear => tick(&value),
            Self::LogOfCounts => tick(&value.round()),
            Self::Log if (1e-3 - 1e-9..1e6 - 1e-3).contains(&value) => tick(&value),
            // Powers of ten, where a plain number would be long.
            Self::Log => {
                let power = (place + 1e-9).floor();
                let mantissa = tick(&(value / 10f64.powf(power)));
                let times = if mantissa == "1" { String::new() } else { format!("{mantissa}·") };
                format!("{times}10^{}", tick(&power))
            }
        }
    }
}

/// Places between two others, with the ticks that a scale gives them.
pub(super) struct Ticked {
    places: RangedCoordf64,
    ticks: Vec<f64>,
}

impl Ranged for Ticked {
    type ValueType = f64;
    type FormatOption = DefaultFormatting;

    fn map(&self, place: &f64, limit: (i32, i32)) -> i32 {
        self.places.map(place, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { vec![] } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.places.range()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, span: Range<f64>) -> Vec<String> {
        scale.ticks(&span).into_iter().map(|place| scale.label(place)).collect()
    }

    #[test]
    fn numbers_stand_where_their_scale_has_them() {
        assert_eq!(labels(Scale::Linear, 0.0..1.0)[..3], ["0", "0.1", "0.2"]);
        assert_eq!(labels(Scale::Log, 0.0..1.5), ["1", "2", "5", "10", "20"]);
        assert_eq!(labels(Scale::Log, -1.0..3.0), ["0.1", "1", "10", "100", "1000"]);
        assert_eq!(labels(Scale::Log, 4.0..5.0), ["10k", "20k", "50k", "100k"]);
        assert_eq!(labels(Scale::Log, 7.0..8.0), ["10^7", "2·10^7", "5·10^7", "10^8"]);
        assert_eq!(labels(Scale::Log, -9.0..-4.0)[..2], ["10^−9", "10^−8"]);
        let places = |low: f64, high: f64| Scale::LogOfCounts.place(low)..Scale::LogOfCounts.place(high);
        assert_eq!(labels(Scale::LogOfCounts, places(0.0, 9.0)), ["0", "1", "2", "4", "8"]);
        assert_eq!(labels(Scale::LogOfCounts, places(600.0, 5000.0)), ["1024", "2048", "4096"]);
        assert!(!Scale::Log.place(0.0).is_finite() && Scale::LogOfCounts.place(0.0) == 0.0);
    }

    #[test]
    fn short_spans_have_numbers_too() {
        assert_eq!(labels(Scale::Log, 3f64.log10()..4.2f64.log10())[..2], ["3", "3.2"]);
        for (scale, low, high) in [(Scale::Log, 5200.0, 9800.0), (Scale::LogOfCounts, 130.0, 200.0), (Scale::Log, 2e-5, 4e-5)] {
            let labels = labels(scale, scale.place(low)..scale.place(high));
            assert!(labels.len() >= FEWEST_TICKS, "{scale:?} {low} to {high}: {labels:?}");
        }
    }
}
