//! Platform vibration before returns from many directions: each range cell's phasor is a sum over directions,
//! which change by different amounts, so that what the cells share is not their deviation but its course in time. One
//! sinusoid with a pattern over channels and ranges that is free, in cells where the body cannot be.

mod amplitude;
mod cells;
mod sums;
mod undo;

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::climb::climb;
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Correction, Estimate, NINETY, Place};
use crate::diagnosis::statistics::{UNDECIDED, chi2_tail, corrected, deviation_at_top};
use crate::effects::{self, Stage};

use amplitude::amplitude;
use cells::Cells;
use undo::undo;

/// Share of what a sinusoid explains whose phase is the same everywhere; half of what turns one way.
const LIKENESS: f64 = 0.75;
/// Teeth of the comb of aliases to either side.
const TEETH: i32 = 4;
/// No mount of a radar vibrates faster with an amplitude that is measurable.
const HIGHEST_HZ: f64 = 300.0;

/// Numbers of a vibration along the boresight.
struct Measured {
    amplitude_m: f64,
    amplitude_deviation_m: f64,
    frequency_hz: f64,
    frequency_deviation_hz: f64,
    p_value: f64,
    gain: f64,
}

pub fn find(evidence: &Evidence) -> Option<Candidate> {
    let cells = Cells::new(evidence)?;
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let duration_s = cells.time_s(*training.last()?, cells.loops - 1) - cells.time_s(training[0], 0);
    // What is slower than the recording is a drift.
    let (lowest, highest) = (1.5 / duration_s, HIGHEST_HZ.min(0.5 / cells.loop_s));
    let step = 0.25 / duration_s;
    let strongest = cells.strongest();
    let gain = |frequency: f64| {
        if (lowest..=highest).contains(&frequency) {
            cells.fit(training, frequency, |cell| strongest[cell]).gain
        } else {
            f64::NEG_INFINITY
        }
    };
    let refined = |frequency: f64| climb(gain, frequency, 0.5 * step, 0.01 * step);
    let count = ((highest - lowest) / step).max(0.0) as usize;
    let tried =
        (0..count).into_par_iter().map(|index| lowest + index as f64 * step).map(|frequency| (frequency, gain(frequency)));
    let first = refined(tried.max_by(|a, b| a.1.total_cmp(&b.1))?.0);
    // Gaps between frames make a comb of nearly equal peaks, a frame rate apart; the grid may have missed its top.
    let frame_rate = 1.0 / (cells.time_s(1, 0) - cells.time_s(0, 0));
    let teeth: Vec<(f64, f64)> = (-TEETH..=TEETH).map(|k| refined(first.0 + f64::from(k) * frame_rate)).collect();
    let top = teeth.iter().map(|tooth| tooth.1).fold(first.1, f64::max);
    // Of those that the short frames cannot tell apart, the slowest.
    let alike = teeth.into_iter().chain([first]).filter(|tooth| tooth.1 > top - UNDECIDED);
    let (frequency, top) = alike.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let vibration = cells.fit(training, frequency, |_| true);
    let found = cells.held_out(held_out, &vibration);
    let p_value = corrected(chi2_tail(2.0 * vibration.gain, 2.0 * vibration.values), 4.0 * (highest - lowest) * duration_s);
    if found <= 0.0 || vibration.likeness < LIKENESS {
        return None;
    }
    let (radians, deviation) = amplitude(evidence, &cells, &vibration)?;
    let frequency_deviation = deviation_at_top(gain, frequency, top, 0.1 * step).unwrap_or(step);
    let metres = evidence.radar.wavelength_m() / (2.0 * TAU);
    let measured = Measured {
        amplitude_m: radians.abs() * metres,
        amplitude_deviation_m: deviation * metres,
        frequency_hz: frequency,
        frequency_deviation_hz: frequency_deviation,
        p_value,
        gain: found,
    };
    Some(measured.candidate(undo(evidence, &cells, &vibration, radians)))
}

impl Measured {
    fn candidate(&self, (correction, energy): (Correction, f64)) -> Candidate {
        Candidate {
            id: Some(effects::radar_vibration::ID),
            estimates: vec![
                Estimate::normal("amplitude_m", self.amplitude_m, self.amplitude_deviation_m),
                Estimate::normal("frequency_hz", self.frequency_hz, self.frequency_deviation_hz),
            ],
            statement: format!(
                "The phases of all static returns oscillate at {:.2} ± {:.2} Hz, in phase with one another but each with a \
                 strength of its own, as returns from several directions do: the radar itself vibrates, by about {:.1} µm along its \
                 boresight.",
                self.frequency_hz,
                NINETY * self.frequency_deviation_hz,
                1e6 * self.amplitude_m
            ),
            energy,
            correction,
            ..Candidate::new(Behaviour::SlowTimePhase, Place::at(Stage::Scene), self.p_value, self.gain)
        }
    }
}

#[cfg(test)]
mod tests;
