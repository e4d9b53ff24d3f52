//! What all strong static returns have in common in a chirp: their complex gain relative to their mean over time.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;
use rustfft::{Fft, FftPlanner};

use crate::diagnosis::evidence::{Evidence, blackman_harris};
use crate::radar::SPEED_OF_LIGHT;
use crate::room::Room;

/// Range cells whose gain is estimated together.
#[derive(Clone, Debug)]
pub struct Group {
    /// Mean delay of its static returns, weighted by their power.
    pub delay_s: f64,
    /// Cosine to the boresight, mean over what the room has at that range; one where the room is not known.
    pub ahead: f64,
    /// Its beat-frequency bins.
    pub bins: std::ops::Range<usize>,
}

/// Deviation of the gain of the static returns from one, group by group of ranges.
pub struct Field {
    pub frames: usize,
    pub loops: usize,
    pub groups: Vec<Group>,
    /// `[frame, loop, group]`, zero where nothing can be said; its imaginary part is an angle where phase excursions are large.
    deviation: Vec<Complex64>,
    /// Inverse variance of a complex deviation, `[frame, group]`; zero where nothing can be said.
    weight: Vec<f64>,
    /// Whether the body is at none of a group's ranges, `[frame, group]`.
    free: Vec<bool>,
    /// Radar time of every loop, `[frame, loop]`: the mean over its transmitters.
    pub times_s: Vec<f64>,
    /// Radians up to which a phase can be read.
    pub farthest: f64,
}

/// Which part of the deviation is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Logarithm of the gain.
    Gain,
    /// Phase that is the same at all ranges.
    Phase,
    /// Phase in proportion to the delay: an error of the local oscillator. Stated per second of delay.
    Delay,
    /// Phase in proportion to the cosine to the boresight, along which the radar moves.
    Boresight,
}

/// One number per chirp: the common deviation, with its inverse variance.
pub struct Series {
    /// `[frame, loop]`
    pub value: Vec<f64>,
    /// `[frame]`: all chirps of a frame are equally sure.
    pub weight: Vec<f64>,
    pub loops: usize,
}

/// Root mean square of a phase, in radians, up to which it is read as its sine.
const SMALL: f64 = 0.2;
/// Radians up to which a phase can be read as its sine, and as an angle that must not be taken for one beyond half a turn.
const FARTHEST: [f64; 2] = [1.0, 2.0];
/// Information (inverse variance) of all groups from which on a chirp's angle is sure.
const SURE: f64 = 100.0;
/// Bins between two groups, across which windowed noise is hardly correlated.
const GAP: usize = 2;
/// Power over the noise that a cell without a mover may have; its law is narrower than this.
const CLEAN: f64 = 1.25;
/// Share of a deviation's power across the channels that may lie aside of the static return's: a strong phase that all
/// share leaves as much where one cell holds returns from several directions.
const ASIDE: f64 = 0.03;
/// Bins beside the body that are not free of it.
const MARGIN: usize = 2;
/// What a range would gain (nats) by a deviation that it shares, for its absence to be informative.
const INFORMATIVE_GAIN: f64 = 10.0;

/// Share that is uncertain of an amplitude along the boresight: how much returns from where is not known.
pub const PATTERN: f64 = 0.2;

impl Part {
    /// What a value of one means at some ranges.
    pub fn lever(self, group: &Group) -> f64 {
        match self {
            Part::Gain | Part::Phase => 1.0,
            Part::Delay => group.delay_s,
            Part::Boresight => group.ahead,
        }
    }

    /// A part that is read from the other component of the same deviations.
    pub fn other(self) -> Self {
        if self == Part::Gain { Part::Phase } else { Part::Gain }
    }

    /// The complex deviation that a value means there.
    pub fn deviation(self, value: f64, group: &Group) -> Complex64 {
        let value = value * self.lever(group);
        if self == Part::Gain { value.into() } else { Complex64::new(0.0, value) }
    }
}

/// Mean cosine to the boresight of what the room's surfaces before the radar return from a range: of the ring that each of them
/// has there, as rough surfaces return by the sine of grazing (constant γ), seen by antennas of one gain in all directions.
pub fn ahead(room: Option<&Room>, range_m: f64) -> f64 {
    const DIRECTIONS: usize = 48;
    let Some(room) = room else { return 1.0 };
    let (low, high) = room.extent_m(range_m);
    let (mut sum, mut all) = (0.0, 0.0);
    for boundary in room.boundaries() {
        let (axis, sign) = boundary.axis();
        let Some(distance) = room.distance_m(boundary).filter(|&distance| distance < range_m) else { continue };
        let radius = (range_m * range_m - distance * distance).sqrt();
        for direction in 0..DIRECTIONS {
            let (sine, cosine) = (TAU * (direction as f64 + 0.5) / DIRECTIONS as f64).sin_cos();
            let mut place = [0.0; 3];
            (place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3]) = (sign * distance, radius * cosine, radius * sine);
            let inside = (0..3).filter(|&other| other != axis).all(|other| (low[other]..=high[other]).contains(&place[other]));
            let cosine = place[1] / range_m;
            if inside && cosine > 0.0 {
                let weight = distance / range_m;
                (sum, all) = (sum + weight * cosine, all + weight);
            }
        }
    }
    if all > 0.0 { sum / all } else { 1.0 }
}

/// Whether most ranges, as [`Field::gains`] has them, gain more than a share of what they could; nothing contradicts where none is
/// informative.
fn most_have(gains: &[[f64; 2]], share: f64) -> bool {
    2 * gains.iter().filter(|[gain, most]| *gain > share * most).count() > gains.len() || gains.is_empty()
}

impl Field {
    /// None where too little of the recording stands still.
    pub fn new(evidence: &Evidence) -> Option<Self> {
        let [frames, _, _, loops, samples] = evidence.cube.dims;
        let channels = evidence.cube.channels();
        let bins = evidence.range_bins();
        let taper = blackman_harris(samples);
        let fft = FftPlanner::new().plan_fft_forward(samples);
        let noise = evidence.noise();
        if noise.iter().any(|v| !v.is_finite() || *v <= 0.0) {
            return None;
        }
        // Static spectra in units of the noise's deviation, `[channel, bin]`.
        let mut still: Vec<Complex64> = evidence.still().iter().enumerate().map(|(i, v)| v * taper[i % samples]).collect();
        fft.process(&mut still);
        for (channel, spectrum) in still.chunks_exact_mut(samples).enumerate() {
            spectrum.iter_mut().for_each(|v| *v /= noise[channel].sqrt());
        }
        let power: Vec<f64> =
            (0..bins).map(|bin| (0..channels).map(|c| still[c * samples + bin].norm_sqr()).sum::<f64>()).collect();
        // Static returns that are lost in the noise of a chirp teach nothing.
        let strong: Vec<bool> = power.iter().map(|p| *p > 3.0 * channels as f64).collect();
        let width = (bins / 16).max(4 + GAP);
        let radar = &evidence.radar;
        let delay_of_bin = radar.sample_rate_hz / (samples as f64 * radar.slope_hz_per_s);
        let groups: Vec<Group> = (0..bins / width)
            .filter_map(|g| {
                let range = g * width..(g + 1) * width - GAP;
                let sum: f64 = range.clone().filter(|&k| strong[k]).map(|k| power[k]).sum();
                let mean = range.clone().filter(|&k| strong[k]).map(|k| power[k] * k as f64).sum::<f64>() / sum;
                let delay_s = mean * delay_of_bin;
                let ahead = ahead(evidence.room.as_ref(), 0.5 * SPEED_OF_LIGHT * delay_s);
                (sum > 0.0).then_some(Group { delay_s, ahead, bins: range })
            })
            .collect();
        if groups.len() < 2 || evidence.split.held_out.is_empty() {
            return None;
        }
        let per_frame: Vec<(Vec<Complex64>, Vec<f64>)> =
            (0..frames).into_par_iter().map(|frame| of_frame(evidence, frame, &groups, &still, &strong, &taper, &fft)).collect();
        let (mut deviation, mut weight) = (vec![], vec![]);
        for (values, weights) in per_frame {
            deviation.extend(values);
            weight.extend(weights);
        }
        let of_groups = |frame: usize| {
            let free = free(evidence, frame, bins);
            groups.iter().map(|group| free[group.bins.clone()].iter().all(|free| *free)).collect::<Vec<bool>>()
        };
        let free = (0..frames).flat_map(of_groups).collect();
        let middle_s = 0.5 * (radar.tx_m.len() as f64 - 1.0) * radar.chirp_period_s;
        let times_s = (0..frames * loops)
            .map(|i| evidence.starts_s[i / loops] + (i % loops) as f64 * radar.loop_period_s() + middle_s)
            .collect();
        let mut field = Self { frames, loops, groups, deviation, weight, free, times_s, farthest: FARTHEST[0] };
        field.unroll(&evidence.split.training);
        field.calibrate();
        let known = (0..frames).filter(|&f| field.weights(f).iter().filter(|w| **w > 0.0).count() >= 2).count();
        (2 * known > frames).then_some(field)
    }

    pub fn deviations(&self, frame: usize, index: usize) -> &[Complex64] {
        &self.deviation[(frame * self.loops + index) * self.groups.len()..][..self.groups.len()]
    }

    /// Mean cosine to the boresight of the static returns, as sure as each group is.
    pub fn mean_ahead(&self) -> f64 {
        let (mut sum, mut all) = (0.0, 0.0);
        for frame in 0..self.frames {
            for (group, weight) in self.groups.iter().zip(self.weights(frame)) {
                (sum, all) = (sum + weight * group.ahead, all + weight);
            }
        }
        if all > 0.0 { sum / all } else { 1.0 }
    }

    pub fn weights(&self, frame: usize) -> &[f64] {
        &self.weight[frame * self.groups.len()..][..self.groups.len()]
    }

    /// What all groups of a chirp share: their mean gain. None where it is not sure.
    fn common(&self, frame: usize, index: usize) -> Option<Complex64> {
        let weights = self.weights(frame);
        let sure: f64 = weights.iter().sum();
        let sum: Complex64 = self.deviations(frame, index).iter().zip(weights).map(|(value, weight)| value * weight).sum();
        (sure > SURE).then(|| Complex64::ONE + sum / sure)
    }

    /// Where phase excursions are large, reads them as angles, and gains as they are without that: a mean over time of what turns
    /// is shorter than it.
    fn unroll(&mut self, training: &[usize]) {
        let chirps = training.iter().flat_map(|&frame| (0..self.loops).map(move |index| (frame, index)));
        let common: Vec<Complex64> = chirps.filter_map(|(frame, index)| self.common(frame, index)).collect();
        let mean = |of: &dyn Fn(&Complex64) -> f64| common.iter().map(of).sum::<f64>() / common.len() as f64;
        if common.is_empty() || mean(&|gain| gain.arg().powi(2)).sqrt() < SMALL {
            return;
        }
        self.farthest = FARTHEST[1];
        let (strength, angle) = (mean(&|gain| gain.norm()), mean(&|gain| gain.arg()));
        for frame in 0..self.frames {
            for index in 0..self.loops {
                let Some(common) = self.common(frame, index) else { continue };
                let at = (frame * self.loops + index) * self.groups.len();
                for value in &mut self.deviation[at..at + self.groups.len()] {
                    // Each group beside what all share is small.
                    let own = (Complex64::ONE + *value) / common;
                    *value = Complex64::new(own.re * common.norm() / strength - 1.0, own.im + common.arg() - angle);
                }
            }
        }
    }

    /// Scales the variances to what is left after a common gain and a phase in proportion to the delay: the noise need
    /// not be as white as it was taken for.
    fn calibrate(&mut self) {
        let count = self.groups.len();
        let (mut sums, mut freedoms) = (vec![0.0; count], vec![0.0; count]);
        for frame in 0..self.frames {
            let weights = self.weights(frame).to_vec();
            let moments = self.moments(&weights);
            let determinant = moments[0] * moments[2] - moments[1] * moments[1];
            if weights.iter().filter(|w| **w > 0.0).count() < 4 || determinant <= 1e-9 * moments[0] * moments[2] {
                continue;
            }
            // Share of a group's variance that the fit takes away.
            let leverage: Vec<f64> = (0..count)
                .map(|g| {
                    let tau = self.groups[g].delay_s;
                    weights[g] * (moments[2] - 2.0 * tau * moments[1] + tau * tau * moments[0]) / determinant
                })
                .collect();
            for index in 0..self.loops {
                let values = self.deviations(frame, index);
                let (mut zero, mut first) = (Complex64::ZERO, Complex64::ZERO);
                for g in 0..count {
                    zero += values[g] * weights[g];
                    first += values[g] * (weights[g] * self.groups[g].delay_s);
                }
                let constant = (zero * moments[2] - first * moments[1]) / determinant;
                let slope = (first * moments[0] - zero * moments[1]) / determinant;
                for g in 0..count {
                    if weights[g] > 0.0 {
                        sums[g] += (values[g] - constant - slope * self.groups[g].delay_s).norm_sqr() * weights[g];
                        freedoms[g] += (1.0 - leverage[g]).max(0.0);
                    }
                }
            }
        }
        for frame in 0..self.frames {
            for g in 0..count {
                if freedoms[g] > 30.0 {
                    self.weight[frame * count + g] /= (sums[g] / freedoms[g]).max(0.5);
                }
            }
        }
    }

    /// Whether most of the ranges that could contradict a deviation share it: one that is far stronger than the others (a
    /// body that stands still for a while) must not speak for all. `predicted` gives it for frame, loop and group.
    pub fn shared(&self, predicted: impl Fn(usize, usize, &Group) -> Complex64) -> bool {
        most_have(&self.gains(predicted, |_| true), 0.0)
    }

    /// The same of a deviation that was read from these ranges chirp by chirp, in which the strongest one finds itself: most of the
    /// others must have most of it, and one of them at least must be informative. The body's ranges are not, while it is there: its
    /// own slow returns move with it.
    pub fn shared_by_others(&self, predicted: impl Fn(usize, usize, &Group) -> Complex64) -> bool {
        let mut gains = self.gains(predicted, |place| self.free[place]);
        let strongest = gains.iter().enumerate().max_by(|(_, a), (_, b)| a[1].total_cmp(&b[1])).map(|(index, _)| index);
        strongest.map(|index| gains.swap_remove(index));
        !gains.is_empty() && most_have(&gains, 0.5)
    }

    /// What ranges gain by a deviation, and what they would if all of it were theirs (nats): the informative ones. `wanted`:
    /// of frame · groups + group.
    fn gains(&self, predicted: impl Fn(usize, usize, &Group) -> Complex64, wanted: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
        let of_group = |(g, group): (usize, &Group)| {
            let (mut gain, mut most) = (0.0, 0.0);
            for frame in (0..self.frames).filter(|frame| wanted(frame * self.groups.len() + g)) {
                let weight = self.weights(frame)[g];
                for index in 0..self.loops {
                    let (value, model) = (self.deviations(frame, index)[g], predicted(frame, index, group));
                    gain += weight * (2.0 * (value * model.conj()).re - model.norm_sqr());
                    most += weight * model.norm_sqr();
                }
            }
            [gain, most]
        };
        self.groups.iter().enumerate().map(of_group).filter(|[_, most]| *most > INFORMATIVE_GAIN).collect()
    }

    fn moments(&self, weights: &[f64]) -> [f64; 3] {
        let mut moments = [0.0; 3];
        for (weight, group) in weights.iter().zip(&self.groups) {
            for (power, moment) in moments.iter_mut().enumerate() {
                *moment += weight * group.delay_s.powi(power as i32);
            }
        }
        moments
    }

    /// The best estimate of one part, from the groups that `wanted` keeps.
    pub fn series(&self, part: Part, wanted: impl Fn(usize) -> bool) -> Series {
        let mut value = Vec::with_capacity(self.frames * self.loops);
        let mut weight = Vec::with_capacity(self.frames);
        for frame in 0..self.frames {
            let kept: Vec<f64> = self.weights(frame).iter().enumerate().map(|(g, w)| if wanted(g) { *w } else { 0.0 }).collect();
            let lever = |g: usize| part.lever(&self.groups[g]);
            let information: f64 = kept.iter().enumerate().map(|(g, w)| w * lever(g) * lever(g)).sum();
            for index in 0..self.loops {
                let sum: f64 = self
                    .deviations(frame, index)
                    .iter()
                    .enumerate()
                    .map(|(g, v)| kept[g] * lever(g) * if part == Part::Gain { v.re } else { v.im })
                    .sum();
                value.push(if information > 0.0 { sum / information } else { 0.0 });
            }
            // Half of a complex variance is in each part.
            weight.push(2.0 * information);
        }
        Series { value, weight, loops: self.loops }
    }
}

impl Series {
    /// Of a frame.
    pub fn mean(&self, frame: usize) -> f64 {
        self.value[frame * self.loops..(frame + 1) * self.loops].iter().sum::<f64>() / self.loops as f64
    }

    /// Log-likelihood that some frames gain by a prediction, of which `predicted` gives frame, loop and radar time.
    pub fn gain(&self, field: &Field, frames: &[usize], predicted: impl Fn(usize, usize, f64) -> f64) -> f64 {
        let mut gain = 0.0;
        for &frame in frames {
            for index in 0..self.loops {
                let i = frame * self.loops + index;
                let (value, model) = (self.value[i], predicted(frame, index, field.times_s[i]));
                gain += self.weight[frame] * model * (value - 0.5 * model);
            }
        }
        gain
    }
}

/// Ranges at which the body is not, in one frame.
pub fn free(evidence: &Evidence, frame: usize, bins: usize) -> Vec<bool> {
    let samples = evidence.cube.dims[4];
    let Some(model) = evidence.power() else { return vec![true; bins] };
    let mut free = vec![true; bins];
    for (cell, _) in model.support(frame).iter().enumerate().filter(|(_, there)| **there) {
        let range = cell % samples;
        (range.saturating_sub(MARGIN)..(range + MARGIN + 1).min(bins)).for_each(|near| free[near] = false);
    }
    free
}

/// Deviations `[loop, group]` of a frame and their inverse variances.
fn of_frame(
    evidence: &Evidence,
    frame: usize,
    groups: &[Group],
    still: &[Complex64],
    strong: &[bool],
    taper: &[f64],
    fft: &Arc<dyn Fft<f64>>,
) -> (Vec<Complex64>, Vec<f64>) {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let channels = evidence.cube.channels();
    let bins = evidence.range_bins();
    let noise = evidence.noise();
    // `[channel, loop, bin]`, in units of the noise's deviation, without static clutter.
    let mut spectra: Vec<Complex64> = Vec::with_capacity(channels * loops * samples);
    for (channel, variance) in noise.iter().enumerate() {
        let scale = 1.0 / variance.sqrt();
        for chirp in evidence.cube.channel(frame, channel).chunks_exact(samples) {
            spectra.extend(chirp.iter().zip(taper).map(|(value, w)| value * (w * scale)));
        }
    }
    fft.process(&mut spectra);
    for (i, value) in spectra.iter_mut().enumerate() {
        let channel = i / (samples * loops);
        *value -= still[channel * samples + i % samples];
    }
    let at = |channel: usize, index: usize, bin: usize| spectra[(channel * loops + index) * samples + bin];
    // A mover does not come from where the static return comes from: what is left across the channels shows it, and a
    // gain that all share does not.
    let power: Vec<f64> = (0..bins)
        .map(|bin| {
            let own: f64 = (0..channels).map(|c| still[c * samples + bin].norm_sqr()).sum();
            let (mut all, mut along) = (0.0, 0.0);
            for index in 0..loops {
                let mut dot = Complex64::ZERO;
                for channel in 0..channels {
                    let value = at(channel, index, bin);
                    all += value.norm_sqr();
                    dot += still[channel * samples + bin].conj() * value;
                }
                along += dot.norm_sqr() / own.max(f64::MIN_POSITIVE);
            }
            match channels {
                1 => all / loops as f64,
                _ if all - along < ASIDE * all => 0.0,
                _ => (all - along) / ((channels - 1) * loops) as f64,
            }
        })
        .collect();
    // The law of a mean of so many powers, five deviations wide.
    let freedom = (loops * (channels - 1).max(1)) as f64;
    let limit = CLEAN.max(1.0 + 5.0 / freedom.sqrt());
    let quiet = |bin: usize| power[bin] < limit;
    let clean: Vec<bool> = (0..bins).map(|bin| strong[bin] && (bin.saturating_sub(1)..(bin + 2).min(bins)).all(quiet)).collect();
    let (mut values, mut weights) = (vec![Complex64::ZERO; loops * groups.len()], vec![0.0; groups.len()]);
    for (g, group) in groups.iter().enumerate() {
        let used: Vec<usize> = group.bins.clone().filter(|&k| clean[k]).collect();
        let own: f64 = used.iter().map(|&k| (0..channels).map(|c| still[c * samples + k].norm_sqr()).sum::<f64>()).sum();
        if own <= 0.0 {
            continue;
        }
        for index in 0..loops {
            let mut dot = Complex64::ZERO;
            for &bin in &used {
                for channel in 0..channels {
                    dot += still[channel * samples + bin].conj() * at(channel, index, bin);
                }
            }
            values[index * groups.len() + g] = dot / own;
        }
        // Variance of that sum of windowed, hence correlated cells, with white noise in the samples.
        let mut variance = 0.0;
        for channel in 0..channels {
            let mut filter = vec![Complex64::ZERO; samples];
            for &bin in &used {
                filter[bin] = still[channel * samples + bin].conj();
            }
            fft.process(&mut filter);
            variance += filter.iter().zip(taper).map(|(h, w)| h.norm_sqr() * w * w).sum::<f64>();
        }
        weights[g] = own * own / variance;
    }
    (values, weights)
}
