//! Gain and frequency that change along the chirp, estimated from what moves.
//!
//! What one Doppler cell holds of the body is speckle along the chirp, too: a Gaussian field over the chirp's parts whose
//! covariance comes from the ranges of the points in that cell. Parts of the chirp are to ranges what receivers are to
//! directions: wherever the points lie and however they reflect, their power is level over the chirp on average, and their
//! phase straight. A power that falls along all chirps is the transmitter's or the receiver's, and a phase that bends is the
//! chirp's.
//!
//! Errors of the predicted ranges change the covariance by the distance of two parts alone. Such a matrix is the same,
//! conjugated, read from its end: it makes neither gains that are odd about the chirp's middle nor phases that are even. Only these are
//! asked for.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use super::doppler_cells::{Cell, cells, place};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::detectors::clutter::unsteadiness;
use crate::diagnosis::estimated::Estimated;
use crate::diagnosis::finding::{Candidate, Correction, Curve, Estimate, NINETY, Place, Volume};
use crate::diagnosis::power::PowerModel;
use crate::diagnosis::speckle::{Look, groups};
use crate::diagnosis::statistics::{DECIBEL, UNDECIDED, corrected};
use crate::diagnosis::{BodyPrediction, Evidence};
use crate::effects::{self, Stage, legendre};
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// Parts of a chirp, and samples of a part, at least.
const PARTS: [usize; 2] = [16, 8];
const LEAST_SAMPLES: usize = 4;
/// Groups of a frame's Doppler cells that errors are taken from, at most.
const MOST_GROUPS: usize = 6;
/// Share of a cell's power that is independent from part to part: what the prediction does not know of the ranges.
const OWN_SHARE: f64 = 0.005;
/// What errors of the prediction look like: logarithm of the gain at the chirp's end, and radian there.
const TILT_FLOOR: f64 = 0.1 / (2.0 * DECIBEL);
const BEND_FLOOR: f64 = 0.01;
/// The same for a test of whether anything is there, which must be uniform where nothing is.
const FLOORS: [f64; 2] = [2.0 * TILT_FLOOR, 0.5 * BEND_FLOOR];
/// Chance below which a finer shape is there, and its size against the bend's from which on it is another thing.
const UNLIKELY: f64 = 1e-3;
const LARGE: f64 = 0.5;
/// Largest deviation from a straight ramp over its part of second order: of that part alone, and of parabolas with more or less of a
/// third order.
const PEAK: [f64; 3] = [1.0, 1.45, 1.55];
/// A tilt, a bend, and one that changes.
const LOOKS: f64 = 3.0;
/// Beyond, nothing is reported: nepers or radian at the chirp's end.
const LARGEST: f64 = 3.0;

/// The numbers. Logarithm of the gain at the chirp's end that is odd about its middle; radian there, at the body's mean delay, of
/// the phase of second and of fourth order; and of what changes from the first frame to the last. All others are errors of the
/// prediction.
const TILT: usize = 0;
const BEND: usize = 1;
const FINER: usize = 2;
const TREND: usize = 3;
const NUMBERS: usize = 9;

/// At most one candidate: a gain that falls along all chirps, or a ramp that bends. None without quadrature or without a tracked
/// body.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let Some((model, body)) = evidence.power().zip(evidence.body.as_ref()) else { return vec![] };
    if evidence.is_real() {
        return vec![];
    }
    let Some(chirps) = Chirps::new(evidence, model, body) else { return vec![] };
    let first = chirps.looks(0.0, [0.0; 2]);
    let mut found = vec![];
    if evidence.may_name(effects::chirp_droop::ID) {
        // What transmits tires; nothing gains power along a chirp.
        let falls = |found: &Estimated| found.values[0] < 0.0;
        found.extend(
            chirps.converged(&first, &[TILT]).filter(falls).map(|found| (found.likelihood, chirps.droop(evidence, &found))),
        );
    }
    if evidence.may_name(effects::chirp_nonlinearity::ID) {
        let once = chirps.converged(&first, &[BEND]);
        let constant = once.as_ref().map(|once| (once.likelihood, chirps.bend(evidence, once)));
        let unsteady = |then: &Evidence| unsteadiness(&then.cube, evidence.noise());
        // To read a chirp between its samples lowers their noise, with either bend alike.
        let before = || constant.as_ref().map_or_else(|| unsteady(evidence), |(_, bend)| unsteady(&evidence.with(bend)));
        let more = |changing: &Estimated| changing.likelihood - once.as_ref().map_or(0.0, |once| once.likelihood);
        let changing = chirps
            .converged(&first, &[BEND, TREND])
            .filter(|changing| more(changing) > UNDECIDED)
            // A synthesiser warms up; none bends its ramp the other way meanwhile.
            .filter(|changing| changing.values[1].abs() < changing.values[0].abs())
            .map(|changing| (more(&changing), changing.likelihood, chirps.bend(evidence, &changing)))
            // What changes for the body changes for static clutter, too.
            .filter(|(more, _, bend)| unsteady(&evidence.with(bend)) - before() < *more)
            .map(|(_, likelihood, bend)| (likelihood, bend));
        found.extend(changing.or(constant));
    }
    found.retain(|(_, candidate)| candidate.p_value < 1e-2 && candidate.nats > 0.0);
    // Either leaves a little of the other.
    found.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, candidate)| candidate).into_iter().collect()
}

/// Chance that a body whose gain and phase nothing changes along the chirp looks as uneven. None without a body that is observed at
/// a sufficient SNR.
pub fn chance(evidence: &Evidence) -> Option<f64> {
    if evidence.is_real() {
        return None;
    }
    let chirps = Chirps::new(evidence, evidence.power()?, evidence.body.as_ref()?)?;
    let looks = chirps.looks(0.0, [0.0; 2]);
    Some(Estimated::new(&looks, &DVector::zeros(2), &directions(&[TILT, BEND]), &FLOORS)?.p_value)
}

/// Some of the numbers alone, `[number, direction]`.
fn directions(numbers: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(NUMBERS, numbers.len(), |row, column| f64::from(u8::from(row == numbers[column])))
}

/// All chirps' Doppler cells that the body fills.
struct Chirps {
    /// `[frame][group][cell]`
    frames: Vec<Vec<Vec<Cell>>>,
    parts: usize,
    /// Mean over the body.
    delay_s: f64,
}

impl Chirps {
    fn new(evidence: &Evidence, model: &PowerModel, body: &BodyPrediction) -> Option<Self> {
        let [frames, _, _, _, samples] = evidence.cube.dims;
        let parts = PARTS.into_iter().find(|parts| samples / parts >= LEAST_SAMPLES)?;
        let mut cells: Vec<Vec<Cell>> =
            (0..frames).into_par_iter().map(|frame| cells(evidence, model, body, frame, parts)).collect();
        let delays = || cells.iter().flatten().map(|cell| cell.delay);
        let delay_s = delays().sum::<f64>() / delays().count().max(1) as f64;
        if delay_s <= 0.0 {
            return None;
        }
        cells.iter_mut().flatten().for_each(|cell| cell.delay /= delay_s);
        let frames = cells
            .into_iter()
            .map(|cells| {
                let count = cells.len().min(MOST_GROUPS);
                groups(cells, count)
            })
            .collect();
        Some(Self { frames, parts, delay_s })
    }

    /// Place of a part over the chirp.
    fn along(&self, part: usize) -> f64 {
        place(part, self.parts)
    }

    /// Place of a frame, −1 to 1 over the recording.
    fn during(&self, frame: usize) -> f64 {
        2.0 * frame as f64 / (self.frames.len() as f64 - 1.0).max(1.0) - 1.0
    }

    /// With a tilt, and a bend with its trend; by frame and group.
    fn looks(&self, tilt: f64, bend: [f64; 2]) -> Vec<Vec<Look>> {
        let free = directions(&(TREND + 1..NUMBERS).collect::<Vec<usize>>());
        let of = |(frame, groups): (usize, &Vec<Vec<Cell>>)| {
            let look = |cells: &Vec<Cell>| {
                let mut look = Look::new(NUMBERS, None);
                let during = self.during(frame);
                cells.iter().for_each(|cell| self.add(&mut look, cell, during, tilt, bend[0] + bend[1] * during));
                look.without(&free)
            };
            groups.iter().map(look).collect()
        };
        self.frames.par_iter().enumerate().map(of).collect()
    }

    fn add(&self, look: &mut Look, cell: &Cell, during: f64, tilt: f64, bend: f64) {
        let own = OWN_SHARE * cell.expected[0].re;
        let shape = DMatrix::from_fn(self.parts, self.parts, |i, j| {
            let value = cell.expected[i.abs_diff(j)] * (1.0 - OWN_SHARE);
            if i == j {
                value + own
            } else if i > j {
                value
            } else {
                value.conj()
            }
        });
        let undo = DVector::from_fn(self.parts, |part, _| {
            let x = self.along(part);
            Complex64::from_polar((-tilt * x).exp(), -bend * cell.delay * legendre(2, x))
        });
        let observed: Vec<DVector<Complex64>> = cell.observed.iter().map(|observed| observed.component_mul(&undo)).collect();
        look.add(shape, &observed, |body| {
            let by = |degree: usize, size: f64, gain: bool| {
                let at = |part: usize| size * legendre(degree, self.along(part));
                DMatrix::from_fn(self.parts, self.parts, |i, j| {
                    body[(i, j)] * if gain { Complex64::from(at(i) + at(j)) } else { Complex64::I * (at(i) - at(j)) }
                })
            };
            let delay = cell.delay;
            vec![
                by(1, 1.0, true),
                by(2, delay, false),
                by(4, delay, false),
                by(2, delay * during, false),
                by(0, 1.0, true),
                by(2, 1.0, true),
                by(1, delay, false),
                by(3, delay, false),
                by(5, delay, false),
            ]
        });
    }

    /// Some of the numbers, from the tilt or the bend on. `first`: looks without any.
    fn converged(&self, first: &[Vec<Look>], numbers: &[usize]) -> Option<Estimated> {
        let looks = |at: &DVector<f64>| match numbers {
            [TILT] => self.looks(at[0], [0.0; 2]),
            _ => self.looks(0.0, [at[0], at.get(1).copied().unwrap_or(0.0)]),
        };
        let floors: Vec<f64> = numbers.iter().map(|&number| if number == TILT { TILT_FLOOR } else { BEND_FLOOR }).collect();
        Estimated::converged(first, &directions(numbers), &floors, |at| (at.amax() <= LARGEST).then(|| looks(at)))
    }

    fn droop(&self, evidence: &Evidence, found: &Estimated) -> Candidate {
        let samples = evidence.cube.dims[4] as f64;
        // From the first sample to the last.
        let db = -2.0 * DECIBEL * found.values[0];
        let deviation = 2.0 * DECIBEL * found.deviation(&DVector::from_element(1, 1.0));
        let total: f64 = evidence.cube.samples.iter().map(|value| value.norm_sqr()).sum();
        Candidate {
            id: Some(effects::chirp_droop::ID),
            estimates: vec![Estimate::normal("db", db, deviation)],
            errs_alike: true,
            statement: format!(
                "the power falls by {db:.2} dB from the first to the last sample of every chirp, whatever is seen",
            ),
            energy: total * (db / DECIBEL).powi(2) / 12.0,
            correction: Correction::inverse(Volume::BY_SAMPLE, move |cube| {
                cube.each_chirp(|_, chirp| {
                    chirp.iter_mut().enumerate().for_each(|(n, value)| {
                        *value *= 10f64.powf(db * (n as f64 / samples - 0.5) / 20.0);
                    });
                });
            }),
            ..Candidate::new(Behaviour::FastTimeGain, Place::at(Stage::Receiver), corrected(found.p_value, LOOKS), found.nats)
        }
    }

    fn bend(&self, evidence: &Evidence, found: &Estimated) -> Candidate {
        let [bend, trend] = [0, 1].map(|index| found.values.get(index).copied().unwrap_or(0.0));
        let named = found.values.len() == 1 && self.is_finer(bend, trend) != Some(true);
        let of_frequency = 1.0 / (TAU * self.delay_s);
        let mut first = DVector::zeros(found.values.len());
        first[0] = 1.0;
        let (second_hz, deviation_hz) = (bend * of_frequency, found.deviation(&first) * of_frequency);
        let peak = peak_hz(second_hz, deviation_hz);
        let usual = peak.values[0];
        let total: f64 = evidence.cube.samples.iter().map(|value| value.norm_sqr()).sum();
        let samples = evidence.radar.samples_per_chirp;
        let at: Vec<f64> = (0..samples).map(|n| place(n, samples)).collect();
        let range_m = 0.5 * self.delay_s * SPEED_OF_LIGHT;
        let place = Place::at(Stage::Waveform);
        Candidate {
            id: named.then_some(effects::chirp_nonlinearity::ID),
            estimates: if named { vec![peak] } else { vec![] },
            errs_alike: true,
            statement: format!(
                "The chirp's ramp is not straight: its frequency bends by {:.0} kHz along the chirp, which smears what is at \
                 {range_m:.1} m by {:.2} radian, and what is farther more.{}",
                1e-3 * usual.abs(),
                bend.abs(),
                match (named, found.values.len()) {
                    (true, _) => String::new(),
                    (false, 1) => " But it is no simple bend.".into(),
                    (false, _) => {
                        let [first, last] = [bend - trend, bend + trend].map(|value| 1e-3 * PEAK[1] * value * of_frequency);
                        format!(" It is not the same in all frames: {first:.0} kHz in the first one, {last:.0} in the last.")
                    }
                }
            ),
            curve: Some(Curve::new(
                "Deviation of the frequency from a straight ramp",
                ["sample", "kHz"],
                [(
                    "fitted",
                    (0..at.len()).map(|n| n as f64).collect(),
                    at.iter().map(|&x| 1e-3 * second_hz * legendre(2, x)).collect(),
                )],
            )),
            energy: total * (bend * bend + trend * trend / 3.0) / 5.0,
            correction: self.straightened(&evidence.radar, at, bend, trend),
            ..Candidate::new(Behaviour::DelayProportionalPhase, place, corrected(found.p_value, LOOKS), found.nats)
        }
    }

    /// Whether another shape than one bend is there.
    fn is_finer(&self, bend: f64, trend: f64) -> Option<bool> {
        let at = DVector::from_column_slice(&[bend, 0.0]);
        let both = Estimated::new(&self.looks(0.0, [bend, trend]), &at, &directions(&[BEND, FINER]), &[BEND_FLOOR; 2])?;
        let chance = both.chance(&DMatrix::from_column_slice(2, 1, &[0.0, 1.0]));
        Some(chance < UNLIKELY && both.values[1].abs() > LARGE * both.values[0].abs())
    }

    /// `at`: places of the samples over the chirp.
    fn straightened(&self, radar: &Radar, at: Vec<f64>, bend: f64, trend: f64) -> Correction {
        let of_frequency = 1.0 / (TAU * self.delay_s);
        let samples_per_hz = radar.sample_rate_hz / radar.slope_hz_per_s;
        let by_frame: Vec<f64> = (0..self.frames.len()).map(|frame| bend + trend * self.during(frame)).collect();
        Correction::samples(move |cube| {
            let shifts: Vec<Vec<f64>> = by_frame
                .iter()
                .map(|bend| at.iter().map(|&x| bend * of_frequency * samples_per_hz * legendre(2, x)).collect())
                .collect();
            cube.each_chirp(|[frame, ..], chirp| straighten(chirp, &shifts[frame]));
        })
    }
}

/// Largest deviation from a straight ramp by its part of second order.
fn peak_hz(second_hz: f64, deviation_hz: f64) -> Estimate {
    // The curve's form decides how far it leaves the straight ramp.
    let ends = PEAK.map(|peak| peak * second_hz.abs());
    let usual = ends[1] * second_hz.signum();
    let reserve = NINETY * deviation_hz * PEAK[1];
    let [low, high] = [ends[0] - reserve, ends[2] + reserve].map(|end| end * second_hz.signum());
    Estimate { name: "peak_hz", values: vec![usual], ci90: vec![[low.min(high), low.max(high)]] }
}

/// Reads a chirp earlier by so many samples each: by polynomials through its neighbours, fewer near the ends.
fn straighten(chirp: &mut [Complex64], earlier: &[f64]) {
    /// Neighbours on either side.
    const TAPS: usize = 4;
    let last = chirp.len() - 1;
    // Beat frequencies of a quadrature receiver are positive: about zero they are slow.
    let turn = -0.25 * TAU;
    let turned: Vec<Complex64> = chirp.iter().enumerate().map(|(n, value)| value * Complex64::cis(turn * n as f64)).collect();
    for (n, value) in chirp.iter_mut().enumerate() {
        let at = (n as f64 - earlier[n]).clamp(0.0, last as f64);
        let before = (at as usize).min(last.saturating_sub(1));
        let taps = TAPS.min(before + 1).min(last - before);
        let places: Vec<usize> = (before + 1 - taps..=before + taps).collect();
        let weight = |i: usize| -> f64 {
            let others = places.iter().filter(|&&j| j != i);
            others.map(|&j| (at - j as f64) / (i as f64 - j as f64)).product()
        };
        let sum: Complex64 = places.iter().map(|&i| turned[i] * weight(i)).sum();
        *value = sum * Complex64::cis(-turn * at);
    }
}

#[cfg(test)]
#[path = "along_tests.rs"]
mod tests;
