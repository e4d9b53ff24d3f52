//! What stands still. Where most returns beyond the leakage do not, the radar may be what moves: its own leakage moves with it.
//!
//! A return stands where the mean of all chirps holds most of its power: of phases that turn, the mean is small. The four-term
//! Blackman–Harris window keeps the leakage's side lobes, 92 dB down (Harris 1978), below what lies beyond its main lobe.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;

use num_complex::Complex64;
use rayon::prelude::*;

use super::{Evidence, Tapered};
use crate::diagnosis::behaviour::Behaviour;

/// A leakage's delay and half the main lobe of that window end here, bins.
const LEAKAGE_BINS: usize = 6;
/// Mean power over the noise of a chirp from which on there is a return.
const RETURN: f64 = 10.0;
/// Share of a range's velocities.
const TOUCHED: f64 = 0.25;
/// Share of a return's power that stands.
const STANDS: f64 = 0.5;
/// A body's echoes and their first detours end here, m: what moves within is one thing.
pub const REACH_M: f64 = 1.2;

/// What is said where [`Evidence::may_move`].
pub const MAY_MOVE: &str = "Most returns beyond the transmitters' leakage move: it may be the radar that does";

/// Power of a stretch's mean chirp and mean power of all chirps over the noise of a chirp, mean over stretches of frames, by range.
struct Profile {
    standing: Vec<f64>,
    power: Vec<f64>,
}

impl Evidence {
    /// Static clutter with what was subtracted of it: what happens to all returns happens to these.
    pub fn standing(&self) -> Cow<'_, [Complex64]> {
        match &self.subtracted {
            Some(subtracted) => self.clutter().iter().zip(&**subtracted).map(|(value, gone)| value + gone).collect(),
            None => self.clutter().into(),
        }
    }

    /// Ranges of which cells were taken out of the samples around zero velocity, or so many that what is left is not as it was, either.
    pub fn touched(&self) -> Vec<bool> {
        let loops = self.cube.dims[3];
        let is_slow = |doppler: usize| doppler.min(loops - doppler) <= 1;
        let of_range = |range: usize| {
            let emptied: Vec<usize> = (0..loops).filter(|&doppler| self.is_emptied(doppler, range)).collect();
            emptied.iter().any(|&doppler| is_slow(doppler)) || emptied.len() as f64 > TOUCHED * loops as f64
        };
        (0..self.range_bins()).map(of_range).collect()
    }

    /// Whether nothing was taken out of some ranges.
    pub fn are_whole(&self, mut ranges: Range<usize>) -> bool {
        ranges.all(|range| (0..self.cube.dims[3]).all(|doppler| !self.is_emptied(doppler, range)))
    }

    /// Whether it may be the radar that moves: most returns beyond the leakage do, at more places than one thing has, and no body is tracked
    /// that may be most of them.
    pub fn may_move(&self) -> bool {
        *self.once.may_move.get_or_init(|| self.body.is_none() && self.do_most_move(std::slice::from_ref(&self.split.training)))
    }

    /// Whether that was said: what else moves is no more than that.
    pub fn is_said_to_move(&self) -> bool {
        self.accepted_unnamed.contains(&Behaviour::PathLike) && self.may_move()
    }

    /// Ranges of returns beyond the leakage that do not stand, with the power of a chirp that does not, over the noise.
    pub fn moving_returns(&self) -> Vec<(usize, f64)> {
        let profile = Profile::of(self, std::slice::from_ref(&self.split.training));
        let moving = profile.returns().filter(|&bin| !profile.stands(bin));
        moving.map(|bin| (bin, profile.power[bin] - profile.standing[bin])).collect()
    }

    /// Whether it may be the radar that moves within a frame.
    pub fn may_move_in_a_frame(&self) -> bool {
        let frames: Vec<Vec<usize>> = self.split.training.iter().map(|&frame| vec![frame]).collect();
        self.body.is_none() && self.do_most_move(&frames)
    }

    /// Whether nothing stands in stretches of frames at most places as large as one thing's echoes.
    fn do_most_move(&self, stretches: &[Vec<usize>]) -> bool {
        let profile = Profile::of(self, stretches);
        let reach = (REACH_M / self.radar.range_resolution_m()).max(2.0) as usize;
        let (standing, moving): (Vec<usize>, Vec<usize>) = profile.returns().partition(|&bin| profile.stands(bin));
        let places = |bins: &[usize]| bins.iter().map(|bin| bin / reach).collect::<BTreeSet<usize>>();
        let (stand, all) = (places(&standing), places(&moving));
        let apart = moving.first().zip(moving.last()).is_some_and(|(first, last)| last - first > reach);
        all.difference(&stand).count() > stand.len() && apart
    }
}

impl Profile {
    fn of(evidence: &Evidence, stretches: &[Vec<usize>]) -> Self {
        let [_, _, _, loops, samples] = evidence.cube.dims;
        let (bins, channels, tapered) = (evidence.range_bins(), evidence.cube.channels(), Tapered::new(samples));
        let noise = evidence.noise();
        let all: Vec<(&Vec<usize>, usize)> =
            stretches.iter().flat_map(|s| (0..channels).map(move |channel| (s, channel))).collect();
        let of = |(stretch, channel): (&Vec<usize>, usize)| {
            let weight = (noise[channel].max(f64::MIN_POSITIVE) * (channels * stretches.len()) as f64).recip();
            let chirps = (stretch.len() * loops) as f64;
            let gone = evidence.subtracted.as_ref().map(|gone| tapered.spectra(&gone[channel * samples..][..samples], 1.0));
            let (mut mean, mut power) = (vec![Complex64::ZERO; bins], vec![0.0; bins]);
            for &frame in stretch {
                for chirp in tapered.spectra(evidence.cube.channel(frame, channel), 1.0).chunks_exact(samples) {
                    for bin in 0..bins {
                        let value = chirp[bin] + gone.as_ref().map_or(Complex64::ZERO, |gone| gone[bin]);
                        mean[bin] += value / chirps;
                        power[bin] += value.norm_sqr() * weight / chirps;
                    }
                }
            }
            let standing = mean.into_iter().map(|mean| mean.norm_sqr() * weight).collect();
            Self { standing, power }
        };
        let none = || Self { standing: vec![0.0; bins], power: vec![0.0; bins] };
        all.into_par_iter().map(of).reduce(none, |mut sum, own| {
            sum.standing.iter_mut().zip(own.standing).for_each(|(sum, own)| *sum += own);
            sum.power.iter_mut().zip(own.power).for_each(|(sum, own)| *sum += own);
            sum
        })
    }

    /// Ranges of returns beyond the leakage, in order.
    fn returns(&self) -> impl Iterator<Item = usize> {
        let power = &self.power;
        let is_summit = |&bin: &usize| power[bin] > RETURN && power[bin] > power[bin - 1] && power[bin] >= power[bin + 1];
        (LEAKAGE_BINS + 1..power.len().saturating_sub(1)).filter(is_summit)
    }

    fn stands(&self, bin: usize) -> bool {
        self.standing[bin] > STANDS * (self.power[bin] - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::radar::Radar;

    /// Leakage, and returns as (range bin, amplitude, turns over the recording).
    fn evidence(returns: &[(f64, f64, f64)], seed: u64) -> Evidence {
        let radar = Radar { samples_per_chirp: 64, loops_per_frame: 16, ..Radar::small(8) };
        Evidence::in_noise(radar, seed, |[frame, channel, index, n]| {
            let tone = |bin: f64, level: f64| Complex64::from_polar(level, TAU * bin * n as f64 / 64.0 + channel as f64 * bin);
            let time = (frame * 16 + index) as f64 / 128.0;
            let of = |&(bin, level, turns): &(f64, f64, f64)| tone(bin, level) * Complex64::cis(TAU * turns * time.powi(2));
            tone(1.2, 200.0) + returns.iter().map(of).sum::<Complex64>()
        })
    }

    #[test]
    fn a_radar_may_move_where_most_returns_do_and_not_where_most_stand_or_only_one_moves() {
        for seed in 0..4 {
            let may = |returns: &[(f64, f64, f64)]| evidence(returns, seed).may_move();
            assert!(may(&[(12.0, 20.0, 6.3), (30.5, 10.0, 5.1), (21.0, 15.0, 6.0)]), "all move");
            assert!(may(&[(12.0, 20.0, 6.3), (30.5, 10.0, 0.0), (21.0, 15.0, 6.0)]), "one stands, as beside a car");
            assert!(!may(&[(12.0, 20.0, 6.3), (30.5, 10.0, 0.0), (21.0, 15.0, 0.0)]), "most stand");
            assert!(!may(&[(12.0, 20.0, 6.3)]), "one moves");
            assert!(!may(&[(12.0, 20.0, 0.0)]) && !may(&[]), "nothing moves");
        }
    }
}
