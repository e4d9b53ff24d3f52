//! What most ranges share, with its size, its frequency and its correction.

use std::f64::consts::{PI, SQRT_2};
use std::sync::Arc;

use num_complex::Complex64;

use super::bets::{Shared, Spectrum};
use super::course::Course;
use crate::diagnosis::detectors::slow::candidates::{self, Description};
use crate::diagnosis::detectors::slow::field::{PATTERN, Part};
use crate::diagnosis::evidence::Evidence;
use crate::diagnosis::finding::{Candidate, Estimate, Place};
use crate::diagnosis::statistics;
use crate::effects::{self, Stage};

/// Level of the test for white noise: the reports' default false-alarm rate.
const WHITE: f64 = 0.01;

/// The phase, or the gain less one, that the ranges share.
struct Phase {
    /// `[frame · loops + loop]`
    course: Vec<f64>,
    rms: f64,
    /// Coding cost of the course, nats per chirp.
    coding_cost: f64,
    frequency_hz: f64,
    /// Half of the band that holds half of its power.
    width_hz: f64,
    /// Whether it may be independent from chirp to chirp.
    is_white: bool,
}

/// `of_radar`: nothing else but the radar's motion does so.
pub fn candidate(evidence: &Evidence, course: &Course, spectra: &[Spectrum], shared: &Shared, of_radar: bool) -> Candidate {
    let phase = Phase::new(course, spectra, &shared.members);
    let description = match shared.part {
        Part::Gain => phase.of_gain(shared),
        Part::Delay => phase.of_delay(shared),
        _ => phase.of_vibration(evidence, course, shared, of_radar),
    };
    let Phase { course: phases, rms, coding_cost, .. } = phase;
    let loops = course.loops;
    let place = if description.id.is_some() { Place::at(Stage::Scene) } else { candidates::place(shared.part) };
    let (behaves_like, p_value) = (candidates::behaves_like(shared.part), (-shared.log_bets).exp().min(1.0));
    Candidate {
        energy: rms * rms * course.frames as f64 * loops as f64 * evidence.clutter().iter().map(|v| v.norm_sqr()).sum::<f64>(),
        correction: candidates::correction(
            evidence,
            shared.part,
            Arc::new(move |[frame, _, index]| phases[frame * loops + index]),
            coding_cost,
        ),
        ..description.candidate(behaves_like, place, p_value, shared.log_bets)
    }
}

impl Phase {
    fn new(course: &Course, spectra: &[Spectrum], members: &[usize]) -> Self {
        let members: Vec<&Spectrum> = members.iter().map(|&index| &spectra[index]).collect();
        let information: f64 = members.iter().map(|member| member.variance.recip()).sum();
        let count = course.frames * course.loops;
        let mean = |i: usize| members.iter().map(|member| member.course[i] / member.variance).sum::<f64>() / information;
        let measured: Vec<f64> = (0..count).map(mean).collect();
        let is_white = course.white_chance(&measured) > WHITE;
        let phases = course.denoised(&measured, information.recip());
        let values = course.spectrum(&phases);
        // A spectrum has one of two sides.
        let rms = (2.0 * values.iter().map(Complex64::norm_sqr).sum::<f64>() / count as f64).sqrt();
        let ratios = values.iter().map(|value| value.norm_sqr() * information);
        let coding_cost = statistics::learned(ratios.collect::<Vec<f64>>().into_iter()) * values.len() as f64 / count as f64;
        let [low_hz, frequency_hz, high_hz] = quartiles(&course.frequencies_hz(), &values);
        let width_hz = (0.5 * (high_hz - low_hz)).max(0.5 / course.duration_s());
        Self { course: phases, rms, coding_cost, frequency_hz, width_hz, is_white }
    }

    fn of_gain(&self, shared: &Shared) -> Description {
        let decibel = 20.0 * self.rms.ln_1p() / std::f64::consts::LN_10;
        Description::unnamed(format!(
            "The gain of all static returns varies alike, by {decibel:.2} dB (standard deviation); {}.",
            ranges(shared)
        ))
    }

    fn of_delay(&self, shared: &Shared) -> Description {
        let at_3_m = self.rms * candidates::stated_delay_s();
        Description::unnamed(format!(
            "The phase of the static returns varies in proportion to their delay, by {at_3_m:.4} rad (standard deviation) at 3 m; {}.",
            ranges(shared)
        ))
    }

    /// A vibration has a frequency: what has all of them alike is no more than a phase that fluctuates.
    fn of_vibration(&self, evidence: &Evidence, course: &Course, shared: &Shared, of_radar: bool) -> Description {
        let Self { rms, frequency_hz, width_hz, is_white, .. } = *self;
        let observed = format!("The phases of all static returns fluctuate together, by {rms:.4} rad (standard deviation)");
        if is_white {
            return Description::unnamed(format!("{observed}, perhaps independently from chirp to chirp; {}.", ranges(shared)));
        }
        let alias = if course.even {
            String::new()
        } else {
            format!(" (or that beside a multiple of {:.2} Hz, the rate of the frames)", course.frame_s.recip())
        };
        let observed = format!("{observed} at {frequency_hz:.2} ± {width_hz:.2} Hz{alias}; {}", ranges(shared));
        if !of_radar {
            return Description::unnamed(format!(
                "{observed}: the radar moves, or its oscillator changes, which the ranges and the transmitters' leakage do not decide."
            ));
        }
        let metres = evidence.radar.wavelength_m() / (4.0 * PI);
        let amplitude_m = SQRT_2 * rms * metres;
        Description {
            id: Some(effects::radar_vibration::ID),
            estimates: vec![
                Estimate::normal("amplitude_m", amplitude_m, amplitude_m * PATTERN),
                Estimate::normal("frequency_hz", frequency_hz, width_hz),
            ],
            statement: format!(
                "{observed}: the radar itself vibrates, by {:.1} µm along its boresight (standard deviation).",
                1e6 * rms * metres
            ),
        }
    }
}

fn ranges(shared: &Shared) -> String {
    format!("{} of the {} informative ranges share it", shared.sharing, shared.informative)
}

/// Frequencies below which a quarter, half and three quarters of a spectrum's power lie.
fn quartiles(frequencies_hz: &[f64], values: &[Complex64]) -> [f64; 3] {
    let mut powers: Vec<(f64, f64)> = frequencies_hz.iter().copied().zip(values.iter().map(Complex64::norm_sqr)).collect();
    powers.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = powers.iter().map(|(_, power)| power).sum();
    [0.25, 0.5, 0.75].map(|share| {
        let mut sum = 0.0;
        let below = |&&(_, power): &&(f64, f64)| {
            sum += power;
            sum < share * all
        };
        let count = powers.iter().take_while(below).count();
        powers[count.min(powers.len() - 1)].0
    })
}
