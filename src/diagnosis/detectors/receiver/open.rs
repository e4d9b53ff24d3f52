//! Receiver fields of recordings whose room is unknown, or without quadrature: an offset, a leakage that dwarfs what is
//! near. Without a room, only what stands out by its shape can be named.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::additive_term::{added, digits, gain};
use super::support::{powers, range_m, ranges_m, tone};
use super::transient::{self, NEAR_M};
use super::zero_beat::ZeroBeat;
use crate::diagnosis::evidence::hann;
use crate::diagnosis::finding::{Candidate, Estimate, Place};
use crate::diagnosis::statistics::{chi2_tail, corrected, decibels};
use crate::diagnosis::{Evidence, denoised};
use crate::effects::{self, Stage};

/// Depth of the valley behind it.
const VALLEY_DB: f64 = 10.0;
const ZERO_PADDING: usize = 4;
/// Noise, over the signal, that keeps a covariance well conditioned where a recording has none.
const LEAST_NOISE: f64 = 1e-9;

/// Level of the test that what is near differs between the channels as reflectors do; customary (Fisher 1925).
const SIGNIFICANCE: f64 = 0.05;

/// Candidates of the first of these that is significant: transients at a chirp's ends, an offset, a leakage. None where the room
/// bounds the delays and there is quadrature.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    if ranges_m(evidence).is_some() && !evidence.is_real() || evidence.cube.dims[4] < 16 {
        return vec![];
    }
    let samples = evidence.cube.dims[4];
    let clutter: Vec<Vec<Complex64>> = evidence.clutter().chunks_exact(samples).map(<[Complex64]>::to_vec).collect();
    if evidence.may_name(effects::ramp_edge_transient::ID) {
        let edge: Vec<Candidate> =
            [false, true].into_iter().filter_map(|at_end| transient::edge(evidence, &clutter, at_end)).collect();
        let edge: Vec<Candidate> = edge.into_iter().filter(|edge| edge.p_value < 1e-6).collect();
        if !edge.is_empty() {
            return edge;
        }
    }
    if evidence.is_real() && evidence.may_name(effects::dc_offset::ID) {
        let offset = offset(evidence, &clutter);
        if offset.is_some() {
            return offset.into_iter().collect();
        }
    }
    if evidence.may_name(effects::tx_leakage::ID) { leakage(evidence, &clutter).into_iter().collect() } else { vec![] }
}

/// The constant of a converter without quadrature.
fn offset(evidence: &Evidence, clutter: &[Vec<Complex64>]) -> Option<Candidate> {
    let [_, tx, rx, _, samples] = evidence.cube.dims;
    // The window keeps what is near zero, but not at it, from tilting the mean.
    let window = hann(samples);
    let sum: f64 = window.iter().sum();
    let mean = |chirp: &Vec<Complex64>| chirp.iter().zip(&window).map(|(value, w)| value.re * w).sum::<f64>() / sum;
    let values: Vec<f64> =
        (0..rx).map(|receiver| (0..tx).map(|t| mean(&clutter[t * rx + receiver])).sum::<f64>() / tx as f64).collect();
    let rest: Vec<f64> = clutter
        .iter()
        .map(|chirp| {
            let mean = mean(chirp);
            (chirp.iter().map(|value| (value.re - mean).powi(2)).sum::<f64>() / samples as f64).sqrt()
        })
        .collect();
    let smallest = values.iter().fold(f64::INFINITY, |a, b| a.min(b.abs()));
    let swing = rest.iter().fold(0.0f64, |a, &b| a.max(b));
    // A tone near zero beat frequency swings about zero: a constant that is larger than any swing is none.
    if smallest < 2.0 * swing || smallest <= 0.0 {
        return None;
    }
    let term: Vec<Vec<Complex64>> = (0..tx * rx).map(|c| vec![Complex64::from(values[c % rx]); samples]).collect();
    let deviation: Vec<f64> = (0..rx).map(|receiver| rest[receiver]).collect();
    let p_value = corrected((-0.5 * (smallest / swing.max(1e-300)).powi(2) * samples as f64).exp(), 1.0);
    let place = Place { range_m: Some([0.0, 0.0]), ..Place::at(Stage::Receiver) };
    let nats = gain(evidence, &term);
    Some(Candidate {
        id: Some(effects::dc_offset::ID),
        estimates: vec![Estimate::list("i", &values, &deviation), Estimate::list("q", &vec![0.0; rx], &vec![0.0; rx])],
        statement: format!(
            "every sample has a constant of about {} codes added (all receivers within {}), {:.0} times what else stands \
             still: the codes' zero is not the signal's",
            digits(values.iter().sum::<f64>() / rx as f64),
            digits(values.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b)) - values.iter().fold(f64::INFINITY, |a, &b| a.min(b))),
            smallest / swing.max(1e-300)
        ),
        ..added(evidence, term, place, p_value, nats)
    })
}

/// What is nearest in the spectra of mean chirps, apart from what is behind it.
struct Near {
    /// Zero-padded, `[channel][bin]`, and their mean over the channels.
    spectra: Vec<Vec<f64>>,
    mean: Vec<f64>,
    /// Bins of its summit, of the valley behind it, and of the strongest return farther away.
    peak: usize,
    valley: usize,
    far: usize,
    /// Bins from here on are not looked at.
    last: usize,
    bin_m: f64,
    /// Power of the noise in a mean chirp.
    white: f64,
}

impl Near {
    fn find(evidence: &Evidence, clutter: &[Vec<Complex64>]) -> Option<Self> {
        let [_, _, _, loops, samples] = evidence.cube.dims;
        let long = samples * ZERO_PADDING;
        let spectra: Vec<Vec<f64>> = clutter.iter().map(|chirp| powers(chirp, ZERO_PADDING)).collect();
        let mean: Vec<f64> = (0..long).map(|bin| spectra.iter().map(|s| s[bin]).sum::<f64>() / spectra.len() as f64).collect();
        let bin_m = range_m(evidence, evidence.radar.sample_rate_hz / long as f64);
        let near = (NEAR_M / bin_m).floor() as usize;
        let last = if evidence.is_real() { long / 2 } else { long - 4 * ZERO_PADDING };
        if near < 2 || near + 8 >= last {
            return None;
        }
        let best = |range: std::ops::Range<usize>| range.max_by(|&a, &b| mean[a].total_cmp(&mean[b]));
        // A summit: what rises towards farther ranges is the flank of a return there.
        let peak = best(0..near).filter(|&peak| mean[peak] >= mean[peak + 1])?;
        let valley_end = (2.5 * NEAR_M / bin_m) as usize;
        let valley = (peak..valley_end.min(last)).min_by(|&a, &b| mean[a].total_cmp(&mean[b]))?;
        let far = best(valley..last)?;
        let white = evidence.mean_noise() / (loops * evidence.split.training.len()) as f64;
        let found = Self { spectra, mean, peak, valley, far, last, bin_m, white };
        let [at_peak, at_far] = [peak, far].map(|bin| found.mean[bin]);
        let weak = found.depth_db() < VALLEY_DB || at_peak < 0.1 * at_far || decibels(found.over_noise(peak)) < 20.0;
        (!weak).then_some(found)
    }

    fn over_noise(&self, bin: usize) -> f64 {
        self.mean[bin] / self.white.max(1e-300)
    }

    /// Of the valley.
    fn depth_db(&self) -> f64 {
        decibels(self.mean[self.peak] / self.mean[self.valley])
    }

    /// Between the channels, dB.
    fn spread(&self, bin: usize) -> f64 {
        let of_channels = self.spectra.iter().map(|s| s[bin]);
        let (low, high) = of_channels.fold((f64::INFINITY, 0.0f64), |(low, high), s| (low.min(s), high.max(s)));
        decibels(high / low.max(1e-300))
    }

    /// Chance of its spread among those of the reflectors behind it.
    fn as_reflectors(&self) -> f64 {
        // Channels differ at a cell where several reflectors interfere, too: what leaks differs more than they do.
        let reflectors = (self.valley + 1..self.last - 1)
            .filter(|&bin| {
                self.mean[bin] > self.mean[bin - 1]
                    && self.mean[bin] >= self.mean[bin + 1]
                    && decibels(self.over_noise(bin)) >= 20.0
            })
            .map(|bin| self.spread(bin));
        rank_chance(self.spread(self.peak), reflectors)
    }
}

fn leakage(evidence: &Evidence, clutter: &[Vec<Complex64>]) -> Option<Candidate> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let near = Near::find(evidence, clutter)?;
    let range = (near.peak as f64 * near.bin_m).max(0.0);
    let end = near.valley as f64 / ZERO_PADDING as f64;
    let part = near_part(&near.mean, end, near.white, samples, evidence.is_real())?;
    let term: Vec<Vec<Complex64>> =
        clutter.iter().map(|chirp| (&part * DVector::from_column_slice(chirp)).iter().copied().collect()).collect();
    let largest = term.iter().flatten().map(|value| value.norm()).fold(0.0, f64::max);
    let peak_sample = denoised::peak_beside(evidence, |channel, n| Some(term[channel][n]));
    let level_db = 20.0 * (largest / peak_sample.max(1e-300)).log10();
    let resolution = range_m(evidence, evidence.radar.sample_rate_hz / samples as f64);
    let variance = |channel: usize| evidence.noise()[channel] / (loops * evidence.split.training.len()) as f64;
    let beat = ZeroBeat::new(evidence, &term, variance);
    let channels = clutter.len();
    let (near_spread, far_spread) = (near.spread(near.peak), near.spread(near.far));
    // What has less delay than the way between the nearest antennas is a constant, which the library may lack.
    let constant = !evidence.is_real() && beat.may_be_constant() && !beat.may_be_leakage();
    // Without quadrature nothing tells a constant from what turns by less than half a bin.
    let unresolved = evidence.is_real() && 2 * near.peak < ZERO_PADDING;
    let id = (!constant || evidence.may_name(effects::dc_offset::ID)).then_some(effects::tx_leakage::ID);
    let estimates = vec![Estimate::normal("range_m", range, 0.3 * resolution), Estimate::normal("level_db", level_db, 1.0)];
    let p_value = chi2_tail(2.0 * near.over_noise(near.peak) * channels as f64, 2.0 * channels as f64);
    let place = Place { range_m: Some([0.0, near.valley as f64 * near.bin_m]), ..Place::at(Stage::Receiver) };
    let nats = gain(evidence, &term);
    Some(Candidate {
        id,
        estimates: if id.is_some() { estimates } else { vec![] },
        look_alikes: [
            (near.as_reflectors() > SIGNIFICANCE, effects::static_reflector::ID),
            (constant || unresolved, effects::dc_offset::ID),
        ]
        .into_iter()
        .filter_map(|(holds, id)| holds.then_some(id))
        .collect(),
        statement: format!(
            "a strong return {range:.2} m away that never changes, {:.0} dB above the range sidelobes behind it; it differs by \
             {near_spread:.0} dB between the {channels} channels, while the strongest far return ({:.1} m) differs by \
             {far_spread:.0} dB{}",
            near.depth_db(),
            near.far as f64 * near.bin_m,
            match id {
                Some(_) if unresolved => ": the transmitters leak into the receivers, or the codes' zero is not the signal's",
                Some(_) => ": the transmitters leak into the receivers",
                None => "",
            },
        ),
        ..added(evidence, term, place, p_value, nats)
    })
}

/// Of a value as large among others of its law: (1 + those as large) / (1 + all) (Phipson & Smyth 2010).
fn rank_chance(value: f64, others: impl Iterator<Item = f64>) -> f64 {
    let (as_large, all) = others.fold((1.0, 1.0), |(large, all), other| (large + f64::from(u8::from(other >= value)), all + 1.0));
    as_large / all
}

/// The part of a mean chirp that comes from beat frequencies below `end` (bins), as a matrix on its samples: every beat frequency has a
/// random amplitude with the power of the spectrum `mean` (zero-padded), so that near and far are separated (Wiener's filter).
fn near_part(mean: &[f64], end: f64, noise: f64, samples: usize, real: bool) -> Option<DMatrix<Complex64>> {
    let step = ZERO_PADDING / 2;
    let total: f64 = mean.iter().step_by(step).sum();
    let power = mean.iter().sum::<f64>() / mean.len() as f64;
    let scale = power / total.max(f64::MIN_POSITIVE);
    // Of two samples by their distance.
    let (mut near, mut all) = (vec![Complex64::ZERO; samples], vec![Complex64::ZERO; samples]);
    for (bin, value) in mean.iter().enumerate().step_by(step) {
        let bins = bin as f64 / ZERO_PADDING as f64;
        // What is near leaks over zero.
        let below = samples as f64 - bins;
        let is_near = bins <= end || below <= if real { end } else { 1.0 };
        for (distance, turned) in tone(bins / samples as f64, samples).into_iter().enumerate() {
            all[distance] += turned * (value * scale);
            if is_near {
                near[distance] += turned * (value * scale);
            }
        }
    }
    all[0] += noise.max(LEAST_NOISE * power);
    let matrix = |of: &[Complex64]| {
        DMatrix::from_fn(samples, samples, |row, column| if row >= column { of[row - column] } else { of[column - row].conj() })
    };
    let (near, all) = (matrix(&near), matrix(&all));
    Some(near * all.cholesky()?.inverse())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::radar::{Radar, Sampling};

    /// What is said of a return at a range, beside a far one, in all channels.
    fn said(near_m: f64) -> Vec<Candidate> {
        let radar = Radar { samples_per_chirp: 128, ..Radar::small(8) };
        let resolution = radar.range_resolution_m();
        let evidence = Evidence::in_noise(radar, 4, |[_, channel, _, n]| {
            let tone = |range_m: f64, level: f64| Complex64::from_polar(level, TAU * range_m / resolution * n as f64 / 128.0);
            tone(near_m, 50.0 * (1.0 + channel as f64)) + tone(40.0 * resolution, 30.0)
        });
        find(&evidence)
    }

    #[test]
    fn what_is_near_leaks_and_the_flank_of_what_lies_behind_does_not() {
        let found = said(0.1);
        assert_eq!(found.iter().filter_map(|found| found.id).collect::<Vec<_>>(), [effects::tx_leakage::ID]);
        assert!(found[0].nats > 100.0 && found[0].estimates[0].values[0] < 0.2, "{found:?}");
        assert!(said(NEAR_M + 0.1).is_empty(), "{:?}", said(NEAR_M + 0.1));
    }

    /// Without quadrature, what was not sampled rises at the ends of a chirp that begins and ends otherwise.
    #[test]
    fn a_leakage_that_hardly_turns_has_no_edges() {
        let radar = Radar { samples_per_chirp: 128, sampling: Sampling::Real, ..Radar::small(8) };
        let evidence = Evidence::in_noise(radar, 4, |[_, channel, _, n]| {
            let tone = |bin: f64, level: f64| Complex64::from_polar(level, TAU * bin * n as f64 / 128.0);
            tone(0.3, 200.0 * (1.0 + channel as f64)) + tone(30.0, 10.0)
        });
        let found = find(&evidence);
        assert!(found.iter().all(|found| found.id != Some(effects::ramp_edge_transient::ID)), "{found:?}");
    }
}
