//! What depends on the chirp's place in its frame only: the first chirps of every frame before the radar has settled.

use num_complex::Complex64;

use super::field::{Field, Part, Series};
use crate::diagnosis::statistics;

/// Deviation `amplitude · exp(−i / chirps)` of chirp i of every frame.
#[derive(Clone, Debug)]
pub struct Settling {
    pub amplitude: Complex64,
    pub amplitude_deviation: f64,
    /// In loops.
    pub loops: f64,
    pub loops_deviation: f64,
    pub constant: Complex64,
    pub p_value: f64,
    pub training_nats: f64,
    pub held_out_nats: f64,
    /// What an amplitude modulation at the mains' frequency gains in training, where its periods fit into the frames': it is then
    /// alike in all of them.
    pub modulation_nats: f64,
    /// What a straight line gains in training.
    pub slope_nats: f64,
    /// What a free function of the loop gains on held-out frames.
    pub free: Free,
}

/// A free function of the loop.
#[derive(Clone, Debug)]
pub struct Free {
    /// `[loop]`, its mean over loops is zero.
    pub values: Vec<Complex64>,
    pub p_value: f64,
    pub held_out_nats: f64,
}

/// Share of what a free function of the loop gains that a decay must reach.
pub const ENOUGH: f64 = 0.8;
/// And share that it may leave where what it leaves is beyond doubt: a strong pattern shows its shape.
const LEFT_OVER: f64 = 0.01;
/// Beyond doubt, nats.
const PLAIN: f64 = 50.0;
/// Frequencies at which supplies and lamps modulate amplitudes.
const MAINS_HZ: [f64; 8] = [50.0, 60.0, 100.0, 120.0, 200.0, 240.0, 300.0, 360.0];
/// Turns that such a modulation may drift over the recording and still look alike in all frames.
const LOCKED_TURNS: f64 = 0.25;
/// What is over within a chirp is no decay that was seen: the first chirp may lack what each leaves to the next.
const FEWEST_LOOPS: f64 = 0.5;

impl Settling {
    /// Whether this is a decay, and not the best decay for something else: a modulation that is locked to the frames, say, or a gain that
    /// goes on through the frame and settles nowhere in it.
    pub fn is_named(&self) -> bool {
        let rest = self.free.held_out_nats - self.held_out_nats;
        self.held_out_nats > ENOUGH * self.free.held_out_nats
            && (rest < PLAIN || rest < LEFT_OVER * self.free.held_out_nats)
            && self.amplitude.re.abs() > self.amplitude.im.abs()
            && self.loops > FEWEST_LOOPS
            && self.training_nats > self.modulation_nats
            && self.training_nats > self.slope_nats + statistics::UNDECIDED
    }

    /// Relative to the settled state.
    pub fn value(&self, index: usize) -> Complex64 {
        self.amplitude * (-(index as f64) / self.loops).exp()
    }
}

/// Least squares of `amplitude · exp(−i / length)`, about the mean over the loops.
pub struct Decay {
    pub amplitude: Complex64,
    /// Mean of the shape, and its energy about that.
    level: f64,
    pub energy: f64,
}

impl Decay {
    /// Fits values by loop; `length` in loops.
    pub fn fit(values: &[Complex64], length: f64) -> Self {
        let shape: Vec<f64> = (0..values.len()).map(|i| (-(i as f64) / length).exp()).collect();
        let level = shape.iter().sum::<f64>() / values.len() as f64;
        let energy: f64 = shape.iter().map(|s| (s - level).powi(2)).sum();
        let amplitude = values.iter().zip(&shape).map(|(v, s)| v * (s - level)).sum::<Complex64>() / energy;
        Self { amplitude, level, energy }
    }

    /// Lengths to be tried, from half a loop in equal ratios.
    pub fn lengths(longest: f64) -> impl Iterator<Item = f64> {
        (0..=60).map(move |i| 0.5 * (longest / 0.5).powf(f64::from(i) / 60.0))
    }
}

/// The gain by the chirp's place in its frame, mean of the training frames.
struct Pattern {
    /// Gain and phase.
    parts: [Series; 2],
    /// `[loop]`
    values: Vec<Complex64>,
    /// Mean over the loops.
    centre: Complex64,
    /// Inverse variance of a part of a value.
    weight: f64,
}

/// A decay of one length as it fits to a pattern.
struct Fit {
    amplitude: Complex64,
    constant: Complex64,
    /// Log-likelihood.
    nats: f64,
    /// Of the shape.
    energy: f64,
}

impl Pattern {
    /// None where nothing is known.
    fn new(field: &Field, training: &[usize]) -> Option<Self> {
        let loops = field.loops;
        let parts = [field.series(Part::Gain, |_| true), field.series(Part::Phase, |_| true)];
        let weight: f64 = training.iter().map(|&f| parts[0].weight[f]).sum();
        if weight <= 0.0 {
            return None;
        }
        let mean = |index: usize| {
            let of = |series: &Series| {
                training.iter().map(|&f| series.weight[f] * series.value[f * loops + index]).sum::<f64>() / weight
            };
            Complex64::new(of(&parts[0]), of(&parts[1]))
        };
        let values: Vec<Complex64> = (0..loops).map(mean).collect();
        let centre = values.iter().sum::<Complex64>() / loops as f64;
        Some(Self { parts, values, centre, weight })
    }

    fn fit(&self, length: f64) -> Fit {
        let Decay { amplitude, level, energy } = Decay::fit(&self.values, length);
        let nats = 0.5 * self.weight * amplitude.norm_sqr() * energy;
        Fit { amplitude, constant: self.centre - amplitude * level, nats, energy }
    }

    /// Of the decay that fits best, in loops. Longer than half a frame is a slope.
    fn length(&self) -> Option<f64> {
        let longest = 0.5 * self.values.len() as f64;
        let lengths: Vec<f64> = Decay::lengths(longest).collect();
        let nats: Vec<f64> = lengths.iter().map(|&length| self.fit(length).nats).collect();
        let at = (0..lengths.len()).max_by(|&a, &b| nats[a].total_cmp(&nats[b]))?;
        let nats = |l: f64| if (0.3..=longest).contains(&l) { self.fit(l).nats } else { f64::NEG_INFINITY };
        let mut length = lengths[at];
        let mut width = 0.05 * length;
        while width > 1e-4 * length {
            if nats(length + width) > nats(length) {
                length += width;
            } else if nats(length - width) > nats(length) {
                length -= width;
            } else {
                width *= 0.5;
            }
        }
        Some(length)
    }

    /// Error of that length, by the curvature of the likelihood.
    fn length_deviation(&self, length: f64) -> f64 {
        let nats = |length: f64| self.fit(length).nats;
        statistics::deviation_at_top(nats, length, nats(length), 0.1 * length).unwrap_or(length)
    }

    /// Log-likelihood that held-out frames gain by a function of the loop.
    fn held_out_nats(&self, field: &Field, held_out: &[usize], model: impl Fn(usize) -> Complex64) -> f64 {
        self.parts[0].log_likelihood_gain(field, held_out, |_, index, _| model(index).re)
            + self.parts[1].log_likelihood_gain(field, held_out, |_, index, _| model(index).im)
    }

    /// Any function of the loop.
    fn free(&self, field: &Field, held_out: &[usize]) -> Free {
        let values: Vec<Complex64> = self.values.iter().map(|v| v - self.centre).collect();
        let chi2: f64 = values.iter().map(|v| self.weight * v.norm_sqr()).sum();
        Free {
            p_value: statistics::chi2_tail(chi2, 2.0 * (values.len() - 1) as f64),
            held_out_nats: self.held_out_nats(field, held_out, |index| values[index]),
            values,
        }
    }
}

/// The decay that training frames make most likely; none of fewer than eight loops, or without a training frame that says
/// anything.
pub fn best(field: &Field, training: &[usize], held_out: &[usize]) -> Option<Settling> {
    if field.loops < 8 {
        return None;
    }
    let pattern = Pattern::new(field, training)?;
    let length = pattern.length()?;
    let Fit { amplitude, constant, nats, energy } = pattern.fit(length);
    let free = pattern.free(field, held_out);
    let decay = |index: usize| amplitude * (-(index as f64) / length).exp() + constant;
    let modulation = locked(field).map(|hertz| explained(field, &free.values, hertz)).fold(0.0, f64::max);
    Some(Settling {
        amplitude,
        amplitude_deviation: (1.0 / (pattern.weight * energy)).sqrt(),
        loops: length,
        loops_deviation: pattern.length_deviation(length),
        constant,
        // A decay has a length (about ten are apart) and a complex amplitude.
        p_value: statistics::corrected((-nats).exp(), 10.0),
        training_nats: nats,
        modulation_nats: 0.5 * pattern.weight * modulation,
        slope_nats: 0.5 * pattern.weight * slope(&free.values),
        held_out_nats: pattern.held_out_nats(field, held_out, decay),
        free,
    })
}

/// Frequencies of the mains that all frames see alike.
fn locked(field: &Field) -> impl Iterator<Item = f64> {
    let starts: Vec<f64> = field.times_s.iter().step_by(field.loops).copied().collect();
    let off = |turns: f64| (turns - turns.round()).abs();
    let locked = move |hertz: f64| starts.iter().all(|start| off(hertz * (start - starts[0])) < LOCKED_TURNS);
    MAINS_HZ.into_iter().filter(move |&hertz| locked(hertz))
}

/// Energy that a straight line takes out of values by loop whose mean is zero.
fn slope(values: &[Complex64]) -> f64 {
    let middle = 0.5 * (values.len() as f64 - 1.0);
    along(values, &(0..values.len()).map(|index| index as f64 - middle).collect::<Vec<f64>>())
}

/// Energy that a course takes out of values.
fn along(values: &[Complex64], course: &[f64]) -> f64 {
    values.iter().zip(course).map(|(v, c)| v * c).sum::<Complex64>().norm_sqr() / dot(course, course)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Energy that a sinusoid takes out of values by loop whose mean is zero.
fn explained(field: &Field, values: &[Complex64], hertz: f64) -> f64 {
    let wave = |shift: f64| -> Vec<f64> {
        let wave = |time: &f64| (std::f64::consts::TAU * hertz * (time - field.times_s[0]) + shift).cos();
        let wave: Vec<f64> = field.times_s[..values.len()].iter().map(wave).collect();
        let mean = wave.iter().sum::<f64>() / wave.len() as f64;
        wave.into_iter().map(|value| value - mean).collect()
    };
    let (cosine, mut sine) = (wave(0.0), wave(-std::f64::consts::FRAC_PI_2));
    let shared = dot(&sine, &cosine) / dot(&cosine, &cosine);
    sine.iter_mut().zip(&cosine).for_each(|(sine, cosine)| *sine -= shared * cosine);
    along(values, &cosine) + along(values, &sine)
}
