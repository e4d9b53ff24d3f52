//! Something nobody tracked that moves with all velocities at once, at one range: a fan, a wheel, a curtain in a draught.
//!
//! Its power fills every Doppler frequency, so that no velocity stands out. Whatever shakes the oscillator or the radar does that to
//! static returns, too, but to all of them, in proportion to their power and at most in proportion to their delay's square: static
//! returns elsewhere that are strong enough must not show it. Noise of the receivers at low beat frequencies is not shared by them; a
//! return is.

use num_complex::Complex64;

use super::region::{Region, floor, left, mean_map, mean_power, moves, power_gain, removal};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::{Evidence, HANN_LOBE, spectrum};
use crate::diagnosis::finding::{Candidate, Place};
use crate::diagnosis::statistics::{corrected, mean_power_tail};
use crate::effects::{self, Stage};

const FEWEST_LOOPS: usize = 16;
/// Floor over the noise that a static return must have if it were modulated as well, for its absence to show that it is not.
const INFORMATIVE: f64 = 3.0;
/// Static returns elsewhere that must deny it.
const FEWEST_DENIALS: usize = 2;
/// p-value below which receivers share it.
const SURE: f64 = 1e-3;
/// Parts of the velocities, and of the recording, in each of which it must be: people who pass one another fill many velocities for a
/// while.
const SECTORS: usize = 8;
const PARTS: usize = 2;

/// Powers over the noise by range bin.
struct Floor {
    /// Median over velocities, of the training frames; zero where all was taken out.
    level: Vec<f64>,
    clutter: Vec<f64>,
}

/// At most one candidate: a range with power at all velocities. None where somebody is tracked, of too few loops, or without
/// held-out frames.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let loops = evidence.cube.dims[3];
    if evidence.body.is_some() || loops < FEWEST_LOOPS || evidence.split.held_out.is_empty() {
        return vec![];
    }
    one(evidence).into_iter().collect()
}

fn moving(loops: usize) -> impl Iterator<Item = usize> {
    (0..loops).filter(move |&doppler| moves(doppler, loops))
}

/// Of some frames, the median over velocities by range; zero where all was taken out.
fn levels(evidence: &Evidence, frames: &[usize]) -> Vec<f64> {
    let mean = mean_map(evidence, frames);
    (0..evidence.range_bins()).map(|bin| floor(evidence, &mean, bin, 1).unwrap_or(0.0)).collect()
}

fn strongest(levels: &[f64]) -> Option<usize> {
    (0..levels.len()).max_by(|&a, &b| levels[a].total_cmp(&levels[b]))
}

impl Floor {
    fn of(evidence: &Evidence) -> Self {
        let samples = evidence.cube.dims[4];
        let (bins, channels) = (evidence.range_bins(), evidence.cube.channels());
        let level = levels(evidence, &evidence.split.training);
        let mut clutter = vec![0.0; bins];
        for (channel, chirp) in evidence.standing().chunks_exact(samples).enumerate() {
            let weight = (evidence.noise()[channel].max(f64::MIN_POSITIVE) * channels as f64).recip();
            clutter.iter_mut().zip(spectrum(chirp)).for_each(|(sum, value)| *sum += weight * value.norm_sqr());
        }
        Self { level, clutter }
    }

    /// Whether static returns elsewhere say that what is at a range is there alone.
    fn is_alone(&self, bin: usize, ends: [usize; 2]) -> bool {
        let ratio = (self.level[bin] - 1.0) / self.clutter[bin].max(f64::MIN_POSITIVE);
        let (mut informative, mut denying) = (0, 0);
        let mut other = 0;
        while other < self.level.len() {
            // A phase of the oscillator grows with the delay at most in proportion.
            let nearer = ((other as f64 + 1.0) / (bin as f64 + 1.0)).min(1.0).powi(2);
            let expected = ratio * self.clutter[other] * nearer;
            let aside = other + HANN_LOBE < ends[0] || other > ends[1] + HANN_LOBE;
            if !aside || expected < INFORMATIVE || self.level[other] == 0.0 {
                other += 1;
                continue;
            }
            informative += 1;
            denying += usize::from(self.level[other] - 1.0 < 0.5 * expected);
            // Of one return each.
            other += 2 * HANN_LOBE;
        }
        denying >= FEWEST_DENIALS && 2 * denying > informative
    }
}

fn one(evidence: &Evidence) -> Option<Candidate> {
    let [frames, _, _, loops, samples] = evidence.cube.dims;
    let floor = Floor::of(evidence);
    let (bins, channels) = (evidence.range_bins(), evidence.cube.channels() as f64);
    let bin = strongest(&floor.level)?;
    let count = evidence.split.training.len() as f64 * channels;
    // The law of one cell; the median over many has less spread.
    let p_value = corrected(mean_power_tail(floor.level[bin], count), bins as f64);
    let above = |bin: usize| mean_power_tail(floor.level[bin], count) < SURE / bins as f64;
    let first = (0..=bin).rev().take_while(|&bin| above(bin)).last()?;
    let last = (bin..bins).take_while(|&bin| above(bin)).last()?;
    if p_value > SURE
        || !fills(evidence, bin)
        || !stays(evidence, bin)
        || !floor.is_alone(bin, [first, last])
        || chance_of_independent_receivers(evidence, bin) > SURE
    {
        return None;
    }
    let held_out = evidence.split.held_out.iter();
    let cells = held_out
        .flat_map(|&frame| (first..=last).flat_map(move |bin| left(evidence, bin, 1).map(move |doppler| (frame, doppler, bin))));
    let of_cell =
        |(frame, doppler, bin): (usize, usize, usize)| power_gain(evidence, frame, doppler * samples + bin, floor.level[bin]);
    let gain: f64 = cells.map(of_cell).sum();
    let bin_m = evidence.radar.range_resolution_m();
    let fastest = 0.5 * evidence.radar.velocity_resolution_mps() * loops as f64;
    let noise = evidence.total_noise();
    let energy = (first..=last).map(|bin| floor.level[bin] - 1.0).sum::<f64>() * noise * (frames * loops) as f64;
    let half = 0.5 * loops as f64;
    let region = Region { range: [first as f64 - 0.5, last as f64 + 0.5], doppler: [-half, half] };
    let place = Place {
        range_m: Some([(first as f64 - 0.5).max(0.0) * bin_m, (last as f64 + 0.5) * bin_m]),
        velocity_mps: Some([-fastest, fastest]),
        ..Place::at(Stage::Scene)
    };
    Some(Candidate {
        id: Some(effects::moving_reflector::ID),
        statement: format!(
            "At {:.2} m something moves with all velocities at once, up to {fastest:.1} m/s and beyond, {:.0} dB above the noise, while \
             stronger static returns elsewhere do not: it turns or flutters, and nobody is tracked there.",
            bin as f64 * bin_m,
            10.0 * floor.level[bin].log10()
        ),
        energy,
        correction: removal(evidence, 1, region),
        ..Candidate::new(Behaviour::PathLike, place, p_value, gain)
    })
}

/// Power of a Hann window's side lobes so many bins from its summit, over that (Harris 1978); none within the main lobe.
fn side_lobe(bins: usize) -> f64 {
    let bins = bins as f64;
    if bins < HANN_LOBE as f64 { 0.0 } else { (std::f64::consts::PI * bins * (bins * bins - 1.0)).powi(-2) }
}

/// Whether what is at a range has all velocities all the time.
fn fills(evidence: &Evidence, bin: usize) -> bool {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let (training, channels) = (&evidence.split.training, evidence.cube.channels() as f64);
    // In the FFT's order they hang together past the fastest.
    let velocities: Vec<usize> = left(evidence, bin, 1).collect();
    let in_frames = |frames: &[usize]| {
        let power = |doppler: usize| mean_power(evidence, frames, doppler * samples + bin);
        let Some(strongest) = velocities.iter().copied().max_by(|&a, &b| power(a).total_cmp(&power(b))) else { return false };
        let apart = |doppler: &usize| doppler.abs_diff(strongest).min(loops - doppler.abs_diff(strongest));
        velocities.chunks(velocities.len().div_ceil(SECTORS)).all(|sector| {
            let mean = sector.iter().map(|&doppler| power(doppler)).sum::<f64>() / sector.len() as f64;
            let leaks = power(strongest) * side_lobe(sector.iter().map(apart).min().unwrap_or(0));
            // Neighbouring cells of a windowed transform share their noise.
            let count = frames.len() as f64 * channels * sector.len().div_ceil(HANN_LOBE + 1) as f64;
            mean > leaks && mean_power_tail(mean, count) < SURE
        })
    };
    training.chunks(training.len().div_ceil(PARTS)).all(in_frames)
}

/// Whether it is strongest at that range in each part of the recording: what turns or flutters stays, a tone of somebody else may wander.
fn stays(evidence: &Evidence, bin: usize) -> bool {
    let training = &evidence.split.training;
    let is_there = |frames| strongest(&levels(evidence, frames)).is_some_and(|other| other.abs_diff(bin) <= HANN_LOBE);
    training.chunks(training.len().div_ceil(PARTS)).all(is_there)
}

/// Chance of what the receivers share at a range if each had noise of its own: of the best pair of channels, whose squared coherence
/// over n independent cells exceeds c with a probability of `(1 − c)^{n−1}`.
fn chance_of_independent_receivers(evidence: &Evidence, bin: usize) -> f64 {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let channels = evidence.cube.channels();
    let mut products = vec![Complex64::ZERO; channels];
    let mut powers = vec![0.0; channels];
    let mut count = 0.0;
    for &frame in &evidence.split.training {
        let maps: Vec<Vec<Complex64>> = (0..channels).map(|channel| evidence.range_doppler(frame, channel)).collect();
        // Neighbouring cells of a windowed transform share their noise.
        for doppler in moving(loops).step_by(HANN_LOBE + 1) {
            let cell = doppler * samples + bin;
            for (channel, map) in maps.iter().enumerate() {
                products[channel] += map[cell] * maps[0][cell].conj();
                powers[channel] += map[cell].norm_sqr();
            }
            count += 1.0;
        }
    }
    let chance = |channel: usize| {
        let coherence = products[channel].norm_sqr() / (powers[channel] * powers[0]).max(f64::MIN_POSITIVE);
        (1.0 - coherence.min(1.0)).powf(count - 1.0)
    };
    (1..channels).map(chance).map(|p| corrected(p, (channels - 1) as f64)).fold(1.0, f64::min)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::radar::Radar;

    const SAMPLES: usize = 64;

    /// Static returns at four ranges; the nearest, or all, are modulated at random from chirp to chirp, or the receivers have noise of
    /// their own at its beat frequency.
    fn evidence(alone: bool, common: f64, noise: f64) -> Evidence {
        let radar = Radar { samples_per_chirp: SAMPLES, loops_per_frame: 32, ..Radar::small(8) };
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let turns: Vec<f64> = (0..8 * 32).map(|_| random.random::<f64>()).collect();
        let own: Vec<f64> = (0..64 * 8 * 32).map(|_| random.random::<f64>()).collect();
        Evidence::in_noise(radar, 3, |[frame, channel, index, n]| {
            let tone = |bin: f64, level: f64| Complex64::from_polar(level, TAU * bin * n as f64 / SAMPLES as f64);
            let chirp = frame * 32 + index;
            let fan = if alone { Complex64::cis(TAU * turns[chirp]) * 0.7 } else { Complex64::ZERO };
            let all = Complex64::cis(common * (turns[chirp] - 0.5));
            let noise = tone(5.0, noise) * Complex64::cis(TAU * own[channel * 256 + chirp]);
            (tone(5.0, 20.0) * (Complex64::ONE + fan) + tone(14.0, 40.0) + tone(22.0, 30.0) + tone(28.0, 25.0)) * all + noise
        })
    }

    #[test]
    fn what_fills_all_velocities_at_one_range_is_a_mover_there_and_then_nothing() {
        let evidence = evidence(true, 0.0, 0.0);
        let found = find(&evidence).pop().expect("a fan");
        assert_eq!(found.id, Some(effects::moving_reflector::ID));
        assert!(found.p_value < 1e-9 && found.nats > 100.0, "{found:?}");
        let bin_m = evidence.radar.range_resolution_m();
        let [low, high] = found.place.range_m.unwrap();
        assert!(low < 5.0 * bin_m && 5.0 * bin_m < high && high < 12.0 * bin_m, "{low} to {high}");
        assert!(find(&evidence.with(&found)).is_empty());
    }

    #[test]
    fn neither_an_oscillator_that_shakes_all_returns_nor_noise_of_each_receiver_is_one() {
        for (common, noise) in [(0.5, 0.0), (0.0, 20.0), (0.0, 0.0)] {
            let found = find(&evidence(false, common, noise));
            assert!(found.is_empty(), "{common} {noise}: {found:?}");
        }
    }

    /// Of a phase of its own in every chirp, as of somebody else's transmitter.
    #[test]
    fn a_tone_that_wanders_is_no_fan() {
        let radar = Radar { samples_per_chirp: SAMPLES, loops_per_frame: 32, ..Radar::small(8) };
        let seen = |bins_per_frame: f64| {
            let mut random = ChaCha8Rng::seed_from_u64(9);
            let turns: Vec<f64> = (0..8 * 32).map(|_| random.random::<f64>()).collect();
            find(&Evidence::in_noise(radar.clone(), 7, |[frame, _, index, n]| {
                let tone = |bin: f64, level: f64| Complex64::from_polar(level, TAU * bin * n as f64 / SAMPLES as f64);
                let other = tone(5.0 + bins_per_frame * frame as f64, 14.0) * Complex64::cis(TAU * turns[frame * 32 + index]);
                other + tone(14.0, 40.0) + tone(22.0, 30.0) + tone(28.0, 25.0)
            }))
        };
        assert!(!seen(0.0).is_empty());
        assert!(seen(1.0).is_empty(), "{:?}", seen(1.0));
    }

    /// Two who cross one range, one after the other, fast and slow.
    #[test]
    fn people_who_pass_one_another_are_no_fan() {
        let radar = Radar { samples_per_chirp: SAMPLES, loops_per_frame: 32, ..Radar::small(8) };
        let evidence = Evidence::in_noise(radar, 7, |[frame, _, index, n]| {
            let tone = |bin: f64, level: f64| Complex64::from_polar(level, TAU * bin * n as f64 / SAMPLES as f64);
            let limb = |doppler: f64| tone(9.0, 30.0) * Complex64::cis(TAU * doppler * index as f64 / 32.0);
            let passes: [f64; 6] =
                if frame < 4 { [3.0, 4.5, 6.0, 7.5, 9.0, 11.0] } else { [-3.0, -5.0, -7.0, -9.0, -11.0, -13.0] };
            passes.into_iter().map(limb).sum::<Complex64>() + tone(14.0, 40.0) + tone(22.0, 30.0) + tone(28.0, 25.0)
        });
        assert!(find(&evidence).is_empty(), "{:?}", find(&evidence));
    }
}
