//! Is anything missing at all? One p-value for a recording, uniform where nothing is.
//!
//! Detectors give bounds: each counts whatever it looked at, says nothing where nothing is worth a word, and many say the same. Their
//! smallest corrected bound is far from uniform. Three tests always have something to say, on disjoint parts of the recording, and none
//! of them asks for one effect of the library:
//! - beside body and room, for power beyond the noise's (`scan.rs`);
//! - of the body along the chirp, for a gain or a phase that no ranges make;
//! - of the body between receivers, for phases that no directions make.
//!
//! The last two are score tests of speckle, in which phases, amplitudes and errors of the predicted ranges and directions are free.
//! Where nothing is missing all three are uniform and independent. The detectors' bound is made a fourth one by its own law on nulls, which
//! was measured; the smallest of all is made uniform again as Šidák's formula does it.

mod scan;

use serde::{Deserialize, Serialize};

use super::Evidence;
use super::detectors::{geometry, waveform};
use super::statistics::corrected;

/// Share of nulls in which any detector has a bound below one, and the power of the bound that its chance falls with: by maximum
/// likelihood from 368 nulls of practice, of which 34 had one. Chances below a hundredth are that law carried on.
const BOUNDED: f64 = 0.09;
const FALLS: f64 = 0.2;

/// Probabilities of statistics at least as extreme where nothing is missing; none where it cannot be asked.
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
    /// Of the most significant detector: a bound.
    #[serde(rename = "suspicion")]
    pub bound: Option<f64>,
}

impl Null {
    /// All but the bound. `seed`: of the draws.
    pub fn of(evidence: &Evidence, seed: u64) -> Self {
        let scanned = scan::scan(evidence, seed);
        Self {
            beside: scanned.map(|chances| chances.all),
            beside_training: scanned.map(|chances| chances.training),
            beside_held_out: scanned.map(|chances| chances.held_out),
            along_chirp: waveform::along::chance(evidence),
            between_receivers: geometry::chance(evidence),
            bound: None,
        }
    }

    /// With what nothing was fitted to alone of what is beside the body.
    pub fn of_held_out(self) -> Self {
        Self { beside: self.beside_held_out, ..self }
    }

    /// Of all together. None where nothing was asked.
    pub fn p_value(&self) -> Option<f64> {
        let tests: Vec<f64> = [self.beside, self.along_chirp, self.between_receivers].into_iter().flatten().collect();
        let smallest = tests.iter().copied().reduce(f64::min);
        let found = self.bound.map(|bound| if bound < 1.0 { BOUNDED * bound.powf(FALLS) } else { 1.0 });
        let (Some(smallest), Some(found)) = (smallest, found) else { return smallest.or(found) };
        // All of the tests are larger, and so is what the detectors find, if anything.
        let least = smallest.min(found);
        let tests_are_larger = 1.0 - corrected(least, tests.len() as f64);
        Some((1.0 - tests_are_larger * (1.0 - least.min(BOUNDED))).clamp(least, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn the_smallest_of_all_counts() {
        let null = Null { beside: Some(0.5), along_chirp: Some(0.1), bound: Some(1.0), ..Null::default() };
        assert!((null.p_value().unwrap() - (1.0 - 0.91 * 0.81)).abs() < 1e-12);
        let found = BOUNDED * 1e-12f64.powf(FALLS);
        let of_three = Null { bound: Some(1e-12), ..null }.p_value().unwrap();
        assert!(of_three > 2.99 * found && of_three < 3.0 * found);
        assert_eq!(Null { bound: Some(1.0), ..Null::default() }.p_value(), Some(1.0));
        assert_eq!(Null::default().p_value(), None);
        assert_eq!(Null { bound: Some(0.0), ..null }.p_value(), Some(0.0));
    }

    #[test]
    fn it_is_uniform_where_its_parts_are_what_they_should_be() {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut uniform = || random.random::<f64>();
        let mut null = || {
            let bound = if uniform() < BOUNDED { uniform().powf(1.0 / FALLS) } else { 1.0 };
            let [beside, along_chirp, between_receivers] = [(); 3].map(|()| Some(uniform()));
            Null { beside, along_chirp, between_receivers, bound: Some(bound), ..Null::default() }.p_value().unwrap()
        };
        let values: Vec<f64> = (0..20_000).map(|_| null()).collect();
        for level in [0.001, 0.01, 0.05, 0.2, 0.5, 0.9] {
            let below = values.iter().filter(|value| **value < level).count() as f64;
            let (mean, deviation) = (20_000.0 * level, (20_000.0 * level * (1.0 - level)).sqrt());
            assert!((below - mean).abs() < 4.0 * deviation, "{below} below {level}");
        }
    }
}
