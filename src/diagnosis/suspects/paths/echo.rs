//! Echoes of the measured body itself, in cells where nothing else can be: a delayed copy of its return (`body_multibounce`). At
//! high signal-to-noise the measurement is the best prediction of the signal, phases included.

use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;

use super::scene::Scene;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::transform;
use crate::diagnosis::locate::CELLS_PER_VALUE;
use crate::diagnosis::statistics::corrected;
use crate::diagnosis::{Candidate, Correction, Cube, Estimate, Place, Volume};
use crate::effects::{self, Stage};
use crate::radar::SPEED_OF_LIGHT;

/// Delays that are tried, half cells of range.
const MOST_HALF_CELLS: usize = 60;
/// Nearer than that a copy is not resolved from the windows' main lobe.
const LEAST_HALF_CELLS: usize = 4;
/// A bounce between parts of the body is weaker than the direct return.
const STRONGEST_COPY: f64 = 0.7;
/// And not as weak as what sidelobes share with the main lobe.
const WEAKEST_COPY: f64 = 0.02;

/// What one complex factor of a template gains.
pub struct Fit {
    pub factor: Complex64,
    pub training: f64,
    pub held_out: f64,
    /// Standard deviation of the factor's real and imaginary part.
    pub deviation: f64,
}

/// Sums of conj(template) · measured and |template|², over the noise, of one frame.
#[derive(Clone, Copy, Default)]
pub struct Match {
    product: Complex64,
    energy: f64,
}

pub fn fit(scene: &Scene, matches: &[Match]) -> Fit {
    let split = &scene.evidence.split;
    let sum = |frames: &[usize]| {
        frames.iter().fold(Match::default(), |sum, &frame| Match {
            product: sum.product + matches[frame].product,
            energy: sum.energy + matches[frame].energy,
        })
    };
    let (training, held_out) = (sum(&split.training), sum(&split.held_out));
    let factor = training.product / training.energy.max(f64::MIN_POSITIVE);
    // |z|² − |z − κ q|², over the noise.
    let gain = |m: Match| (2.0 * (factor.conj() * m.product).re - factor.norm_sqr() * m.energy) / CELLS_PER_VALUE;
    Fit {
        factor,
        training: gain(training),
        held_out: gain(held_out),
        deviation: (CELLS_PER_VALUE / (2.0 * training.energy.max(f64::MIN_POSITIVE))).sqrt(),
    }
}

/// Per frame, templates `[doppler, range]` of every channel against what is measured, in free cells.
pub fn matches(scene: &Scene, template: impl Fn(usize, usize) -> Vec<Complex64> + Sync) -> Vec<Match> {
    let noise = scene.evidence.noise();
    (0..scene.frames())
        .into_par_iter()
        .map(|frame| {
            let (taken, base) = (scene.reached(frame), scene.base(frame));
            let mut sum = Match::default();
            for (channel, noise) in noise.iter().enumerate() {
                let measured = scene.evidence.range_doppler(frame, channel);
                let map = template(frame, channel);
                for cell in (0..taken.len()).filter(|&cell| !taken[cell]) {
                    let weight = 1.0 / (noise.max(f64::MIN_POSITIVE) * scene.shape[cell % scene.samples] * f64::from(base[cell]));
                    sum.product += map[cell].conj() * measured[cell] * weight;
                    sum.energy += map[cell].norm_sqr() * weight;
                }
            }
            sum
        })
        .collect()
}

/// `body_multibounce`: the body once more, a fixed way later.
pub fn multibounce(scene: &Scene, tried: f64) -> Option<Candidate> {
    // Products of the signal with itself repeat the body, too.
    if scene.evidence.accepted_unnamed.contains(&Behaviour::Quadratic) {
        return None;
    }
    let half_cells: Vec<usize> = (1..=MOST_HALF_CELLS.min(scene.bins)).collect();
    let sums = shifted_matches(scene, half_cells.len());
    let best = half_cells
        .iter()
        .filter(|shift| **shift >= LEAST_HALF_CELLS)
        .map(|&shift| (shift, fit(scene, &sums.iter().map(|by_shift| by_shift[shift - 1]).collect::<Vec<_>>())))
        .max_by(|a, b| a.1.training.total_cmp(&b.1.training))?;
    let coarse = best.1;
    if coarse.held_out < super::LEAST_GAIN {
        return None;
    }
    // Between half cells by the templates themselves.
    let radar = &scene.evidence.radar;
    let later = |extra_m: f64| {
        let rate = std::f64::consts::TAU * radar.slope_hz_per_s * 2.0 * extra_m / SPEED_OF_LIGHT / radar.sample_rate_hz;
        matches(scene, |frame, channel| {
            let copy: Vec<Complex64> = (scene.evidence.moving(frame, channel).iter().enumerate())
                .map(|(i, value)| value * Complex64::cis(rate * (i % scene.samples) as f64))
                .collect();
            let mut map = transform(&copy, scene.samples);
            for (cell, value) in map.iter_mut().enumerate() {
                // The copy's noise is no template.
                let source = (cell % scene.samples) as f64 - extra_m * scene.model.cells.bins_per_m;
                let source = source.round().rem_euclid(scene.samples as f64) as usize % scene.samples;
                if !scene.model.support(frame)[cell / scene.samples * scene.samples + source] {
                    *value = Complex64::ZERO;
                }
            }
            map
        })
    };
    let (extra_m, found) = (-3..=3)
        .map(|step| scene.range_m(0.5 * best.0 as f64 + f64::from(step) / 8.0))
        .filter(|extra_m| *extra_m > 0.0)
        .map(|extra_m| (extra_m, fit(scene, &later(extra_m))))
        .max_by(|a, b| a.1.training.total_cmp(&b.1.training))?;
    let p_value = corrected((-(found.training + found.held_out).max(0.0)).exp(), tried * MOST_HALF_CELLS as f64);
    if found.held_out < super::LEAST_GAIN || p_value > 1e-3 || !(WEAKEST_COPY..STRONGEST_COPY).contains(&found.factor.norm()) {
        return None;
    }
    // Nothing comes before its cause: what looks the same in front of the body is a distortion.
    if fit(scene, &later(-extra_m)).held_out > 0.2 * found.held_out {
        return None;
    }
    let (factor, still) = (found.factor, scene.evidence.still().to_vec());
    let rate = std::f64::consts::TAU * radar.slope_hz_per_s * 2.0 * extra_m / SPEED_OF_LIGHT / radar.sample_rate_hz;
    let samples = scene.samples;
    let body: f64 = (0..scene.frames())
        .flat_map(|frame| (0..scene.size()).map(move |cell| (frame, cell)))
        .filter(|&(frame, cell)| scene.model.support(frame)[cell])
        .map(|(frame, cell)| f64::from(scene.map(frame)[cell] - 1.0))
        .sum();
    let mut place = Place::at(Stage::Propagation);
    place.range_m = None;
    let step_m = scene.range_m(0.125);
    Some(Candidate {
        id: Some(effects::body_multibounce::ID),
        behaves_like: Behaviour::PathLike,
        estimates: vec![Estimate::normal("extra_m", extra_m, 0.4 * step_m)],
        choice: None,
        place,
        p_value,
        gain: found.held_out,
        errs_alike: false,
        look_alikes: vec![],
        statement: format!(
            "The body's return comes a second time, {extra_m:.2} m behind itself and {:.0} dB weaker, with the body's own Doppler: \
             it bounced between parts of the body.",
            -20.0 * factor.norm().max(1e-12).log10()
        ),
        curve: None,
        energy: factor.norm_sqr() * super::mover::energy(scene, body / 2.25),
        correction: Correction::Inverse(
            Arc::new(move |cube: &mut Cube| {
                cube.each_chirp(|[_, channel, _], chirp| {
                    let still = &still[channel * samples..][..samples];
                    for (n, value) in chirp.iter_mut().enumerate() {
                        // The measured signal holds the copy, too: undo 1 + κ D, to third order.
                        let copy = factor * Complex64::cis(rate * n as f64);
                        *value -= (*value - still[n]) * copy * (1.0 - copy + copy * copy);
                    }
                });
            }),
            Volume::BY_SAMPLE,
        ),
    })
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
                let between = half_cell_later(scene, frame, channel);
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

/// The moving part's map if everything were half a cell farther.
fn half_cell_later(scene: &Scene, frame: usize, channel: usize) -> Vec<Complex64> {
    let samples = scene.samples;
    let copy: Vec<Complex64> = (scene.evidence.moving(frame, channel).iter().enumerate())
        .map(|(i, value)| value * Complex64::cis(std::f64::consts::PI * (i % samples) as f64 / samples as f64))
        .collect();
    transform(&copy, samples)
}
