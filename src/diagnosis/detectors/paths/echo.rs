//! Echoes of the measured body itself, in cells where nothing else can be: a delayed copy of its return (`body_multibounce`). At
//! high signal-to-noise the measurement is the best prediction of the signal, phases included.

use num_complex::Complex64;
use rayon::prelude::*;

use super::factor::{Fit, Match, fit, matches};
use super::mover::energy;
use super::scene::Scene;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::transform;
use crate::diagnosis::statistics::corrected;
use crate::diagnosis::{Candidate, Correction, Estimate, Place, Volume};
use crate::effects::{self, Stage};
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// Delays that are tried, half cells of range.
const MOST_HALF_CELLS: usize = 60;
/// Nearer than that a copy is not resolved from the windows' main lobe.
const LEAST_HALF_CELLS: usize = 4;
/// A bounce between parts of the body is weaker than the direct return.
const STRONGEST_COPY: f64 = 0.7;
/// And not as weak as what sidelobes share with the main lobe.
const WEAKEST_COPY: f64 = 0.02;

/// `body_multibounce`: the body once more, a fixed way later.
pub fn multibounce(scene: &Scene, tried: f64) -> Option<Candidate> {
    // Products of the signal with itself repeat the body, too.
    if scene.evidence.accepted_unnamed.contains(&Behaviour::Quadratic) {
        return None;
    }
    let copy = Bounce::between(scene, half_cells(scene)?)?;
    let p_value = corrected((-(copy.fit.training + copy.fit.held_out).max(0.0)).exp(), tried * MOST_HALF_CELLS as f64);
    let is_likely = copy.fit.held_out >= super::LEAST_GAIN && p_value <= 1e-3;
    let is_bounce = (WEAKEST_COPY..STRONGEST_COPY).contains(&copy.fit.factor.norm());
    // Nothing comes before its cause: what looks the same in front of the body is a distortion.
    let found = is_likely && is_bounce && fit(scene, &later(scene, -copy.extra_m)).held_out <= 0.2 * copy.fit.held_out;
    found.then(|| copy.candidate(scene, p_value))
}

/// How many half cells of range later the copy is that explains most.
fn half_cells(scene: &Scene) -> Option<usize> {
    let most = MOST_HALF_CELLS.min(scene.bins);
    let sums = shifted_matches(scene, most);
    let of_shift = |shift: usize| fit(scene, &sums.iter().map(|by_shift| by_shift[shift - 1]).collect::<Vec<_>>());
    let (shift, best) =
        (LEAST_HALF_CELLS..=most).map(|shift| (shift, of_shift(shift))).max_by(|a, b| a.1.training.total_cmp(&b.1.training))?;
    (best.held_out >= super::LEAST_GAIN).then_some(shift)
}

/// Phase per sample that a longer way adds.
fn rate(radar: &Radar, extra_m: f64) -> f64 {
    std::f64::consts::TAU * radar.slope_hz_per_s * 2.0 * extra_m / SPEED_OF_LIGHT / radar.sample_rate_hz
}

/// By frame: what is measured against what moves, so much farther.
fn later(scene: &Scene, extra_m: f64) -> Vec<Match> {
    let (samples, rate) = (scene.samples, rate(&scene.evidence.radar, extra_m));
    matches(scene, |frame, channel| {
        let mut map = delayed(scene, frame, channel, rate);
        for (cell, value) in map.iter_mut().enumerate() {
            // The copy's noise is no template.
            let source = (cell % samples) as f64 - extra_m * scene.model.cells.bins_per_m;
            let source = source.round().rem_euclid(samples as f64) as usize % samples;
            if !scene.model.support(frame)[cell / samples * samples + source] {
                *value = Complex64::ZERO;
            }
        }
        map
    })
}

/// The body's return once more, so much farther.
struct Bounce {
    extra_m: f64,
    fit: Fit,
}

impl Bounce {
    /// Between half cells by the templates themselves.
    fn between(scene: &Scene, half_cells: usize) -> Option<Self> {
        (-3..=3)
            .map(|step| scene.range_m(0.5 * half_cells as f64 + f64::from(step) / 8.0))
            .filter(|extra_m| *extra_m > 0.0)
            .map(|extra_m| Self { extra_m, fit: fit(scene, &later(scene, extra_m)) })
            .max_by(|a, b| a.fit.training.total_cmp(&b.fit.training))
    }

    fn candidate(&self, scene: &Scene, p_value: f64) -> Candidate {
        let (extra_m, factor) = (self.extra_m, self.fit.factor);
        let body: f64 = (0..scene.frames())
            .flat_map(|frame| (0..scene.size()).map(move |cell| (frame, cell)))
            .filter(|&(frame, cell)| scene.model.support(frame)[cell])
            .map(|(frame, cell)| f64::from(scene.map(frame)[cell] - 1.0))
            .sum();
        let step_m = scene.range_m(0.125);
        Candidate {
            id: Some(effects::body_multibounce::ID),
            estimates: vec![Estimate::normal("extra_m", extra_m, 0.4 * step_m)],
            statement: format!(
                "The body's return comes a second time, {extra_m:.2} m behind itself and {:.0} dB weaker, with the body's own \
                 Doppler: it bounced between parts of the body.",
                -20.0 * factor.norm().max(1e-12).log10()
            ),
            energy: factor.norm_sqr() * energy(scene, body / 2.25),
            correction: self.undo(scene),
            ..Candidate::new(Behaviour::PathLike, Place::at(Stage::Propagation), p_value, self.fit.held_out)
        }
    }

    fn undo(&self, scene: &Scene) -> Correction {
        let (factor, rate, samples) = (self.fit.factor, rate(&scene.evidence.radar, self.extra_m), scene.samples);
        let clutter = scene.evidence.clutter().to_vec();
        Correction::inverse(Volume::BY_SAMPLE, move |cube| {
            cube.each_chirp(|[_, channel, _], chirp| {
                let clutter = &clutter[channel * samples..][..samples];
                for (n, value) in chirp.iter_mut().enumerate() {
                    // The measured signal holds the copy, too: undo 1 + κ D, to third order.
                    let copy = factor * Complex64::cis(rate * n as f64);
                    *value -= (*value - clutter[n]) * copy * (1.0 - copy + copy * copy);
                }
            });
        })
    }
}

/// By frame and shift (half cells of range, from one on): the body's cells against those so far behind them.
fn shifted_matches(scene: &Scene, shifts: usize) -> Vec<Vec<Match>> {
    let (samples, noise) = (scene.samples, scene.evidence.noise());
    (0..scene.frames())
        .into_par_iter()
        .map(|frame| {
            let mut sums = vec![Match::default(); shifts];
            let (taken, base, support) = (scene.reached(frame), scene.base(frame), scene.model.support(frame));
            let sources: Vec<usize> = (0..support.len()).filter(|&cell| support[cell] && scene.map(frame)[cell] > 4.0).collect();
            for (channel, noise) in noise.iter().enumerate() {
                let map = scene.evidence.range_doppler(frame, channel);
                let between = delayed(scene, frame, channel, std::f64::consts::PI / samples as f64);
                for &source in &sources {
                    let (row, range) = (source / samples * samples, source % samples);
                    for shift in 1..=shifts {
                        // Odd shifts: the copy, half a cell on, read at its cells.
                        let target = row + (range + shift / 2) % samples;
                        if taken[target] {
                            continue;
                        }
                        let value = if shift % 2 == 0 { map[source] } else { between[source] };
                        let weight =
                            1.0 / (noise.max(f64::MIN_POSITIVE) * scene.shape[target % samples] * f64::from(base[target]));
                        sums[shift - 1].product += value.conj() * map[target] * weight;
                        sums[shift - 1].energy += value.norm_sqr() * weight;
                    }
                }
            }
            sums
        })
        .collect()
}

/// The moving part's map if everything were farther by so much phase per sample.
fn delayed(scene: &Scene, frame: usize, channel: usize, rate: f64) -> Vec<Complex64> {
    let mut moving = scene.evidence.moving(frame, channel);
    moving.iter_mut().enumerate().for_each(|(i, value)| *value *= Complex64::cis(rate * (i % scene.samples) as f64));
    transform(&moving, scene.samples)
}
