//! What simpler methods make of the same cases: a global χ², templates on the raw residual one by one, and a sparse
//! regression on all of them together.
//!
//! They work on the samples alone. A simulator's mistakes inside the person's cells would drown them (every millimetre of
//! mesh error is a turn of phase there), so their residual is what lies where nothing is expected: nearer than anything
//! and farther than the room. Their thresholds are calibrated on the nulls of the very set, which flatters them.

use hybridsim_fft::FftPlanner;
use num_complex::Complex64;
use serde::Serialize;

use crate::data::Recording;
use crate::diagnosis::evidence::transform;
use crate::diagnosis::statistics::exponential_scale;
use crate::effects;
use crate::error::Result;
use crate::radar::{Radar, SPEED_OF_LIGHT};

/// Range bins next to a boundary of what is expected: the width of the window's main lobe.
const MARGIN_BINS: usize = 3;
/// Most templates that a sparse regression takes together.
const MOST_ATOMS: usize = 3;

/// Derivatives of the samples by an effect's parameter, at zero, as far as the samples themselves determine them.
pub const TEMPLATES: [&str; 13] = [
    effects::dc_offset::ID,
    effects::tx_leakage::ID,
    effects::iq_imbalance::ID,
    effects::second_harmonic::ID,
    effects::compression::ID,
    effects::chirp_droop::ID,
    effects::if_highpass::ID,
    effects::if_lowpass::ID,
    effects::slope_error::ID,
    effects::chirp_nonlinearity::ID,
    effects::gain_drift::ID,
    effects::chirp_settling::ID,
    effects::ramp_edge_transient::ID,
];

/// Of one case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Mean power of the residual over the noise.
    pub chi2: f64,
    /// Energy that each template explains on its own, over the noise.
    pub templates: [f64; 13],
    /// What a sparse regression picks, in this order, with the energy that it explains further.
    pub sparse: Vec<(usize, f64)>,
}

/// The statistics of a recording's samples.
///
/// # Errors
/// A frame that cannot be read.
pub fn statistics(recording: &Recording) -> Result<Statistics> {
    let radar = &recording.radar;
    let farthest_m = recording.room.as_ref().and_then(|room| room.farthest_m()).unwrap_or(radar.max_range_m());
    let bins = outside_bins(radar, farthest_m);
    let frames: Vec<Vec<Complex64>> = (0..radar.frames)
        .map(|frame| {
            let frame = recording.frame(frame)?;
            let im = frame.im.unwrap_or(vec![0.0; frame.re.len()]);
            Ok(frame.re.iter().zip(im).map(|(&re, im)| Complex64::new(re.into(), im.into())).collect())
        })
        .collect::<Result<_>>()?;
    Ok(of_samples(radar, &bins, &frames))
}

/// Beat frequencies of no expected path.
fn outside_bins(radar: &Radar, farthest_m: f64) -> Vec<usize> {
    let samples = radar.samples_per_chirp;
    let bin_m = radar.sample_rate_hz / samples as f64 * SPEED_OF_LIGHT / (2.0 * radar.slope_hz_per_s);
    let first = (farthest_m / bin_m).ceil() as usize + MARGIN_BINS;
    // The nearest bins hold leakage, offsets, and nobody.
    (0..samples).filter(|&bin| bin < MARGIN_BINS || (first..samples - MARGIN_BINS).contains(&bin)).collect()
}

/// `frames`: `[frame][tx · rx, loop, sample]`.
fn of_samples(radar: &Radar, bins: &[usize], frames: &[Vec<Complex64>]) -> Statistics {
    let (loops, samples) = (radar.loops_per_frame, radar.samples_per_chirp);
    let peak = frames.iter().flatten().map(|value| value.norm()).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let keep = |map: Vec<Complex64>| -> Vec<Complex64> {
        (0..loops)
            .flat_map(|doppler| bins.iter().map(move |bin| (doppler, bin)))
            .map(|(doppler, bin)| map[doppler * samples + bin])
            .collect()
    };
    const K: usize = TEMPLATES.len();
    let mut gram = vec![[Complex64::ZERO; K]; K];
    let mut onto = [Complex64::ZERO; K];
    let mut powers = vec![];
    for (index, frame) in frames.iter().enumerate() {
        let progress = index as f64 / frames.len() as f64 - 0.5;
        for channel in frame.chunks_exact(loops * samples) {
            let residual = keep(transform(channel, samples));
            powers.extend(residual.iter().map(Complex64::norm_sqr));
            let traces: Vec<Vec<Complex64>> =
                (0..K).map(|k| keep(transform(&template(k, channel, radar, peak, progress), samples))).collect();
            for (k, a) in traces.iter().enumerate() {
                onto[k] += inner(a, &residual);
                for (l, b) in traces.iter().enumerate().skip(k) {
                    let product = inner(a, b);
                    gram[k][l] += product;
                    if l != k {
                        gram[l][k] += product.conj();
                    }
                }
            }
        }
    }
    let mean = powers.iter().sum::<f64>() / powers.len().max(1) as f64;
    let noise = exponential_scale(&mut powers, 0.35).max(f64::MIN_POSITIVE);
    let mut templates = [0.0; K];
    for k in 0..K {
        templates[k] = onto[k].norm_sqr() / (gram[k][k].re.max(f64::MIN_POSITIVE) * noise);
    }
    Statistics { chi2: mean / noise, templates, sparse: pursue(&gram, &onto, noise) }
}

fn inner(a: &[Complex64], b: &[Complex64]) -> Complex64 {
    a.iter().zip(b).map(|(a, b)| a.conj() * b).sum()
}

/// One template over a channel's frame, `[loop, sample]`.
fn template(k: usize, channel: &[Complex64], radar: &Radar, peak: f64, progress: f64) -> Vec<Complex64> {
    let samples = radar.samples_per_chirp;
    let fast = |i: usize| (i % samples) as f64 / samples as f64 - 0.5;
    let map = |f: &dyn Fn(usize, Complex64) -> Complex64| channel.iter().enumerate().map(|(i, &y)| f(i, y)).collect();
    match TEMPLATES[k] {
        effects::dc_offset::ID => vec![Complex64::from(peak); channel.len()],
        effects::tx_leakage::ID => {
            let cycles = 2.0 * 0.1 / SPEED_OF_LIGHT * radar.slope_hz_per_s / radar.sample_rate_hz;
            map(&|i, _| Complex64::cis(std::f64::consts::TAU * cycles * (i % samples) as f64) * peak)
        }
        effects::iq_imbalance::ID => map(&|_, y| y.conj()),
        effects::second_harmonic::ID => map(&|_, y| y * y / peak),
        effects::compression::ID => map(&|_, y| y * (y.norm_sqr() / (peak * peak))),
        effects::chirp_droop::ID => map(&|i, y| y * fast(i)),
        effects::gain_drift::ID => map(&|_, y| y * progress),
        effects::chirp_settling::ID => map(&|i, y| y * (-((i / samples) as f64) / 3.0).exp()),
        effects::ramp_edge_transient::ID => {
            map(&|i, _| if i % samples + 2 >= samples { Complex64::from(peak) } else { Complex64::ZERO })
        }
        effects::if_highpass::ID => filtered(channel, samples, |f| Complex64::new(0.0, -1.0 / (f + 0.5))),
        effects::if_lowpass::ID => filtered(channel, samples, |f| Complex64::new(0.0, f)),
        effects::slope_error::ID => times(filtered(channel, samples, |f| Complex64::new(0.0, f)), fast),
        _ => times(filtered(channel, samples, |f| Complex64::new(0.0, f)), |i| fast(i).powi(2)),
    }
}

fn times(mut signal: Vec<Complex64>, by: impl Fn(usize) -> f64) -> Vec<Complex64> {
    signal.iter_mut().enumerate().for_each(|(i, value)| *value *= by(i));
    signal
}

/// Every chirp through a response over the beat frequency in bins.
fn filtered(channel: &[Complex64], samples: usize, response: impl Fn(f64) -> Complex64) -> Vec<Complex64> {
    let mut planner = FftPlanner::new();
    let mut signal = channel.to_vec();
    planner.plan_fft_forward(samples).process(&mut signal);
    signal.iter_mut().enumerate().for_each(|(i, value)| *value *= response((i % samples) as f64) / samples as f64);
    planner.plan_fft_inverse(samples).process(&mut signal);
    signal
}

/// Orthogonal matching pursuit on the normal equations.
fn pursue(gram: &[[Complex64; 13]], onto: &[Complex64; 13], noise: f64) -> Vec<(usize, f64)> {
    let mut chosen: Vec<(usize, f64)> = vec![];
    let (mut gram, mut onto) = (gram.to_vec(), *onto);
    let scale: Vec<f64> = (0..13).map(|k| gram[k][k].re).collect();
    while chosen.len() < MOST_ATOMS {
        let gain = |k: usize| {
            // What the chosen ones span already explains nothing further.
            let fresh = gram[k][k].re > 1e-9 * scale[k] && scale[k] > 0.0;
            if fresh { onto[k].norm_sqr() / (gram[k][k].re * noise) } else { 0.0 }
        };
        let best = (0..13).max_by(|&a, &b| gain(a).total_cmp(&gain(b))).expect("thirteen templates");
        let explained = gain(best);
        // As many as pay for themselves (BIC of some 10⁴ cells).
        if explained < 10.0 {
            break;
        }
        chosen.push((best, explained));
        let (row, diagonal, amount) = (gram[best], gram[best][best].re, onto[best]);
        for k in 0..13 {
            let share = row[k].conj() / diagonal;
            onto[k] -= share * amount;
            for l in 0..13 {
                gram[k][l] -= share * row[l];
            }
        }
    }
    chosen
}

/// The level that so large a part of the nulls stays below.
pub fn quantile(values: &[f64], part: f64) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let index = ((sorted.len() as f64 * part).ceil() as usize).saturating_sub(1);
    sorted.get(index).copied().unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn frames(radar: &Radar, spoil: impl Fn(Complex64, usize) -> Complex64) -> Vec<Vec<Complex64>> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let [frames, tx, rx, loops, samples] = radar.dims();
        (0..frames)
            .map(|_| {
                (0..tx * rx * loops * samples)
                    .map(|i| {
                        let (slow, fast) = (i / samples % loops, i % samples);
                        let [re, im]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
                        // Two echoes: the cube of a single tone is that tone again.
                        let tone = |turn: f64, beat: f64| Complex64::cis(turn * slow as f64 + beat * fast as f64);
                        let y = tone(0.5, 0.9) * 100.0 + tone(-0.3, 1.3) * 60.0;
                        spoil(y, fast) + Complex64::new(re, im)
                    })
                    .collect()
            })
            .collect()
    }

    #[test]
    fn each_kind_of_trace_is_identified_by_its_template_and_silence_by_none() {
        let radar = Radar::small(4);
        let bins = outside_bins(&radar, 0.5 * radar.max_range_m());
        let seen = |spoil: &dyn Fn(Complex64, usize) -> Complex64| of_samples(&radar, &bins, &frames(&radar, spoil));
        let at = |id: &str| TEMPLATES.iter().position(|template| *template == id).unwrap();
        for (id, found) in [("iq_imbalance", seen(&|y, _| y + y.conj() * 0.03)), ("dc_offset", seen(&|y, _| y + 5.0))] {
            assert_eq!(found.sparse.first().map(|&(k, _)| TEMPLATES[k]), Some(id));
            let silent = seen(&|y, _| y).templates[at(id)];
            assert!(found.templates[at(id)] > 100.0 && silent < 20.0, "{id}: {} against {silent}", found.templates[at(id)]);
        }
        // Noise alone: the echoes' side lobes reach everywhere.
        let clean = of_samples(&radar, &bins, &frames(&radar, |_, _| Complex64::ZERO));
        assert!((clean.chi2 - 1.0).abs() < 0.1, "{}", clean.chi2);
    }

    #[test]
    fn a_quantile_leaves_that_part_below() {
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(quantile(&values, 0.98), 98.0);
        assert_eq!(quantile(&[], 0.98), f64::INFINITY);
    }
}
