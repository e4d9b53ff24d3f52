//! One frame of one channel that is not like the others: samples that slipped, a frame that was written over.
//!
//! Static clutter is alike in all frames. Movers leave a residual in it, which all channels of a frame share in power,
//! range by range; so the odd one stands out from its frame's other channels, by more than any other does. A frame is
//! all there is of it, so its even chirps propose and its odd chirps judge.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::cube::halves;
use crate::diagnosis::evidence::{Evidence, spectrum};
use crate::diagnosis::finding::{Candidate, Correction, Place};
use crate::diagnosis::statistics::{corrected, median};
use crate::effects::Stage;
use crate::grid::Grid;

/// Fewest frames and channels among which one can be odd.
const FEWEST_FRAMES: usize = 6;
const FEWEST_CHANNELS: usize = 2;
/// Deviations of the scores' law that the odd one's is out at least, and how many times the next one's.
const STANDS_OUT: f64 = 10.0;
const FROM_THE_NEXT: f64 = 2.0;
/// Of the scores, which are sums of logarithms: without noise they would all be alike.
const LEAST_SPREAD: f64 = 1e-3;
/// Median absolute deviation to standard deviation of a normal law.
const TO_DEVIATION: f64 = 1.4826;

/// Mean chirps of the even and of the odd loops of every frame and channel.
struct Means(Grid<[Vec<Complex64>; 2], 2>);

/// The same less the channel's mean over the other frames.
struct Deviation {
    halves: [Vec<Complex64>; 2],
    /// |spectrum|² of both halves' mean over the noise's expectation, by range.
    power: Vec<f64>,
}

type Deviations = Grid<Deviation, 2>;

/// A frame of a channel that stands out.
struct Odd {
    /// Frame and channel.
    at: [usize; 2],
    score: f64,
    deviations: Deviations,
}

/// At most one candidate: the frame and channel that stands out. None of too few frames, channels or loops.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let [frames, _, _, loops, _] = evidence.cube.dims;
    if frames < FEWEST_FRAMES
        || evidence.cube.channels() < FEWEST_CHANNELS
        || loops < 4
        || evidence.accepted_unnamed.contains(&Behaviour::SingleFrame)
    {
        return vec![];
    }
    Odd::of(evidence).map(|odd| odd.candidate(evidence)).into_iter().collect()
}

impl Means {
    fn of(evidence: &Evidence) -> Self {
        let [frames, .., samples] = evidence.cube.dims;
        let channels = evidence.cube.channels();
        let means = (0..frames * channels)
            .into_par_iter()
            .map(|at| halves(evidence.cube.channel(at / channels, at % channels), samples))
            .collect();
        Self(Grid::new(["frame", "channel"], [frames, channels], means))
    }

    /// `without`: a frame that the others are not compared with.
    fn deviations(&self, evidence: &Evidence, without: Option<usize>) -> Deviations {
        let shape @ [frames, channels] = self.0.shape();
        let of = |at: usize| self.deviation(evidence, [at / channels, at % channels], without);
        Grid::new(["frame", "channel"], shape, (0..frames * channels).into_par_iter().map(of).collect())
    }

    fn deviation(&self, evidence: &Evidence, at @ [frame, channel]: [usize; 2], without: Option<usize>) -> Deviation {
        let (means, [.., loops, samples]) = (&self.0, evidence.cube.dims);
        let others: Vec<usize> = (0..means.shape()[0]).filter(|&other| other != frame && Some(other) != without).collect();
        let mut rest = vec![Complex64::ZERO; samples];
        for half in others.iter().flat_map(|&other| &means[[other, channel]]) {
            rest.iter_mut().zip(half).for_each(|(sum, value)| *sum += value / (2 * others.len()) as f64);
        }
        let halves = [0, 1].map(|half| means[at][half].iter().zip(&rest).map(|(a, b)| a - b).collect::<Vec<_>>());
        let mean: Vec<Complex64> = halves[0].iter().zip(&halves[1]).map(|(a, b)| (a + b) / 2.0).collect();
        let noise = evidence.noise()[channel].max(1e-300) / loops as f64;
        Deviation { power: spectrum(&mean).iter().map(|value| value.norm_sqr() / noise).collect(), halves }
    }
}

impl Odd {
    fn of(evidence: &Evidence) -> Option<Self> {
        let means = Means::of(evidence);
        let largest = |scores: &[f64]| (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]));
        // The odd one is in all others' means, too: it is judged against what they are without it.
        let odd = largest(&scores(&means.deviations(evidence, None)))?;
        let channels = evidence.cube.channels();
        let at @ [frame, _] = [odd / channels, odd % channels];
        let deviations = means.deviations(evidence, Some(frame));
        let scores = scores(&deviations);
        let next = (0..scores.len()).filter(|&at| at != odd).map(|at| scores[at]).fold(0.0, f64::max);
        if scores[odd] < STANDS_OUT.max(FROM_THE_NEXT * next) {
            return None;
        }
        Some(Self { at, score: scores[odd], deviations })
    }

    fn own(&self) -> &Deviation {
        &self.deviations[self.at]
    }

    /// Power of all other deviations, mean over them.
    fn usual(&self) -> f64 {
        let [frames, channels] = self.deviations.shape();
        let all = (0..frames).flat_map(|frame| (0..channels).map(move |channel| [frame, channel]));
        let others = all.filter(|&at| at != self.at);
        others.map(|at| self.deviations[at].total()).sum::<f64>() / (frames * channels - 1) as f64
    }

    /// Log-likelihood that the odd chirps gain, predicted by what the even ones deviate by.
    fn gain(&self, evidence: &Evidence) -> f64 {
        let [.., loops, samples] = evidence.cube.dims;
        let [even, uneven] = &self.own().halves;
        let floor = (self.usual() / samples as f64).max(1.0);
        let noise = floor * evidence.noise()[self.at[1]].max(1e-300) / (0.5 * loops as f64);
        uneven.iter().zip(even).map(|(a, b)| a.norm_sqr() - (a - b).norm_sqr()).sum::<f64>() / noise
    }

    fn candidate(&self, evidence: &Evidence) -> Candidate {
        let [_, transmitters, receivers, loops, samples] = evidence.cube.dims;
        let [frame, channel] = self.at;
        let ratio = self.own().total() / self.usual().max(f64::MIN_POSITIVE);
        let [even, uneven] = &self.own().halves;
        let change: Vec<Complex64> = even.iter().zip(uneven).map(|(a, b)| (a + b) / 2.0).collect();
        let energy = change.iter().map(|value| value.norm_sqr()).sum::<f64>() * loops as f64;
        let size = loops * samples;
        let start = (frame * evidence.cube.channels() + channel) * size;
        let place = Place {
            frames: Some(vec![frame]),
            rx: Some(vec![channel % receivers]),
            tx: (transmitters > 1).then(|| vec![channel / receivers]),
            ..Place::at(Stage::Receiver)
        };
        // Scores of residuals of movers have a longer tail than a normal law's.
        let p_value = corrected((-self.score).exp(), self.deviations.values().len() as f64).max(f64::MIN_POSITIVE);
        Candidate {
            statement: format!(
                "In frame {frame} receiver {} sees the room otherwise than in all other frames, with {:.1} times the power of \
                 the usual deviation, and no other receiver does at those ranges: that frame of that receiver was corrupted or shifted.",
                channel % receivers,
                ratio
            ),
            energy,
            correction: Correction::samples(move |cube| {
                for chirp in cube.samples[start..start + size].chunks_exact_mut(change.len()) {
                    chirp.iter_mut().zip(&change).for_each(|(value, change)| *value -= change);
                }
            }),
            ..Candidate::new(Behaviour::SingleFrame, place, p_value, self.gain(evidence))
        }
    }
}

impl Deviation {
    fn total(&self) -> f64 {
        self.power.iter().sum()
    }
}

/// How far every deviation is out of its frame's other channels', over the ranges, in deviations from the median:
/// `[frame, channel]`.
fn scores(deviations: &Deviations) -> Vec<f64> {
    let [_, channels] = deviations.shape();
    let others = (channels - 1) as f64;
    let raw = |(at, deviation): (usize, &Deviation)| -> f64 {
        let frame = deviations.below([at / channels]);
        let out = |(range, own): (usize, &f64)| {
            let all: f64 = frame.iter().map(|deviation| deviation.power[range]).sum();
            // The likelihood ratio of one power against so many others of one law, which is never below the noise's.
            (own / (all - own).max(others)).ln_1p()
        };
        deviation.power.iter().enumerate().map(out).sum()
    };
    let scores: Vec<f64> = deviations.values().iter().enumerate().map(raw).collect();
    let middle = median(&mut scores.clone());
    let mut apart: Vec<f64> = scores.iter().map(|score| (score - middle).abs()).collect();
    let spread = TO_DEVIATION * median(&mut apart);
    scores.iter().map(|score| (score - middle) / spread.max(LEAST_SPREAD)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Radar;

    /// Two static returns and a slow mover in noise.
    fn evidence(slip: usize) -> Evidence {
        let mut radar = Radar::small(8);
        (radar.loops_per_frame, radar.samples_per_chirp) = (16, 64);
        Evidence::in_noise(radar, 4, |[frame, rx, slow, n]| {
            let n = if (frame, rx) == (3, 1) { n + slip } else { n } as f64;
            let mover = Complex64::cis(0.6 * n + 0.03 * slow as f64 + 1.9 * frame as f64) * 4.0;
            Complex64::cis(0.9 * n + 0.4 * rx as f64) * 30.0 + mover
        })
    }

    #[test]
    fn a_slipped_frame_is_found_where_it_is_and_nothing_is_nothing() {
        let found = find(&evidence(3));
        let place = &found[0].place;
        assert_eq!((place.frames.as_deref(), place.rx.as_deref()), (Some(&[3][..]), Some(&[1][..])));
        assert!(found[0].p_value < 1e-6 && found[0].nats > 15.0, "{} {}", found[0].p_value, found[0].nats);
        assert!(find(&evidence(3).with(&found[0])).is_empty());
        assert!(find(&evidence(0)).is_empty());
    }
}
