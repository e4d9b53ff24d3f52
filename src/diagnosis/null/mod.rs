//! Is anything missing at all? One p-value for a recording, uniform where nothing is.
//!
//! Suspects give bounds: each counts whatever it looked at, says nothing where nothing is worth a word, and many say the same. Their
//! smallest corrected bound is valid and far from uniform. So most of the chance of a false alarm goes to three tests that always have
//! something to say, on disjoint parts of the recording, none of which asks for an effect of the library by name:
//! - beside body and room, for power beyond the noise's ([`scan`]);
//! - of the body along the chirp, for a gain or a phase that no ranges make;
//! - of the body between receivers, for phases that no directions make.
//!
//! The last two are score tests of speckle, in which phases, amplitudes and errors of the predicted ranges and directions are free.
//! Where nothing is missing all three are uniform and independent; the smallest of so many is made uniform again by Šidák's formula, and
//! combined with the suspects' bound by Bonferroni's, with shares.

mod scan;

use serde::{Deserialize, Serialize};

use super::Evidence;
use super::statistics::corrected;
use super::suspects::{geometry, waveform};

/// Share of the suspects in the chance of a false alarm.
const SUSPECTS: f64 = 0.05;

/// Chances that recordings with nothing missing look as odd as this one; none where it cannot be asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Null {
    /// Beside body and room: in all frames, in those that the noise's levels come from, and in those held out.
    pub beside: Option<f64>,
    pub beside_training: Option<f64>,
    pub beside_held_out: Option<f64>,
    /// Of the body along the chirp, and between receivers.
    pub along_chirp: Option<f64>,
    pub between_receivers: Option<f64>,
    /// That the strongest suspicion would be as strong: a bound.
    pub suspicion: Option<f64>,
}

impl Null {
    /// All but the suspicion. `seed`: of the draws.
    pub fn of(evidence: &Evidence, seed: u64) -> Self {
        let scanned = scan::scan(evidence, seed);
        Self {
            beside: scanned.map(|chances| chances.all),
            beside_training: scanned.map(|chances| chances.training),
            beside_held_out: scanned.map(|chances| chances.held_out),
            along_chirp: waveform::along::chance(evidence),
            between_receivers: geometry::chance(evidence),
            suspicion: None,
        }
    }

    /// Of all together. None where nothing was asked.
    pub fn p_value(&self) -> Option<f64> {
        let tests: Vec<f64> = [self.beside, self.along_chirp, self.between_receivers].into_iter().flatten().collect();
        let smallest = tests.iter().copied().reduce(f64::min).map(|smallest| corrected(smallest, tests.len() as f64));
        match (smallest, self.suspicion) {
            (Some(tests), Some(suspicion)) => Some((tests / (1.0 - SUSPECTS)).min(suspicion / SUSPECTS).min(1.0)),
            (one, other) => one.or(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tests_have_most_of_the_chance_and_the_suspects_a_twentieth() {
        let null = Null { beside: Some(0.5), along_chirp: Some(0.1), suspicion: Some(1.0), ..Null::default() };
        assert!((null.p_value().unwrap() - 0.19 / 0.95).abs() < 1e-12);
        assert!((Null { suspicion: Some(1e-6), ..null }.p_value().unwrap() - 2e-5).abs() < 1e-18);
        assert_eq!(Null { suspicion: Some(0.3), ..Null::default() }.p_value(), Some(0.3));
        assert_eq!(Null { beside: Some(0.999), suspicion: Some(1.0), ..Null::default() }.p_value(), Some(1.0));
        assert_eq!(Null::default().p_value(), None);
    }
}
